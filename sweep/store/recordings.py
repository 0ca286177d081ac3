"""Recorded data of stored trials, and stored trials that replace missing trials.

A stored trial replaces a missing trial that is an equal run and records less.
"""

import json
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from sweep.design import (
    BLOCK,
    BYTES,
    LATER,
    NO_IDS,
    Ids,
    Job,
    KnownIds,
    Recording,
    as_texts,
    blocks,
    blocks_of,
    ids_recording,
    profile_content,
)
from sweep.spec import Column, RecordedProfile, Study
from sweep.store.locations import Location
from sweep.store.manifest import table_names
from sweep.store.origin import part_provenance, stamps
from sweep.store.parquet import each, opened, stored_schema
from sweep.store.regular import fits
from sweep.store.rows import EXPRESSION, EXTENT
from sweep.store.store import Store


def stored_recordings(store: Store) -> list[Recording]:
    """Return the recordings of the parts of a store, each recording once.

    Recordings of versions before 0.7 are left out, because ids of trials covered
    different inputs. Raises StoreError for a damaged part.
    """

    def read(parts: list[Location]) -> list[Recording]:
        recordings = filter(None, each(parts, _recording))
        by_text = {
            json.dumps(recording, sort_keys=True): recording for recording in recordings
        }
        return [by_text[text] for text in sorted(by_text)]

    return store.steadily(read)


def others_stored(store: Store, study: Study) -> list[Recording]:
    """Return the recordings of a store, except the recording of `study`."""
    own = Recording.of(study)
    return [recording for recording in stored_recordings(store) if recording != own]


def measured(columns: Iterable[str], derived: Iterable[str]) -> list[str]:
    """Return the metrics that kernels measured, from the names of columns of trials."""
    recorded = list(columns)
    excluded = set(derived)
    return [
        name
        for name in recorded
        if str(Column(name, half=True)) in recorded and name not in excluded
    ]


def expressions(trials: pa.Schema) -> dict[str, str]:
    """Return the expressions that derive metrics of stored trials, by their names."""
    return {
        field.name: field.metadata[EXPRESSION].decode(errors="replace")
        for field in trials
        if EXPRESSION in (field.metadata or {})
    }


def recorded_profiles(profiles: pa.Schema) -> tuple[RecordedProfile, ...]:
    """Return the profiles of a stored table, with the wanted extents of their axes.

    An extent that no launch writes is left out: a spec does not have it either.
    """
    return tuple(
        _recorded_profile(field.name, field.metadata[EXTENT])
        for field in profiles
        if EXTENT in (field.metadata or {})
    )


def _recorded_profile(name: str, extent: bytes) -> RecordedProfile:
    with suppress(ValueError, RecursionError):
        stored = json.loads(extent)
        if fits(stored, [float | int | None]) and len(stored) == 2:
            return RecordedProfile(name, *stored)
    return RecordedProfile(name)


def _recording(part: Location) -> Recording | None:
    file = part / "trials.parquet"
    with opened(file) as opened_file:
        schema = opened_file.schema_arrow
        first = opened_file.read(columns=["every"]).slice(0, 1).to_pylist()
    code = stamps(part_provenance(schema, file))
    tables = table_names(part)
    if code is None or not first or "every" not in first[0]:
        return None
    series = stored_schema(part / "series.parquet").names if "series" in tables else []
    derived = expressions(schema)
    content: dict[str, Any] = {
        "metrics": sorted(measured(schema.names, derived)),
        "series": sorted({*series} - {"trial_id", "frame"}),
        **first[0],
        "heatmaps": "heatmaps" in tables,
        "trajectories": "trajectories" in tables,
    }
    if derived:
        content["derive"] = derived
    if "profiles" in tables:
        schema = stored_schema(part / "profiles.parquet")
        content["profiles"] = profile_content(recorded_profiles(schema))
    content |= {key: True for key in LATER if key in tables}
    return Recording(code.metrics, content)


@dataclass(frozen=True, eq=False)
class Served:
    """Missing trials, and stored trials that replace them.

    A stored trial is an equal run and records more.

    Attributes
    ----------
    missing : KnownIds
        Ids of n missing trials.
    stored : Ids
        Ids of the stored trials that replace the missing trials, shape (n,).
    """

    missing: KnownIds
    stored: Ids

    @classmethod
    def of(cls, missing: Ids, stored: Ids) -> "Served":
        """Pair missing trials with stored trials.

        Parameters
        ----------
        missing : Ids
            Ids of n missing trials, shape (n,).
        stored : Ids
            Ids of the stored trials, shape (n,).
        """
        return cls(KnownIds.of(missing), stored)

    def __len__(self) -> int:
        return len(self.stored)

    def into(self, ids: Ids) -> Ids:
        """Return the ids, with missing trials replaced by stored trials."""
        replaced = ids.copy()
        for block in blocks(replaced):
            rows = self.missing.places(block)
            is_served = rows >= 0
            block[is_served] = self.stored[rows[is_served]]
        return replaced

    def into_rows(self, rows: pa.RecordBatchReader) -> pa.RecordBatchReader:
        """Return rows with replaced ids in the column `trial_id`."""
        column = rows.schema.get_field_index("trial_id")
        field = rows.schema.field(column)

        def into(batch: pa.RecordBatch) -> pa.RecordBatch:
            ids = batch.column(column)
            index = self.missing.places_of_column(pa.chunked_array([ids]))
            is_served = index >= 0
            stored = as_texts(self.stored[index[is_served]]).combine_chunks()
            ids = pc.replace_with_mask(ids, pa.array(is_served), stored)
            return batch.set_column(column, field, ids)

        return pa.RecordBatchReader.from_batches(rows.schema, map(into, rows))

    def also(self, more: "Served") -> "Served":
        """Return the union of these pairs and `more`."""
        if not len(self):
            return more
        rows = np.concatenate([self.missing.rows, len(self) + more.missing.rows])
        ids = np.concatenate([self.missing.ids, more.missing.ids])
        order = np.argsort(ids)
        stored = np.concatenate([self.stored, more.stored])
        return Served(KnownIds(ids[order], rows[order]), stored)


NONE_SERVED = Served.of(NO_IDS, NO_IDS)


def served(
    study: Study,
    jobs: Sequence[Job],
    recordings: Iterable[Recording],
    stored_ids: KnownIds,
    done: NDArray[np.bool_],
) -> Served:
    """Return the missing trials of a study that stored trials replace.

    Parameters
    ----------
    study : Study
    jobs : sequence of Job
        Missing trials of the study.
    recordings : iterable of Recording
        Recordings of stored trials of a different spec.
    stored_ids : KnownIds
        Ids of the n stored trials.
    done : array of bool
        True for stored trials with the status done, shape (n,).
    """
    needed = Recording.of(study)
    covering = [recording for recording in recordings if recording.covers(needed)]
    most = len(jobs) if covering else 0
    missing = np.empty(most, BYTES)
    stored = np.empty(most, BYTES)
    count = 0
    for block in blocks_of(jobs, BLOCK) if covering else ():
        own = ids_recording(study, block, needed)
        lacking = np.ones(len(own), np.bool_)
        for recording in covering:
            other = ids_recording(study, block, recording)
            rows = stored_ids.places(other)
            serves = (rows >= 0) & lacking
            serves[serves] = done[rows[serves]]
            lacking &= ~serves
            new = slice(count, count + int(serves.sum()))
            missing[new] = own[serves]
            stored[new] = other[serves]
            count = new.stop
    return Served.of(missing[:count], stored[:count])
