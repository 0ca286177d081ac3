"""What the disk holds when the power fails: the content and names that were flushed.

Flushing a file saves its content; flushing a folder saves the names in it. So a new
file is safe when first its content is flushed, and then its name in each folder on the
way to it.

Windows has no way to flush the names in a folder. There a file system that keeps a
journal, as NTFS, holds them soon after.
"""

import os
import sys
from contextlib import suppress
from pathlib import Path


def flush(descriptor: int) -> None:
    """Flush what an open file or folder holds to the disk. Raises OSError.

    On macOS fsync only hands it to the drive, which may keep it in memory of its own.
    """
    if sys.platform == "darwin":
        import fcntl

        with suppress(OSError):  # a file system that cannot ask its drive
            fcntl.fcntl(descriptor, fcntl.F_FULLFSYNC)
            return
    os.fsync(descriptor)


def flush_to_disk(path: Path) -> None:
    """Flush a file's content, or the names in a folder, to the disk. Raises OSError."""
    flags = os.O_RDONLY
    if not hasattr(os, "O_DIRECTORY"):  # folders cannot be opened
        if path.is_dir():
            return
        flags = os.O_RDWR  # by which alone Windows flushes
    descriptor = os.open(path, flags)
    try:
        flush(descriptor)
    finally:
        os.close(descriptor)


def move_durably(source: Path, target: Path) -> None:
    """Rename a file or folder that was flushed; afterwards its new name is flushed too.

    Raises OSError.
    """
    for path in [*source.iterdir(), source] if source.is_dir() else [source]:
        flush_to_disk(path)
    source.replace(target)
    flush_to_disk(target.parent)


def make_folder(path: Path) -> None:
    """Make a folder in one that is there; afterwards the disk holds its name.

    Raises OSError.
    """
    path.mkdir(exist_ok=True)
    with suppress(PermissionError):  # only who may read a folder can flush it
        flush_to_disk(path.parent)


def make_folders(path: Path) -> None:
    """Make a folder, and those above it; afterwards the disk holds their names.

    If the folder exists, nothing is flushed. Raises OSError.
    """
    if not path.is_dir():
        _hold(path.parent)
        make_folder(path)


def _hold(path: Path) -> None:
    if not path.is_dir():
        make_folders(path)
        return
    # Whoever made it may have been killed before the disk held its name. But it may
    # also be somebody else's, in a place that nobody can flush.
    with suppress(OSError):
        flush_to_disk(path.parent)
