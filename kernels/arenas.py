"""Arenas for small robots, in metres.

Each function returns obstacles in the format of `kernels.worlds`. MAPS of that module
has these functions.
"""

import numpy as np
from numpy.typing import NDArray

from kernels.settings import WorldSettings

Obstacles = NDArray[np.float64]

HALF = 0.1
"""Half of the thickness of a wall."""


def arena(_settings: WorldSettings, _rng: np.random.Generator) -> Obstacles:
    """Return no obstacles.

    Robots with an occupancy grid detect the border through the grid.
    """
    return np.empty((0, 5))


def arena_two_obstacles(
    _settings: WorldSettings, _rng: np.random.Generator
) -> Obstacles:
    """Return a disc and a box, both on the diagonal from (1, 1) to (9, 9)."""
    return np.array([[3.5, 3.5, 0.8, 0.8, 1.0], [6.5, 6.3, 0.9, 0.6, 0.0]])


def maze(_settings: WorldSettings, _rng: np.random.Generator) -> Obstacles:
    """Return walls that alternately block the path from (1, 1) to (9, 9).

    The passages are 0.9 to 1.8 m wide.
    """
    outer = [_level(0.0, 10.0, HALF), _level(0.0, 10.0, 10.0 - HALF)]
    outer += [_upright(HALF, 0.0, 10.0), _upright(10.0 - HALF, 0.0, 10.0)]
    level = [_level(0.2, 4.4, 4.6), _level(3.1, 7.3, 7.0), _level(7.1, 9.8, 3.2)]
    upright = [
        _upright(2.7, 0.2, 3.2),
        _upright(5.7, 1.5, 5.7),
        _upright(8.3, 4.4, 8.0),
        _upright(1.6, 5.9, 8.7),
    ]
    return np.array([*outer, *level, *upright])


def _level(left: float, right: float, y: float) -> list[float]:
    """Return a wall along x as a row of obstacles."""
    return [0.5 * (left + right), y, 0.5 * (right - left), HALF, 0.0]


def _upright(x: float, low: float, high: float) -> list[float]:
    """Return a wall along y as a row of obstacles."""
    return [x, 0.5 * (low + high), HALF, 0.5 * (high - low), 0.0]
