"""Headings of boids that all have one speed, and noise of them."""

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
    """The sum of the velocities of boid `i` and its `found` neighbours, and how many
    these are together.

    Of boids with one speed its direction is the average heading of Eq. (2) of Vicsek et
    al. (1995), the arctangent of the mean sine over the mean cosine.
    """
    return velocity_sum_from(seen.vx[i], seen.vy[i], seen, near, found)


@jit
def velocity_sum_from(
    vx: float, vy: float, seen: Flock, near: Near, found: int
) -> tuple[float, float, float]:
    """`velocity_sum` of a boid whose own velocity is (vx, vy), and not the one seen."""
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
    """The unit vector along (x, y); along the other vector where (x, y) is zero, and
    zero where both are.
    """
    along = x != 0.0 or y != 0.0
    x, y = x if along else other_x, y if along else other_y
    length = math.sqrt(x * x + y * y)
    scale = 1.0 / length if length > 0.0 else 0.0
    return x * scale, y * scale


@jit
def random_turn(rng: Generator, width: float) -> tuple[float, float]:
    """Cosine and sine of an angle that is uniform within +- width / 2, for a width from
    0 to 2 pi radians: the noise of Eq. (2) of Vicsek et al. (1995).
    """
    return cosine_sine(rng.uniform(-0.5 * width, 0.5 * width))


@jit
def turned(x: float, y: float, cosine: float, sine: float) -> tuple[float, float]:
    """The vector (x, y), turned by the angle of which these are cosine and sine."""
    return cosine * x - sine * y, sine * x + cosine * y


@jit
def turned_towards(
    x: float, y: float, to_x: float, to_y: float, cosine: float, sine: float
) -> tuple[float, float]:
    """The unit vector (x, y), turned towards another one by at most the angle from 0 to
    pi of which these are cosine and sine. To the opposite it turns left.
    """
    reached = x * to_x + y * to_y >= cosine
    way = sine if x * to_y - y * to_x >= 0.0 else -sine
    new_x, new_y = turned(x, y, cosine, way)
    new_x = to_x if reached else new_x
    new_y = to_y if reached else new_y
    return new_x, new_y
