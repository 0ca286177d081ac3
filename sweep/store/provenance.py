"""Origin of results: the spec as launched, the code, versions and machine."""

import os
import platform
import sys
from collections.abc import Mapping
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from kernels.identity import Code, kernels_sha
from sweep.design import study_code
from sweep.own_code import OwnCatalogue, of_packages
from sweep.spec import Study, sections
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


def launch_provenance(
    study: Study, device: dict[str, str] | None = None
) -> dict[str, Any]:
    """Return the provenance of every part of a launch, ready for JSON.

    `device` is the device on which the trials run, or None for the processor.
    """
    code = study_code(study)
    spec_state = study_state(study.path, study.text)
    return {
        "format": 1,
        "study": study.name,
        "model": study.model,
        "preset": study.preset,
        "spec": study.text,
        "spec_path": str(study.path),
        "kernels_sha": kernels_sha(),
        "code": code._asdict(),
        **_added_code(study, code),
        "git": git_state(HERE) or built_from(HERE),
        **({"study_git": spec_state} if spec_state else {}),
        "lock": list(installed()),
        **machine(),
        **({"device": device} if device else {}),
    }


def measured_provenance(
    origin: Mapping[str, Any], study: Study, spec: str
) -> dict[str, Any]:
    """Return the origin of trials, or of a plan, with metrics that were measured later.

    The entry `measured` has the code, the versions and the machine of the measurement.

    Parameters
    ----------
    origin : mapping
        Origin of the trials before the measurement.
    study : Study
        A study that records all old and new metrics.
    spec : str
        Text of the spec of `study`.
    """
    then = Code(**origin["code"])
    now = study_code(study)
    code = then._replace(metrics={**then.metrics, **now.metrics})
    added = _added_code(study, code)
    if "own" in origin and added["own"]["sha"] == origin["own"]["sha"]:
        added["own"] = origin["own"]  # keeps the seal of the user who launched
    # `PlanAbout.into` writes the records of the sections.
    left_out = {"study_git", *sections()}
    earlier = {name: origin[name] for name in origin if name not in left_out}
    here = {"git": git_state(HERE) or built_from(HERE), **machine()}
    return earlier | {"spec": spec, "code": code._asdict(), **added, "measured": here}


def _added_code(study: Study, code: Code) -> dict[str, Any]:
    """Return the custom code and the packages that compute the trials.

    Custom code has the seal of the user. Entries of packages have a description for
    tables, because a package may be uninstalled later.
    """
    catalogue = study.catalogue
    names = {
        "models": [study.model],
        "metrics": code.metrics,
        "maps": code.maps,
        "starts": code.starts,
        "profiles": study.record.profile_names,
    }
    packages = of_packages(catalogue, names)
    added = {"packages": packages} if packages else {}
    if isinstance(catalogue, OwnCatalogue):
        added["own"] = {"sha": catalogue.code.sha, "seal": seal(catalogue.code.sha)}
    return added


@cache
def machine() -> dict[str, Any]:
    """Return the versions, the system and the processor.

    Results may depend on these in addition to the code.
    """
    return {
        "versions": {"python": platform.python_version()}
        | {name: _version(name) for name in PACKAGES},
        "platform": platform.platform(),
        "cpu": cpu_name(),
        "cores": os.cpu_count(),
    }


@cache
def installed() -> tuple[str, ...]:
    """Return `name==version` of all distributions on `sys.path`, sorted.

    The names of metadata folders contain the versions. Reading these names is a hundred
    times as fast as importlib.metadata.
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
