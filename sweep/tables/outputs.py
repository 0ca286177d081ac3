"""Files for the user: checked before any work, and complete or absent afterwards."""

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
from sweep.store import in_unicode, replacing
from sweep.text import unknown


def check_output(path: Path, endings: Iterable[str], *, force: bool = False) -> None:
    """Raise OutputError unless a file can be written.

    Parameters
    ----------
    path : Path
        The file, in a folder that exists.
    endings : iterable of str
        Allowed endings, such as ".csv".
    force : bool, default False
        Allow a file that exists, which will be replaced.
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
    """Open a file that becomes `path` in one step at the end, see `replacing`.

    Raises OutputError if the file cannot be written.
    """
    try:
        with replacing(path, below) as file:
            yield file
    except OSError as error:
        raise OutputError(
            f"{path}: cannot be written ({error.strerror or error})"
        ) from error


def by_path(write: Callable[[Path], object], file: BinaryIO) -> None:
    """Call `write`, which can write to a path only, with a path that leads to `file`.

    On Linux the path is an entry of /proc for the open file. The path is also valid in
    processes that `write` starts. So no content is copied, and no name in the folder of
    the file is followed. On further systems no path to an open file can be opened more
    than once. There `write` fills a file in a new private folder, and the content is
    copied.
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
    """Return the sha256 of a file in hexadecimal."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def write_checksum(path: Path) -> str:
    """Write `<path>.sha256`, for `sha256sum -c`, and return the sha256 of a file."""
    digest = sha256(path)
    with unfinished(path.with_name(path.name + ".sha256")) as file:
        file.write(f"{digest}  {path.name}\n".encode())
    return digest
