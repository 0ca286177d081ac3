"""What hides a boid from another: obstacles, and the bodies of boids between them."""

from kernels.jit import jit
from kernels.polygons import is_polygon, meets_polygon
from kernels.robots.senses import Senses
from kernels.state import Corners, World
from kernels.torus import nearest_image

BEYOND = 1.0 + 1e-9
"""A factor of lengths and of their squares, by far more than their rounding."""


@jit
def obstacles_within(senses: Senses, world: World, i: int, length2: float) -> int:
    """Keep in `senses.hiding` all obstacles that can be between boid `i` and boids up
    to the square root of `length2` away, in `senses.shift` how far each is shifted, and
    return how many they are: none where obstacles do not hide. On a torus that is seen
    across its borders there are those beyond them too.
    """
    found = 0
    if senses.obstacles_hide:
        x, y = senses.place[0, i], senses.place[1, i]
        around = 1 if world.minimum_image else 0
        for m in range(world.obstacle_x.size):
            for column in range(-around, around + 1):
                for row in range(-around, around + 1):
                    off_x, off_y = column * world.width, row * world.height
                    senses.hiding[found] = m
                    senses.shift[0, found], senses.shift[1, found] = off_x, off_y
                    to_x = world.obstacle_x[m] + off_x - x
                    to_y = world.obstacle_y[m] + off_y - y
                    found += int(_is_near(world.corners, world, m, to_x, to_y, length2))
    return found


@jit
def _is_near(
    corners: Corners | None,
    world: World,
    m: int,
    to_x: float,
    to_y: float,
    length2: float,
) -> bool:
    """Whether the rectangle about obstacle `m` with its middle at (to_x, to_y) comes as
    near to 0 as the square root of `length2`. What is outside an arena is everywhere.
    """
    if corners is not None and corners.is_arena[m]:
        return True
    across = max(abs(to_x) - world.half_width[m] * BEYOND, 0.0)
    along = max(abs(to_y) - world.half_height[m] * BEYOND, 0.0)
    return bool(across * across + along * along <= length2 * BEYOND)


@jit
def is_behind_obstacle(
    senses: Senses, world: World, i: int, count: int, dx: float, dy: float
) -> bool:
    """Whether one of the first `count` obstacles of `obstacles_within` is on the way
    (dx, dy) from the middle of boid `i`.
    """
    x, y = senses.place[0, i], senses.place[1, i]
    for k in range(count):
        off = senses.shift[0, k], senses.shift[1, k]
        if _meets(world.corners, world, senses.hiding[k], off, x, y, dx, dy):
            return True
    return False


@jit
def _meets(
    corners: Corners | None,
    world: World,
    m: int,
    off: tuple[float, float],
    x: float,
    y: float,
    dx: float,
    dy: float,
) -> bool:
    """Whether the way (dx, dy) from (x, y) leads through obstacle `m` at a place that
    is `off` its own.
    """
    to_x = world.obstacle_x[m] + off[0] - x
    to_y = world.obstacle_y[m] + off[1] - y
    half_width, half_height = world.half_width[m], world.half_height[m]
    if corners is not None and is_polygon(corners, m):
        beside = _is_beside(dx, to_x, half_width) or _is_beside(dy, to_y, half_height)
        if beside and not corners.is_arena[m]:
            return False
        return meets_polygon(corners, m, x - off[0], y - off[1], dx, dy)
    if world.is_round[m]:
        return meets_disc(dx, dy, to_x, to_y, half_width)
    return meets_rectangle(dx, dy, to_x, to_y, half_width, half_height)


@jit
def _is_beside(way: float, middle: float, half: float) -> bool:
    """Whether along one axis all of a `way` from 0 is beside what reaches `half` to
    both sides of its `middle`, by more than numbers are rounded.
    """
    return abs(middle - 0.5 * way) > (0.5 * abs(way) + half) * BEYOND


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
