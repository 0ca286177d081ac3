"""The values of an entry of a file in small worlds.

As a program, the module writes the values from a separate process:

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
from sweep.design import Job
from sweep.spec import UnitCube
from sweep.testing.elsewhere import mishaps_said
from sweep.testing.entrants import Entrant, entrant
from sweep.testing.flights import STEPS, go, in_words
from sweep.trial import Simulation, flock_drawn_now, obstacles

POINTS = (1, 12)
"""Numbers of points that a sampler draws."""
SIDES = ("one", "two", "three")
"""Names of the parameters that a sampler draws."""
BLANK = float("nan")

Floats = NDArray[np.float64]


class Given(NamedTuple):
    """The values of an entry in a world.

    `where` is the world in words. `job` is the trial; None for a sampler.
    """

    numbers: Floats
    where: str
    job: Job | None = None


def given(entrant: Entrant) -> Iterator[Given]:
    """Yield the values of an entry in small worlds.

    metric   values in all frames of trials
    map      obstacles
    start    x, y, vx and vy
    sampler  columns
    """
    if entrant.kind == "samplers":
        for points in POINTS:
            cube = UnitCube(points, SIDES, "joint", 1)
            columns = [np.asarray(column, float) for column in entrant.entry.draw(cube)]
            yield Given(np.concatenate(columns), f"{points} points of {len(SIDES)}")
    else:
        for job in entrant.jobs():
            yield Given(_numbers(entrant, job), in_words(job), job)


def _numbers(entrant: Entrant, job: Job) -> Floats:
    if entrant.kind == "maps":
        return numbers_of(obstacles(job))
    if entrant.kind == "starts":
        return np.stack(flock_drawn_now(job)[:4])
    flown = flight_of(job)
    return measured(flown, entrant.entry, np.full(flown.filled, BLANK))


def flight_of(job: Job) -> Any:
    """Return the `Flight` of a job after STEPS steps, with frames."""
    simulation = Simulation(job)
    go(simulation, STEPS)
    return simulation.flight


def measured(flight: Any, metric: Any, values: Floats) -> Floats:
    """Return `values` after a metric has written into the array.

    Parameters
    ----------
    flight : Flight
        A run with F frames.
    metric : Metric
    values : ndarray, shape (F,) or longer
        Receives one value per frame.
    """
    arguments = (flight.record.frames, flight.filled, flight.ground, flight.observation)
    metric.measure(*arguments, values)
    return values


def read(file: Path) -> list[Floats]:
    """Return the values in a file of the program."""
    with np.load(file) as arrays:
        return [arrays[name] for name in arrays.files]


def main(file: str, kind: str, name: str, numbers: str) -> None:
    """Write the values of an entry into a file, or print the sentence of an error.

    Parameters
    ----------
    file : str
        Path of the file with the entry.
    kind : str
        One of `sweep.testing.entrants.KINDS`.
    name : str
        Name of the entry.
    numbers : str
        Path of the file of values, in the format npz.
    """
    warnings.simplefilter("ignore", RuntimeWarning)  # compiled code has none
    checked = entrant(file, kind, name)
    with mishaps_said():
        np.savez(numbers, *(sample.numbers for sample in given(checked)))


if __name__ == "__main__":
    main(*sys.argv[1:])
