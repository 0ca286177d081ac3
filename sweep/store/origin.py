"""What stored tables say of their origin. It is checked, as anyone may have written it.

Each table has it in its metadata, as JSON. An entry that is missing, or of another kind
than we write, raises a StoreError that names the file. Further entries are left alone.
Some of plans came with later versions: those of LATER together, those of ALONE one by
one.
"""

from collections.abc import Mapping
from typing import Any

import pyarrow as pa

from kernels.identity import Code
from sweep.errors import UnreadableError
from sweep.store.locations import Location
from sweep.store.parquet import remedy_for
from sweep.store.regular import fits, parsed

PROVENANCE = b"boidsweep"
"""The key of the provenance, as JSON, in the schema metadata of every file."""

NUMBER = int | float
PART = {
    "spec": str,
    "kernels_sha": str,
    "git": {},
    "versions": {"python": str, "numpy": str, "numba": str, "llvmlite": str},
    "platform": str,
    "cpu": str,
}
PLAN = PART | {"varied": [str], "record": [str]}
LATER = {
    "model": str,
    "preset": str,
    "maps": {},
    "ablated": {str: [[str]]},
}
STAMPS = {kind: {str: str} for kind in Code._fields[1:]}
NUMBERS = ("half_width", "confidence", "nominal_confidence")
ALONE = {
    "axes": {str: {"fields": [str], "sampler": str | None}},
    "code": {"flight": str} | STAMPS,
    "own": {"sha": str, "seal": str},
    "packages": {kind: {} for kind in Code._fields[1:]},
    "until": {"metric": str, "min": int, "max": int} | dict.fromkeys(NUMBERS, NUMBER),
}
LAUNCH_AGAIN = "delete it and launch the study again"


def part_provenance(schema: pa.Schema, file: Location) -> dict[str, Any]:
    """Where the trials in a file of a part come from. Raises StoreError."""
    return metadata(schema, PROVENANCE, PART, file, remedy_for(file.parent))


def plan_provenance(plan: pa.Table, file: Location) -> dict[str, Any]:
    """Where a plan comes from; it has the columns that it names. Raises StoreError."""
    about = metadata(plan.schema, PROVENANCE, PLAN, file, LAUNCH_AGAIN)
    later = LATER if LATER.keys() & about.keys() else {}
    alone = {name: shape for name, shape in ALONE.items() if name in about}
    if not fits(about, later | alone):
        raise _unknown(file, LAUNCH_AGAIN)
    settings = [
        name for axis in about.get("axes", {}).values() for name in axis["fields"]
    ]
    for name in ("trial_id", "point", *about["varied"], *settings):
        if name not in plan.column_names:
            raise UnreadableError(file, f"has no column {name}", LAUNCH_AGAIN)
    return about


def same_code(one: Mapping[str, Any], other: Mapping[str, Any]) -> bool:
    """Whether trials of two origins are computed by the same code, as far as they have
    models, metrics and maps in common.

    Before 0.7 only one hash of all kernels was recorded.
    """
    if "code" in one and "code" in other:
        return not Code(**one["code"]).changes(Code(**other["code"]))
    return bool(one["kernels_sha"] == other["kernels_sha"])


def metadata(
    schema: pa.Schema, key: bytes, shape: dict[str, Any], file: Location, remedy: str
) -> dict[str, Any]:
    """What a table's metadata say under a key.

        schema  the schema of the table
        key     the key
        shape   the shape that the value must have, see `fits`
        file    the file of the table, for the error
        remedy  the way out, for the error

    Raises UnreadableError if there is no such value of this shape.
    """
    try:
        about: dict[str, Any] = parsed((schema.metadata or {}).get(key, b""), shape)
    except ValueError as error:
        raise _unknown(file, remedy) from error
    return about


def _unknown(file: Location, remedy: str) -> UnreadableError:
    wrong = "does not say, or not rightly, where it comes from"
    return UnreadableError(file, wrong, remedy)
