"""What a part consists of, written with it: a part that lost a file, or a bit of one, is known by its manifest.

    manifest.json     {"trials": 12, "files": {"trials.parquet": {"bytes": 4096, "crc32": 123456789}, ...}}

Parquet's own checksums cover the pages of a file and not its footer; those here cover every byte, and are checked ten
times as fast as the file is decoded. Parts of version 0.2.0 have none: they are decoded.

An object store keeps what it was given, with checksums of its own, so there only sizes are compared, as they are
listed; the bytes of an object are fetched and compared where it was written over after its manifest.
"""

import json
import zlib
from pathlib import Path
from typing import TypedDict

from sweep.storing.locations import Location, StoreError
from sweep.storing.parquet import load_table, opened

MANIFEST = "manifest.json"
BLOCK_BYTES = 2**20


class FileAbout(TypedDict):
    """What a file was when it was written."""

    bytes: int
    crc32: int


class Manifest(TypedDict):
    """The number of trials of a part, and its files by name."""

    trials: int
    files: dict[str, FileAbout]


def seal(folder: Path) -> None:
    """Write the manifest of a part that has all its files."""
    files = {file.name: _about(file) for file in sorted(folder.iterdir())}
    with opened(folder / "trials.parquet") as file:
        manifest: Manifest = {"trials": file.metadata.num_rows, "files": files}
    (folder / MANIFEST).write_text(json.dumps(manifest), encoding="utf-8")


def damage(part: Location) -> str:
    """What is wrong with a part, in a few words; empty where every byte is as it was written.

    Raises StoreError where we may not read it, which is no damage.
    """
    try:
        manifest: Manifest = json.loads((part / MANIFEST).read_text(encoding="utf-8"))
        sealed, _, files = (part / MANIFEST).stat().st_mtime_ns, manifest["trials"], manifest["files"].items()
    except FileNotFoundError:
        return _undecodable(part)
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return f"{MANIFEST} cannot be read"
    for name, about in files:
        try:
            found = _now(part / name, about, sealed)
        except FileNotFoundError:
            return f"{name} is missing"
        except PermissionError as error:
            raise StoreError(f"{part / name}: cannot be read ({error})") from error
        except OSError as error:
            return f"{name} cannot be read ({error})"
        if found["bytes"] != about["bytes"]:
            return f"{name} has {found['bytes']:,} bytes of {about['bytes']:,}"
        if found != about:
            return f"{name} has other bytes than were written"
    return ""


def trials_of(part: Location) -> int | None:
    """How many trials a part holds, or held before it was damaged; None where that cannot be known."""
    try:
        manifest: Manifest = json.loads((part / MANIFEST).read_text(encoding="utf-8"))
        return int(manifest["trials"])
    except (OSError, ValueError, KeyError, TypeError):
        pass
    try:
        with opened(part / "trials.parquet") as file:
            return int(file.metadata.num_rows)
    except StoreError:
        return None


def _now(file: Location, about: FileAbout, sealed: int) -> FileAbout:
    """What a file is now; of an object as old as the manifest, written at `sealed`, as far as its size shows."""
    if not isinstance(file, Path):
        size, written = file.stat()
        if size != about["bytes"] or written <= sealed:
            return {"bytes": size, "crc32": about["crc32"]}
    return _about(file)


def _about(file: Location) -> FileAbout:
    size, crc = 0, 0
    with file.open("rb") as content:
        while block := content.read(BLOCK_BYTES):
            size, crc = size + len(block), zlib.crc32(block, crc)
    return {"bytes": size, "crc32": crc}


def _undecodable(part: Location) -> str:
    """The same for a part without a manifest, as far as decoding shows."""
    present, missing = {file.stem for file in part.glob("*.parquet")}, set[str]()
    for name in sorted({"trials"} | present):
        try:
            table = load_table(part, name)
        except StoreError:
            return f"{name}.parquet cannot be read"
        if name == "trials":
            missing = _recorded(table.schema.metadata or {}) - present
    return f"{min(missing)}.parquet is missing" if missing else ""


def _recorded(metadata: dict[bytes, bytes]) -> set[str]:
    """The tables beside trials that a launch of the spec in the metadata has stored."""
    from sweep.storing.rows import PROVENANCE
    from sweep.strict_yaml import parse_document

    if PROVENANCE not in metadata:
        return set()
    spec = parse_document(json.loads(metadata[PROVENANCE])["spec"], Path("stored spec")).value
    record = spec.get("record") or {}
    return {name for name in ("series", "heatmaps", "trajectories") if record.get(name)}
