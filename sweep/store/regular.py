"""Reading of stored files: only regular files, without links, up to a size.

A store may be untrusted. A pipe in place of a file would block the reader, a device has
no end, and a link leads out of the study.
"""

import errno
import json
import os
import stat
from pathlib import Path
from typing import Any, BinaryIO

from sweep.store.locations import Location


class ForeignError(OSError):
    """A file that boidsweep has not written: not a regular file, or too large."""


def quietly() -> int:
    """Return flags of `os.open` that follow no link and wait for no pipe.

    The flags are 0 on a system without them.
    """
    return getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)


def open_regular(path: Path, flags: int = os.O_RDONLY) -> BinaryIO:
    """Open a regular file for reading, or with `flags` for writing too.

    Raises OSError if the file is not regular, and for writing if the file has a second
    name (a hard link).
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
        raise ForeignError("is not a regular file")
    if flags != os.O_RDONLY and status.st_nlink > 1:
        os.close(descriptor)
        raise ForeignError("has a second name (a hard link): replace it with a copy")
    return os.fdopen(descriptor, "rb" if flags == os.O_RDONLY else "r+b")


def regular_size(path: Path) -> int:
    """Return the bytes of a regular file, for libraries that open files by path.

    Raises OSError if the file is not regular.
    """
    status = path.lstat()
    if stat.S_ISLNK(status.st_mode):
        raise _link()
    if not stat.S_ISREG(status.st_mode):
        raise ForeignError("is not a regular file")
    return status.st_size


def _link() -> OSError:
    return OSError(
        "is a symbolic link, which is not followed: put the file itself there"
    )


def open_stored(path: Location) -> Any:
    """Open a stored file or object for reading.

    Raises OSError as `open_regular` does.
    """
    return open_regular(path) if isinstance(path, Path) else path.open()


def read_whole(path: Location, most: int) -> bytes:
    """Return the content of a small file or object.

    Raises OSError, also if the content has more than `most` bytes.
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
    """Return the value of a small JSON file or object.

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
        If the file cannot be read, is larger, or has a value of another shape.
    """
    return parsed(read_whole(path, most), shape)


def parsed(content: bytes, shape: Any) -> Any:
    """Return the value of a JSON text.

    Raises ValueError for another shape: see `fits`.
    """
    try:
        value = json.loads(content)
    except RecursionError:
        raise ValueError("the JSON is nested too deeply") from None
    if not fits(value, shape):
        raise ValueError("the JSON does not have the required entries")
    return value


def fits(value: object, shape: Any) -> bool:
    """Return whether a value from JSON has a shape.

    A shape is a type, [shape] for a list, or {str: shape} for a mapping. The shape
    {name: shape, ...} is a mapping with these names, and possibly further names.
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
