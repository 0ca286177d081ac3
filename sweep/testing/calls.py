"""That each step of a model keeps the flock from before it, and tells the grid where
boids are.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sweep.design.jobs import Job
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
from sweep.trial.simulation import Simulation
from sweep.trial.state import State

FIRST = 3
"""Steps before the one that is looked at: boids then differ in their velocities."""
WORLD, APART = 2 * SIDE, 4
"""The side of the world, and the distance between pairs of boids, in ranges of sight.
Larger groups would be searched without the grid.
"""
PUBLISH = "call publish(flock, others, work) at the beginning of each step"
MOVE = (
    "call move(work.grid, i, x, y) after each boid that moves, or"
    " move_all(work.grid, flock) at the end of each step"
)


def calls(subject: Subject) -> None:
    """After a step the flock has the velocities of before as its previous ones; nothing
    that stood in `work.before` earlier is seen; and the grid has each boid that has
    moved in the cell in which it is now.
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
    """Places in pairs: the two are 0.1, 0.2 and so on of a range of sight apart, in
    different directions.
    """
    pair, second = np.divmod(np.arange(BOIDS), 2)
    row, column = np.divmod(pair, WORLD // APART)
    away, angle = second * (pair + 1) / 10, 2.4 * pair
    return {
        "flock.x": length * (APART * (column + 0.5) + away * np.cos(angle)),
        "flock.y": length * (APART * (row + 0.5) + away * np.sin(angle)),
    }


def _forgotten(job: Job, state: State) -> str | None:
    """What is wrong if a step does not begin with `publish`."""
    after = _after(job, state)
    for name in ("vx", "vy"):
        before = state.arrays[f"flock.{name}"]
        kept = getattr(after.flock, f"previous_{name}")
        for boid in np.flatnonzero(before != kept)[:1].tolist():
            return (
                f"after a step previous_{name} of boid {boid} is {float(kept[boid])!r},"
                f" and its {name} before was {float(before[boid])!r}; {PUBLISH}"
            )
    unknown = {
        name: np.full_like(array, np.nan)
        for name, array in state.arrays.items()
        if name.startswith("work.before.")
    }
    other = _after(job, state._replace(arrays=state.arrays | unknown))
    if _bits(after) != _bits(other):
        return f"boids see in work.before what an earlier step has left; {PUBLISH}"
    return None


def _stale(job: Job, state: State) -> str | None:
    """What is wrong if the grid is not told of moves: tried with a grid that has one of
    each pair elsewhere, so that no boid needs to leave its cell.

    A model that does not search may leave its grid as it is.
    """
    told = _after(job, state, _parted(job, state))
    if told.flight.work.grid.everyone or _bits(told) == _bits(_after(job, state)):
        return None
    anew = Simulation(job)
    anew.restore(told.state())
    grid, wanted = told.flight.work.grid, anew.flight.work.grid
    lost = (grid.column != wanted.column) | (grid.row != wanted.row)
    for boid in np.flatnonzero(lost & _moved(state, told))[:1].tolist():
        return f"boid {boid} moves, and stays in its old cell of the grid; {MOVE}"
    return None


def _parted(job: Job, state: State) -> State:
    """The state with the first of each pair on the other side of the world."""
    x = state.arrays["flock.x"].copy()
    x[::2] += float(job.settings["width"]) / 2
    return state._replace(arrays=state.arrays | {"flock.x": x})


def _moved(state: State, after: Simulation) -> NDArray[np.bool_]:
    """Which boids are elsewhere than in the state."""
    x, y = state.arrays["flock.x"], state.arrays["flock.y"]
    moved: NDArray[np.bool_] = (x != after.flock.x) | (y != after.flock.y)
    return moved


def _after(job: Job, state: State, entered: State | None = None) -> Simulation:
    """A trial one step after a state; its grid has the boids where they are in
    `entered`, if that is another one.
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
