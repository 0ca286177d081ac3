"""Rules that need neither neighbours nor obstacles:
wandering, and the way to a goal.
"""

import math

import numpy as np

from kernels.jit import jit


@jit
def wander(rng: np.random.Generator, width: float) -> tuple[float, float]:
    """Two independent components, uniform within +-width: Eq. (8) of nguyen2024."""
    x = rng.uniform(-width, width)
    y = rng.uniform(-width, width)
    return x, y


@jit
def seek(
    dx: float, dy: float, vx: float, vy: float, gain: float
) -> tuple[float, float]:
    """From the velocity to the one that is `gain` times the way (dx, dy) to the goal:
    Algorithm 5 of rustamani2024.
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
    """From the velocity to the one that takes a boid along (dx, dy) to its goal:
    Algorithm 6 of rustamani2024.

    The wanted speed is `gain` times `most`; nearer than `slow` it falls in proportion
    to the distance. Nearer than `stop` the vector is zero, so the boid drifts.
    """
    distance = math.sqrt(dx * dx + dy * dy)
    scale = gain * most / max(distance, slow)
    far = 0.0 if distance < stop else 1.0
    return far * (scale * dx - vx), far * (scale * dy - vy)
