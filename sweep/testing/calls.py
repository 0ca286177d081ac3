"""The check that each step publishes the previous flock, and updates the grid."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sweep.design import Job
from sweep.testing.flights import (
    BOIDS,
    SIDE,
    Floats,
    begun,
    broken_demands,
    every_way,
    go,
    in_words,
)
from sweep.testing.places import of_function
from sweep.testing.subject import Subject
from sweep.trial import Simulation, State

FIRST = 3
"""Steps before the checked step. After these steps the velocities of boids differ."""
WORLD = 2 * SIDE
"""Side of the world, in ranges of sight."""
APART = 4
"""Distance between pairs of boids, in ranges of sight.

Larger groups would be searched without the grid.
"""
PUBLISH = "call publish(flock, others, work) at the beginning of each step"
MOVE = (
    "call move(work.grid, i, x, y) after each boid that moves, or"
    " move_all(work.grid, flock) at the end of each step"
)


def calls(subject: Subject) -> None:
    """Check the previous velocities and the grid after a step.

    After a step, the previous velocities of the flock are the velocities before the
    step. No boid perceives values of an earlier step in `work.before`. The grid has
    each moved boid in the new cell.
    """
    place = of_function(subject.model.advance)
    for job in every_way(subject, obstacles=False):
        length = float(job.settings["width"]) / SIDE
        side = WORLD * length
        wide = replace(job, settings=job.settings | {"width": side, "height": side})
        state = begun(wide, FIRST)
        if state is None or broken_demands(subject, wide.settings):
            continue
        paired = state._replace(arrays=state.arrays | _pairs(length))
        for wrong in (_forgotten(wide, paired), _stale(wide, paired)):
            if wrong:
                raise AssertionError(f"{place}: {wrong} ({in_words(job)})")


def _pairs(length: float) -> dict[str, Floats]:
    """Return positions of boids in pairs.

    The boids of a pair have distances of 0.1, 0.2 and so on, in ranges of sight, and
    different directions.
    """
    pair, second = np.divmod(np.arange(BOIDS), 2)
    row, column = np.divmod(pair, WORLD // APART)
    away = second * (pair + 1) / 10
    angle = 2.4 * pair
    return {
        "flock.x": length * (APART * (column + 0.5) + away * np.cos(angle)),
        "flock.y": length * (APART * (row + 0.5) + away * np.sin(angle)),
    }


def _forgotten(job: Job, state: State) -> str | None:
    """Return the error if a step does not begin with `publish`."""
    after = _after(job, state)
    for name in ("vx", "vy"):
        before = state.arrays[f"flock.{name}"]
        previous = getattr(after.flock, f"previous_{name}")
        for boid in np.flatnonzero(before != previous)[:1].tolist():
            return (
                f"after a step previous_{name} of boid {boid} is"
                f" {float(previous[boid])!r}, but {name} before the step was"
                f" {float(before[boid])!r}; {PUBLISH}"
            )
    unknown = {
        name: np.full_like(array, np.nan)
        for name, array in state.arrays.items()
        if name.startswith("work.before.")
    }
    without_before = _after(job, state._replace(arrays=state.arrays | unknown))
    if _bits(after) != _bits(without_before):
        return f"work.before has values of an earlier step; {PUBLISH}"
    return None


def _stale(job: Job, state: State) -> str | None:
    """Return the error if the grid is not updated after moves.

    The grid of this check has one boid of each pair in another cell. So a missing
    update is detected, although no boid needs to leave its cell. A model without a
    search does not need to update the grid.
    """
    parted = _after(job, state, _parted(job, state))
    if parted.flight.work.grid.everyone or _bits(parted) == _bits(_after(job, state)):
        return None
    restored = Simulation(job)
    restored.restore(parted.state())
    grid = parted.flight.work.grid
    expected = restored.flight.work.grid
    lost = (grid.column != expected.column) | (grid.row != expected.row)
    for boid in np.flatnonzero(lost & _moved(state, parted))[:1].tolist():
        return f"boid {boid} moves, but stays in the old cell of the grid; {MOVE}"
    return None


def _parted(job: Job, state: State) -> State:
    """Return the state with the first of each pair across the world."""
    x = state.arrays["flock.x"].copy()
    x[::2] += float(job.settings["width"]) / 2
    return state._replace(arrays=state.arrays | {"flock.x": x})


def _moved(state: State, after: Simulation) -> NDArray[np.bool_]:
    """Return a mask of the boids that have moved since the state, shape (N,)."""
    x, y = state.arrays["flock.x"], state.arrays["flock.y"]
    moved: NDArray[np.bool_] = (x != after.flock.x) | (y != after.flock.y)
    return moved


def _after(job: Job, state: State, entered: State | None = None) -> Simulation:
    """Return a trial one step after a state.

    The grid has the positions of boids in `entered`, if `entered` is another state.
    """
    simulation = Simulation(job)
    simulation.restore(entered or state)
    for name in ("x", "y"):
        getattr(simulation.flock, name)[:] = state.arrays[f"flock.{name}"]
    go(simulation, 1)
    simulation.take_frames()
    return simulation


def _bits(simulation: Simulation) -> bytes:
    return np.stack(simulation.flock[:4]).tobytes()
