"""Which trials go on from the last state that the same trial with fewer steps has left,
and what that is.

The shorter trial is found by the id that the job would have with the steps of a stored
last state. The id covers all else that makes the flight, and what is recorded. Whether
both trials begin alike is seen by the worker (`sweep.workers.last_state`).
"""

import secrets
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import BinaryIO

import numpy as np
import pyarrow as pa

from sweep.design.jobs import (
    ContinuedJobs,
    Counts,
    Job,
    LastState,
    ids_of_steps,
    steps_of,
)
from sweep.design.trial_ids import BYTES, NO_IDS, Ids, KnownIds, as_texts
from sweep.errors import StoreError
from sweep.spec.study import LAST_STATES, Study
from sweep.store.locations import Location
from sweep.store.manifest import table_names
from sweep.store.memory import give_back
from sweep.store.new_files import create
from sweep.store.parquet import load_table, pieces
from sweep.store.store import Store


@dataclass(frozen=True, eq=False)
class Earlier:
    """For each of some jobs the stored trial with the most steps from which it can go
    on: its id, which means nothing where there is none, and the `steps` that it has
    done, 0 there; both (n,).
    """

    ids: Ids
    steps: Counts

    @property
    def count(self) -> int:
        """How many of the jobs go on."""
        return int((self.steps > 0).sum())


def earlier_trials(study: Study, store: Store, jobs: Sequence[Job]) -> Earlier:
    """From which stored trials `jobs` of a study can go on. Raises StoreError for a
    damaged part.
    """
    known, done = _stored_steps(store)
    ids, steps = np.zeros(len(jobs), BYTES), np.zeros(len(jobs), np.int64)
    asked = steps_of(jobs)
    for step in np.unique(done)[::-1].tolist():
        could = (asked > step) & (steps == 0)
        if not could.any():
            continue
        shorter = ids_of_steps(study, jobs, step)
        places = known.places(shorter)
        found = could & (places >= 0)
        found[found] = done[places[found]] == step
        ids[found], steps[found] = shorter[found], step
    return Earlier(ids, steps)


def _stored_steps(store: Store) -> tuple[KnownIds, Counts]:
    """The trials whose last states are stored, and after how many steps; (n,)."""
    stored = store.read(LAST_STATES, columns=["trial_id", "step"])
    if not len(stored):
        return KnownIds.of(NO_IDS), np.zeros(0, np.int64)
    _check(store, stored.schema.field("step").type == pa.int64())
    _check(store, not stored["step"].null_count)
    return KnownIds.of_column(stored["trial_id"]), stored["step"].to_numpy()


def _check(store: Store, as_written: bool) -> None:
    """Raise StoreError for rows that no launch writes."""
    if not as_written:
        why = "are not what a launch writes; delete the study, or launch it elsewhere"
        raise StoreError(f"{store.folder}: its stored {LAST_STATES} {why}")


@contextmanager
def continued(
    store: Store, jobs: Sequence[Job], earlier: Earlier
) -> Iterator[Sequence[Job]]:
    """`jobs`, each with the last state of the earlier trial from which it goes on.

    Meanwhile these states lie in a local file, in the order in which they are stored:
    so a job finds its own at once, and no memory is taken for all of them. Raises
    StoreError for a damaged part, and where that file cannot be written.
    """
    if not earlier.count:
        yield jobs
        return
    # Else what finding them has freed would be kept beside what copying takes.
    give_back()
    with store.staging(f"{LAST_STATES}-{secrets.token_hex(6)}") as folder:
        wanted = KnownIds.of(np.unique(earlier.ids[earlier.steps > 0]))
        which = wanted.places(earlier.ids)
        with create(folder / LAST_STATES) as file:
            places = store.steadily(lambda parts: _copied(store, parts, wanted, file))

            def state(job: int) -> LastState:
                first, size = places[which[job]].tolist()
                file.seek(first)
                (trial,) = as_texts(earlier.ids[job : job + 1]).to_pylist()
                return LastState(trial, file.read(size))

            yield ContinuedJobs(jobs, earlier.steps, state)


def _copied(
    store: Store, parts: list[Location], wanted: KnownIds, file: BinaryIO
) -> Counts:
    """Write the last states of some trials into a file. Returns where each begins, and
    its bytes, shape (len(wanted.ids), 2); the latest part of a trial counts.
    """
    file.seek(0)
    file.truncate()
    places = np.zeros((len(wanted.ids), 2), np.int64)
    for part in parts:
        if LAST_STATES not in table_names(part):
            continue
        there = load_table(part, LAST_STATES, ["trial_id"])["trial_id"]
        if not (wanted.places_of_column(there) >= 0).any():
            continue
        for rows in pieces(part, LAST_STATES):
            _check(store, rows["state"].type == pa.large_binary())
            _check(store, not rows["state"].null_count)
            which = wanted.places_of_column(rows["trial_id"])
            for row in np.flatnonzero(which >= 0).tolist():
                content = rows["state"][row].as_buffer()
                places[which[row]] = file.tell(), len(content)
                file.write(content)
        give_back()
    return places
