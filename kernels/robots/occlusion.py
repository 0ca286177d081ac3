"""Occlusion: obstacles and bodies of boids that hide a boid from another."""

from kernels.jit import jit
from kernels.polygons import is_polygon, meets_polygon
from kernels.robots.senses import Senses
from kernels.state import Corners, World
from kernels.torus import nearest_image

BEYOND = 1.0 + 1e-9
"""Factor of lengths and of their squares, above 1 by far more than their rounding."""


@jit
def obstacles_within(senses: Senses, world: World, i: int, length2: float) -> int:
    """Keep the obstacles that can hide boids from a boid, and return their number.

    They are written into `senses.hiding`, and their shifts into `senses.shift`. There
    are none where obstacles do not hide. In a periodic world in which boids see across
    the borders, the obstacles beyond the borders are included.

    Parameters
    ----------
    senses : Senses
        Senses of the flock; its room for obstacles changes.
    world : World
    i : int
        Index of the boid that looks.
    length2 : float
        Square of the distance up to which other boids matter.
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
    """Return whether an obstacle comes as near to 0 as the square root of `length2`.

    The obstacle is represented by its rectangle, with the middle at (to_x, to_y). The
    outside of an arena is everywhere.
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
    """Return whether an obstacle of `obstacles_within` is on the way from a boid.

    Parameters
    ----------
    senses : Senses
        Senses of the flock.
    world : World
    i : int
        Index of the boid that looks, at the beginning of the way.
    count : int
        Number of obstacles.
    dx, dy : float
        Way from the boid, in lengths.
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
    """Return whether the way (dx, dy) from (x, y) leads through a shifted obstacle.

    The obstacle `m` is shifted by `off`.
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
    """Return whether a way passes beside an extent, along one axis.

    The way begins at 0, and the extent reaches `half` to both sides of its `middle`.
    The distance must be larger than rounding.
    """
    return abs(middle - 0.5 * way) > (0.5 * abs(way) + half) * BEYOND


@jit
def bodies_within(senses: Senses, world: World, i: int, length2: float) -> int:
    """Keep the bodies that can hide boids from a boid, and return their number.

    The ways to them are written into `senses.bodies`. There are none where bodies do
    not hide.

    Parameters
    ----------
    senses : Senses
        Senses of the flock; its room for bodies changes.
    world : World
    i : int
        Index of the boid that looks.
    length2 : float
        Square of the distance up to which other boids matter.
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
    """Return whether a body of `bodies_within` is between two boids.

    The middle of such a body is beside the way, and nearer to it than body_radius. The
    middles at both ends of the way are not beside it: there `along` is 0 and `length2`.

    Parameters
    ----------
    senses : Senses
        Senses of the flock.
    count : int
        Number of bodies.
    dx, dy : float
        Way from the boid that looks to the other one, in lengths.
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
    """Return the way from boid `i` to boid `j` at the last sample.

    Parameters
    ----------
    senses : Senses
        Senses of the flock.
    world : World
        With `minimum_image` the way may cross its borders.
    i, j : int
        Indices of the boids.
    """
    dx = senses.place[0, j] - senses.place[0, i]
    dy = senses.place[1, j] - senses.place[1, i]
    if world.minimum_image:
        dx, dy = nearest_image(dx, world.width), nearest_image(dy, world.height)
    return dx, dy


@jit
def meets_disc(dx: float, dy: float, x: float, y: float, radius: float) -> bool:
    """Return whether a way from 0 comes nearer than `radius` to (x, y).

    Parameters
    ----------
    dx, dy : float
        Way, in lengths.
    x, y : float
        Centre of the disc, in lengths.
    radius : float
        Radius of the disc.
    """
    length2 = dx * dx + dy * dy
    share = (x * dx + y * dy) / length2 if length2 > 0.0 else 0.0
    share = min(max(share, 0.0), 1.0)
    off_x, off_y = x - share * dx, y - share * dy
    return off_x * off_x + off_y * off_y < radius * radius


@jit
def meets_rectangle(
    dx: float, dy: float, x: float, y: float, half_width: float, half_height: float
) -> bool:
    """Return whether a way from 0 leads through the inside of a rectangle.

    It does if a part of the way, from 0 to 1, is between both pairs of sides (Liang and
    Barsky 1984, A new concept and method for line clipping, ACM Transactions on
    Graphics 3, 1-22).

    Parameters
    ----------
    dx, dy : float
        Way, in lengths.
    x, y : float
        Centre of the rectangle, in lengths.
    half_width, half_height : float
        Half of its sides, in lengths.
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
