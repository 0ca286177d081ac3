"""Where boids of stored trials are at their end, and chains that go on from there."""

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from sweep.design.chains import FIRST
from sweep.design.jobs import Job, LastFlock, LinkedJobs, SomeJobs
from sweep.errors import StoreError
from sweep.spec.study import LAST_FLOCKS
from sweep.store.rows import FLIGHT, HEADINGS
from sweep.store.store import Store


def last_flocks(
    store: Store, trials: Iterable[str], state: Sequence[str]
) -> dict[str, LastFlock]:
    """The last flocks of those of some trials that have left one, by their ids. `state`
    are the names of the rows of state of their model.

    Raises StoreError for a damaged part, and for what no launch writes.
    """
    wanted = pa.array(sorted({*trials}), pa.string())
    if not len(wanted):
        return {}
    table = store.read(LAST_FLOCKS, trial_ids=wanted)
    try:
        return {row["trial_id"]: _flock(row, state) for row in table.to_pylist()}
    except (KeyError, TypeError, ValueError):
        why = "are not what a launch writes; delete the study, or launch it elsewhere"
        raise StoreError(f"{store.folder}: its stored {LAST_FLOCKS} {why}") from None


def _flock(row: dict[str, list[float]], state: Sequence[str]) -> LastFlock:
    def rows(names: Sequence[str]) -> NDArray[np.float64]:
        found = np.array([row[name] for name in names], np.float64)
        if not np.isfinite(found).all():
            raise ValueError("a number is not finite")
        return found.reshape(len(names), len(row["x"]))

    return LastFlock(rows(FLIGHT), rows(HEADINGS), rows(state))


def chains(store: Store, missing: SomeJobs) -> LinkedJobs:
    """The chains that missing links make, each from a first link, or from a link that
    is stored. Those are left out where that one did not come to its end.

    Raises StoreError as `last_flocks`.
    """
    jobs, places = missing.jobs, missing.indices
    before = jobs.before(places).tolist()
    pairs = zip(before, places.tolist(), strict=True)
    after = {parent: place for parent, place in pairs if parent != FIRST}
    there = {*places.tolist()}
    begins = [
        (place, parent)
        for place, parent in zip(places.tolist(), before, strict=True)
        if parent not in there
    ]
    model = jobs.study.known.models[jobs.study.model]
    parents = {place: jobs.at(place).parent for place, one in begins if one != FIRST}
    flocks = last_flocks(store, parents.values(), [*model.state])
    links, first = list[list[int]](), list[LastFlock | None]()
    for place, _ in begins:
        if place not in parents or parents[place] in flocks:
            links.append(_chain(place, after))
            first.append(flocks[parents[place]] if place in parents else None)
    return LinkedJobs(jobs, links, first)


def _chain(place: int, after: dict[int, int]) -> list[int]:
    """The missing links from one on, as far as each is that after the one before."""
    found = [place]
    while found[-1] in after:
        found.append(after[found[-1]])
    return found


def with_beginning(store: Store, job: Job) -> Job:
    """The job of a stored trial, with the flock with which it begins, if another trial
    has left that. Raises StoreError where it is not stored any more.
    """
    if not job.parent:
        return job
    state = [*job.known.models[job.model].state]
    found = last_flocks(store, [job.parent], state)
    if job.parent not in found:
        raise StoreError(
            f"{store.folder}: trial {job.trial_id} begins where trial {job.parent} has"
            " ended, which is not stored any more; launch the study again"
        )
    return replace(job, begins=found[job.parent])
