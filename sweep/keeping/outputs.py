"""Files for the user: refused before any work where they cannot be, and whole or absent afterwards."""

import hashlib
import secrets
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from sweep.names import unknown
from sweep.storing.locations import in_unicode
from sweep.storing.parquet import StoreError, move_durably


def check_output(path: Path, endings: Iterable[str], *, force: bool = False) -> None:
    """Raise StoreError unless `path` ends as one of `endings`, lies in a folder, and is free or may be replaced."""
    in_unicode(path)
    if path.suffix not in endings:
        raise StoreError(f"{path}: {unknown('kind of file', path.suffix, endings)}")
    if not path.parent.is_dir():
        raise StoreError(f"{path}: there is no folder {path.parent}")
    if path.is_dir():
        raise StoreError(f"{path}: is a folder")
    if path.exists() and not force:
        raise StoreError(f"{path}: exists already; --force replaces it")


@contextmanager
def unfinished(path: Path) -> Iterator[Path]:
    """A place beside `path` to write to, which becomes `path` in one step at the end, or is gone after an error.

    Raises StoreError where it cannot be written.
    """
    beside = path.with_name(f".{path.stem}-{secrets.token_hex(4)}{path.suffix}")
    try:
        yield beside
        move_durably(beside, path)
    except OSError as error:
        raise StoreError(f"{path}: cannot be written ({error.strerror or error})") from error
    finally:
        beside.unlink(missing_ok=True)


def sha256(path: Path) -> str:
    """The sha256 of a file in hexadecimal."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def write_checksum(path: Path) -> str:
    """Write the sha256 of a file to `<path>.sha256`, as `sha256sum -c` reads it, and return it."""
    digest = sha256(path)
    with unfinished(path.with_name(path.name + ".sha256")) as beside:
        beside.write_text(f"{digest}  {path.name}\n", encoding="utf-8")
    return digest
