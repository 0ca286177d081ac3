"""What the layers between a model and its boids share."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.chance import NO_KEY, ChanceKey
from kernels.robots import senses
from kernels.robots.breakdowns import BLIND, SILENT, Failing, failing
from kernels.robots.motors import Motors, build_motors, motors_are_ideal
from kernels.robots.spreads import Rows, build_rows
from kernels.robots.wind import Wind, build_wind, is_calm
from kernels.settings import RobotSettings
from kernels.state import World


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
    address that begins with it, so that none depends on those before. `driven` (1,)
    counts the calls of `drive` while there are `motors`, which are None where all boids
    move as their model wants. `rows` have the parameters of each robot, and are empty
    where all have those of the flock. `wind` is None where the medium is at rest.
    """

    clock: NDArray[np.int64]
    driven: NDArray[np.int64]
    keys: ChanceKeys
    failing: Failing
    motors: Motors | None
    rows: Rows
    wind: Wind | None


def build_robots(
    settings: RobotSettings,
    keys: ChanceKeys,
    n: int,
    dt: float,
    world: World,
    params: Any = None,
) -> Robots:
    """The layers of `n` boids in `world`, at the start of a flight with steps of length
    `dt`, of a model with these `params`.
    """
    fails = failing(settings.breakdowns, keys.made, n, dt)
    return Robots(
        np.zeros(1, np.int64),
        np.zeros(1, np.int64),
        keys,
        fails,
        build_motors(settings.actuation, fails.moves, keys.made, n, dt),
        build_rows(params, settings.spreads, keys.made, n),
        build_wind(settings.medium, keys.made, dt, world),
    )


def may_sense(settings: RobotSettings, dt: float) -> bool:
    """Whether, in steps of `dt`, boids measure and hear: all of them, or those who fail
    are not heard of, or hear of nobody.
    """
    fails = settings.breakdowns
    unheard = fails.failing_share > 0.0 and fails.failing_how in (SILENT, BLIND)
    return unheard or not senses.is_ideal(settings.sensing, dt)


def is_ideal(settings: RobotSettings, dt: float) -> bool:
    """Whether, in steps of `dt`, boids know what is and do what their model wants, all
    have the same parameters, none fails, and the medium is at rest: then no layer
    changes a bit.
    """
    return (
        senses.is_ideal(settings.sensing, dt)
        and motors_are_ideal(settings.actuation)
        and settings.breakdowns.failing_share == 0.0
        and all(one.deviation == 0.0 for one in settings.spreads)
        and is_calm(settings.medium)
    )
