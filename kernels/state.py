"""The values that enter kernels. Arrays hold one entry a boid, in index order, unless
their shape says otherwise.
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
LINE = 64
"""The bytes that a processor's cache loads together."""


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


class Corners(NamedTuple):
    """The vertices of the polygons among M obstacles: those of obstacle m are `x` and
    `y` from `first[m]` to `first[m + 1]`, none where it is a disc or a rectangle.

    A polygon is solid inside, or outside where `is_arena` (M,).
    """

    x: Floats
    y: Floats
    first: Kinds
    is_arena: NDArray[np.bool_]


class World(NamedTuple):
    """The rectangle from (0, 0) to (width, height), and M obstacles in arrays of shape
    (M,).

    A round obstacle is a disc of radius `half_width`; the others are rectangles, or
    polygons with such a rectangle about them. `corners` are None where there is no
    polygon: then kernels are compiled without any of them. `borders` is OPEN, TORUS or
    BOUNDED. The goal is a place that boids may be drawn to, and by which arrivals are
    measured.
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
    """A flock of `n` boids at the origin, at rest."""
    return Flock(*(np.zeros(n) for _ in Flock._fields))


def is_large(n: int) -> bool:
    """Whether `n` boids are more than the caches near a processor hold."""
    return n > LARGE_FLOCK


def laid_out(flock: Flock) -> Flock:
    """The same flock as kernels read it fastest.

    Of a small flock each field is an array of its own. In a large one the neighbours of
    a boid lie far apart in memory, and what is looked up of each of them is the time of
    a search: so place and velocity of a boid stand together, in half a line of the
    processor's cache, and the fields are views of that.
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
    """Zeros that begin with a line of the processor's cache."""
    size = math.prod(shape) * np.dtype(kind).itemsize
    room = np.zeros(size + LINE, np.uint8)
    first = -room.ctypes.data % LINE
    made: NDArray[Any] = room[first : first + size].view(kind).reshape(shape)
    return made


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
