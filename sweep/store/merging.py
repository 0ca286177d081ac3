"""Merging of small parts into larger parts, and superseded rows.

At the end of a launch, all small parts are considered. During a launch, the parts of
this launch are gathered by generation, the number of times that a part has been merged.
MOST_GATHERED parts of a generation, or 100,000 trials, become one part of the next
generation. So each trial is written again only once per generation. A launch of a
million trials has a few hundred parts at any time.
"""

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from sweep.store.locations import Location
from sweep.store.manifest import table_names
from sweep.store.parquet import each, load_table, opened, stored_schema

MERGED_ROWS = 100_000
MOST_GATHERED = 64
MAX_MERGED_BYTES = 512 * 1024**2


class Gathered(NamedTuple):
    """A part that this launch has stored, with its numbers of trials and bytes."""

    part: Location
    rows: int
    size: int


@dataclass
class Gathering:
    """Small parts of one launch by generation, oldest first."""

    generations: defaultdict[int, list[Gathered]] = field(
        default_factory=lambda: defaultdict(list)
    )

    def add(self, part: Gathered, generation: int = 0) -> None:
        """Note a new part, unless the part is large enough to stay.

        Parameters
        ----------
        part : Gathered
        generation : int, default 0
            Number of times that the part has been merged.
        """
        if part.rows < MERGED_ROWS and part.size < MAX_MERGED_BYTES // 2:
            self.generations[generation].append(part)

    def due(self) -> tuple[int, list[Gathered]] | None:
        """Return a generation that is due for a merge, and the parts to merge.

        Returns None if no generation is due.
        """
        for generation, held in self.generations.items():
            full = (
                sum(part.rows for part in held) >= MERGED_ROWS
                or sum(part.size for part in held) >= MAX_MERGED_BYTES
            )
            if len(held) >= MOST_GATHERED or (full and len(held) > 1):
                return generation, held
        return None

    def replace(self, generation: int, merged: Gathered) -> None:
        """Note that a generation has been merged into one part of the next generation.

        Parameters
        ----------
        generation : int
            Generation that was merged.
        merged : Gathered
            The merged part.
        """
        del self.generations[generation]
        self.add(merged, generation + 1)

    def parts(self) -> list[Location]:
        """Return all gathered parts, oldest first."""
        return sorted(
            (stored.part for held in self.generations.values() for stored in held),
            key=lambda part: part.name,
        )


def _ids(part: Location) -> pa.ChunkedArray:
    return load_table(part, "trials", ["trial_id"])["trial_id"]


def _are_distinct(parts: Sequence[Location]) -> bool:
    """Return whether certainly no trial is in two parts, which is the usual case.

    The check takes 8 bytes per trial, while a join takes 200 bytes.
    """

    def hashes(part: Location) -> NDArray[np.int64]:
        ids = _ids(part)
        return np.fromiter(
            (hash(trial) for chunk in ids.chunks for trial in chunk.to_pylist()),
            np.int64,
            len(ids),
        )

    ordered = np.concatenate([np.empty(0, np.int64), *each(parts, hashes)])
    ordered.sort()
    return not (ordered[1:] == ordered[:-1]).any()


def superseded_rows(parts: Sequence[Location]) -> dict[Location, pa.Array]:
    """Return for each part the ids of its trials that a later part also has.

    Parts without such trials are left out.
    """
    if _are_distinct(parts):
        return {}
    ids = each(parts, _ids)
    chunks = pa.chunked_array(
        [chunk for column in ids for chunk in column.chunks], pa.string()
    )
    position = np.repeat(np.arange(len(parts)), [len(column) for column in ids])
    rows = pa.table({"trial_id": chunks, "part": position})
    latest = rows.group_by("trial_id").aggregate([("part", "max")])
    stale = rows.join(latest, "trial_id").filter(
        pc.field("part") < pc.field("part_max")
    )
    return {
        parts[index]: stale.filter(pc.field("part") == index)[
            "trial_id"
        ].combine_chunks()
        for index in pc.unique(stale["part"]).to_pylist()
    }


def without(table: pa.Table, trial_ids: pa.Array | None) -> pa.Table:
    """Return the rows of `table` without some trials; None excludes no trial."""
    if trial_ids is None:
        return table
    return table.filter(pc.invert(pc.is_in(table["trial_id"], value_set=trial_ids)))


def mergeable(parts: Sequence[Location], rows: int) -> Iterator[list[Location]]:
    """Yield groups of two or more small parts with equal tables and schemas.

    Small parts have fewer than `rows` trials. The parts of a group are oldest first.
    """
    groups = dict[bytes, tuple[list[Location], int, int]]()
    for part, (kind, size, size_bytes) in zip(parts, each(parts, _kind), strict=True):
        if size >= rows:
            continue
        group, held, held_bytes = groups.pop(kind, ([], 0, 0))
        group = [*group, part]
        held += size
        held_bytes += size_bytes
        if held < rows and held_bytes < MAX_MERGED_BYTES:
            groups[kind] = group, held, held_bytes
        elif len(group) > 1:
            yield group
    yield from (group for group, _, _ in groups.values() if len(group) > 1)


def _kind(part: Location) -> tuple[bytes, int, int]:
    """Return a key that mergeable parts share, the number of trials, and the bytes."""
    files = [part / f"{name}.parquet" for name in table_names(part)]
    with opened(part / "trials.parquet") as file:
        rows = file.metadata.num_rows
    kind = b"".join(
        file.stem.encode() + stored_schema(file).serialize().to_pybytes()
        for file in files
    )
    return kind, rows, sum(file.stat().st_size for file in files)
