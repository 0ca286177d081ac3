"""Where results come from: the spec as launched, the code, versions and machine."""

import hashlib
import os
import platform
import subprocess
import sys
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from kernels.identity import Code, kernels_sha
from sweep.design.code import study_code
from sweep.own_code.catalogue import OwnCatalogue, of_packages
from sweep.spec.study import Study
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
MOST_DIFF = 200_000
QUIETLY = ("--no-pager", "-c", "core.fsmonitor=false", "-c", "core.hooksPath=/dev/null")
OURSELVES = ("--no-ext-diff", "--no-textconv", "--ignore-submodules=all")
APART = {"GIT_OPTIONAL_LOCKS": "0", "GIT_NO_LAZY_FETCH": "1", "GIT_ALLOW_PROTOCOL": ""}
"""With this git neither writes the index nor fetches what a partial clone lacks."""


def provenance(study: Study) -> dict[str, Any]:
    """All that is recorded with every part of a launch, ready for JSON."""
    code = study_code(study)
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
        "git": git_state(Path(__file__).parent.parent),
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


def git_state(folder: Path) -> dict[str, Any]:
    """What the working tree that `folder` is in says of the code; empty where the code
    is not kept in one.

    The code is what is below `folder` and in `kernels` beside it: `commit`; its `diff`
    to it, of which `cut` characters beyond MOST_DIFF are left out; and of the files
    that are `untracked` the name and the sha256 of each.
    """
    root, code = folder.parent, ("--", folder.name, "kernels")
    commit = _git(root, "rev-parse", "HEAD")
    if not commit or not _git(root, "ls-files", "--", folder.name):
        return {}
    diff = os.fsencode(_git(root, "diff", *OURSELVES, "HEAD", *code)).decode(
        errors="replace"
    )
    return {
        "commit": commit.strip(),
        "diff": diff[:MOST_DIFF],
        "cut": max(0, len(diff) - MOST_DIFF),
        "untracked": _untracked(root, code),
    }


def _untracked(root: Path, code: tuple[str, ...]) -> dict[str, str]:
    names = _git(root, "ls-files", "--others", "--exclude-standard", "-z", *code).split(
        "\0"
    )
    paths = {name: root / name for name in names if name and (root / name).is_file()}
    return {
        name: hashlib.sha256(path.read_bytes()).hexdigest()
        for name, path in sorted(paths.items())
    }


def _git(root: Path, *arguments: str) -> str:
    """The output of git, which runs none of the commands that the settings of a
    repository may name.

    The code may be installed within somebody else's repository. Filters of files have
    names of their own, and are switched off by them.
    """
    names = _run(
        root, "config", "--name-only", "-z", "--get-regexp", r"^filter\."
    ).split("\0")
    if any("=" in name for name in names):  # no option can name it
        return ""
    off = [
        f"{name}={'false' if name.endswith('.required') else ''}"
        for name in names
        if name
    ]
    return _run(
        root, *(word for setting in off for word in ("-c", setting)), *arguments
    )


def _run(root: Path, *arguments: str) -> str:
    command = ["git", "-C", str(root), *QUIETLY, *arguments]
    try:
        done = subprocess.run(
            command, env=os.environ | APART, capture_output=True, timeout=20
        )
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return os.fsdecode(done.stdout) if done.returncode == 0 else ""


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
