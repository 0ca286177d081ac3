"""Polygons: nearest points on the border, inside tests and occlusion.

All results are exact up to rounding, for any polygon without crossing sides.
"""

import math

from kernels.jit import jit
from kernels.state import Corners


@jit
def is_polygon(corners: Corners, m: int) -> bool:
    """Return whether obstacle `m` is a polygon."""
    return bool(corners.first[m + 1] > corners.first[m])


@jit
def from_border(
    corners: Corners, m: int, x: float, y: float
) -> tuple[float, float, bool]:
    """Return the vector from a border to a point, and whether the point is solid.

    The vector begins at the nearest point of the border. A ray along x crosses the
    border an odd number of times from inside (Shimrat 1962, Algorithm 112: position of
    point relative to polygon, Communications of the ACM 5, 434). At a side the vector
    is a multiple of the normal of the side. So the vector is exactly zero on sides
    along x or y.

    Parameters
    ----------
    corners : Corners
        Vertices of all polygons.
    m : int
        Index of an obstacle that is a polygon.
    x, y : float
        Point, in the unit of length of the model.

    Returns
    -------
    from_x, from_y : float
        Vector from the nearest point of the border to (x, y).
    solid : bool
        True if (x, y) is strictly within the solid side: inside a polygon, or outside
        an arena.
    """
    first, end = corners.first[m], corners.first[m + 1]
    ax, ay = corners.x[end - 1], corners.y[end - 1]
    from_x, from_y, least, odd = 0.0, 0.0, math.inf, False
    for k in range(first, end):
        bx, by = corners.x[k], corners.y[k]
        along_x, along_y, dx, dy = bx - ax, by - ay, x - ax, y - ay
        length2 = along_x * along_x + along_y * along_y
        along, cross = dx * along_x + dy * along_y, dx * along_y - dy * along_x
        if (ay > y) != (by > y) and (cross < 0.0) == (along_y > 0.0):
            odd = not odd
        if along >= length2:
            dx, dy = x - bx, y - by
        elif along > 0.0:
            dx, dy = cross * along_y / length2, -(cross * along_x) / length2
        distance2 = dx * dx + dy * dy
        if distance2 < least:
            from_x, from_y, least = dx, dy, distance2
        ax, ay = bx, by
    return from_x, from_y, odd != corners.is_arena[m] and least > 0.0


@jit
def meets_polygon(
    corners: Corners, m: int, x: float, y: float, dx: float, dy: float
) -> bool:
    """Return whether a straight path leads through the solid side of a polygon.

    The border cuts the path into pieces. Each piece is on one side, and the middle of
    the piece decides the side.

    Parameters
    ----------
    corners : Corners
        Vertices of all polygons.
    m : int
        Index of an obstacle that is a polygon.
    x, y : float
        Beginning of the path, in the unit of length of the model.
    dx, dy : float
        Displacement from the beginning to the end of the path.
    """
    start = 0.0
    while start < 1.0:
        end = _next_cut(corners, m, x, y, dx, dy, start)
        share = 0.5 * (start + end)
        _, _, solid = from_border(corners, m, x + share * dx, y + share * dy)
        if solid:
            return True
        start = end
    return False


@jit
def _next_cut(
    corners: Corners,
    m: int,
    x: float,
    y: float,
    dx: float,
    dy: float,
    start: float,
) -> float:
    """Return the least fraction of the path above `start` where a side cuts the path.

    The result is 1 if no further side cuts the path.
    """
    first, end = corners.first[m], corners.first[m + 1]
    ax, ay = corners.x[end - 1], corners.y[end - 1]
    found = 1.0
    for k in range(first, end):
        bx, by = corners.x[k], corners.y[k]
        along_x, along_y = bx - ax, by - ay
        cross = dx * along_y - dy * along_x
        if cross != 0.0:  # adjacent sides meet a side along the path
            to_x, to_y = ax - x, ay - y
            share = (to_x * along_y - to_y * along_x) / cross
            part = (to_x * dy - to_y * dx) / cross
            if start < share < found and 0.0 <= part <= 1.0:
                found = share
        ax, ay = bx, by
    return found
