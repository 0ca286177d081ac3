"""What stored tables say of their origin. It is checked, as anyone may have written it.

Each table has it in its metadata, as JSON. An entry that is missing, or of another kind
than we write, raises a StoreError that names the file. Further entries are left alone.
Some came with later versions: those of LATER together, those of COMPUTED and of ALONE
one by one. Only trials that no processor has flown have a `device`.
"""

from collections.abc import Mapping
from typing import Any

import pyarrow as pa

from kernels.identity import Code
from sweep.errors import UnreadableError
from sweep.spec.study import sections
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
COMPUTED = {
    "code": {"flight": str} | STAMPS,
    "own": {"sha": str, "seal": str},
    "packages": {kind: {} for kind in Code._fields[1:]},
    "device": {"name": str, "driver": str, "numba_cuda": str, "nvvm": str},
}
"""By which code: its stamps, which of the user's own, and entries of packages; and on
which device.
"""
ALONE = COMPUTED | {
    "axes": {str: {"fields": [str], "sampler": str | None}},
    "designs": [[str]],
    "details": [str],
    "continued": {"axis": str, "directions": [str]},
    "series": [str],
    "study_git": {"commit": str, "path": str, "modified": bool},
    "tables": [str],
}
LAUNCH_AGAIN = "delete it and launch the study again"


def part_provenance(schema: pa.Schema, file: Location) -> dict[str, Any]:
    """Where the trials in a file of a part come from. Raises StoreError."""
    remedy = remedy_for(file.parent)
    about = metadata(schema, PROVENANCE, PART, file, remedy)
    if not fits(about, _among(COMPUTED, about)):
        raise _unknown(file, remedy)
    return about


def plan_provenance(plan: pa.Table, file: Location) -> dict[str, Any]:
    """Where a plan comes from; it has the columns that it names. Raises StoreError."""
    about = metadata(plan.schema, PROVENANCE, PLAN, file, LAUNCH_AGAIN)
    later = LATER if LATER.keys() & about.keys() else {}
    of_sections = {name: section.shape for name, section in sections().items()}
    if not fits(about, later | _among(ALONE | of_sections, about)):
        raise _unknown(file, LAUNCH_AGAIN)
    settings = [
        name for axis in about.get("axes", {}).values() for name in axis["fields"]
    ]
    for name in ("trial_id", "point", *about["varied"], *settings):
        if name not in plan.column_names:
            raise UnreadableError(file, f"has no column {name}", LAUNCH_AGAIN)
    return about


def _among(shapes: dict[str, Any], about: Mapping[str, Any]) -> dict[str, Any]:
    """The shapes of what an origin has."""
    return {name: shape for name, shape in shapes.items() if name in about}


def stamps(origin: Mapping[str, Any]) -> Code | None:
    """The stamps of what computes the trials of an origin; None for one before 0.7."""
    stored = origin.get("code")
    return Code(*(stored[name] for name in Code._fields)) if stored else None


def machine_said(origin: Mapping[str, Any]) -> str:
    """The machine and the versions on which bits depend, in one line: first the device
    that has flown, where one has.
    """
    versions = origin["versions"]
    named = ", ".join(
        f"{name} {versions[name]}" for name in ("python", "numpy", "numba", "llvmlite")
    )
    device = f"{device_said(origin)}, " if "device" in origin else ""
    return (
        f"{device}{origin['cpu'] or 'an unknown processor'},"
        f" {origin['platform']}, {named}"
    )


def device_said(origin: Mapping[str, Any]) -> str:
    """The device that has flown, and what compiled for it; "" for a processor."""
    if "device" not in origin:
        return ""
    device = origin["device"]
    return (
        f"{device['name']} (CUDA {device['driver']}, numba-cuda {device['numba_cuda']},"
        f" NVVM {device['nvvm']})"
    )


def same_code(one: Mapping[str, Any], other: Mapping[str, Any]) -> bool:
    """Whether trials of two origins are computed by the same code, as far as they have
    models, metrics and maps in common.

    Before 0.7 only one hash of all kernels was recorded.
    """
    then, now = stamps(one), stamps(other)
    if then and now:
        return not then.changes(now)
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
