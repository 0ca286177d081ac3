"""Reading of stored files: only ordinary ones, not through links, up to a size.

A store may come from anyone. In the place of a file, a pipe would make us wait, a
device has no end, and a link leads out of the study.
"""

import errno
import json
import os
import stat
from pathlib import Path
from typing import Any, BinaryIO

from sweep.store.locations import Location


class ForeignError(OSError):
    """A file that we have not written: it is no ordinary file, or too large."""


def quietly() -> int:
    """Return flags of `os.open` that follow no link and wait for no pipe.

    They are 0 where the system has none.
    """
    return getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)


def open_regular(path: Path, flags: int = os.O_RDONLY) -> BinaryIO:
    """Open an ordinary file for reading, with other `flags` for writing too.

    Raises OSError for anything else, and for writing if the file has a second name.
    """
    if not hasattr(os, "O_NOFOLLOW") and path.is_symlink():
        raise _link()
    try:
        descriptor = os.open(path, flags | quietly(), 0o666)
    except OSError as error:
        if error.errno == errno.ELOOP:
            raise _link() from None
        raise
    status = os.fstat(descriptor)
    if not stat.S_ISREG(status.st_mode):
        os.close(descriptor)
        raise ForeignError("is no ordinary file")
    if flags != os.O_RDONLY and status.st_nlink > 1:
        os.close(descriptor)
        raise ForeignError("has a second name (a hard link): put a copy in its place")
    return os.fdopen(descriptor, "rb" if flags == os.O_RDONLY else "r+b")


def regular_size(path: Path) -> int:
    """Return the bytes of an ordinary file, for those who open it by its path.

    Raises OSError for anything else.
    """
    status = path.lstat()
    if stat.S_ISLNK(status.st_mode):
        raise _link()
    if not stat.S_ISREG(status.st_mode):
        raise ForeignError("is no ordinary file")
    return status.st_size


def _link() -> OSError:
    return OSError(
        "is a symbolic link, which is not followed: put the file itself there"
    )


def open_stored(path: Location) -> Any:
    """Open a stored file, or object, for reading.

    Raises OSError as `open_regular` does.
    """
    return open_regular(path) if isinstance(path, Path) else path.open()


def read_whole(path: Location, most: int) -> bytes:
    """Return the content of a small file, or object.

    Raises OSError, also if it has more than `most` bytes.
    """
    if isinstance(path, Path):
        with open_regular(path) as file:
            content = file.read(most + 1)
    else:
        content = path.head(most + 1)
    if len(content) > most:
        raise ForeignError(f"is larger than {most:,} bytes")
    return content


def read_json(path: Location, most: int, shape: Any) -> Any:
    """Return the value of a small file, or object, in JSON.

    Parameters
    ----------
    path : Location
    most : int
        Most bytes of the content.
    shape : shape
        Shape that the value must have, see `fits`.

    Raises
    ------
    OSError, ValueError
        If the file cannot be read, is larger, or its value has another shape.
    """
    return parsed(read_whole(path, most), shape)


def parsed(content: bytes, shape: Any) -> Any:
    """Return the value of a text in JSON.

    Raises ValueError for another shape: see `fits`.
    """
    try:
        value = json.loads(content)
    except RecursionError:
        raise ValueError("it is nested too deeply") from None
    if not fits(value, shape):
        raise ValueError("it does not have the entries that it should")
    return value


def fits(value: object, shape: Any) -> bool:
    """Return whether a value from JSON has a shape.

    That is a type, [shape] for a list, {str: shape} for a mapping, or {name: shape,
    ...} for a mapping that has these names, and may have others.
    """
    if isinstance(shape, list):
        return isinstance(value, list) and all(fits(inner, shape[0]) for inner in value)
    if not isinstance(shape, dict):
        return isinstance(value, shape)
    if not isinstance(value, dict):
        return False
    if str in shape:
        return all(fits(inner, shape[str]) for inner in value.values())
    return all(
        name in value and fits(value[name], inner) for name, inner in shape.items()
    )
