"""Occlusion: obstacles and bodies of boids that block a line of sight."""

from kernels.jit import jit
from kernels.polygons import is_polygon, meets_polygon
from kernels.robots.senses import Senses
from kernels.state import Corners, World
from kernels.torus import nearest_image

BEYOND = 1.0 + 1e-9
"""Factor of lengths and squared lengths, above 1 by far more than rounding errors."""


@jit
def obstacles_within(senses: Senses, world: World, i: int, length2: float) -> int:
    """Keep the obstacles that can hide boids from a boid, and return the number.

    The function writes obstacles into `senses.hiding`, and shifts into `senses.shift`.
    The number is 0 if obstacles do not hide boids. In a periodic world in which boids
    see across the borders, the obstacles beyond the borders are included.

    Parameters
    ----------
    senses : Senses
        Sensing model of the flock; the memory for obstacles changes.
    world : World
    i : int
        Index of the boid that looks.
    length2 : float
        Square of the distance up to which boids are tested.
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
    """Return whether the distance of an obstacle from 0 is at most sqrt(`length2`).

    The obstacle is represented by a rectangle with the centre (to_x, to_y). The outside
    of an arena is always near.
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
    """Return whether an obstacle of `obstacles_within` blocks a line of sight.

    Parameters
    ----------
    senses : Senses
        Sensing model of the flock.
    world : World
    i : int
        Index of the boid that looks, at the beginning of the line.
    count : int
        Number of obstacles.
    dx, dy : float
        Displacement along the line, in lengths.
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
    """Return whether the line (dx, dy) from (x, y) crosses a shifted obstacle.

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
    """Return whether a line passes beside an extent, along one axis.

    The line begins at 0, and the extent is `middle` +- `half`. The distance must be
    larger than rounding errors.
    """
    return abs(middle - 0.5 * way) > (0.5 * abs(way) + half) * BEYOND


@jit
def bodies_within(senses: Senses, world: World, i: int, length2: float) -> int:
    """Keep the bodies that can hide boids from a boid, and return the number.

    The function writes the displacements to the bodies into `senses.bodies`. The number
    is 0 if bodies do not hide boids.

    Parameters
    ----------
    senses : Senses
        Sensing model of the flock; the memory for bodies changes.
    world : World
    i : int
        Index of the boid that looks.
    length2 : float
        Square of the distance up to which boids are tested.
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

    The centre of a blocking body is beside the line of sight, at a distance below
    body_radius. The centres at the two ends of the line do not count: there `along` is
    0 and `length2`.

    Parameters
    ----------
    senses : Senses
        Sensing model of the flock.
    count : int
        Number of bodies.
    dx, dy : float
        Displacement from the boid that looks to the second boid, in lengths.
    """
    length2 = dx * dx + dy * dy
    bound = senses.body_radius * senses.body_radius * length2
    hidden = False
    for m in range(count):  # no early exit, so that several bodies are tested at once
        to_x, to_y = senses.bodies[0, m], senses.bodies[1, m]
        along = to_x * dx + to_y * dy
        across = to_x * dy - to_y * dx
        hidden |= (along > 0.0) & (along < length2) & (across * across < bound)
    return hidden


@jit
def way_between(senses: Senses, world: World, i: int, j: int) -> tuple[float, float]:
    """Return the displacement from boid `i` to boid `j` at the last sample.

    Parameters
    ----------
    senses : Senses
        Sensing model of the flock.
    world : World
        World; with `minimum_image` the displacement may cross borders.
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
    """Return whether a line from 0 has a distance below `radius` from (x, y).

    Parameters
    ----------
    dx, dy : float
        Displacement along the line, in lengths.
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
    """Return whether a line from 0 crosses the interior of a rectangle.

    The result is true if some part of the line, from 0 to 1, is between the two sides
    along each axis. The method is by Liang and Barsky (1984), A new concept and method
    for line clipping, ACM Transactions on Graphics 3, 1-22.

    Parameters
    ----------
    dx, dy : float
        Displacement along the line, in lengths.
    x, y : float
        Centre of the rectangle, in lengths.
    half_width, half_height : float
        Half of the sides, in lengths.
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
