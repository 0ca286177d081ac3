"""Creation of every file: under an unpredictable name, followed by a rename.

A file is flushed to the disk before the rename. So a file exists as a whole or not at
all. If an untrusted folder has a link under the name of the file, the rename replaces
the link, and the target of the link is not written.

All steps use the descriptor of the folder that was opened first. So a folder that is
replaced by a link meanwhile does no harm. Windows cannot open folders. On Windows all
steps use paths, and such a replacement is not noticed.
"""

import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO, Protocol

from sweep.store.durable import flush, flush_names


def create(path: Path, folder: int | None = None) -> BinaryIO:
    """Create and open a new file, relative to the descriptor `folder`.

    Raises OSError, also for a link.
    """
    new = os.open(
        path,
        os.O_RDWR | os.O_CREAT | os.O_EXCL | getattr(os, "O_NOFOLLOW", 0),
        0o666,
        dir_fd=folder,
    )
    return os.fdopen(new, "w+b")


@contextmanager
def replacing(path: Path, below: Path | None = None) -> Iterator[BinaryIO]:
    """Open a new file that becomes `path` in one step at the end.

    After an error the new file is deleted. `below` is the folder that the user has
    named, by default the folder of `path`; `below` may be a link. Missing folders
    between `below` and `path` are made, and may not be links. Raises OSError.
    """
    # The name of `path` may be as long as names can be.
    name = f"{path.name[:40]}-{secrets.token_hex(8)}.unfinished"
    folder = _open_folder(path.parent, below or path.parent)
    try:
        new = folder.create(name)
        try:
            with new as file:
                yield file
                file.flush()
                flush(file.fileno())
            folder.rename(name, path.name)  # Windows renames no open file
        except BaseException:
            with suppress(OSError):
                folder.delete(name)
            raise
        folder.flush()
    finally:
        folder.close()


class _Folder(Protocol):
    """A folder in which a file is created.

    All methods but `close` may raise OSError.
    """

    def create(self, name: str) -> BinaryIO: ...

    def rename(self, name: str, new: str) -> None: ...

    def delete(self, name: str) -> None: ...

    def enter(self, name: str) -> "_Folder":
        """Return a sub-folder, which is made if missing, and may not be a link."""

    def flush(self) -> None:
        """Flush the names in the folder, if the system can."""

    def close(self) -> None: ...


class _Opened:
    """A folder by its descriptor, which later changes of the path do not affect."""

    def __init__(
        self, path: str | Path, flags: int = 0, above: int | None = None
    ) -> None:
        flags |= os.O_RDONLY | os.O_DIRECTORY
        self._descriptor = os.open(path, flags, dir_fd=above)

    def create(self, name: str) -> BinaryIO:
        return create(Path(name), self._descriptor)

    def rename(self, name: str, new: str) -> None:
        here = self._descriptor
        os.replace(name, new, src_dir_fd=here, dst_dir_fd=here)

    def delete(self, name: str) -> None:
        os.unlink(name, dir_fd=self._descriptor)

    def enter(self, name: str) -> "_Opened":
        with suppress(FileExistsError):
            os.mkdir(name, dir_fd=self._descriptor)
            self.flush()
        return _Opened(name, os.O_NOFOLLOW, self._descriptor)

    def flush(self) -> None:
        flush_names(self._descriptor)

    def close(self) -> None:
        os.close(self._descriptor)


class _Named:
    """A folder by its path, for systems that cannot open folders."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def create(self, name: str) -> BinaryIO:
        return create(self._path / name)

    def rename(self, name: str, new: str) -> None:
        (self._path / name).replace(self._path / new)

    def delete(self, name: str) -> None:
        (self._path / name).unlink()

    def enter(self, name: str) -> "_Named":
        inner = self._path / name
        with suppress(FileExistsError):
            inner.mkdir()
        if inner.is_symlink() or not inner.is_dir():
            raise NotADirectoryError
        return _Named(inner)

    def flush(self) -> None:
        """Do nothing: see `durable.py`."""

    def close(self) -> None:
        """Do nothing: no folder is open."""


def _open_folder(path: Path, below: Path) -> _Folder:
    """Return the folder `path`, reached from `below` without links."""
    here = below
    folder: _Folder = _Opened(below) if hasattr(os, "O_DIRECTORY") else _Named(below)
    for name in path.relative_to(below).parts:
        here = here / name
        try:
            inner = folder.enter(name)
        except NotADirectoryError:
            raise OSError(f"{here} is a symbolic link, or not a folder") from None
        finally:
            folder.close()
        folder = inner
    return folder
