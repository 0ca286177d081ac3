"""Trials that run again for a larger recording.

A repeated run must reproduce the stored results, bitwise identical.
"""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
import pyarrow.compute as pc
from numpy.typing import NDArray

from sweep.design import (
    Counts,
    Job,
    KnownIds,
    Recording,
    as_texts,
    ids_recording,
    packed,
)
from sweep.errors import StoreError
from sweep.spec import Study, columns_of
from sweep.store import (
    Location,
    Served,
    Store,
    give_back,
    load_table,
    stored_schema,
    trial_metrics,
)
from sweep.tables import checked_numbers
from sweep.trial import Result

Stored = tuple[NDArray[np.uint64], NDArray[np.bool_]]
"""Digests of the stored values of n trials, and a mask of done trials, shape (n,)."""
NO_VALUE = np.float64(np.nan).view(np.uint64)


class Twins(NamedTuple):
    """Stored trials of one recording, each the same run as one of some jobs.

    These trials record less than the jobs. Each trial takes 24 bytes.

    Attributes
    ----------
    store : Store
        Store of the study.
    study : Study
        Study of the jobs.
    recording : Recording
        Recording of the stored trials.
    columns : list of str
        Columns of stored trials and jobs.
    ids : KnownIds
        Ids of the n jobs.
    digests : array of uint64
        Digests of the stored values in the columns, by the rows of `ids`, shape (n,).
    """

    store: Store
    study: Study
    recording: Recording
    columns: list[str]
    ids: KnownIds
    digests: NDArray[np.uint64]

    def check(self, results: Iterable[Result]) -> None:
        """Raise StoreError if a result differs from the stored one."""
        done = [result for result in results if result.status == "done"]
        if not done:
            return
        rows = [trial_metrics(result) for result in done]
        values = np.array([[row[name] for name in self.columns] for row in rows])
        places = self.ids.places(packed(result.job.trial_id for result in done))
        differs = (places >= 0) & (self.digests[places] != _digests(values))
        for place in np.flatnonzero(differs)[:1].tolist():
            raise self._difference(done[place].job, rows[place])

    def _difference(self, job: Job, computed: dict[str, float]) -> StoreError:
        stored = ids_recording(self.study, [job], self.recording)
        table = self.store.read(
            "trials",
            trial_ids=as_texts(stored).combine_chunks(),
            columns=["trial_id", *self.columns],
        )
        (then,) = table.to_pylist()
        name = next(
            name
            for name in self.columns
            if _bits(np.array(then[name])) != _bits(np.array(computed[name]))
        )
        return StoreError(
            f"trial {job.trial_id} is the same run as the stored trial"
            f" {then['trial_id']}, but its {name} is {computed[name]!r}, and"
            f" {then[name]!r} is stored: another processor or library may have computed"
            " the stored trial. Finished trials are stored; launch again to resume, and"
            f' "sweep verify {self.study.name}" compares more trials',
            self.study.name,
        )


def twins(
    store: Store,
    study: Study,
    jobs: Sequence[Job],
    recordings: Iterable[Recording],
    served: Served,
) -> list[Twins]:
    """Return the stored trials that the run of some jobs must reproduce.

    Parameters
    ----------
    store : Store
        Store of the study.
    study : Study
        Study of the jobs.
    jobs : sequence of Job
        Trials that are not stored.
    recordings : iterable of Recording
        Recordings of stored trials that belong to another spec.
    served : Served
        Jobs that do not run, because larger stored trials serve in their place.

    Returns
    -------
    list of Twins
        One per recording with such trials.

    Raises
    ------
    StoreError
        If a part is damaged.
    """
    current = Recording.of(study)
    groups = list[Twins]()
    for recording in recordings:
        columns = columns_of(recording.shared(current))
        own_ids = ids_recording(study, jobs if columns else (), current)
        run = served.missing.places(own_ids) < 0
        if not run.any():
            continue
        own_ids = own_ids[run]
        recorded_ids = ids_recording(study, jobs, recording)[run]
        # Searched ids of a million take 16 MB, which are free again after it.
        digests, done = _read(store, columns, KnownIds.of(recorded_ids))
        del recorded_ids
        if done.any():
            ids = KnownIds.of(own_ids[done])
            groups.append(
                Twins(
                    store,
                    study,
                    recording,
                    columns=columns,
                    ids=ids,
                    digests=digests[done],
                )
            )
    return groups


def _read(store: Store, columns: list[str], ids: KnownIds) -> Stored:
    """Return the stored values in the columns as digests, by the rows of `ids`."""

    def of_part(part: Location) -> tuple[Counts, NDArray[np.uint64], NDArray[np.bool_]]:
        if not {*columns} <= {*stored_schema(part / "trials.parquet").names}:
            return np.empty(0, np.int64), np.empty(0, np.uint64), np.empty(0, np.bool_)
        rows = load_table(part, "trials", ["trial_id", "status", *columns])
        checked_numbers(store.folder, rows, columns)
        places = ids.places_of_column(rows["trial_id"])
        values = np.column_stack([rows[name].to_numpy() for name in columns])
        done = pc.equal(rows["status"], "done").fill_null(False).to_numpy()
        is_known = places >= 0
        return places[is_known], _digests(values)[is_known], done[is_known]

    def read(parts: list[Location]) -> Stored:
        digests = np.empty(len(ids.rows), np.uint64)
        done = np.zeros(len(ids.rows), np.bool_)
        for part in parts:
            # Parts come oldest first, and a trial counts from the latest one.
            places, numbers, ended = of_part(part)
            digests[places] = numbers
            done[places] = ended
            # Otherwise freed memory of a part would stay in use with the next part.
            give_back()
        return digests, done

    return store.steadily(read)


def _bits(values: NDArray[np.float64]) -> NDArray[np.uint64]:
    """Return the bits of numbers, with equal bits for every NaN."""
    bits = np.ascontiguousarray(values, np.float64).view(np.uint64)
    return np.where(np.isnan(values), NO_VALUE, bits)


def _digests(values: NDArray[np.float64]) -> NDArray[np.uint64]:
    """Return a digest of each row of values (n, columns)."""
    import pandas as pd  # here, because few launches need it: 0.2 s to import

    rows = pd.DataFrame(_bits(values))
    hashed = pd.util.hash_pandas_object(rows, index=False)
    return np.asarray(hashed, np.uint64)
