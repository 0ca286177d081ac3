"""Which package `kernels` is ours, and where what it compiles is kept: in a folder that
nobody else can write.

Another distribution has a package of that name. So ours is found at its own place: in a
checkout beside `sweep`, in a wheel within it, where no other distribution writes.

numba's cache is pickles: whoever can write there, or rename a folder on the way there,
runs code as the user. So the folder, and every folder and link on the way, belongs to
the user or to root, and nobody else can write it. ssh asks that of a home folder. As
Debian's ssh does, we allow a group that is the user's private one: with such groups a
umask of 002 is common. A folder on the way may also be sticky, as /tmp is: there only
its owner can change an entry. Root is whoever owns `/`; in a container that may be
another user.

If that does not hold, or nothing can be written, kernels are compiled into a temporary
folder. Worker processes share it, as they have the environment of the process that
started them. It is deleted when that process ends.
"""

import atexit
import logging
import os
import shutil
import stat
import sys
from collections.abc import Iterator
from contextlib import suppress
from importlib.machinery import ModuleSpec, PathFinder
from pathlib import Path
from types import ModuleType
from typing import Any

from sweep.errors import CacheError
from sweep.surroundings import OF_NUMBA, ignore_settings

PACKAGE = Path(__file__).parents[1]
REINSTALL = "install it again: pip install --force-reinstall --no-deps boidsweep"
NAME = "boidsweep"
VARIABLE = "NUMBA_CACHE_DIR"
WAY_OUT = f"Set {VARIABLE} to a folder that you alone can write."
NOTHING_IS_KEPT = "BOIDSWEEP_KEEPS_NO_KERNELS"
"""A variable that says that the folder cannot be written any more, and that it was
said. Worker processes inherit it.
"""
LOG = logging.getLogger("sweep")


class OurKernels:
    """Finds our `kernels`, and calls `settle` just before, as it reads NUMBA_CACHE_DIR
    when it is imported. It imports numba, which then obeys no settings in the current
    folder; where a program has imported numba before, the program's rules hold.

    It is a finder for `sys.meta_path` that finds no other module. So the folder is
    looked at only when kernels are needed, and `sweep --help` looks at none.
    """

    def find_spec(self, name: str, *_: Any) -> ModuleSpec | None:
        """Python asks this for each module that it imports for the first time.

        Raises ImportError where the package is not at its place.
        """
        if name != "kernels":
            return None
        found = PathFinder.find_spec(name, [str(beside_kernels())])
        if found is None or found.origin is None:
            raise ImportError(
                f"boidsweep lacks its package `kernels` in {beside_kernels()};"
                f" {REINSTALL}"
            )
        if "numba" not in sys.modules:
            ignore_settings(OF_NUMBA)
        if hasattr(os, "geteuid"):  # other systems have no modes to look at
            settle()
        return found


def beside_kernels() -> Path:
    """The folder that holds our `kernels`."""
    within = PACKAGE / "bundled"
    return within if within.is_dir() else PACKAGE.parent


def check_kernels(imported: ModuleType | None) -> None:
    """Raise ImportError if a package `kernels` that is imported already is not ours."""
    file = getattr(imported, "__file__", None)
    if imported and (file is None or Path(file).parent.parent != beside_kernels()):
        raise ImportError(
            "boidsweep needs its own package `kernels`, but this process has imported"
            f" another one, of {file or 'no file'}: import sweep first, or use a"
            " separate environment for one of them"
        )


def settle() -> None:
    """Make the usual folder private; if that fails, set NUMBA_CACHE_DIR to a temporary
    one.

    Raises CacheError where no temporary folder can be made either.
    """
    try:
        make_private(usual())
    except CacheError as error:
        os.environ[VARIABLE] = str(_temporary(error))
        words = "compiled kernels are kept for this process only"
        LOG.warning("%s: %s. %s", words, error, WAY_OUT)


def usual() -> Path:
    """Where `kernels` keeps what it compiles, by its own rules.

    Raises CacheError for a relative path: it would lead into a stranger's folder, too.
    """
    cache = os.environ.get(VARIABLE) or os.environ.get("XDG_CACHE_HOME")
    try:
        cache = cache or str(Path.home() / ".cache")
    except RuntimeError:
        raise CacheError("you have no home folder") from None
    if not Path(cache).is_absolute():
        raise CacheError(f"{cache} is another folder wherever you stand")
    return Path(cache) / NAME


def make_private(folder: Path) -> None:
    """Make `folder` unless it exists, and take away others' permission to write it.

    Raises CacheError if others can write it, or could until now, and if nobody can.
    """
    import tempfile

    try:
        for place in _way(folder):
            if not os.path.lexists(place):
                place.mkdir(0o700, exist_ok=True)
            _check(place, sticky=True)
        inside = folder.resolve()
        _check(inside)
        if stat.S_IMODE(inside.stat().st_mode) != 0o700:
            for path in inside.rglob("*"):
                with suppress(FileNotFoundError):
                    _check(path)
            inside.chmod(0o700)
        tempfile.TemporaryFile(dir=inside).close()
    except OSError as error:
        raise CacheError(f"{folder} cannot be used ({error})") from None
    except CacheError as error:
        words = f"{error}, so {folder} may hold code of others: remove it"
        raise CacheError(words) from None


def _way(folder: Path) -> Iterator[Path]:
    """Every folder and link that leads to `folder`, from the root on, and itself."""
    for place in (*reversed(folder.parents), folder):
        if place.is_symlink():
            with suppress(FileNotFoundError):
                place.stat()  # raises an OSError for links in a circle
            yield from _way(place.parent / place.readlink())
        yield place


def _check(place: Path, *, sticky: bool = False) -> None:
    """Raise CacheError where others can change what is at `place`, or in it.

    With `sticky`, others may have entries of their own in it.
    """
    about = place.lstat()
    if about.st_uid not in (os.geteuid(), Path("/").stat().st_uid):
        raise CacheError(f"{place} belongs to user {about.st_uid}")
    if sticky and (stat.S_ISLNK(about.st_mode) or about.st_mode & stat.S_ISVTX):
        return
    by_group = about.st_mode & stat.S_IWGRP and not _is_private(about.st_gid)
    if by_group or about.st_mode & stat.S_IWOTH:
        mode = f"mode {stat.S_IMODE(about.st_mode):o}"
        raise CacheError(f"{place} can be written by others ({mode})")


def _is_private(number: int) -> bool:
    """Whether a group is the user's own, of the same name and without other members."""
    import grp
    import pwd

    try:
        group, user = grp.getgrgid(number), pwd.getpwuid(os.geteuid())
    except KeyError:
        return False
    return group.gr_name == user.pw_name and {*group.gr_mem} <= {user.pw_name}


def _temporary(why: CacheError) -> Path:
    """A new private folder, gone at the end. Raises CacheError, with both reasons."""
    import tempfile

    try:
        folder = Path(tempfile.mkdtemp(prefix=f"{NAME}-"))
        atexit.register(shutil.rmtree, folder, ignore_errors=True)
        make_private(folder / NAME)
    except (OSError, CacheError) as error:
        words = f"no folder can keep compiled kernels: {why}; a temporary one: {error}"
        raise CacheError(f"{words}. {WAY_OUT}") from None
    return folder
