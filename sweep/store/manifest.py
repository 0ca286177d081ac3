"""List of the files of a part, with their sizes and checksums.

The manifest is written with the part, and shows a lost file or a changed bit.

    {
      "trials": 12,
      "files": {"trials.parquet": {"bytes": 4096, "crc32": 123456789}, ...}
    }

The checksums of parquet cover the pages of a file but not the footer. The checksums of
a manifest cover every byte, and a check is ten times as fast as decoding the file.
Parts of version 0.2.0 have no manifest. A check of such a part decodes all tables.

An object store has checksums too. So a check of objects compares only the listed sizes.
The bytes of an object are fetched and compared only if the object was overwritten after
the manifest was written.
"""

import errno
import json
import re
import zlib
from pathlib import Path
from typing import TypedDict

import pyarrow as pa

from sweep.errors import StoreError, UnreadableError
from sweep.spec import TABLES
from sweep.store.locations import Location
from sweep.store.new_files import create
from sweep.store.origin import part_provenance
from sweep.store.parquet import load_table, opened, remedy_for
from sweep.store.regular import ForeignError, open_stored, read_json

MANIFEST = "manifest.json"
REPLACES = "replaces.json"
MERGED_MARK = "+"
MOST_MANIFEST = 2**16
"""Bytes of a manifest of a few tables."""
MOST_REPLACES = 2**24
"""Bytes of a list of up to 100,000 merged parts."""
NAME = re.compile(r"[a-z_]+\.(parquet|json)")
TABLE = re.compile(r"[a-z_]+\.parquet")
SHAPE = {"trials": int, "files": {str: {"bytes": int, "crc32": int}}}
READ_BYTES = 2**20


class FileAbout(TypedDict):
    """Size and checksum of a file at the time of writing."""

    bytes: int
    crc32: int


class Manifest(TypedDict):
    """Number of trials of a part, and its files by name."""

    trials: int
    files: dict[str, FileAbout]


def write_manifest(folder: Path) -> None:
    """Write the manifest of a part that has all its files."""
    files = {file.name: _about(file) for file in sorted(folder.iterdir())}
    with opened(folder / "trials.parquet") as file:
        manifest: Manifest = {"trials": file.metadata.num_rows, "files": files}
    with create(folder / MANIFEST) as new:
        new.write(json.dumps(manifest).encode())


def damage(part: Location) -> str:
    """Return the flaw of a part, in a few words.

    The string is empty if the part is intact. Raises StoreError if the part cannot be
    read now, which does not count as damage.
    """
    try:
        manifest = _read(part)
        written_at = (part / MANIFEST).stat().st_mtime_ns
    except FileNotFoundError:
        return _undecodable(part)
    except ValueError:
        return f"{MANIFEST} cannot be read"
    except OSError as error:
        return _what_damages(part / MANIFEST, error)
    for name, written in manifest["files"].items():
        try:
            present = _now(part / name, written, written_at)
        except FileNotFoundError:
            return f"{name} is missing"
        except OSError as error:
            return _what_damages(part / name, error)
        if present["bytes"] != written["bytes"]:
            return f"{name} has {present['bytes']:,} bytes of {written['bytes']:,}"
        if present != written:
            return f"{name} does not match its checksum"
    return _made_up(part, manifest) if isinstance(part, Path) else ""


def _what_damages(file: Location, error: OSError) -> str:
    """Return the flaw of a file, in a few words, if the error concerns the content.

    Raises StoreError for any other error.
    """
    if isinstance(error, ForeignError) or error.errno == errno.EIO:
        return f"{file.name} cannot be read ({error})"
    way_out = "nothing was set aside: fix the cause, or move the part away"
    raise StoreError(f"{file}: cannot be read ({error}); {way_out}") from error


def trials_of(part: Location) -> int | None:
    """Return the number of trials that a part holds, or held before damage.

    Returns None if the number is unknown.
    """
    try:
        return _read(part)["trials"]
    except (OSError, ValueError):
        pass
    try:
        with opened(part / "trials.parquet") as file:
            return int(file.metadata.num_rows)
    except StoreError:
        return None


