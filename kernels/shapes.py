"""What obstacles there can be, as maps and specs have them.

A row of five numbers is a disc or a rectangle: x and y of the centre, half width, half
height, and 1 for a disc (whose half width is its radius) or 0 for a rectangle. A
Polygon has any other shape.
"""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.state import Corners, Floats

Row = tuple[float, float, float, float, float]
Point = tuple[float, float]


class Polygon(NamedTuple):
    """An obstacle by its vertices, in their order round it, in either direction.

    It is solid inside; an arena is solid outside, and boids are to be in it.
    """

    vertices: tuple[Point, ...]
    is_arena: bool = False


Obstacle = Row | Polygon
Obstacles = NDArray[np.float64] | Sequence[Obstacle]
"""An array of rows (M, 5), or a sequence of rows and polygons."""


def shapes_of(obstacles: Obstacles) -> tuple[Obstacle, ...]:
    """The same obstacles one by one, in plain numbers."""
    return tuple(
        one
        if isinstance(one, Polygon)
        else (float(one[0]), float(one[1]), float(one[2]), float(one[3]), float(one[4]))
        for one in obstacles
    )


def checked(obstacles: Obstacles, name: str) -> Obstacles:
    """The obstacles that a map of this name draws. Raises ValueError for what are
    none.
    """
    if not isinstance(obstacles, np.ndarray) and any(polygons_of(obstacles)):
        found = tuple(obstacles)
        rows = [one for one in found if not isinstance(one, Polygon)]
        _check_rows(np.array(rows, np.float64) if rows else np.empty((0, 5)), name)
        for polygon in polygons_of(found):
            corners = np.asarray(polygon.vertices, np.float64)
            fits = corners.ndim == 2 and corners.shape[1] == 2 and len(corners) > 2
            if not fits or not np.isfinite(corners).all():
                raise ValueError(
                    f"map {name} draws a polygon whose vertices are no pairs (x, y) of"
                    " finite numbers, at least three"
                )
        return found
    return _check_rows(np.asarray(obstacles, np.float64), name)


def _check_rows(rows: Floats, name: str) -> Floats:
    if rows.ndim != 2 or rows.shape[1] != 5 or not np.isfinite(rows).all():
        raise ValueError(
            f"map {name} draws an array of shape {rows.shape}: it must be (M, 5), of"
            " finite numbers, or a sequence of such rows and Polygons"
        )
    return rows


def polygons_of(obstacles: Obstacles) -> list[Polygon]:
    """The polygons among obstacles."""
    if isinstance(obstacles, np.ndarray):
        return []
    return [one for one in obstacles if isinstance(one, Polygon)]


def numbers_of(obstacles: Obstacles) -> Floats:
    """All numbers of obstacles in a row, by which two draws are compared."""
    parts: Iterable[Sequence[float]] = (
        [value for vertex in one.vertices for value in vertex]
        if isinstance(one, Polygon)
        else one
        for one in shapes_of(obstacles)
    )
    return np.array([value for part in parts for value in part], np.float64)


def box_of(polygon: Polygon) -> Row:
    """The rectangle about the vertices of a polygon."""
    x, y = np.array(polygon.vertices, np.float64).T
    left, right, low, high = map(float, (x.min(), x.max(), y.min(), y.max()))
    middle = (left + right) / 2, (low + high) / 2
    return *middle, (right - left) / 2, (high - low) / 2, 0.0


def boxes_of(obstacles: Obstacles, width: float, height: float) -> Floats:
    """The obstacles of a world of this size as rows (M, 5): a polygon as the rectangle
    about it. What is solid of an arena is everywhere outside of it: its rectangle holds
    all of the world.
    """
    if isinstance(obstacles, np.ndarray):
        return obstacles
    world = width / 2, height / 2, width / 2, height / 2, 0.0
    rows = [
        (world if one.is_arena else box_of(one)) if isinstance(one, Polygon) else one
        for one in obstacles
    ]
    return np.array(rows, np.float64).reshape(-1, 5)


def corners_of(obstacles: Obstacles) -> Corners | None:
    """The vertices of the polygons among M obstacles; None where there are none."""
    if not polygons_of(obstacles):
        return None
    vertices = [
        one.vertices if isinstance(one, Polygon) else () for one in shapes_of(obstacles)
    ]
    x, y = np.array([xy for one in vertices for xy in one], np.float64).T.copy()
    arena = [isinstance(one, Polygon) and one.is_arena for one in obstacles]
    first = np.cumsum([0, *map(len, vertices)], dtype=np.int64)
    return Corners(x, y, first, np.array(arena, np.bool_))
