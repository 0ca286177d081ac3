"""Polygons: the nearest point of their border, what lies inside, what is behind them.

All of it is exact but for rounding, for any polygon whose sides do not cross.
"""

import math

from kernels.jit import jit
from kernels.state import Corners


@jit
def is_polygon(corners: Corners, m: int) -> bool:
    """Whether obstacle `m` is a polygon."""
    return bool(corners.first[m + 1] > corners.first[m])


@jit
def from_border(
    corners: Corners, m: int, x: float, y: float
) -> tuple[float, float, bool]:
    """The vector from the nearest point of the border of polygon `m` to (x, y), and
    whether (x, y) is strictly within what is solid.

    A ray along x crosses the border an odd number of times from inside (Shimrat 1962,
    Algorithm 112: position of point relative to polygon, Communications of the ACM 5,
    434). At a side the vector is a multiple of its normal, so that it is exactly zero
    on sides along x or y.
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
    """Whether the way (dx, dy) from (x, y) leads through what is solid of polygon `m`.

    The border cuts the way into pieces, each of which lies on one side: the middle of
    a piece says on which.
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
    """The least part above `start` of the way at which it meets a side; 1 if none."""
    first, end = corners.first[m], corners.first[m + 1]
    ax, ay = corners.x[end - 1], corners.y[end - 1]
    found = 1.0
    for k in range(first, end):
        bx, by = corners.x[k], corners.y[k]
        along_x, along_y = bx - ax, by - ay
        cross = dx * along_y - dy * along_x
        if cross != 0.0:  # a side along the way is met at its ends, by its neighbours
            to_x, to_y = ax - x, ay - y
            share = (to_x * along_y - to_y * along_x) / cross
            part = (to_x * dy - to_y * dx) / cross
            if start < share < found and 0.0 <= part <= 1.0:
                found = share
        ax, ay = bx, by
    return found
