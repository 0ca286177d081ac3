"""The start ring: boids on a circle, at equal distances, which all fly round it.

A spec names this file under `start_draws`.
"""

import math

from numpy.random import Generator

from kernels.elementary import sine_cosine
from kernels.settings import StartSettings
from kernels.starts import Start
from kernels.state import Flock, World, empty_flock
from kernels.worlds import Reach


def draw(
    n: int,
    settings: StartSettings,
    _world: World,
    _contact: Reach,
    rng: Generator,
    _seed: int,
) -> Flock:
    """`n` boids on the circle of the settings, the first one anywhere on it."""
    flock, first = empty_flock(n), rng.uniform(0.0, math.tau)
    for i in range(n):
        angle = first + math.tau * i / n
        y, x = sine_cosine(angle)
        flock.x[i] = settings.start_center_x + settings.start_radius * x
        flock.y[i] = settings.start_center_y + settings.start_radius * y
        flock.vx[i] = -settings.start_speed * y
        flock.vy[i] = settings.start_speed * x
    return flock


SOURCE = "not stated"  # who described it, and where
STARTS = {"ring": Start(draw, "on a circle, flying round", SOURCE)}
