"""The world of a trial, drawn from its job, for whoever shows it."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sweep.design.jobs import Job
from sweep.trial.simulation import obstacles


class TrialWorld(NamedTuple):
    """The size of a trial's world, and its obstacles (M, 5) as kernels.worlds has them.

    A row is x and y of a centre, half width, half height, and 1 for a disc or 0 for a
    rectangle. Lengths are in the model's unit.
    """

    width: float
    height: float
    obstacles: NDArray[np.float64]


def world_of(job: Job) -> TrialWorld:
    """The world in which the trial of `job` runs."""
    settings = job.settings
    return TrialWorld(
        float(settings["width"]), float(settings["height"]), obstacles(job)
    )
