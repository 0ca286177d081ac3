"""Shapes of obstacles, as maps and specs have them.

A row of five numbers is a disc or a rectangle: x and y of the centre, half width, half
height, and 1 for a disc (whose half width is its radius) or 0 for a rectangle. Two
further numbers are the velocity of the obstacle, if it has one of its own. A Polygon
has any other shape.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.state import Corners, Floats

Row = tuple[float, ...]
Point = tuple[float, float]


class Polygon(NamedTuple):
    """Obstacle by its vertices, in their order round it, in either direction.

    A polygon is solid inside. An arena is solid outside, boids are to be in it, and it
    does not move. `velocity` is None for a polygon without a velocity of its own.
    """

    vertices: tuple[Point, ...]
    is_arena: bool = False
    velocity: Point | None = None


Obstacle = Row | Polygon
Obstacles = NDArray[np.float64] | Sequence[Obstacle]
"""Array of rows, (M, 5) or (M, 7), or sequence of rows and polygons."""


def is_arena(obstacle: Obstacle) -> bool:
    """Return whether an obstacle is solid outside."""
    return isinstance(obstacle, Polygon) and obstacle.is_arena


def velocity_of(obstacle: Obstacle) -> Point | None:
    """Return the velocity that an obstacle has of its own, None without one."""
    if isinstance(obstacle, Polygon):
        return obstacle.velocity
    return (obstacle[5], obstacle[6]) if len(obstacle) == 7 else None


def shapes_of(obstacles: Obstacles) -> tuple[Obstacle, ...]:
    """Return the obstacles one by one; rows become tuples of Python floats."""
    return tuple(
        one if isinstance(one, Polygon) else tuple(float(number) for number in one)
        for one in obstacles
    )


def checked(obstacles: Obstacles, name: str) -> Obstacles:
    """Return the obstacles that a map draws, if they are valid.

    Rows become an array if there are no polygons. `name` is the name of the map.

    Raises
    ------
    ValueError
        If a row or a polygon has another shape, or a number that is not finite.
    """
    if isinstance(obstacles, np.ndarray) or not polygons_of(obstacles):
        rows = np.asarray(obstacles, np.float64)
        if rows.ndim != 2 or rows.shape[1] not in (5, 7) or not np.isfinite(rows).all():
            raise ValueError(
                f"map {name} draws an array of shape {rows.shape}: it must be (M, 5) or"
                " (M, 7), of finite numbers, or a sequence of such rows and Polygons"
            )
        return rows
    found = tuple(obstacles)
    for one in found:
        if not isinstance(one, Polygon):
            checked(np.array([one], np.float64), name)
            continue
        corners = np.asarray(one.vertices, np.float64)
        fits = corners.ndim == 2 and corners.shape[1] == 2 and len(corners) > 2
        velocity = np.asarray(one.velocity or (0.0, 0.0), np.float64)
        finite = np.isfinite(corners).all() and np.isfinite(velocity).all()
        if not fits or not finite or velocity.shape != (2,):
            raise ValueError(
                f"map {name} draws a polygon that is none: it must have pairs (x, y) of"
                " finite numbers, at least three, and such a velocity or None"
            )
    return found


def polygons_of(obstacles: Obstacles) -> list[Polygon]:
    """Return the polygons among obstacles."""
    if isinstance(obstacles, np.ndarray):
        return []
    return [one for one in obstacles if isinstance(one, Polygon)]


def numbers_of(obstacles: Obstacles) -> Floats:
    """Return all numbers of obstacles in a row, by which two draws are compared."""
    parts: list[float] = []
    for one in shapes_of(obstacles):
        if isinstance(one, Polygon):
            parts += [value for vertex in one.vertices for value in vertex]
            parts += one.velocity or ()
        else:
            parts += one
    return np.array(parts, np.float64)


def box_of(polygon: Polygon) -> Row:
    """Return the rectangle about the vertices of a polygon as five numbers."""
    x, y = np.array(polygon.vertices, np.float64).T
    left, right, low, high = map(float, (x.min(), x.max(), y.min(), y.max()))
    middle = (left + right) / 2, (low + high) / 2
    return *middle, (right - left) / 2, (high - low) / 2, 0.0


def boxes_of(obstacles: Obstacles, width: float, height: float) -> Floats:
    """Return obstacles as discs and rectangles.

    A polygon becomes the rectangle about it. An arena is solid everywhere outside: its
    rectangle holds all of the world.

    Parameters
    ----------
    obstacles : Obstacles
        M obstacles of a world.
    width, height : float
        Size of the world, in the unit of length.

    Returns
    -------
    Floats
        Rows of shape (M, 5): centre, half width, half height, and 1 for a disc.
    """
    if isinstance(obstacles, np.ndarray):
        return obstacles[:, :5]
    world = width / 2, height / 2, width / 2, height / 2, 0.0
    rows = [
        (world if one.is_arena else box_of(one))
        if isinstance(one, Polygon)
        else one[:5]
        for one in obstacles
    ]
    return np.array(rows, np.float64).reshape(-1, 5)


def corners_of(obstacles: Obstacles) -> Corners | None:
    """Return the vertices of the polygons among M obstacles, None without polygons."""
    if not polygons_of(obstacles):
        return None
    vertices = [
        one.vertices if isinstance(one, Polygon) else () for one in shapes_of(obstacles)
    ]
    x, y = np.array([xy for one in vertices for xy in one], np.float64).T.copy()
    arena = [isinstance(one, Polygon) and one.is_arena for one in obstacles]
    first = np.cumsum([0, *map(len, vertices)], dtype=np.int64)
    return Corners(x, y, first, np.array(arena, np.bool_))
