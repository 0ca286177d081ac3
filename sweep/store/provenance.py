"""Where results come from: the spec as launched, the code, versions and machine."""

import os
import platform
import sys
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from kernels.identity import Code, kernels_sha
from sweep.design.code import study_code
from sweep.own_code.catalogue import OwnCatalogue, of_packages
from sweep.spec.study import Study
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


def provenance(study: Study) -> dict[str, Any]:
    """All that is recorded with every part of a launch, ready for JSON."""
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
    }


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


def cpu_name() -> str:
    """The processor's name as the system gives it."""
    try:
        lines = Path("/proc/cpuinfo").read_text("utf-8").splitlines()
    except OSError:
        return platform.processor()
    names = [
        line.partition(":")[2].strip()
        for line in lines
        if line.startswith("model name")
    ]
    return names[0] if names else platform.processor()


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return ""
