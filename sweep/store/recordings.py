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

from sweep.design.jobs import Job, blocks_of, ids_recording
from sweep.design.recording import LATER, Recording
from sweep.design.trial_ids import (
    BLOCK,
    BYTES,
    NO_IDS,
    Ids,
    KnownIds,
    as_texts,
    blocks,
)
from sweep.spec.recorded import Column
from sweep.spec.study import Study
from sweep.store.locations import Location
from sweep.store.manifest import table_names
from sweep.store.origin import part_provenance, stamps
from sweep.store.parquet import each, opened, stored_schema
from sweep.store.rows import EXPRESSION
from sweep.store.store import Store


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
    if derived:
        content["derive"] = derived
    content |= {key: True for key in LATER if key in names}
    return Recording(code.metrics, content)


@dataclass(frozen=True, eq=False)
class Served:
    """Trials that are not stored, `missing`, and the stored ones in their place, which
    are the same flights and record more; both (n,).
    """

    missing: KnownIds
    stored: Ids

    @classmethod
    def of(cls, missing: Ids, stored: Ids) -> "Served":
        """Each of some trials, and the stored one in its place."""
        return cls(KnownIds.of(missing), stored)

    def __len__(self) -> int:
        return len(self.stored)

    def into(self, ids: Ids) -> Ids:
        """The ids with those of stored trials in the place of those that they serve."""
        found = ids.copy()
        for some in blocks(found):
            places = self.missing.places(some)
            there = places >= 0
            some[there] = self.stored[places[there]]
        return found

    def into_rows(self, rows: pa.RecordBatchReader) -> pa.RecordBatchReader:
        """The same of the column `trial_id` of some rows after the other."""
        place = rows.schema.get_field_index("trial_id")
        field = rows.schema.field(place)

        def into(batch: pa.RecordBatch) -> pa.RecordBatch:
            ids = batch.column(place)
            places = self.missing.places_of_column(pa.chunked_array([ids]))
            there = places >= 0
            stored = as_texts(self.stored[places[there]]).combine_chunks()
            ids = pc.replace_with_mask(ids, pa.array(there), stored)
            return batch.set_column(place, field, ids)

        return pa.RecordBatchReader.from_batches(rows.schema, map(into, rows))

    def also(self, others: "Served") -> "Served":
        """These and others."""
        if not len(self):
            return others
        mine, theirs = self.missing, others.missing
        rows = np.concatenate([mine.rows, len(self) + theirs.rows])
        ids = np.concatenate([mine.ids, theirs.ids])
        order = np.argsort(ids)
        stored = np.concatenate([self.stored, others.stored])
        return Served(KnownIds(ids[order], rows[order]), stored)


NONE_SERVED = Served.of(NO_IDS, NO_IDS)


def served(
    study: Study,
    jobs: Sequence[Job],
    recordings: Iterable[Recording],
    known: KnownIds,
    done: NDArray[np.bool_],
) -> Served:
    """Which of some jobs of `study` are served by trials that are stored.

    study       the study
    jobs        trials of it that are not stored
    recordings  what stored trials record that are of another spec
    known       the ids of the n stored trials
    done        (n,) which of them are done
    """
    asked = Recording.of(study)
    covering = [one for one in recordings if one.covers(asked)]
    most = len(jobs) if covering else 0
    mine, theirs, found = np.empty(most, BYTES), np.empty(most, BYTES), 0
    for some in blocks_of(jobs, BLOCK) if covering else ():
        own = ids_recording(study, some, asked)
        lacking = np.ones(len(own), np.bool_)
        for recording in covering:
            other = ids_recording(study, some, recording)
            places = known.places(other)
            there = (places >= 0) & lacking
            there[there] = done[places[there]]
            lacking &= ~there
            new = slice(found, found + int(there.sum()))
            mine[new], theirs[new], found = own[there], other[there], new.stop
    return Served.of(mine[:found], theirs[:found])
