"""Limits of the actuators of boids, robot by robot."""

import math
from typing import NamedTuple

import numpy as np

from kernels.chance import ChanceKey, normals
from kernels.elementary import cos, exp, sin
from kernels.jit import jit
from kernels.robots.purposes import FACTOR
from kernels.settings import Actuation
from kernels.state import Floats


class Motors(NamedTuple):
    """Actuators of N boids for steps of equal length.

    Attributes
    ----------
    wheels : bool
        Whether boids move only along their heading.
    changes, turns : bool
        Whether the change of the velocity and the turn of the heading have limits.
    noise : float
        Standard deviation of the noise of a step, of each component of the velocity.
    kept : array of float, shape (N,)
        Fraction of the difference from the commanded velocity that remains after a
        step.
    change : array of float, shape (N,)
        Maximum change of the velocity in a step.
    cosine, sine : array of float, shape (N,)
        Cosine and sine of the maximum turn of the heading in a step.
    least, most : array of float, shape (N,)
        Limits of the speed.
    """

    wheels: bool
    changes: bool
    turns: bool
    noise: float
    kept: Floats
    change: Floats
    cosine: Floats
    sine: Floats
    least: Floats
    most: Floats


def motors_are_ideal(settings: Actuation) -> bool:
    """Return whether boids have exactly the velocities that the model commands."""
    return (
        settings.motor_lag == 0.0
        and settings.motor_acceleration == math.inf
        and settings.motor_turn_rate == math.inf
        and settings.motor_min_speed == 0.0
        and settings.motor_max_speed == math.inf
        and settings.motor_noise == 0.0
        and not settings.wheels
    )


def build_motors(
    settings: Actuation, some_fail: bool, key: ChanceKey, n: int, dt: float
) -> Motors | None:
    """Return the actuators of a flock, None if all boids move as the model commands.

    With None, kernels are compiled without actuation. With motor_spread s, each robot
    has four random factors exp(s z), with standard normal numbers z. The factors apply
    to the lag, to the acceleration, to the turn rate, and to the two limits of the
    speed.

    Parameters
    ----------
    settings : Actuation
        Lag, limits, noise and spread of the actuators.
    some_fail : bool
        Whether any boids stop or drift.
    key : ChanceKey
        Key of the random factors.
    n : int
        Number of boids.
    dt : float
        Time of a step.
    """
    if motors_are_ideal(settings) and not some_fail:
        return None
    lags, changes, turns, speeds = _factors(settings.motor_spread, key, n)
    angles = np.minimum(
        np.radians(settings.motor_turn_rate) * dt * turns, math.pi
    ).tolist()
    lag = settings.motor_lag
    return Motors(
        wheels=settings.wheels,
        changes=settings.motor_acceleration < math.inf,
        turns=settings.motor_turn_rate < math.inf,
        noise=settings.motor_noise * math.sqrt(dt),
        kept=np.array(
            [exp(-dt / (lag * one)) if lag > 0.0 else 0.0 for one in lags.tolist()]
        ),
        change=settings.motor_acceleration * dt * changes,
        cosine=np.array([cos(one) for one in angles]),
        sine=np.array([sin(one) for one in angles]),
        least=settings.motor_min_speed * speeds,
        most=settings.motor_max_speed * speeds,
    )


def _factors(spread: float, key: ChanceKey, n: int) -> Floats:
    """Return four factors per robot, (4, N)."""
    factors = np.ones((4, n))
    if spread > 0.0:
        _draw(key, spread, factors)
    return factors


@jit
def _draw(key: ChanceKey, spread: float, factors: Floats) -> None:
    """Draw factors, each from the key, the spread and the index of a robot alone."""
    for i in range(factors.shape[1]):
        for k in range(0, 4, 2):
            one, other = normals(key, i, k, 0, FACTOR)
            factors[k, i], factors[k + 1, i] = (
                exp(spread * one),
                exp(spread * other),
            )
