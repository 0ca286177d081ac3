"""The fingerprint of a process: the code and libraries that results depend on.

Code and libraries must be equal wherever the trials of a launch run. A process takes
its fingerprint once, after the import of the code that it runs. The fingerprint has the
versions, and a hash of every source file of `kernels`, of `sweep`, and of installed
packages that offer entries. So after an edit of a file, the fingerprints of older and
newer processes differ.

A process that runs trials for another process compares the two fingerprints. It rejects
the trials if a difference concerns a file that it has imported, or a package that may
be imported later. A fingerprint is sent as JSON, which any version of this module can
read.
"""

import hashlib
import importlib.util
import json
import platform
import sys
from functools import cache, lru_cache
from pathlib import Path

PACKAGES = ("kernels", "sweep")
LIBRARIES = ("numpy", "numba", "llvmlite")
MOST_NAMED = 4


@cache
def fingerprint() -> str:
    """Return the fingerprint of this process, as JSON; computed once per process."""
    own = {"boidsweep": str(sys.modules["sweep"].__version__)}
    return json.dumps(json.loads(libraries()) | own | _sources())


@cache
def libraries() -> str:
    """Return the versions of Python and of the libraries that results depend on.

    The JSON has all parts of a fingerprint except the code, which the ids of trials
    cover.
    """
    versions = {"python": platform.python_version()}
    versions |= {
        name: str(sys.modules[name].__version__)
        for name in LIBRARIES
        if name in sys.modules
    }
    return json.dumps(versions)


def own_part() -> str:
    """Return the part of the fingerprint that concerns this process.

    Of `kernels` and `sweep`, only imported source files count. All files of further
    packages count, because trials may still import these files.
    """
    other_packages = tuple(f"{name}/" for name in _folders() if name not in PACKAGES)
    everything = json.loads(fingerprint())
    relevant = imported()
    return json.dumps(
        {
            name: value
            for name, value in everything.items()
            if not _is_file(name) or name in relevant or name.startswith(other_packages)
        }
    )


@lru_cache(maxsize=4)
def refusal(expected: str) -> str:
    """Return why this process must not run trials for another process; "" if it may.

    The fingerprint of the sending process is `expected`.
    """
    return "" if fingerprint() == expected else differences(expected, own_part())


def differences(ours: str, theirs: str) -> str:
    """Return the differences between two fingerprints, in words.

    Of source files, only files in the second fingerprint count.
    """
    expected = json.loads(ours)
    actual = json.loads(theirs)
    both = sorted(
        name
        for name in expected.keys() & actual.keys()
        if expected[name] != actual[name]
    )
    phrases = [
        f"{name} {expected[name]:.12} here, {actual[name]:.12} there"
        for name in both
        if not _is_file(name)
    ]
    changed = sorted(
        name for name in actual if _is_file(name) and expected.get(name) != actual[name]
    )
    if changed:
        unnamed = len(changed) - MOST_NAMED
        more = f" and {unnamed} more files" if unnamed > 0 else ""
        phrases.append(f"other code in {', '.join(changed[:MOST_NAMED])}{more}")
    return "; ".join(phrases)


def _is_file(name: str) -> bool:
    return name.endswith(".py")


def edited() -> str:
    """Return the source files that this process runs and that were edited, in words.

    The string is "" if all files are unchanged.
    """
    then = json.loads(fingerprint())
    now = _sources()
    return ", ".join(
        sorted(name for name in imported() if then.get(name) != now.get(name))
    )


def imported() -> set[str]:
    """Return the source files that this process has imported.

    The files belong to `kernels`, `sweep` and further packages with entries. Each path
    begins with the name of its package.
    """
    files = set()
    folders = _folders()
    for name, module in list(sys.modules.items()):
        folder = folders.get(name.partition(".")[0])
        if folder and module.__file__ and Path(module.__file__).is_relative_to(folder):
            files.add(_named(folder, Path(module.__file__)))
    return files


@cache
def _folders() -> dict[str, Path]:
    """Return the folder of each package whose code trials may run."""
    from kernels.registry import packages

    folders = dict[str, Path]()
    for name in (*PACKAGES, *packages()):
        spec = importlib.util.find_spec(name)
        if spec and spec.submodule_search_locations:
            folders[name] = Path(spec.submodule_search_locations[0])
    return folders


def _sources() -> dict[str, str]:
    return {
        _named(folder, path): _hash(path)
        for folder in _folders().values()
        for path in sorted(folder.rglob("*.py"))
    }


def _named(folder: Path, path: Path) -> str:
    return path.relative_to(folder.parent).as_posix()


def _hash(path: Path) -> str:
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()[:12]
    except OSError:  # an editor is replacing the file right now
        return ""
