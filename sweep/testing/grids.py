"""That a model finds the same neighbours with any grid."""

import math
from collections.abc import Iterator
from dataclasses import replace
from unittest import SkipTest

from kernels.model import Sight
from sweep.design.jobs import Job
from sweep.testing.flights import (
    Flown,
    begun,
    difference,
    every_way,
    go_on,
    in_words,
    sight_of,
)
from sweep.testing.places import of_function
from sweep.testing.subject import Subject
from sweep.trial.state import State

BOIDS, STEPS = 80, 26
CALLS = (5,) * (STEPS // 5)
WIDER = 1.4
ROOMS = (1, 5, 64)
"""Of blocks in the grid: in small ones lists go on in others."""
SPREADS = {"": 1.0, " and gathered": 0.02, " and far outside the world": 30.0}


def grid(subject: Subject) -> None:
    """A flight has the same bits whether everyone is searched, or a grid of any cells,
    also one whose lists are cut into blocks; and wherever the boids are.
    """
    everyone, wider = _seeing(subject, math.inf), _seeing(subject, WIDER)
    jobs = [
        job
        for job in every_way(subject, n=BOIDS, steps=STEPS)
        if math.isfinite(sight_of(job, subject).range)
    ]
    for job in jobs:
        searching = replace(job, known=everyone.known)
        larger = replace(job, known=wider.known)
        for where, state in _flocks(job):
            wanted = go_on(searching, state, CALLS)
            for way, flown in _flown(job, larger, state):
                if said := difference(wanted, flown, "if everyone is searched", way):
                    raise AssertionError(
                        f"{of_function(subject.model.sight)}: {said} ({in_words(job)}"
                        f"{where}); sight must declare the longest range that is"
                        " searched, kernels.neighbours.search alone finds"
                        " neighbours, and the grid is told of each move at once"
                    )
    if not jobs:
        raise SkipTest("its boids see everyone, so there is no grid")


def _flocks(job: Job) -> Iterator[tuple[str, State]]:
    """The flock after a step, as it is, gathered, and far outside the world."""
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
    """What becomes of a flock with each grid."""
    yield "with cells as large as it sees", go_on(job, state, CALLS)
    yield "with larger cells", go_on(larger, state, CALLS)
    for room in ROOMS:
        yield f"with room for {room} in a block", go_on(job, state, CALLS, room)


def _seeing(subject: Subject, more: float) -> Subject:
    """The model with cells for a sight that is so many times as long."""

    def sight(params: object) -> Sight:
        seen = subject.model.sight(params)
        return seen._replace(range=seen.range * more)

    return subject.variant(sight=sight)
