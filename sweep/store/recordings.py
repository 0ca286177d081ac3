"""What the stored trials of a study record, and which of them serve for trials that
record less.
"""

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from sweep.design.jobs import Counts, Job, blocks_of, ids_recording
from sweep.design.recording import Recording
from sweep.spec.recorded import Column
from sweep.spec.study import Study
from sweep.store.locations import Location
from sweep.store.manifest import table_names
from sweep.store.origin import part_provenance, stamps
from sweep.store.parquet import each, opened, stored_schema
from sweep.store.rows import EXPRESSION
from sweep.store.store import Store

LOOKED_UP = 100_000
"""How many known ids are searched at once: a hash table of a million would be large."""
NO_IDS = pa.chunked_array([], pa.string())


def stored_recordings(store: Store) -> list[Recording]:
    """What the parts of a store record, each once. Those of before 0.7 are left out:
    their ids covered other things. Raises StoreError for a damaged part.
    """

    def read(parts: list[Location]) -> list[Recording]:
        found = [one for one in each(parts, _recording) if one]
        by_text = {json.dumps(one, sort_keys=True): one for one in found}
        return [by_text[text] for text in sorted(by_text)]

    return store.steadily(read)


def others_stored(store: Store, study: Study) -> list[Recording]:
    """What trials of a store record, where it is not what those of `study` record."""
    asked = Recording.of(study)
    return [one for one in stored_recordings(store) if one != asked]


def measured(columns: Iterable[str], derived: Iterable[str]) -> list[str]:
    """The metrics that kernels measured, by the names of the columns of trials."""
    names, left = list(columns), set(derived)
    return [
        name
        for name in names
        if str(Column(name, half=True)) in names and name not in left
    ]


def expressions(trials: pa.Schema) -> dict[str, str]:
    """What derives metrics of stored trials, by their names."""
    return {
        field.name: field.metadata[EXPRESSION].decode(errors="replace")
        for field in trials
        if EXPRESSION in (field.metadata or {})
    }


def _recording(part: Location) -> Recording | None:
    file = part / "trials.parquet"
    with opened(file) as opened_file:
        schema = opened_file.schema_arrow
        first = opened_file.read(columns=["every"]).slice(0, 1).to_pylist()
    code, names = stamps(part_provenance(schema, file)), table_names(part)
    if code is None or not first or "every" not in first[0]:
        return None
    series = stored_schema(part / "series.parquet").names if "series" in names else []
    derived = expressions(schema)
    content: dict[str, Any] = {
        "metrics": sorted(measured(schema.names, derived)),
        "series": sorted({*series} - {"trial_id", "frame"}),
        **first[0],
        "heatmaps": "heatmaps" in names,
        "trajectories": "trajectories" in names,
    }
    return Recording(code.metrics, content | ({"derive": derived} if derived else {}))


@dataclass(frozen=True, eq=False)
class Served:
    """Trials that are not stored, `asked`, and the stored ones in their place, which
    are the same flights and record more; both (n,).
    """

    asked: pa.ChunkedArray
    stored: pa.ChunkedArray

    def __len__(self) -> int:
        return len(self.asked)

    def into(self, ids: pa.ChunkedArray) -> pa.ChunkedArray:
        """The ids with those of stored trials in the place of those that they serve."""
        if not len(self):
            return ids
        parts = [
            self._into(ids.slice(first, LOOKED_UP))
            for first in range(0, len(ids), LOOKED_UP)
        ]
        return pa.chunked_array(parts, pa.string())

    def _into(self, ids: pa.ChunkedArray) -> pa.Array:
        places = places_of(ids, self.asked)
        stored = self.stored.take(pa.array(places, mask=places < 0))
        return pc.coalesce(stored, ids).combine_chunks()

    def into_table(self, table: pa.Table) -> pa.Table:
        """The same of the column `trial_id`."""
        place = table.schema.get_field_index("trial_id")
        field = table.schema.field(place)
        return table.set_column(place, field, self.into(table["trial_id"]))

    def also(self, others: "Served") -> "Served":
        """These and others."""
        pairs = ((self.asked, others.asked), (self.stored, others.stored))
        return Served(
            *(pa.chunked_array([*a.chunks, *b.chunks], pa.string()) for a, b in pairs)
        )


NONE_SERVED = Served(NO_IDS, NO_IDS)


def served(
    study: Study,
    jobs: Sequence[Job],
    recordings: Iterable[Recording],
    known: pa.ChunkedArray,
    done: NDArray[np.bool_],
) -> Served:
    """Which of some jobs of `study` are served by trials that are stored.

    study       the study
    jobs        trials of it that are not stored
    recordings  what stored trials record that are of another spec
    known       (n,) the ids of the stored trials
    done        (n,) which of them are done
    """
    asked, found = Recording.of(study), NONE_SERVED
    covering = [one for one in recordings if one.covers(asked)]
    for some in blocks_of(jobs, LOOKED_UP) if covering else ():
        own, block = ids_recording(study, some, asked), NONE_SERVED
        for recording in covering:
            other = ids_recording(study, some, recording)
            places = places_of(other, known)
            there = (places >= 0) & (places_of(own, block.asked) < 0)
            there[there] = done[places[there]]
            mask = pa.array(there)
            block = block.also(Served(own.filter(mask), other.filter(mask)))
        found = found.also(block)
    return found


def places_of(ids: pa.ChunkedArray, known: pa.ChunkedArray) -> Counts:
    """The place of each id among the `known` ones, -1 where it is none of them."""
    places = np.full(len(ids), -1, np.int64)
    for first in range(0, len(known), LOOKED_UP):
        some = known.slice(first, LOOKED_UP).combine_chunks()
        found = pc.index_in(ids, value_set=some)
        here = pc.is_valid(found).to_numpy()
        places[here] = first + found.filter(pa.array(here)).to_numpy()
        # Else what each turn has freed would be kept beside what the next one takes.
        del some, found, here
        pa.default_memory_pool().release_unused()
    return places
