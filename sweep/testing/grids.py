"""The check that a model finds the same neighbours with any grid."""

import math
from collections.abc import Iterator
from dataclasses import replace
from unittest import SkipTest

from kernels.model import Sight
from sweep.design import Job
from sweep.testing.flights import (
    Flown,
    begun,
    difference,
    every_way,
    in_words,
    resume,
    sight_of,
)
from sweep.testing.places import of_function
from sweep.testing.subject import Subject
from sweep.trial import State

BOIDS = 80
STEPS = 26
CALLS = (5,) * (STEPS // 5)
WIDER = 1.4
ROOMS = (1, 5, 64)
"""Numbers of boids per block of the grid: small blocks chain into longer lists."""
SPREADS = {"": 1.0, " and gathered": 0.02, " and far outside the world": 30.0}


def grid(subject: Subject) -> None:
    """Check that a trial is bitwise identical with any grid.

    The reference searches all pairs. The grids have different cells, also with lists
    that are cut into blocks. The boids are unchanged, gathered, or far outside the
    world.
    """
    everyone = _seeing(subject, math.inf)
    wider = _seeing(subject, WIDER)
    jobs = [
        job
        for job in every_way(subject, n=BOIDS, steps=STEPS)
        if math.isfinite(sight_of(job, subject).range)
    ]
    for job in jobs:
        searching = replace(job, catalogue=everyone.catalogue)
        larger = replace(job, catalogue=wider.catalogue)
        for where, state in _flocks(job):
            expected = resume(searching, state, CALLS)
            for way, flown in _flown(job, larger, state):
                if mismatch := difference(
                    expected, flown, "with a search of all pairs", way
                ):
                    raise AssertionError(
                        f"{of_function(subject.model.sight)}: {mismatch}"
                        f" ({in_words(job)}{where}); sight must declare the longest"
                        " searched range. Find neighbours only with"
                        " kernels.neighbours.search, and update the grid after each"
                        " move"
                    )
    if not jobs:
        raise SkipTest("all boids perceive all boids, so there is no grid")


def _flocks(job: Job) -> Iterator[tuple[str, State]]:
    """Yield the flock after a step: unchanged, gathered, and far outside."""
    state = begun(job)
    for where, spread in SPREADS.items() if state else ():
        assert state is not None
        arrays = dict(state.arrays)
        for name, side in (("x", "width"), ("y", "height")):
            middle = float(job.settings[side]) / 2
            here = arrays[f"flock.{name}"]
            arrays[f"flock.{name}"] = middle + (here - middle) * spread
        yield where, state._replace(arrays=arrays)


def _flown(job: Job, larger: Job, state: State) -> Iterator[tuple[str, Flown]]:
    """Yield the trial of a flock with each grid, and the grid in words."""
    yield "with cells of the perception range", resume(job, state, CALLS)
    yield "with larger cells", resume(larger, state, CALLS)
    for room in ROOMS:
        yield f"with room for {room} in a block", resume(job, state, CALLS, room)


def _seeing(subject: Subject, more: float) -> Subject:
    """Return the model with a range of sight that is `more` times as long."""

    def sight(params: object) -> Sight:
        declared = subject.model.sight(params)
        return declared._replace(range=declared.range * more)

    return subject.variant(sight=sight)
