"""Files and names that survive a loss of power, because they are flushed to the disk.

A flush of a file saves the content. A flush of a folder saves the names in the folder.
So a new file is safe after two steps: first a flush of the content, then a flush of
each folder of the path.

Windows cannot flush the names in a folder. Some file systems, such as network file
systems and file systems in user space, cannot do this either. A file system with a
journal, such as NTFS, saves the names soon after. If a file system reports that folders
cannot be flushed, the log has a single warning.
"""

import errno
import logging
import os
import stat
import sys
from contextlib import suppress
from pathlib import Path

LOG = logging.getLogger("sweep")
HAS_NO_WAY = {errno.EINVAL, errno.ENOSYS, errno.ENOTSUP, errno.EOPNOTSUPP}
"""Errors of a file system that cannot flush folders.

All other errors, such as EIO and ENOSPC, mean that a flush was tried and failed, so
data may be lost already.
"""
SAID = "BOIDSWEEP_FLUSHES_NO_FOLDERS"
"""Environment variable that notes the warning, and that worker processes inherit."""


def flush(descriptor: int) -> None:
    """Flush the content of an open file, or the names in an open folder, to the disk.

    On macOS fsync only passes data to the drive, which may keep the data in a cache.
    Raises OSError.
    """
    if sys.platform == "darwin":
        import fcntl

        with suppress(OSError):  # a file system that cannot ask its drive
            fcntl.fcntl(descriptor, fcntl.F_FULLFSYNC)
            return
    os.fsync(descriptor)


def flush_names(descriptor: int) -> None:
    """Flush the names in an open folder, if its file system can do this.

    Raises OSError.
    """
    try:
        flush(descriptor)
    except OSError as error:
        if error.errno not in HAS_NO_WAY:
            raise
        if SAID not in os.environ:
            os.environ[SAID] = "1"
            LOG.warning(
                "this file system cannot flush a folder to the disk (%s): a power cut"
                " may lose the last stored part; after a power cut, launch the study"
                " again",
                error.strerror,
            )


def flush_to_disk(path: Path) -> None:
    """Flush the content of a file, or the names in a folder, to the disk.

    Raises OSError.
    """
    flags = os.O_RDONLY
    if not hasattr(os, "O_DIRECTORY"):  # folders cannot be opened
        if path.is_dir():
            return
        flags = os.O_RDWR  # Windows flushes only writable files
    descriptor = os.open(path, flags)
    try:
        is_folder = stat.S_ISDIR(os.fstat(descriptor).st_mode)
        (flush_names if is_folder else flush)(descriptor)
    finally:
        os.close(descriptor)


def move_durably(source: Path, target: Path) -> None:
    """Rename a file or folder that was flushed, and flush its new name.

    Raises OSError.
    """
    for path in [*source.iterdir(), source] if source.is_dir() else [source]:
        flush_to_disk(path)
    source.replace(target)
    flush_to_disk(target.parent)


def make_folder(path: Path) -> None:
    """Make a folder in an existing folder; afterwards the disk holds the name.

    Raises OSError.
    """
    path.mkdir(exist_ok=True)
    with suppress(PermissionError):  # a flush needs the right to read the folder
        flush_to_disk(path.parent)


def make_folders(path: Path) -> None:
    """Make a folder and all parents; afterwards the disk holds the names.

    If the folder exists, nothing is flushed. Raises OSError.
    """
    if not path.is_dir():
        _hold(path.parent)
        make_folder(path)


def _hold(path: Path) -> None:
    if not path.is_dir():
        make_folders(path)
        return
    # The process that made the folder may have been killed before the flush. But the
    # folder may also belong to another user, in a folder that cannot be flushed.
    with suppress(OSError):
        flush_to_disk(path.parent)
