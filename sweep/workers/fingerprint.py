"""What must be equal wherever the trials of a launch run: the code and the libraries
that its bits depend on.

A process takes its fingerprint once, after it has imported what it runs: the versions,
and a hash of every source file of `kernels`, of `sweep`, and of installed packages that
offer entries. So after an edit of a file, the fingerprints of older and newer processes
differ. A process that runs trials for another one compares both fingerprints, and
refuses if something differs that it has imported itself, or that another package may
still bring. A fingerprint travels as text, which any version of this module can read.
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
    """This process's fingerprint, as JSON; the same as long as the process lives."""
    own = {"boidsweep": str(sys.modules["sweep"].__version__)}
    return json.dumps(json.loads(libraries()) | own | _sources())


@cache
def libraries() -> str:
    """The versions of Python and of the libraries that bits depend on, as JSON: what a
    fingerprint has besides the code, which the ids of trials cover.
    """
    versions = {"python": platform.python_version()}
    versions |= {
        name: str(sys.modules[name].__version__)
        for name in LIBRARIES
        if name in sys.modules
    }
    return json.dumps(versions)


def own_part() -> str:
    """This process's fingerprint, with only those of our source files that are imported
    so far. Other packages are imported when a trial asks for them.
    """
    others = tuple(f"{name}/" for name in _folders() if name not in PACKAGES)
    everything, relevant = json.loads(fingerprint()), imported()
    return json.dumps(
        {
            name: value
            for name, value in everything.items()
            if not _is_file(name) or name in relevant or name.startswith(others)
        }
    )


@lru_cache(maxsize=4)
def refusal(expected: str) -> str:
    """Why this process must not run trials for one whose fingerprint is `expected`;
    empty where it may.
    """
    return "" if fingerprint() == expected else differences(expected, own_part())


def differences(ours: str, theirs: str) -> str:
    """How the second fingerprint differs from the first, in words; of source files only
    those that it has.
    """
    one, other = json.loads(ours), json.loads(theirs)
    both = sorted(
        name for name in one.keys() & other.keys() if one[name] != other[name]
    )
    words = [
        f"{name} {one[name]:.12} here, {other[name]:.12} there"
        for name in both
        if not _is_file(name)
    ]
    changed = sorted(
        name for name in other if _is_file(name) and one.get(name) != other[name]
    )
    if changed:
        more = len(changed) - MOST_NAMED
        others = f" and {more} more files" if more > 0 else ""
        words.append(f"other code in {', '.join(changed[:MOST_NAMED])}{others}")
    return "; ".join(words)


def _is_file(name: str) -> bool:
    return name.endswith(".py")


def edited() -> str:
    """Which source files that this process runs are no longer what they were, in words;
    empty where all are.
    """
    then, now = json.loads(fingerprint()), _sources()
    return ", ".join(
        sorted(name for name in imported() if then.get(name) != now.get(name))
    )


def imported() -> set[str]:
    """The source files of `kernels`, `sweep` and other packages with entries that this
    process has imported, each as from the folder of its package.
    """
    found, folders = set(), _folders()
    for name, module in list(sys.modules.items()):
        folder = folders.get(name.partition(".")[0])
        if folder and module.__file__ and Path(module.__file__).is_relative_to(folder):
            found.add(_named(folder, Path(module.__file__)))
    return found


@cache
def _folders() -> dict[str, Path]:
    """The folder of each package whose code trials may run."""
    from kernels.registry import packages

    found = dict[str, Path]()
    for name in (*PACKAGES, *packages()):
        spec = importlib.util.find_spec(name)
        if spec and spec.submodule_search_locations:
            found[name] = Path(spec.submodule_search_locations[0])
    return found


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
    except OSError:  # an editor is just putting another in its place
        return ""
