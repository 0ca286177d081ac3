"""What an entry of a file gives in small worlds; and a program that does the same in a
process of its own:

python -m sweep.testing.given FILE KIND NAME NUMBERS.npz
"""

import sys
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.shapes import numbers_of
from sweep.design.jobs import Job
from sweep.spec.sampling import UnitCube
from sweep.testing.elsewhere import mishaps_said
from sweep.testing.entrants import Entrant, entrant
from sweep.testing.flights import STEPS, go, in_words
from sweep.trial.scenery import flock_drawn_now, obstacles
from sweep.trial.simulation import Simulation

POINTS, SIDES = (1, 12), ("one", "two", "three")
"""The numbers of points that a sampler is asked for, and the settings."""
BLANK = float("nan")

Floats = NDArray[np.float64]


class Given(NamedTuple):
    """What an entry gives in a world: its numbers, where in words, and the job."""

    numbers: Floats
    where: str
    job: Job | None = None


def given(one: Entrant) -> Iterator[Given]:
    """The values of a metric in all frames of flights, the obstacles of a map, x, y, vx
    and vy of a start, or the columns of a sampler.
    """
    if one.kind == "samplers":
        for points in POINTS:
            cube = UnitCube(points, SIDES, "joint", 1)
            columns = [np.asarray(column, float) for column in one.entry.draw(cube)]
            yield Given(np.concatenate(columns), f"{points} points of {len(SIDES)}")
    else:
        for job in one.jobs():
            yield Given(_numbers(one, job), in_words(job), job)


def _numbers(one: Entrant, job: Job) -> Floats:
    if one.kind == "maps":
        return numbers_of(obstacles(job))
    if one.kind == "starts":
        return np.stack(flock_drawn_now(job)[:4])
    flown = flight_of(job)
    return measured(flown, one.entry, np.full(flown.filled, BLANK))


def flight_of(job: Job) -> Any:
    """The flight of a job after STEPS steps, whose frames are still there."""
    simulation = Simulation(job)
    go(simulation, STEPS)
    return simulation.flight


def measured(flight: Any, metric: Any, values: Floats) -> Floats:
    """`values` after the metric has written those of all frames of a flight."""
    frames, ground = flight.record.frames, flight.ground
    metric.measure(frames, flight.filled, ground, flight.observation, values)
    return values


def read(file: Path) -> list[Floats]:
    """The numbers that the program has written."""
    with np.load(file) as arrays:
        return [arrays[name] for name in arrays.files]


def main(file: str, kind: str, name: str, numbers: str) -> None:
    """Write what an entry gives, or say what it raises."""
    warnings.simplefilter("ignore", RuntimeWarning)  # compiled code has none
    one = entrant(file, kind, name)
    with mishaps_said():
        np.savez(numbers, *(found.numbers for found in given(one)))


if __name__ == "__main__":
    main(*sys.argv[1:])
