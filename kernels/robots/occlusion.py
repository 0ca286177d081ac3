"""What hides a boid from another: obstacles, and the bodies of boids between them."""

from kernels.jit import jit
from kernels.robots.senses import Senses
from kernels.state import World
from kernels.torus import nearest_image

BEYOND = 1.0 + 1e-9
"""A factor of squared lengths, by far more than their rounding."""


@jit
def is_behind_obstacle(
    senses: Senses, world: World, i: int, dx: float, dy: float
) -> bool:
    """Whether an obstacle that hides is on the way (dx, dy) from the middle of boid
    `i`.
    """
    x, y = senses.place[0, i], senses.place[1, i]
    return senses.obstacles_hide and _is_behind_obstacle(world, x, y, dx, dy)


@jit
def _is_behind_obstacle(world: World, x: float, y: float, dx: float, dy: float) -> bool:
    """Whether the way (dx, dy) from (x, y) leads through an obstacle; on a torus that
    is seen across its borders, through one of those beyond them too.
    """
    around = 1 if world.minimum_image else 0
    for m in range(world.obstacle_x.size):
        for column in range(-around, around + 1):
            for row in range(-around, around + 1):
                to_x = world.obstacle_x[m] + column * world.width - x
                to_y = world.obstacle_y[m] + row * world.height - y
                if world.is_round[m]:
                    crossed = meets_disc(dx, dy, to_x, to_y, world.half_width[m])
                else:
                    crossed = meets_rectangle(
                        dx, dy, to_x, to_y, world.half_width[m], world.half_height[m]
                    )
                if crossed:
                    return True
    return False


@jit
def bodies_within(senses: Senses, world: World, i: int, length2: float) -> int:
    """Keep in `senses.bodies` the ways from boid `i` to all bodies that can be between
    it and boids up to the square root of `length2` away, and return how many they are.
    They can be so none where bodies do not hide.
    """
    found = 0
    if senses.boids_hide:
        radius2 = senses.body_radius * senses.body_radius
        reach2 = (length2 + radius2) * BEYOND
        for m in range(senses.place.shape[1]):
            to_x, to_y = way_between(senses, world, i, m)
            senses.bodies[0, found], senses.bodies[1, found] = to_x, to_y
            found += int(to_x * to_x + to_y * to_y <= reach2)
    return found


@jit
def is_behind_body(senses: Senses, count: int, dx: float, dy: float) -> bool:
    """Whether one of the first `count` bodies of `bodies_within` is between their boid
    and the one at the end of the way (dx, dy): its middle is beside the way, and nearer
    to it than body_radius.

    Both ends are no middles beside the way: there `along` is 0 and `length2`.
    """
    length2 = dx * dx + dy * dy
    bound = senses.body_radius * senses.body_radius * length2
    hidden = False
    for m in range(count):  # without a way out, it looks at several bodies at once
        to_x, to_y = senses.bodies[0, m], senses.bodies[1, m]
        along = to_x * dx + to_y * dy
        across = to_x * dy - to_y * dx
        hidden |= (along > 0.0) & (along < length2) & (across * across < bound)
    return hidden


@jit
def way_between(senses: Senses, world: World, i: int, j: int) -> tuple[float, float]:
    """The way from boid `i` to boid `j`, by where both were at the last sample."""
    dx = senses.place[0, j] - senses.place[0, i]
    dy = senses.place[1, j] - senses.place[1, i]
    if world.minimum_image:
        dx, dy = nearest_image(dx, world.width), nearest_image(dy, world.height)
    return dx, dy


@jit
def meets_disc(dx: float, dy: float, x: float, y: float, radius: float) -> bool:
    """Whether the way (dx, dy) from 0 comes nearer than `radius` to (x, y)."""
    length2 = dx * dx + dy * dy
    share = (x * dx + y * dy) / length2 if length2 > 0.0 else 0.0
    share = min(max(share, 0.0), 1.0)
    off_x, off_y = x - share * dx, y - share * dy
    return off_x * off_x + off_y * off_y < radius * radius


@jit
def meets_rectangle(
    dx: float, dy: float, x: float, y: float, half_width: float, half_height: float
) -> bool:
    """Whether the way (dx, dy) from 0 leads through the inside of the rectangle about
    (x, y): whether there are parts of it, from 0 to 1, that are between both pairs of
    its sides (Liang and Barsky 1984, A new concept and method for line clipping, ACM
    Transactions on Graphics 3, 1-22).
    """
    first, last = 0.0, 1.0
    for d, middle, half in ((dx, x, half_width), (dy, y, half_height)):
        if d == 0.0:
            if abs(middle) >= half:
                return False
        else:
            one, other = (middle - half) / d, (middle + half) / d
            first, last = max(first, min(one, other)), min(last, max(one, other))
    return first < last if dx != 0.0 or dy != 0.0 else True
