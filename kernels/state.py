"""Inputs of kernels: the flock and the world.

Arrays hold one entry per boid, in index order, unless the shape is stated.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.jit import jit

Floats = NDArray[np.float64]
Indices = NDArray[np.uint32]
Kinds = NDArray[np.int64]

LARGE_FLOCK = 4096
"""Largest number of boids that fit into the caches near a processor."""
LINE = 64
"""Bytes of one line of the processor cache."""


class Flock(NamedTuple):
    """Positions and velocities of N boids: six arrays of shape (N,).

    `previous_vx` and `previous_vy` are the velocities one step earlier.
    """

    x: Floats
    y: Floats
    vx: Floats
    vy: Floats
    previous_vx: Floats
    previous_vy: Floats


class Corners(NamedTuple):
    """Vertices of the polygons among M obstacles.

    The vertices of obstacle m are `x` and `y` from `first[m]` to `first[m + 1]`. A disc
    or a rectangle has no vertices. `first` has the shape (M + 1,).

    A polygon is solid inside; outside if `is_arena` (M,) is True.
    """

    x: Floats
    y: Floats
    first: Kinds
    is_arena: NDArray[np.bool_]


class World(NamedTuple):
    """Rectangle from (0, 0) to (width, height) with M obstacles.

    Arrays of obstacles have the shape (M,). A round obstacle is a disc of radius
    `half_width`. The remaining obstacles are rectangles, or polygons with an enclosing
    rectangle. `corners` is None without polygons. With None kernels are compiled
    without polygons.

    `borders` is OPEN, TORUS or BOUNDED. With `minimum_image` boids perceive boids
    across the borders of a torus. The goal is a point that may attract boids, and the
    reference of arrivals.
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
    corners: Corners | None = None


def empty_flock(n: int) -> Flock:
    """Return a flock of `n` boids at the origin, at rest."""
    return Flock(*(np.zeros(n) for _ in Flock._fields))


def is_large(n: int) -> bool:
    """Return whether `n` boids exceed the caches near a processor."""
    return n > LARGE_FLOCK


def laid_out(flock: Flock) -> Flock:
    """Return the flock in the memory layout that kernels read fastest.

    A small flock has a separate array per field and is returned unchanged. In a large
    flock the neighbours of a boid are far apart in memory, and loading the neighbours
    dominates the time of a search. So the copy stores position and velocity of a boid
    together, in half a line of the cache. The fields of the copy are views of this
    storage.
    """
    n = flock.x.size
    if not is_large(n):
        return flock
    now, before = aligned((n, 4), np.float64), aligned((n, 2), np.float64)
    made = Flock(*now.T, *before.T)
    for mine, given in zip(made, flock, strict=True):
        mine[:] = given
    return made


def aligned(shape: tuple[int, int], kind: Any) -> NDArray[Any]:
    """Return an array of zeros that begins at a line of the processor cache."""
    size = math.prod(shape) * np.dtype(kind).itemsize
    room = np.zeros(size + LINE, np.uint8)
    first = -room.ctypes.data % LINE
    made: NDArray[Any] = room[first : first + size].view(kind).reshape(shape)
    return made


@jit
def remember(flock: Flock, seen: Flock) -> None:
    """Copy the velocities of a flock before a step, and the flock into `seen`.

    A sequential update passes the flock itself as `seen`. A synchronous update passes a
    second flock, which then holds the copy.
    """
    for i in range(flock.x.size):
        flock.previous_vx[i] = flock.vx[i]
        flock.previous_vy[i] = flock.vy[i]
        seen.x[i] = flock.x[i]
        seen.y[i] = flock.y[i]
        seen.vx[i] = flock.vx[i]
        seen.vy[i] = flock.vy[i]
