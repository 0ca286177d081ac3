"""Repulsion by obstacles and walls."""

import math

from kernels.arbitration import TINY
from kernels.jit import jit
from kernels.polygons import from_border, is_polygon
from kernels.state import Corners, World
from kernels.worlds import Reach, reach_cell


@jit
def away_from(world: World, m: int, x: float, y: float) -> tuple[float, float, float]:
    """Return the vector from an obstacle to a position, and the surface distance.

    For a disc, the vector begins at the centre, and the distance is the radius. For a
    rectangle, the vector begins at the centre, and the distance is the larger
    half-width. For a polygon, the vector begins at the nearest point of the border, and
    the distance is 0. Within a polygon, the vector is mirrored and leads out, and the
    distance is infinite. So a polygon repels at any depth, as a disc does.

    Parameters
    ----------
    world : World
        World with M obstacles.
    m : int
        Index of the obstacle.
    x, y : float
        Position, in lengths.

    Returns
    -------
    x, y : float
        Vector along which the obstacle repels.
    size : float
        Distance of the surface from the beginning of the vector.
    """
    return _away_from(world.corners, world, m, x, y)


@jit
def _away_from(
    corners: Corners | None, world: World, m: int, x: float, y: float
) -> tuple[float, float, float]:
    if corners is not None and is_polygon(corners, m):
        from_x, from_y, solid = from_border(corners, m, x, y)
        if solid:
            return -from_x, -from_y, math.inf
        return from_x, from_y, 0.0
    size = float(max(world.half_width[m], world.half_height[m]))
    return x - world.obstacle_x[m], y - world.obstacle_y[m], size


@jit
def repulsion_unit(
    world: World, reach: Reach, margin: float, x: float, y: float
) -> tuple[float, float]:
    """Return the sum of unit vectors away from near obstacles: Eq. (7) of nguyen2024.

    Parameters
    ----------
    world : World
        World with M obstacles.
    reach : Reach
        Obstacles that can act, by position.
    margin : float
        Distance from the surface up to which an obstacle acts.
    x, y : float
        Position, in lengths.
    """
    force_x, force_y = 0.0, 0.0
    cell = reach_cell(reach, x, y)
    for k in range(reach.first[cell], reach.first[cell + 1]):
        m = reach.obstacle[k]
        dx, dy, size = away_from(world, m, x, y)
        distance = math.sqrt(dx * dx + dy * dy)
        scale = (1.0 if distance < size + margin else 0.0) / max(distance, TINY)
        force_x += dx * scale
        force_y += dy * scale
    return force_x, force_y


@jit
def repulsion_inverse(
    world: World, reach: Reach, margin: float, epsilon: float, x: float, y: float
) -> tuple[float, float]:
    """Return the sum of d / (|d| (|d| + epsilon)) over near obstacles.

    The sum is f_obs of aziel_chen2025, with d the vector away from an obstacle. The
    publication has the denominator (|d| + epsilon)^2. For |d| of 1 px or more, the
    forms agree to 1 part in 10^10.

    Parameters
    ----------
    world : World
        World with M obstacles.
    reach : Reach
        Obstacles that can act, by position.
    margin : float
        Distance from the surface up to which an obstacle acts.
    epsilon : float
        Length that is added to |d|.
    x, y : float
        Position, in lengths.
    """
    force_x, force_y = 0.0, 0.0
    cell = reach_cell(reach, x, y)
    for k in range(reach.first[cell], reach.first[cell + 1]):
        m = reach.obstacle[k]
        dx, dy, size = away_from(world, m, x, y)
        distance = math.sqrt(dx * dx + dy * dy)
        scale = (1.0 if distance < size + margin else 0.0) / max(
            distance * (distance + epsilon), TINY
        )
        force_x += dx * scale
        force_y += dy * scale
    return force_x, force_y


@jit
def repulsion_linear(
    world: World, reach: Reach, margin: float, x: float, y: float
) -> tuple[float, float]:
    """Return the sum of displacements from near obstacles: Eq. (25) of patel2023.

    Parameters
    ----------
    world : World
        World with M obstacles.
    reach : Reach
        Obstacles that can act, by position.
    margin : float
        Distance from the surface up to which an obstacle acts.
    x, y : float
        Position, in lengths.
    """
    force_x, force_y = 0.0, 0.0
    cell = reach_cell(reach, x, y)
    for k in range(reach.first[cell], reach.first[cell + 1]):
        m = reach.obstacle[k]
        dx, dy, size = away_from(world, m, x, y)
        counts = 1.0 if math.sqrt(dx * dx + dy * dy) < size + margin else 0.0
        force_x += dx * counts
        force_y += dy * counts
    return force_x, force_y


@jit
def wall_repulsion(position: float, length: float, epsilon: float) -> float:
    """Return 1/(x + epsilon) - 1/(L - x + epsilon) for one coordinate x in [0, L].

    The rule is f_wall of aziel_chen2025. Beyond a wall the sign changes: a boid that
    escapes is repelled further, as in the authors' program.

    Parameters
    ----------
    position : float
        Coordinate x, in lengths.
    length : float
        Size L of the world along the axis.
    epsilon : float
        Length that is added to each distance.
    """
    return 1.0 / (position + epsilon) - 1.0 / (length - position + epsilon)
