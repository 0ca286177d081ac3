"""Files and names that outlive a loss of power: the disk holds what was flushed.

Flushing a file saves its content; flushing a folder saves the names in it. So a new
file is safe when first its content is flushed, and then its name in each folder on the
way to it.

Windows has no way to flush the names in a folder. Some file systems have none either,
such as those of networks and in user space. One that keeps a journal, such as NTFS,
holds the names soon after. Where a file system reports that it has no way, the log has
one warning.
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

All others, such as EIO and ENOSPC, mean that it has tried, and that something may be
lost already.
"""
SAID = "BOIDSWEEP_FLUSHES_NO_FOLDERS"
"""Variable of the environment that notes the warning. Worker processes inherit it."""


def flush(descriptor: int) -> None:
    """Flush the content of an open file, or the names in an open folder, to the disk.

    On macOS fsync only hands it to the drive, which may keep it in memory of its own.
    Raises OSError.
    """
    if sys.platform == "darwin":
        import fcntl

        with suppress(OSError):  # a file system that cannot ask its drive
            fcntl.fcntl(descriptor, fcntl.F_FULLFSYNC)
            return
    os.fsync(descriptor)


def flush_names(descriptor: int) -> None:
    """Flush the names in an open folder, where its file system has a way to do that.

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
                " may cost the last part that is stored; launch the study again then",
                error.strerror,
            )


def flush_to_disk(path: Path) -> None:
    """Flush a file's content, or the names in a folder, to the disk.

    Raises OSError.
    """
    flags = os.O_RDONLY
    if not hasattr(os, "O_DIRECTORY"):  # folders cannot be opened
        if path.is_dir():
            return
        flags = os.O_RDWR  # by which alone Windows flushes
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
    """Make a folder in one that exists; afterwards the disk holds its name.

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
