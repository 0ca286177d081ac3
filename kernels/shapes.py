"""Shapes of obstacles in maps and specs.

A row of five numbers is a disc or a rectangle. The numbers are x and y of the centre,
half width, half height, and 1 for a disc or 0 for a rectangle. The half width of a disc
is the radius. Two further numbers give the velocity of an obstacle with a fixed
velocity. A Polygon has any further shape.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.state import Corners, Floats

Row = tuple[float, ...]
Point = tuple[float, float]


class Polygon(NamedTuple):
    """Obstacle given by vertices, in order round the border, in either direction.

    A polygon is solid inside. An arena is solid outside, contains the boids and does
    not move. `velocity` is None for a polygon without a fixed velocity.
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
    """Return the fixed velocity of an obstacle; None without a fixed velocity."""
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
    """Return the obstacles of a map after validation.

    Rows become an array if the map has no polygons. `name` is the name of the map.

    Raises
    ------
    ValueError
        If a row or a polygon has a wrong shape, or a number that is not finite.
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
    """Return all numbers of obstacles in one array, for comparisons of two draws."""
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

    A polygon becomes the enclosing rectangle. An arena is solid everywhere outside, so
    its rectangle contains the whole world.

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
    """Return the vertices of the polygons among M obstacles; None without polygons."""
    if not polygons_of(obstacles):
        return None
    vertices = [
        one.vertices if isinstance(one, Polygon) else () for one in shapes_of(obstacles)
    ]
    x, y = np.array([xy for one in vertices for xy in one], np.float64).T.copy()
    arena = [isinstance(one, Polygon) and one.is_arena for one in obstacles]
    first = np.cumsum([0, *map(len, vertices)], dtype=np.int64)
    return Corners(x, y, first, np.array(arena, np.bool_))
