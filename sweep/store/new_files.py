"""How every file is written: under a name that nobody can foresee, then renamed.

It is flushed to the disk before the rename. So a file exists whole or not at all. If a
stranger's folder has a link in its place, the rename replaces the link, and nothing is
written through it. Everything happens relative to the descriptor of the folder that was
opened first, so it does no harm if somebody swaps a folder for a link meanwhile.
"""

import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

NEW = os.O_RDWR | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW
FOLDER = os.O_RDONLY | os.O_DIRECTORY


def create(path: Path, folder: int | None = None) -> BinaryIO:
    """Open a file that is not there yet, relative to the descriptor `folder`.

    Raises OSError, also where there is a link.
    """
    return os.fdopen(os.open(path, NEW, 0o666, dir_fd=folder), "w+b")


@contextmanager
def replacing(path: Path, below: Path | None = None) -> Iterator[BinaryIO]:
    """A new file that becomes `path` in one step at the end, or is gone after an error.

    `below` is the folder that the user has named, by default that of `path`. It may be
    a link. Folders between `below` and `path` are made where they are missing, and none
    of them may be a link. Raises OSError.
    """
    # The name of `path` may be as long as names can be.
    name = Path(f"{path.name[:40]}-{secrets.token_hex(8)}.unfinished")
    folder = _open_folder(path.parent, below or path.parent)
    try:
        with create(name, folder) as file:
            try:
                yield file
                file.flush()
                os.fsync(file.fileno())
                os.replace(name, path.name, src_dir_fd=folder, dst_dir_fd=folder)
            except BaseException:
                with suppress(OSError):
                    os.unlink(name, dir_fd=folder)
                raise
        os.fsync(folder)
    finally:
        os.close(folder)


def _open_folder(path: Path, below: Path) -> int:
    """A descriptor of the folder `path`, reached from `below` through no link."""
    here, folder = below, os.open(below, FOLDER)
    for name in path.relative_to(below).parts:
        here = here / name
        try:
            with suppress(FileExistsError):
                os.mkdir(name, dir_fd=folder)
                os.fsync(folder)
            inner = os.open(name, FOLDER | os.O_NOFOLLOW, dir_fd=folder)
        except NotADirectoryError:
            raise OSError(f"{here} is a symbolic link, or no folder") from None
        finally:
            os.close(folder)
        folder = inner
    return folder
