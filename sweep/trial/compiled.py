"""The built-in package `kernels`, and the private folder of its compiled code.

Another distribution has a package with this name. So the finder looks only at a single
path: next to `sweep` in a checkout, and inside `sweep` in a wheel.

The cache of numba consists of pickles. A user with permission to write there, or to
rename a parent folder, can run code as the owner. So the cache folder, its parents and
all links must belong to the owner or to root. No other user may have permission to
write there. This is also a requirement of ssh for a home folder.

There are three exceptions:

- A private group of the user may write, as in Debian's ssh, because a umask of 002 is
  common with private groups.
- A parent may also be sticky, such as /tmp: there only the owner of an entry can change
  it.
- The owner of `/` counts as root. In a container this may be another user.

If a requirement does not hold, or the folder is not writable, kernels are compiled into
a temporary folder. Worker processes share the temporary folder, because the environment
is inherited. The process that created the folder deletes it at exit.
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
"""Environment variable, set after the warning that the folder cannot be written.

Worker processes inherit the variable, so that the warning is printed once.
"""
LOG = logging.getLogger("sweep")


class OurKernels:
    """Finder for `sys.meta_path` that finds only the built-in `kernels`.

    The finder calls `settle` first, because `kernels` reads NUMBA_CACHE_DIR on import.
    Then numba ignores configuration files in the current folder, unless numba was
    imported before. The folder is checked only when kernels are needed, not for `sweep
    --help`.
    """

    def find_spec(self, name: str, *_: Any) -> ModuleSpec | None:
        """Return the spec of `kernels`, None for any other module.

        Raises ImportError if the package is not in the built-in folder.
        """
        if name != "kernels":
            return None
        spec = PathFinder.find_spec(name, [str(beside_kernels())])
        if spec is None or spec.origin is None:
            raise ImportError(
                f"boidsweep lacks its package `kernels` in {beside_kernels()};"
                f" {REINSTALL}"
            )
        if "numba" not in sys.modules:
            ignore_settings(OF_NUMBA)
        if hasattr(os, "geteuid"):  # other systems have no modes to look at
            settle()
        return spec


def beside_kernels() -> Path:
    """Return the folder that contains the built-in `kernels`."""
    within = PACKAGE / "bundled"
    return within if within.is_dir() else PACKAGE.parent


def check_kernels(imported: ModuleType | None) -> None:
    """Raise ImportError if an imported package `kernels` is not the built-in one."""
    file = getattr(imported, "__file__", None)
    if imported and (file is None or Path(file).parent.parent != beside_kernels()):
        raise ImportError(
            "boidsweep needs its own package `kernels`, but this process has imported"
            f" another one, of {file or 'no file'}: import sweep first, or use a"
            " separate environment for one of them"
        )


def settle() -> None:
    """Make the usual folder private, or set NUMBA_CACHE_DIR to a temporary one.

    Raises CacheError if no temporary folder can be created either.
    """
    try:
        make_private(usual())
    except CacheError as error:
        os.environ[VARIABLE] = str(_temporary(error))
        effect = "compiled kernels are stored for this process only"
        LOG.warning("%s: %s. %s", effect, error, WAY_OUT)


def usual() -> Path:
    """Return the folder where the package `kernels` stores compiled code.

    Raises CacheError for a relative path, because the current folder may be untrusted.
    """
    cache = os.environ.get(VARIABLE) or os.environ.get("XDG_CACHE_HOME")
    try:
        cache = cache or str(Path.home() / ".cache")
    except RuntimeError:
        raise CacheError("you have no home folder") from None
    if not Path(cache).is_absolute():
        raise CacheError(f"{cache} is relative to the current folder")
    return Path(cache) / NAME


def make_private(folder: Path) -> None:
    """Create a folder if it does not exist, with permissions only for the user.

    Raises CacheError if other users can write the folder, or could until now, or if
    the user cannot write it.
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
        message = f"{error}, so {folder} may hold code of other users: remove it"
        raise CacheError(message) from None


def _way(folder: Path) -> Iterator[Path]:
    """Yield every folder and link on the path from the root to a folder."""
    for place in (*reversed(folder.parents), folder):
        if place.is_symlink():
            with suppress(FileNotFoundError):
                place.stat()  # raises an OSError for links in a circle
            yield from _way(place.parent / place.readlink())
        yield place


def _check(place: Path, *, sticky: bool = False) -> None:
    """Raise CacheError if other users can change a file or folder, or its content.

    With `sticky`, other users may have their own entries in the folder.
    """
    status = place.lstat()
    if status.st_uid not in (os.geteuid(), Path("/").stat().st_uid):
        raise CacheError(f"{place} belongs to user {status.st_uid}")
    if sticky and (stat.S_ISLNK(status.st_mode) or status.st_mode & stat.S_ISVTX):
        return
    by_group = status.st_mode & stat.S_IWGRP and not _is_private(status.st_gid)
    if by_group or status.st_mode & stat.S_IWOTH:
        mode = f"mode {stat.S_IMODE(status.st_mode):o}"
        raise CacheError(f"{place} can be written by other users ({mode})")


def _is_private(number: int) -> bool:
    """Return whether a group has the user's name and no other members."""
    import grp
    import pwd

    try:
        group = grp.getgrgid(number)
        user = pwd.getpwuid(os.geteuid())
    except KeyError:
        return False
    return group.gr_name == user.pw_name and {*group.gr_mem} <= {user.pw_name}


def _temporary(why: CacheError) -> Path:
    """Return a new private folder, which is deleted when the process ends.

    Raises CacheError, with two reasons, if no folder can be created.
    """
    import tempfile

    try:
        folder = Path(tempfile.mkdtemp(prefix=f"{NAME}-"))
        atexit.register(shutil.rmtree, folder, ignore_errors=True)
        make_private(folder / NAME)
    except (OSError, CacheError) as error:
        reason = f"no folder can store compiled kernels: {why}; temporary: {error}"
        raise CacheError(f"{reason}. {WAY_OUT}") from None
    return folder
