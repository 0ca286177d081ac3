"""Where results come from: the spec as launched, the code, the versions and the machine."""

import platform
import subprocess
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from kernels import KERNELS_SHA
from sweep.spec import Study

PACKAGES = ("boidsweep", "numpy", "numba", "llvmlite", "scipy", "pandas", "pyarrow", "joblib", "pillow", "SALib")
MOST_DIFF = 200_000


def provenance(study: Study) -> dict[str, Any]:
    """All that is recorded with every part of a launch, ready for JSON."""
    return {
        "format": 1,
        "study": study.name,
        "model": study.model,
        "preset": study.preset,
        "spec": study.text,
        "spec_path": str(study.path),
        "kernels_sha": KERNELS_SHA,
        "git": git_state(Path(__file__).parent),
        **machine(),
    }


def machine() -> dict[str, Any]:
    """What bits may depend on beside the code: versions, system and processor."""
    return {
        "versions": {"python": platform.python_version()} | {name: _version(name) for name in PACKAGES},
        "platform": platform.platform(),
        "cpu": cpu_name(),
    }


def git_state(folder: Path) -> dict[str, str]:
    """Commit and diff of the working tree that `folder` is in; empty where the code is not in one."""
    commit = _git(folder, "rev-parse", "HEAD")
    if not commit:
        return {}
    diff = _git(folder, "diff", "HEAD")
    return {"commit": commit.strip(), "diff": diff[:MOST_DIFF]}


def _git(folder: Path, *arguments: str) -> str:
    try:
        done = subprocess.run(["git", "-C", str(folder), *arguments], capture_output=True, text=True, timeout=20)
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return done.stdout if done.returncode == 0 else ""


def cpu_name() -> str:
    """The processor's name as the system gives it."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor()
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor()


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return ""
