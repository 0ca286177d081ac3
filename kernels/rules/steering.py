"""Rules without neighbours and obstacles: wandering, and steering to a goal."""

import math

import numpy as np

from kernels.jit import jit


@jit
def wander(rng: np.random.Generator, width: float) -> tuple[float, float]:
    """Return two independent numbers, uniform in +-width: Eq. (8) of nguyen2024."""
    x = rng.uniform(-width, width)
    y = rng.uniform(-width, width)
    return x, y


@jit
def seek(
    dx: float, dy: float, vx: float, vy: float, gain: float
) -> tuple[float, float]:
    """Return the change to a velocity towards the goal: Algorithm 5 of rustamani2024.

    The target velocity is `gain` times the displacement to the goal.

    Parameters
    ----------
    dx, dy : float
        Displacement to the goal, in lengths.
    vx, vy : float
        Velocity of the boid.
    gain : float
        Target velocity per length of the displacement.
    """
    return gain * dx - vx, gain * dy - vy


@jit
def arrival(
    dx: float,
    dy: float,
    vx: float,
    vy: float,
    stop: float,
    slow: float,
    most: float,
    gain: float,
) -> tuple[float, float]:
    """Return the change to a velocity that slows down towards the goal.

    The rule is Algorithm 6 of rustamani2024. The target speed is `gain` times `most`.
    At distances below `slow`, the target speed is reduced in proportion to the
    distance. At distances below `stop`, the vector is zero, so that the boid drifts.

    Parameters
    ----------
    dx, dy : float
        Displacement to the goal, in lengths.
    vx, vy : float
        Velocity of the boid.
    stop : float
        Distance below which the rule is zero.
    slow : float
        Distance below which the target speed is reduced.
    most : float
        Maximum speed.
    gain : float
        Factor of the maximum speed.
    """
    distance = math.sqrt(dx * dx + dy * dy)
    scale = gain * most / max(distance, slow)
    far = 0.0 if distance < stop else 1.0
    return far * (scale * dx - vx), far * (scale * dy - vy)
