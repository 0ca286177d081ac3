"""Files for the user: refused before any work where they cannot be, and whole or absent
afterwards.
"""

import hashlib
import os
import shutil
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import BinaryIO

from sweep.errors import OutputError
from sweep.store.locations import in_unicode
from sweep.store.new_files import replacing
from sweep.text import unknown


def check_output(path: Path, endings: Iterable[str], *, force: bool = False) -> None:
    """Raise OutputError unless `path` ends in one of `endings`, lies in a folder, and
    is free or may be replaced.
    """
    in_unicode(path)
    if path.suffix not in endings:
        raise OutputError(f"{path}: {unknown('kind of file', path.suffix, endings)}")
    if not path.parent.is_dir():
        raise OutputError(f"{path}: there is no folder {path.parent}")
    if path.is_dir():
        raise OutputError(f"{path}: is a folder")
    if path.exists() and not force:
        raise OutputError(f"{path}: exists already; --force replaces it")


@contextmanager
def unfinished(path: Path, below: Path | None = None) -> Iterator[BinaryIO]:
    """A file to write to, which becomes `path` in one step at the end: see `replacing`.

    Raises OutputError where it cannot be written.
    """
    try:
        with replacing(path, below) as file:
            yield file
    except OSError as error:
        raise OutputError(
            f"{path}: cannot be written ({error.strerror or error})"
        ) from error


def by_path(write: Callable[[Path], object], file: BinaryIO) -> None:
    """Put what `write` writes to a path into `file`, for programs that know paths only.

    On Linux the path is an entry of /proc that leads to the open file itself, for the
    programs that `write` starts too. So nothing is copied, and no name in the folder of
    the file is followed. Other systems have no such path that can be opened more than
    once: there `write` fills a file in a new folder that nobody else may enter, and its
    content is copied.
    """
    if sys.platform == "linux":
        write(Path(f"/proc/{os.getpid()}/fd/{file.fileno()}"))
        return
    with TemporaryDirectory(prefix="boidsweep-") as folder:
        path = Path(folder) / "written"
        write(path)
        with path.open("rb") as content:
            shutil.copyfileobj(content, file)


def sha256(path: Path) -> str:
    """The sha256 of a file in hexadecimal."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def write_checksum(path: Path) -> str:
    """Write a file's sha256 to `<path>.sha256`, for `sha256sum -c`, and return it."""
    digest = sha256(path)
    with unfinished(path.with_name(path.name + ".sha256")) as file:
        file.write(f"{digest}  {path.name}\n".encode())
    return digest
