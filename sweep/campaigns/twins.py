"""Trials that run again because more is recorded of them: what was stored of the same
flight must come out again, to the last bit.
"""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from sweep.design.jobs import Job, blocks_of, ids_recording
from sweep.design.recording import Recording
from sweep.errors import StoreError
from sweep.spec.recorded import columns_of
from sweep.spec.study import Study
from sweep.store.recordings import Served, places_of
from sweep.store.rows import trial_metrics
from sweep.store.store import Store
from sweep.tables.stored_tables import checked_numbers
from sweep.trial.result import Result

READ_AT_ONCE = 100_000
"""So many trials are read together. What stays of each is 16 bytes."""
NO_VALUE = np.float64(np.nan).view(np.uint64)


class Twins(NamedTuple):
    """Up to READ_AT_ONCE stored trials of a recording, which are the same flights as
    some jobs, though they record less.

    `columns` are those that both have. `keys` (n,) are the beginnings of the ids of the
    jobs in ascending order, and `digests` (n,) stand for what is stored in the columns.
    """

    store: Store
    study: Study
    recording: Recording
    columns: list[str]
    keys: NDArray[np.uint64]
    digests: NDArray[np.uint64]

    def check(self, results: Iterable[Result]) -> None:
        """Raise StoreError where a result has another value than what is stored."""
        done = [one for one in results if one.status == "done"]
        if not done:
            return
        rows = [trial_metrics(result) for result in done]
        values = np.array([[row[name] for name in self.columns] for row in rows])
        keys = _keys([result.job.trial_id for result in done])
        places = np.searchsorted(self.keys, keys).clip(max=len(self.keys) - 1)
        known = self.keys[places] == keys
        differs = known & (self.digests[places] != _digests(values))
        for place in np.flatnonzero(differs)[:1].tolist():
            raise self._difference(done[place].job, rows[place])

    def _difference(self, job: Job, found: dict[str, float]) -> StoreError:
        stored = ids_recording(self.study, [job], self.recording)
        table = self.store.read(
            "trials",
            trial_ids=stored.combine_chunks(),
            columns=["trial_id", *self.columns],
        )
        (then,) = table.to_pylist()
        name = next(
            name
            for name in self.columns
            if _bits(np.array(then[name])) != _bits(np.array(found[name]))
        )
        return StoreError(
            f"trial {job.trial_id} is the same flight as the stored trial"
            f" {then['trial_id']}, but its {name} is {found[name]!r}, and"
            f" {then[name]!r} is stored: another processor or library may have computed"
            " it. What is done is stored; launch again to go on, and"
            f' "sweep verify {self.study.name}" compares more trials',
            self.study.name,
        )


def twins(
    store: Store,
    study: Study,
    jobs: Sequence[Job],
    recordings: Iterable[Recording],
    known: pa.ChunkedArray,
    served: Served,
) -> list[Twins]:
    """The stored trials of each of the `recordings` that must come out again when those
    of the `jobs` run that are not `served`, some after the other; `known` are the ids
    of all that is stored. Raises StoreError for a damaged part.
    """
    asked, found = Recording.of(study), list[Twins]()
    for recording in recordings:
        names = columns_of(recording.shared(asked))
        for some in blocks_of(jobs, READ_AT_ONCE) if names else ():
            own = ids_recording(study, some, asked)
            other = ids_recording(study, some, recording)
            run = (places_of(own, served.asked) < 0) & (places_of(other, known) >= 0)
            if run.any():
                mask = pa.array(run)
                pairs = Served(own.filter(mask), other.filter(mask))
                keys, digests = _read(store, names, pairs)
                found.append(Twins(store, study, recording, names, keys, digests))
    return [one for one in found if len(one.keys)]


def _read(
    store: Store, columns: list[str], pairs: Served
) -> tuple[NDArray[np.uint64], NDArray[np.uint64]]:
    """The keys and digests of the stored ones that are done, as Twins has them."""
    rows = store.read(
        "trials",
        trial_ids=pairs.stored.combine_chunks(),
        columns=["trial_id", "status", *columns],
    )
    checked_numbers(store.folder, rows, columns)
    rows = rows.filter(pc.equal(rows["status"], "done"))
    places = places_of(rows["trial_id"], pairs.stored)
    keys = _keys(pairs.asked.take(pa.array(places)).to_pylist())
    values = np.column_stack([rows[name].to_numpy() for name in columns])
    order = np.argsort(keys)
    return keys[order], _digests(values)[order]


def _keys(ids: Iterable[str]) -> NDArray[np.uint64]:
    return np.array([int(trial[:16], 16) for trial in ids], np.uint64)


def _bits(values: NDArray[np.float64]) -> NDArray[np.uint64]:
    """The bits of numbers, those of NaN the same whatever they are."""
    bits = np.ascontiguousarray(values, np.float64).view(np.uint64)
    return np.where(np.isnan(values), NO_VALUE, bits)


def _digests(values: NDArray[np.float64]) -> NDArray[np.uint64]:
    """A number that stands for each row of values (n, columns)."""
    rows = pd.DataFrame(_bits(values))
    hashed = pd.util.hash_pandas_object(rows, index=False)
    return np.asarray(hashed, np.uint64)