def table_names(part: Location) -> list[str]:
    """Return the names of the tables of a part, from the manifest.

    Further files in the folder are not tables. Raises StoreError if the manifest cannot
    be read.
    """
    try:
        files = [*_read(part)["files"]]
    except FileNotFoundError:  # a part of version 0.2.0, or a part under deletion
        files = _listed(part)
    except (OSError, ValueError) as error:
        raise UnreadableError(
            part / MANIFEST, f"cannot be read ({error})", remedy_for(part)
        ) from error
    return sorted(
        name.removesuffix(".parquet") for name in files if TABLE.fullmatch(name)
    )


def _listed(part: Location) -> list[str]:
    try:
        return [file.name for file in part.iterdir()]
    except FileNotFoundError:
        return []


def replaced_by(part: Location) -> list[str]:
    """Return the names of the parts that a merged part replaces.

    Raises FileNotFoundError if there is no list, and StoreError if the list cannot be
    read.
    """
    try:
        names: list[str] = read_json(part / REPLACES, MOST_REPLACES, [str])
    except FileNotFoundError:
        raise
    except (OSError, ValueError) as error:
        raise UnreadableError(
            part / REPLACES, f"cannot be read ({error})", remedy_for(part)
        ) from error
    return names


def _read(part: Location) -> Manifest:
    """Return the manifest of a part.

    Raises OSError, and ValueError if the file is not a manifest.
    """
    manifest: Manifest = read_json(part / MANIFEST, MOST_MANIFEST, SHAPE)
    if odd := [name for name in manifest["files"] if not NAME.fullmatch(name)]:
        raise ValueError(f"{odd[0]} is not the name of a file in a part")
    return manifest


def _now(file: Location, written: FileAbout, written_at: int) -> FileAbout:
    """Return the present size and checksum of a file.

    The bytes are read only if the size is correct. An object that is not newer than the
    manifest, which was written at `written_at` (ns), counts as unchanged.
    """
    status = file.stat()
    unchanged = not isinstance(file, Path) and status.st_mtime_ns <= written_at
    if status.st_size != written["bytes"] or unchanged:
        return {"bytes": status.st_size, "crc32": written["crc32"]}
    return _about(file)


def _about(file: Location) -> FileAbout:
    size = 0
    crc = 0
    with open_stored(file) as stream:
        while content := stream.read(READ_BYTES):
            size += len(content)
            crc = zlib.crc32(content, crc)
    return {"bytes": size, "crc32": crc}


def _made_up(part: Path, manifest: Manifest) -> str:
    """Return the flaw of a part with correct checksums, which is then forged."""
    try:
        with opened(part / "trials.parquet") as file:
            rows = file.metadata.num_rows
            schema = file.schema_arrow
        part_provenance(schema, part / "trials.parquet")
        if MERGED_MARK in part.name:
            replaced_by(part)
    except UnreadableError as error:
        return f"{error.file.name}: {error.wrong}"
    except FileNotFoundError as error:
        return f"{Path(error.filename).name} is missing"
    if rows != manifest["trials"]:
        return f"trials.parquet has {rows:,} rows of {manifest['trials']:,}"
    kinds = dict(zip(schema.names, schema.types, strict=True))
    for name in ("trial_id", "status"):
        if kinds.get(name) != pa.string():
            return f"trials.parquet has no column {name} of strings"
    return ""


def _undecodable(part: Location) -> str:
    """Return the flaw that decoding finds in a part without a manifest."""
    present = {*table_names(part)}
    missing = set[str]()
    for name in sorted({"trials"} | present):
        try:
            table = load_table(part, name)
            if name == "trials":
                missing = _recorded(table.schema, part / "trials.parquet") - present
        except UnreadableError:
            return f"{name}.parquet cannot be read"
    return f"{min(missing)}.parquet is missing" if missing else ""


def _recorded(schema: pa.Schema, trials: Location) -> set[str]:
    """Return the tables, except trials, that the spec in `schema` records."""
    from sweep.errors import SpecError
    from sweep.spec import parse_document

    try:
        text = part_provenance(schema, trials)["spec"]
        spec = parse_document(text, Path("stored spec")).value
    except SpecError as error:
        raise UnreadableError(trials, str(error), remedy_for(trials.parent)) from error
    record = spec.get("record") if isinstance(spec, dict) else None
    return {name for name in TABLES if isinstance(record, dict) and record.get(name)}
