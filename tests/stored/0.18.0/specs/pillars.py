"""The map pillars: discs in a square grid, as many as `n_obstacles` has room for.

A spec names this file under `map`.
"""

import math

import numpy as np
from numpy.typing import NDArray

from kernels.settings import WorldSettings
from kernels.worlds import Map


def draw(settings: WorldSettings, _rng: np.random.Generator) -> NDArray[np.float64]:
    """Obstacles, shape (M, 5): x, y, half width, half height, and 1 for a disc.

    A rectangle has 0 there. A disc's half width is its radius.
    """
    side = math.isqrt(settings.n_obstacles)
    places = (np.arange(side) + 0.5) / max(side, 1)
    x, y = np.meshgrid(places * settings.width, places * settings.height)
    radius = np.full(side * side, settings.obstacle_radius)
    return np.column_stack([x.ravel(), y.ravel(), radius, radius, np.ones(side * side)])


SOURCE = "not stated"  # who described it, and where
MAPS = {"pillars": Map(draw, "discs in a square grid", SOURCE)}
