"""The robots of a trial: non-idealities, failures and keys of random numbers."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.chance import ChanceKey
from kernels.moving import given_velocities
from kernels.robots.breakdowns import Failing, failing
from kernels.robots.motors import Motors, motors_are_ideal
from kernels.robots.robots import ChanceKeys, is_ideal
from kernels.robots.senses import NEVER, Senses
from kernels.robots.senses import is_ideal as senses_are_ideal
from kernels.robots.wind import Wind, is_calm
from kernels.settings import FAILURES, RobotSettings
from sweep.design import Job, robots_at, stream


def robots_of(job: Job) -> RobotSettings:
    """Return the differences between the boids of a job and ideal boids."""
    return robots_at(job.model, job.catalogue, job.settings)


def flies_alone(job: Job) -> bool:
    """Return whether a trial cannot run in a batch, for reasons beyond its model.

    The reasons are boids that are not ideal or have several goals, wind, and moving
    obstacles.
    """
    settings = job.settings
    if settings["next_goals"] or float(settings["obstacle_speed"]) > 0.0:
        return True
    if job.obstacles and given_velocities(job.obstacles, 0.0) is not None:
        return True
    return not is_ideal(robots_of(job), float(settings["dt"]))


def robot_layers_of(job: Job) -> frozenset[type]:
    """Return the layers between the model of a trial and its boids.

    The layers are sensing, actuation and wind, if the trial has these features.
    """
    robots = robots_of(job)
    failing = failing_of(job)
    ideal = senses_are_ideal(robots.sensing, float(job.settings["dt"]))
    layers = set[type]()
    if not ideal or failing.unheard:
        layers.add(Senses)
    if not motors_are_ideal(robots.actuation) or failing.moves:
        layers.add(Motors)
    if not is_calm(robots.medium):
        layers.add(Wind)
    return frozenset(layers)


class FailingBoids(NamedTuple):
    """Failures of K boids.

    Attributes
    ----------
    how : str
        Kind of failure, one of FAILURES.
    boids : array of int, shape (K,)
        Indices of the boids.
    steps : array of int, shape (K,)
        Step from which on each boid has failed.
    """

    how: str
    boids: NDArray[np.int64]
    steps: NDArray[np.int64]


def failures_of(job: Job) -> FailingBoids:
    """Return the failures in a trial, for display."""
    fails_at, how = failing_of(job)
    boids = np.flatnonzero(fails_at < NEVER)
    return FailingBoids(FAILURES[how], boids, fails_at[boids])


def failing_of(job: Job) -> Failing:
    """Return which boids of a trial fail, when and how."""
    n = int(job.settings["n"])
    dt = float(job.settings["dt"])
    return failing(robots_of(job).breakdowns, keys_of(job).made, n, dt)


def keys_of(job: Job) -> ChanceKeys:
    """Return the keys of the random numbers of the robots of a trial."""
    variability = stream(job, "made")
    events = stream(job, "flown")
    return ChanceKeys(
        ChanceKey(*map(int, variability.generate_state(2))),
        ChanceKey(*map(int, events.generate_state(2))),
    )
