"""What the disk holds when the power fails: content, names and folders that were flushed.

Flushing a file saves its content, and flushing a folder the names in it. So what is new is safe
when its content was flushed, and then its name in each folder on the way to it.
"""

import os
from contextlib import suppress
from pathlib import Path


def flush_to_disk(path: Path) -> None:
    """Have the disk hold the content of a file, or the names in a folder. Raises OSError."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def move_durably(source: Path, target: Path) -> None:
    """Rename, having made sure that the disk holds the content, then that it holds the new name.

    Raises OSError.
    """
    for path in [*source.iterdir(), source] if source.is_dir() else [source]:
        flush_to_disk(path)
    source.replace(target)
    flush_to_disk(target.parent)


def make_folder(path: Path) -> None:
    """Make a folder in one that is there; afterwards the disk holds its name. Raises OSError."""
    path.mkdir(exist_ok=True)
    with suppress(PermissionError):  # who may write a folder and not read it cannot flush it
        flush_to_disk(path.parent)


def make_folders(path: Path) -> None:
    """Make a folder, and all above it that are missing; afterwards the disk holds their names.

    Where the folder is there, nothing is flushed. Raises OSError.
    """
    if not path.is_dir():
        _hold(path.parent)
        make_folder(path)


def _hold(path: Path) -> None:
    if not path.is_dir():
        make_folders(path)
        return
    # Who made this folder may have been killed before the disk held its name. But it may also
    # be somebody else's, in a place that nobody can flush.
    with suppress(OSError):
        flush_to_disk(path.parent)
