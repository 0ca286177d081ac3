"""The layers between a model and the boids."""

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
    """Keys of the random numbers of the robots of a trial.

    Attributes
    ----------
    made : ChanceKey
        Key of the properties of each robot.
    flown : ChanceKey
        Key of the events during the trial.
    """

    made: ChanceKey
    flown: ChanceKey


NO_KEYS = ChanceKeys(NO_KEY, NO_KEY)


class Robots(NamedTuple):
    """Layers of one trial.

    Attributes
    ----------
    clock : array of int, shape (1,)
        Number of steps that have begun. Addresses of random numbers of the trial begin
        with this number, so that no random number depends on earlier random numbers.
    driven : array of int, shape (1,)
        Number of calls of `drive`, counted if `motors` is not None.
    keys : ChanceKeys
    failing : Failing
    motors : Motors or None
        None if all boids move as the model commands.
    rows : Rows
        Parameters of each robot, empty if all robots have the parameters of the flock.
    wind : Wind or None
        None if the medium is at rest.
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
    """Return the layers of a flock at the start of a trial.

    Parameters
    ----------
    settings : RobotSettings
        Non-idealities of robots and medium.
    keys : ChanceKeys
        Keys of the random numbers.
    n : int
        Number of boids.
    dt : float
        Time of a step.
    world : World
    params : NamedTuple, optional
        Parameters of the model; needed if parameters differ from robot to robot.
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
    """Return whether boids have a sensing model in steps of `dt`.

    The result is true with sensing errors or limits of communication, and with boids
    that fail as silent or blind.
    """
    fails = settings.breakdowns
    unheard = fails.failing_share > 0.0 and fails.failing_how in (SILENT, BLIND)
    return unheard or not senses.is_ideal(settings.sensing, dt)


def is_ideal(settings: RobotSettings, dt: float) -> bool:
    """Return whether no layer changes a number in steps of `dt`.

    If so, boids know the exact state and move as the model commands. All boids have
    equal parameters, no boid fails, and the medium is at rest.
    """
    return (
        senses.is_ideal(settings.sensing, dt)
        and motors_are_ideal(settings.actuation)
        and settings.breakdowns.failing_share == 0.0
        and all(one.deviation == 0.0 for one in settings.spreads)
        and is_calm(settings.medium)
    )
