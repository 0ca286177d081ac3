"""Last flocks of stored trials, and chains that begin with a last flock."""

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from sweep.design import FIRST, Job, LastFlock, LinkedJobs, SomeJobs
from sweep.errors import StoreError
from sweep.spec import LAST_FLOCKS
from sweep.store.rows import FLIGHT, HEADINGS
from sweep.store.store import Store


def last_flocks(
    store: Store, trials: Iterable[str], state: Sequence[str]
) -> dict[str, LastFlock]:
    """Return the stored last flocks of some trials, by trial id.

    Parameters
    ----------
    store : Store
    trials : iterable of str
        Ids of trials. Trials without a stored flock are not in the result.
    state : sequence of str
        Names of the rows of state of the model.

    Returns
    -------
    dict of str to LastFlock

    Raises
    ------
    StoreError
        If a part is damaged, or its last flocks are not what a launch writes.
    """
    trial_ids = pa.array(sorted({*trials}), pa.string())
    if not len(trial_ids):
        return {}
    table = store.read(LAST_FLOCKS, trial_ids=trial_ids)
    try:
        return {row["trial_id"]: _flock(row, state) for row in table.to_pylist()}
    except (KeyError, TypeError, ValueError):
        why = "are not what a launch writes; delete the study, or use another folder"
        raise StoreError(f"{store.folder}: its stored {LAST_FLOCKS} {why}") from None


def _flock(row: dict[str, list[float]], state: Sequence[str]) -> LastFlock:
    def rows(names: Sequence[str]) -> NDArray[np.float64]:
        numbers = np.array([row[name] for name in names], np.float64)
        if not np.isfinite(numbers).all():
            raise ValueError("a number is not finite")
        return numbers.reshape(len(names), len(row["x"]))

    return LastFlock(rows(FLIGHT), rows(HEADINGS), rows(state))


def chains(store: Store, missing: SomeJobs) -> LinkedJobs:
    """Return the chains of missing links.

    Each chain begins at a first link, or after a link that is stored. A chain is left
    out if the trial of the stored link did not come to its end. Raises StoreError as
    `last_flocks` does.
    """
    jobs = missing.jobs
    indices = missing.indices.tolist()
    before = jobs.before(missing.indices).tolist()
    pairs = [*zip(before, indices, strict=True)]
    after = {previous: index for previous, index in pairs if previous != FIRST}
    unstored = {*indices}
    begins = [
        (index, previous) for previous, index in pairs if previous not in unstored
    ]
    model = jobs.study.catalogue.models[jobs.study.model]
    parents = {
        index: jobs.at(index).parent for index, previous in begins if previous != FIRST
    }
    flocks = last_flocks(store, parents.values(), [*model.state])
    links = list[list[int]]()
    first = list[LastFlock | None]()
    for index, _ in begins:
        if index not in parents or parents[index] in flocks:
            links.append(_chain(index, after))
            first.append(flocks[parents[index]] if index in parents else None)
    return LinkedJobs(jobs, links, first)


def _chain(index: int, after: dict[int, int]) -> list[int]:
    """Return the missing links from a job to the end of its chain, in order."""
    links = [index]
    while links[-1] in after:
        links.append(after[links[-1]])
    return links


def with_beginning(store: Store, job: Job) -> Job:
    """Return the job of a stored trial, with the flock with which it begins.

    Only links of chains begin with the last flock of another trial. Raises StoreError
    if this flock is no longer stored.
    """
    if not job.parent:
        return job
    state = [*job.catalogue.models[job.model].state]
    flocks = last_flocks(store, [job.parent], state)
    if job.parent not in flocks:
        raise StoreError(
            f"{store.folder}: trial {job.trial_id} begins with the last flock of trial"
            f" {job.parent}, which is no longer stored; launch the study again"
        )
    return replace(job, begins=flocks[job.parent])
