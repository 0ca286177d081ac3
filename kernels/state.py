"""The values that enter kernels. Arrays hold one entry a boid, in index order, unless
their shape says otherwise.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.jit import jit

Floats = NDArray[np.float64]
Indices = NDArray[np.uint32]
Kinds = NDArray[np.int64]


class Flock(NamedTuple):
    """Positions and velocities of N boids, and the velocities one step earlier; six
    arrays of shape (N,).
    """

    x: Floats
    y: Floats
    vx: Floats
    vy: Floats
    previous_vx: Floats
    previous_vy: Floats


class World(NamedTuple):
    """The rectangle from (0, 0) to (width, height), and M obstacles in arrays of shape
    (M,).

    A round obstacle is a disc of radius `half_width`; the others are rectangles.
    `borders` is OPEN, TORUS or BOUNDED. The goal is a place that boids may be drawn to,
    and by which arrivals are measured.
    """

    width: float
    height: float
    borders: int
    minimum_image: bool
    obstacle_x: Floats
    obstacle_y: Floats
    half_width: Floats
    half_height: Floats
    is_round: NDArray[np.bool_]
    goal_x: float
    goal_y: float


def empty_flock(n: int) -> Flock:
    """A flock of `n` boids at the origin, at rest."""
    return Flock(*(np.zeros(n) for _ in Flock._fields))


@jit
def remember(flock: Flock, seen: Flock) -> None:
    """Before a step, keep the velocities of `flock`, and its whole state in `seen`
    where that is another flock.

    A sequential update sees the flock itself; a synchronous one sees the copy made
    here.
    """
    for i in range(flock.x.size):
        flock.previous_vx[i] = flock.vx[i]
        flock.previous_vy[i] = flock.vy[i]
        seen.x[i] = flock.x[i]
        seen.y[i] = flock.y[i]
        seen.vx[i] = flock.vx[i]
        seen.vy[i] = flock.vy[i]
