"""Origin of stored tables, read from their metadata and checked.

The origin is JSON from a possibly untrusted file, so every entry is checked. A missing
entry, or an entry of a wrong type, raises a StoreError that names the file. Unknown
entries are ignored. Later versions added entries: the entries of LATER appear together,
and the entries of COMPUTED and ALONE independently. Only trials that ran on a device
such as a GPU have a `device`.
"""

from collections.abc import Mapping
from typing import Any

import pyarrow as pa

from kernels.identity import Code
from sweep.errors import UnreadableError
from sweep.spec import sections
from sweep.store.locations import Location
from sweep.store.parquet import remedy_for
from sweep.store.regular import fits, parsed

PROVENANCE = b"boidsweep"
"""Key of the provenance, as JSON, in the schema metadata of every file."""

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
    "device": {"name": str},
}
"""Entries on the computation: code hashes, custom code, packages and the device."""
ALONE = COMPUTED | {
    "axes": {str: {"fields": [str], "sampler": str | None}},
    "designs": [[str]],
    "details": [str],
    "continued": {"axis": str, "directions": [str]},
    "series": [str],
    "study_git": {"commit": str, "path": str, "modified": bool},
    "tables": [str],
}
PACKAGES = {"driver": "CUDA", "numba_cuda": "numba-cuda", "nvvm": "NVVM"}
"""Names of packages by their keys in the description of a device, where they differ."""
LAUNCH_AGAIN = "delete it and launch the study again"


def part_provenance(schema: pa.Schema, file: Location) -> dict[str, Any]:
    """Return the origin of the trials in a file of a part.

    Raises StoreError.
    """
    remedy = remedy_for(file.parent)
    origin = metadata(schema, PROVENANCE, PART, file=file, remedy=remedy)
    if not fits(origin, _among(COMPUTED, origin)):
        raise _unknown(file, remedy)
    return origin


def plan_provenance(plan: pa.Table, file: Location) -> dict[str, Any]:
    """Return the origin of a plan, after a check of the columns that the origin names.

    Raises StoreError.
    """
    origin = metadata(plan.schema, PROVENANCE, PLAN, file=file, remedy=LAUNCH_AGAIN)
    later = LATER if LATER.keys() & origin.keys() else {}
    of_sections = {
        name: section.shape for name, section in sections().items() if section.recorded
    }
    if not fits(origin, later | _among(ALONE | of_sections, origin)):
        raise _unknown(file, LAUNCH_AGAIN)
    settings = [
        name for axis in origin.get("axes", {}).values() for name in axis["fields"]
    ]
    for name in ("trial_id", "point", *origin["varied"], *settings):
        if name not in plan.column_names:
            raise UnreadableError(file, f"has no column {name}", LAUNCH_AGAIN)
    return origin


def _among(shapes: dict[str, Any], origin: Mapping[str, Any]) -> dict[str, Any]:
    """Return the shapes of the entries that an origin has."""
    return {name: shape for name, shape in shapes.items() if name in origin}


def stamps(origin: Mapping[str, Any]) -> Code | None:
    """Return the code hashes of the trials of an origin; None for one before 0.7."""
    stored = origin.get("code")
    return Code(*(stored[name] for name in Code._fields)) if stored else None


def machine_said(origin: Mapping[str, Any]) -> str:
    """Return the machine and the versions on which results depend, in one line.

    The line begins with the device, if a device ran the trials.
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
    """Return the device that ran trials, and the versions of its compilers.

    The string is "" for a processor.
    """
    if "device" not in origin:
        return ""
    versions = dict(origin["device"])
    name = versions.pop("name")
    packages = [f"{PACKAGES.get(key, key)} {versions[key]}" for key in versions]
    return f"{name} ({', '.join(packages)})" if packages else name


def same_code(earlier: Mapping[str, Any], later: Mapping[str, Any]) -> bool:
    """Return whether equal code computed the trials of two origins.

    Only common models, metrics and maps count. Versions before 0.7 recorded a single
    hash of all kernels.
    """
    then = stamps(earlier)
    now = stamps(later)
    if then and now:
        return not then.changes(now)
    return bool(earlier["kernels_sha"] == later["kernels_sha"])


def metadata(
    schema: pa.Schema, key: bytes, shape: dict[str, Any], file: Location, remedy: str
) -> dict[str, Any]:
    """Return the value of a key in the metadata of a table.

    Parameters
    ----------
    schema : Schema
        Schema of the table.
    key : bytes
    shape : dict
        Shape that the value must have, see `fits`.
    file : Location
        File of the table, for the error.
    remedy : str
        How to fix the file, for the error.

    Raises
    ------
    UnreadableError
        If there is no value of this shape.
    """
    try:
        value: dict[str, Any] = parsed((schema.metadata or {}).get(key, b""), shape)
    except ValueError as error:
        raise _unknown(file, remedy) from error
    return value


def _unknown(file: Location, remedy: str) -> UnreadableError:
    wrong = "has no valid provenance in its metadata"
    return UnreadableError(file, wrong, remedy)
