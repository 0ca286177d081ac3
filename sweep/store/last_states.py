"""Trials that resume from the last state of an otherwise equal trial with fewer steps.

The id of the shorter trial is the id of the job with the steps of a stored last state.
The id covers all other inputs of the trial, and the recorded data. The worker checks
that the two trials begin in the same way (`sweep.workers.last_state`).
"""

import secrets
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import BinaryIO

import numpy as np
import pyarrow as pa

from sweep.design import (
    BYTES,
    NO_IDS,
    ContinuedJobs,
    Counts,
    Ids,
    Job,
    KnownIds,
    LastState,
    as_texts,
    ids_of_steps,
    steps_of,
)
from sweep.errors import StoreError
from sweep.spec import LAST_STATES, Study
from sweep.store.locations import Location
from sweep.store.manifest import table_names
from sweep.store.memory import give_back
from sweep.store.new_files import create
from sweep.store.parquet import load_table, pieces
from sweep.store.store import Store


@dataclass(frozen=True, eq=False)
class Earlier:
    """Stored trials from which n jobs can resume: for each job the longest such trial.

    Attributes
    ----------
    ids : Ids
        Id of the stored trial, shape (n,); undefined where `steps` is 0.
    steps : array of int
        Steps of the stored trial, shape (n,); 0 if no trial is stored.
    """

    ids: Ids
    steps: Counts

    @property
    def count(self) -> int:
        """Number of jobs that resume."""
        return int((self.steps > 0).sum())


def earlier_trials(study: Study, store: Store, jobs: Sequence[Job]) -> Earlier:
    """Return the stored trials from which jobs of a study can resume.

    Parameters
    ----------
    study : Study
    store : Store
    jobs : sequence of Job

    Returns
    -------
    Earlier

    Raises
    ------
    StoreError
        If a part is damaged.
    """
    stored, done = _stored_steps(store)
    ids = np.zeros(len(jobs), BYTES)
    steps = np.zeros(len(jobs), np.int64)
    needed = steps_of(jobs)
    for step in np.unique(done)[::-1].tolist():
        could = (needed > step) & (steps == 0)
        if not could.any():
            continue
        shorter = ids_of_steps(study, jobs, step)
        rows = stored.places(shorter)
        resumes = could & (rows >= 0)
        resumes[resumes] = done[rows[resumes]] == step
        ids[resumes] = shorter[resumes]
        steps[resumes] = step
    return Earlier(ids, steps)


def _stored_steps(store: Store) -> tuple[KnownIds, Counts]:
    """Return the n trials with stored last states, and their steps, shape (n,)."""
    stored = store.read(LAST_STATES, columns=["trial_id", "step"])
    if not len(stored):
        return KnownIds.of(NO_IDS), np.zeros(0, np.int64)
    _check(store, stored.schema.field("step").type == pa.int64())
    _check(store, not stored["step"].null_count)
    return KnownIds.of_column(stored["trial_id"]), stored["step"].to_numpy()


def _check(store: Store, as_written: bool) -> None:
    """Raise StoreError for rows that no launch writes."""
    if not as_written:
        why = "are not what a launch writes; delete the study, or use another folder"
        raise StoreError(f"{store.folder}: its stored {LAST_STATES} {why}")


@contextmanager
def continued(
    store: Store, jobs: Sequence[Job], earlier: Earlier
) -> Iterator[Sequence[Job]]:
    """Yield jobs, each with the last state of the earlier trial from which it resumes.

    Inside the context the states are in a local file, in the order in which the store
    has them. So a job finds its state at once, and the states take no memory.

    Parameters
    ----------
    store : Store
    jobs : sequence of Job
    earlier : Earlier
        Earlier trials of these jobs.

    Raises
    ------
    StoreError
        If a part is damaged, or the local file cannot be written.
    """
    if not earlier.count:
        yield jobs
        return
    # Otherwise memory freed by the search would be kept in addition to the copies.
    give_back()
    with store.staging(f"{LAST_STATES}-{secrets.token_hex(6)}") as folder:
        resumed = KnownIds.of(np.unique(earlier.ids[earlier.steps > 0]))
        which = resumed.places(earlier.ids)
        with create(folder / LAST_STATES) as file:
            places = store.steadily(lambda parts: _copied(store, parts, resumed, file))

            def state(job: int) -> LastState:
                first, size = places[which[job]].tolist()
                file.seek(first)
                (trial,) = as_texts(earlier.ids[job : job + 1]).to_pylist()
                return LastState(trial, file.read(size))

            yield ContinuedJobs(jobs, earlier.steps, state)


def _copied(
    store: Store, parts: list[Location], resumed: KnownIds, file: BinaryIO
) -> Counts:
    """Write the last states of some trials into a file.

    Returns the offset and the bytes of each state, shape (len(resumed.ids), 2). The
    latest part of a trial counts.
    """
    file.seek(0)
    file.truncate()
    places = np.zeros((len(resumed.ids), 2), np.int64)
    for part in parts:
        if LAST_STATES not in table_names(part):
            continue
        ids = load_table(part, LAST_STATES, ["trial_id"])["trial_id"]
        if not (resumed.places_of_column(ids) >= 0).any():
            continue
        for rows in pieces(part, LAST_STATES):
            _check(store, rows["state"].type == pa.large_binary())
            _check(store, not rows["state"].null_count)
            which = resumed.places_of_column(rows["trial_id"])
            for row in np.flatnonzero(which >= 0).tolist():
                content = rows["state"][row].as_buffer()
                places[which[row]] = file.tell(), len(content)
                file.write(content)
        give_back()
    return places
