"""What hides a boid from another: obstacles, and the bodies of boids between them."""

from kernels.jit import jit
from kernels.polygons import is_polygon, meets_polygon
from kernels.robots.senses import Senses
from kernels.state import Corners, World
from kernels.torus import nearest_image


@jit
def is_hidden(
    senses: Senses, world: World, i: int, j: int, dx: float, dy: float
) -> bool:
    """Whether something is on the way (dx, dy) from boid `i` to `j`, from middle to
    middle.
    """
    x, y = senses.place[0, i], senses.place[1, i]
    if senses.obstacles_hide and _is_behind_obstacle(world, x, y, dx, dy):
        return True
    return senses.boids_hide and _is_behind_boid(senses, world, i, j, dx, dy)


@jit
def _is_behind_obstacle(world: World, x: float, y: float, dx: float, dy: float) -> bool:
    """Whether the way (dx, dy) from (x, y) leads through an obstacle; on a torus that
    is seen across its borders, through one of those beyond them too.
    """
    around = 1 if world.minimum_image else 0
    for m in range(world.obstacle_x.size):
        for column in range(-around, around + 1):
            for row in range(-around, around + 1):
                off = column * world.width, row * world.height
                if _meets(world.corners, world, m, off, x, y, dx, dy):
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
    if corners is not None and is_polygon(corners, m):
        return meets_polygon(corners, m, x - off[0], y - off[1], dx, dy)
    to_x = world.obstacle_x[m] + off[0] - x
    to_y = world.obstacle_y[m] + off[1] - y
    if world.is_round[m]:
        return meets_disc(dx, dy, to_x, to_y, world.half_width[m])
    return meets_rectangle(
        dx, dy, to_x, to_y, world.half_width[m], world.half_height[m]
    )


@jit
def _is_behind_boid(
    senses: Senses, world: World, i: int, j: int, dx: float, dy: float
) -> bool:
    """Whether the body of a third boid is between `i` and `j`: its middle is beside the
    way, and nearer to it than body_radius.
    """
    length2 = dx * dx + dy * dy
    for m in range(senses.place.shape[1]):
        to_x = senses.place[0, m] - senses.place[0, i]
        to_y = senses.place[1, m] - senses.place[1, i]
        if world.minimum_image:
            to_x = nearest_image(to_x, world.width)
            to_y = nearest_image(to_y, world.height)
        along = to_x * dx + to_y * dy
        across = to_x * dy - to_y * dx
        beside = (along > 0.0) & (along < length2)
        bound = senses.body_radius * senses.body_radius * length2
        if beside & (across * across < bound) & (m != i) & (m != j):
            return True
    return False


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
