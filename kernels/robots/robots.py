"""What the layers between a model and its boids share."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.chance import NO_KEY, ChanceKey
from kernels.robots.breakdowns import Failing, failing
from kernels.robots.motors import Motors, build_motors, motors_are_ideal
from kernels.settings import RobotSettings, Sensing


class ChanceKeys(NamedTuple):
    """Of the random numbers of a trial's robots: of who is made how, and of what
    happens to them under way.
    """

    made: ChanceKey
    flown: ChanceKey


NO_KEYS = ChanceKeys(NO_KEY, NO_KEY)


class Robots(NamedTuple):
    """The layers of one flight.

    `clock` (1,) counts the steps that have begun. Random numbers of the flight have an
    address that begins with it, so that none depends on those before. `motors` are
    None where all boids move as their model wants.
    """

    clock: NDArray[np.int64]
    keys: ChanceKeys
    failing: Failing
    motors: Motors | None


def build_robots(
    settings: RobotSettings, keys: ChanceKeys, n: int, dt: float
) -> Robots:
    """The layers of `n` boids at the start of a flight with steps of length `dt`."""
    fails = failing(settings.breakdowns, keys.made, n, dt)
    return Robots(
        np.zeros(1, np.int64),
        keys,
        fails,
        build_motors(settings.actuation, fails.moves, keys.made, n, dt),
    )


def is_ideal(settings: RobotSettings) -> bool:
    """Whether boids know what is, do what their model wants, and all hold: then no
    layer changes a bit.
    """
    fails = settings.breakdowns.failing_share > 0.0
    return (
        _senses_are_ideal(settings.sensing)
        and motors_are_ideal(settings.actuation)
        and not fails
    )


def _senses_are_ideal(sensing: Sensing) -> bool:
    return (
        sensing.position_noise == 0.0
        and sensing.velocity_noise == 0.0
        and sensing.sensing_delay == 0.0
        and sensing.sensing_period == 0.0
        and sensing.radio_range == math.inf
        and sensing.packet_loss == 0.0
        and sensing.occlusion == 0
    )
