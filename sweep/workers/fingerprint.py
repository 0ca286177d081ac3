"""What must be equal wherever the trials of a launch run: the code and the libraries
that its bits depend on.

A process takes its fingerprint once, after it has imported what it runs: the versions,
and a hash of every source file of `kernels` and `sweep`. So
after an edit of a file, the fingerprints of older and newer processes differ. A process
that runs trials for another one compares both fingerprints, and refuses if something
differs that it has imported itself. A fingerprint travels as text, which any version of
this module can read.
"""

import hashlib
import json
import platform
import sys
from functools import cache, lru_cache
from pathlib import Path

ROOT = Path(__file__).parent.parent.parent
PACKAGES = ("kernels", "sweep")
LIBRARIES = ("numpy", "numba", "llvmlite")
MOST_NAMED = 4


@cache
def fingerprint() -> str:
    """This process's fingerprint, as JSON; the same as long as the process lives."""
    versions = {
        "python": platform.python_version(),
        "boidsweep": str(sys.modules["sweep"].__version__),
    }
    versions |= {
        name: str(sys.modules[name].__version__)
        for name in LIBRARIES
        if name in sys.modules
    }
    return json.dumps(versions | _sources(ROOT))


def own_part() -> str:
    """This process's fingerprint, with only those source files imported so far."""
    everything, relevant = json.loads(fingerprint()), imported()
    return json.dumps(
        {
            name: value
            for name, value in everything.items()
            if not _is_file(name) or name in relevant
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
    then, now = json.loads(fingerprint()), _sources(ROOT)
    return ", ".join(
        sorted(name for name in imported() if then.get(name) != now.get(name))
    )


def imported() -> set[str]:
    """The source files of `kernels` and `sweep` that this process has imported, named
    as from the folder of both.
    """
    own = [
        module
        for name, module in list(sys.modules.items())
        if name.partition(".")[0] in PACKAGES
    ]
    paths = [Path(module.__file__) for module in own if module.__file__]
    return {
        path.relative_to(ROOT).as_posix() for path in paths if path.is_relative_to(ROOT)
    }


def _sources(root: Path) -> dict[str, str]:
    paths = sorted(
        path for package in PACKAGES for path in (root / package).rglob("*.py")
    )
    return {path.relative_to(root).as_posix(): _hash(path) for path in paths}


def _hash(path: Path) -> str:
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()[:12]
    except OSError:  # an editor is just putting another in its place
        return ""
