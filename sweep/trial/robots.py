"""Whether the boids of a trial are ideal ones, which of them fail, and their keys of
random numbers.
"""

from collections.abc import Iterable
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
from sweep.design.jobs import Job, stream
from sweep.design.robots import robots_at
from sweep.spec.settings import Value


def robots_of(job: Job) -> RobotSettings:
    """In what the boids of a job and their medium differ from ideal ones."""
    return robots_at(job.model, job.known, job.settings)


def flies_alone(job: Job) -> bool:
    """Whether a trial flies alone, and not in a lane: its boids are not ideal ones or
    have several goals, or their medium or obstacles move.
    """
    settings = job.settings
    if settings["next_goals"] or float(settings["obstacle_speed"]) > 0.0:
        return True
    if job.obstacles and given_velocities(job.obstacles, 0.0) is not None:
        return True
    return not is_ideal(robots_of(job), float(settings["dt"]))


def robot_layers_of(job: Job) -> frozenset[type]:
    """Which layers lie between the model of a trial and its boids, or carry these."""
    settings, failing = robots_of(job), failing_of(job)
    ideal = senses_are_ideal(settings.sensing, float(job.settings["dt"]))
    layers = set[type]()
    if not ideal or failing.unheard:
        layers.add(Senses)
    if not motors_are_ideal(settings.actuation) or failing.moves:
        layers.add(Motors)
    if not is_calm(settings.medium):
        layers.add(Wind)
    return frozenset(layers)


def with_layers(layers: Iterable[type]) -> dict[str, Value]:
    """Settings that give boids these layers, whatever their model."""
    given: dict[type, dict[str, Value]] = {
        Senses: {"radio_range": 1.0},
        Motors: {"motor_max_speed": 1.0},
        Wind: {"wind_x": 1.0},
    }
    return {name: value for layer in layers for name, value in given[layer].items()}


class FailingBoids(NamedTuple):
    """How boids fail, the indices of those that do (K,), and the steps (K,) from which
    on each of them has failed.
    """

    how: str
    boids: NDArray[np.int64]
    steps: NDArray[np.int64]


def failures_of(job: Job) -> FailingBoids:
    """The failures in a trial, for whoever shows them."""
    fails_at, how = failing_of(job)
    boids = np.flatnonzero(fails_at < NEVER)
    return FailingBoids(FAILURES[how], boids, fails_at[boids])


def failing_of(job: Job) -> Failing:
    """Which boids of a trial fail, when and how."""
    n, dt = int(job.settings["n"]), float(job.settings["dt"])
    return failing(robots_of(job).breakdowns, keys_of(job).made, n, dt)


def keys_of(job: Job) -> ChanceKeys:
    """The keys of what is random about the robots of a trial."""
    made, flown = (stream(job, purpose) for purpose in ("made", "flown"))
    return ChanceKeys(
        *(ChanceKey(*map(int, one.generate_state(2))) for one in (made, flown))
    )
