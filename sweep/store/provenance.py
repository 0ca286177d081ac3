"""Where results come from: the spec as launched, the code, versions and machine."""

import os
import platform
import sys
from collections.abc import Mapping
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from kernels.identity import Code, kernels_sha
from sweep.design.code import study_code
from sweep.own_code.catalogue import OwnCatalogue, of_packages
from sweep.spec.study import Study
from sweep.store.processes import cpu_name
from sweep.store.repository import built_from, git_state, study_state
from sweep.store.stored_code import seal

PACKAGES = (
    "boidsweep",
    "numpy",
    "numba",
    "llvmlite",
    "scipy",
    "pandas",
    "pyarrow",
    "joblib",
    "pillow",
    "SALib",
)
HERE = Path(__file__).parent.parent


def provenance(study: Study, device: dict[str, str] | None = None) -> dict[str, Any]:
    """All that is recorded with every part of a launch, ready for JSON. `device` is
    what its trials fly on, if not on the processor.
    """
    code, kept = study_code(study), study_state(study.path, study.text)
    return {
        "format": 1,
        "study": study.name,
        "model": study.model,
        "preset": study.preset,
        "spec": study.text,
        "spec_path": str(study.path),
        "kernels_sha": kernels_sha(),
        "code": code._asdict(),
        **_others(study, code),
        "git": git_state(HERE) or built_from(HERE),
        **({"study_git": kept} if kept else {}),
        "lock": list(installed()),
        **machine(),
        **({"device": device} if device else {}),
    }


def measured_provenance(
    origin: Mapping[str, Any], study: Study, spec: str
) -> dict[str, Any]:
    """The origin of trials, or of a plan, with metrics that were measured here, after
    the flight; `measured` says by which code, versions and machine.

    origin  that of the same trials before
    study   a study that records all of their metrics
    spec    the text of a spec that does
    """
    then, now = Code(**origin["code"]), study_code(study)
    code = then._replace(metrics={**then.metrics, **now.metrics})
    others = _others(study, code)
    if "own" in origin and others["own"]["sha"] == origin["own"]["sha"]:
        others["own"] = origin["own"]  # else another user's code would become ours
    about = {name: origin[name] for name in origin if name != "study_git"}
    here = {"git": git_state(HERE) or built_from(HERE), **machine()}
    return about | {"spec": spec, "code": code._asdict(), **others, "measured": here}


def _others(study: Study, code: Code) -> dict[str, Any]:
    """Which code of the user's own computes the trials, with the user's seal; and what
    tables need to know of the entries of other packages, which may be gone one day.
    """
    known = study.known
    names = {
        "models": [study.model],
        "metrics": code.metrics,
        "maps": code.maps,
        "starts": code.starts,
    }
    packages = of_packages(known, names)
    said = {"packages": packages} if packages else {}
    if isinstance(known, OwnCatalogue):
        said["own"] = {"sha": known.code.sha, "seal": seal(known.code.sha)}
    return said


@cache
def machine() -> dict[str, Any]:
    """What results may depend on besides the code: versions, system and processor."""
    return {
        "versions": {"python": platform.python_version()}
        | {name: _version(name) for name in PACKAGES},
        "platform": platform.platform(),
        "cpu": cpu_name(),
        "cores": os.cpu_count(),
    }


@cache
def installed() -> tuple[str, ...]:
    """All distributions in reach of this process, as `name==version` in the order of
    names.

    They are read from the names of their metadata folders, a hundred times as fast as
    with importlib.metadata.
    """
    folders = {
        path.stem for place in sys.path for path in Path(place).glob("*.dist-info")
    }
    return tuple(sorted("==".join(folder.split("-", 1)) for folder in folders))


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return ""
