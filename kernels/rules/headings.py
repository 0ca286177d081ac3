"""Headings of boids of equal speed, and noise of headings."""

import math

from numpy.random import Generator

from kernels.angles import cosine_sine
from kernels.jit import jit
from kernels.near import Near
from kernels.state import Flock


@jit
def velocity_sum(
    seen: Flock, i: int, near: Near, found: int
) -> tuple[float, float, float]:
    """Return the sum of the velocities of a boid and its neighbours, and the count.

    For boids of equal speed, the direction of the sum is the average heading of Eq. (2)
    of Vicsek et al. (1995): the arctangent of the mean sine over the mean cosine.

    Parameters
    ----------
    seen : Flock
        Flock as boids perceive it.
    i : int
        Index of the boid.
    near : Near
        Neighbours of the boid.
    found : int
        Number of neighbours, which are the first entries of `near`.

    Returns
    -------
    x, y : float
        Sum of the velocities.
    count : float
        Number of boids in the sum, `found` + 1.
    """
    return velocity_sum_from(seen.vx[i], seen.vy[i], seen, near, found)


@jit
def velocity_sum_from(
    vx: float, vy: float, seen: Flock, near: Near, found: int
) -> tuple[float, float, float]:
    """Return `velocity_sum` for a boid with a given velocity.

    Parameters
    ----------
    vx, vy : float
        Velocity of the boid, in place of the velocity in `seen`.
    seen : Flock
        Flock as boids perceive it.
    near : Near
        Neighbours of the boid.
    found : int
        Number of neighbours, which are the first entries of `near`.

    Returns
    -------
    x, y, count : float
        As `velocity_sum`.
    """
    x, y, count = vx, vy, 1.0
    for k in range(found):
        x += seen.vx[near.boid[k]]
        y += seen.vy[near.boid[k]]
        count += 1.0
    return x, y, count


@jit
def direction(
    x: float, y: float, other_x: float, other_y: float
) -> tuple[float, float]:
    """Return the unit vector along a vector.

    Parameters
    ----------
    x, y : float
        Vector.
    other_x, other_y : float
        Vector that is used if (x, y) is zero.

    Returns
    -------
    x, y : float
        Unit vector; zero if the two vectors are zero.
    """
    along = x != 0.0 or y != 0.0
    x, y = x if along else other_x, y if along else other_y
    length = math.sqrt(x * x + y * y)
    scale = 1.0 / length if length > 0.0 else 0.0
    return x * scale, y * scale


@jit
def random_turn(rng: Generator, width: float) -> tuple[float, float]:
    """Return cosine and sine of an angle with uniform distribution in +- width / 2.

    The `width` is from 0 to 2 pi radians. The angle is the noise of Eq. (2) of Vicsek
    et al. (1995).
    """
    return cosine_sine(rng.uniform(-0.5 * width, 0.5 * width))


@jit
def turned(x: float, y: float, cosine: float, sine: float) -> tuple[float, float]:
    """Return the vector (x, y), rotated by an angle.

    Parameters
    ----------
    x, y : float
        Vector.
    cosine, sine : float
        Cosine and sine of the angle, which is positive from x towards y.
    """
    return cosine * x - sine * y, sine * x + cosine * y


@jit
def turned_towards(
    x: float, y: float, to_x: float, to_y: float, cosine: float, sine: float
) -> tuple[float, float]:
    """Return a unit vector, rotated towards a target by at most a given angle.

    If the target is the opposite vector, the angle is positive, from x towards y.

    Parameters
    ----------
    x, y : float
        Unit vector.
    to_x, to_y : float
        Unit vector of the target.
    cosine, sine : float
        Cosine and sine of the largest angle, which is from 0 to pi.
    """
    reached = x * to_x + y * to_y >= cosine
    way = sine if x * to_y - y * to_x >= 0.0 else -sine
    new_x, new_y = turned(x, y, cosine, way)
    new_x = to_x if reached else new_x
    new_y = to_y if reached else new_y
    return new_x, new_y
