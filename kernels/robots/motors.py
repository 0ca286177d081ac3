"""What limits the motors of boids, robot by robot."""

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
    """The motors of N boids for steps of one length; arrays are (N,).

    `kept` is the part of the difference from the wanted velocity that is left after a
    step, `change` the most that a velocity changes in it, `cosine` and `sine` are those
    of the most that a heading turns in it, `least` and `most` the limits of the speed.
    `changes` and `turns` say whether there are such limits. `noise` is the standard
    deviation of what a step adds to each component.
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
    """Whether boids get the velocities that their model wants."""
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
    """The motors of `n` boids, for steps of length `dt`; `some_fail` says that some
    boids stop or drift. None where all move as their model wants: then kernels are
    compiled without any of this.

    With motor_spread s each robot has factors exp(s z) of its own, with standard normal
    numbers z, of its lag, its acceleration, its turn rate and both limits of its speed.
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
    """Four factors of each robot, (4, N)."""
    factors = np.ones((4, n))
    if spread > 0.0:
        _draw(key, spread, factors)
    return factors


@jit
def _draw(key: ChanceKey, spread: float, factors: Floats) -> None:
    """Factors that depend on nothing but the spread and the index of a robot."""
    for i in range(factors.shape[1]):
        for k in range(0, 4, 2):
            one, other = normals(key, i, k, 0, FACTOR)
            factors[k, i], factors[k + 1, i] = (
                exp(spread * one),
                exp(spread * other),
            )
