"""Polygons by angles and clamped feet, and obstacles that walk and turn round."""

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

Vector = np.ndarray
Points = Sequence[tuple[float, float]]


def winding(vertices: Points, x: float, y: float) -> int:
    """How many times the border goes round (x, y): the angles under which its sides are
    seen, summed up.
    """
    total = 0.0
    for (ax, ay), (bx, by) in sides(vertices):
        one, other = math.atan2(ay - y, ax - x), math.atan2(by - y, bx - x)
        total += math.remainder(other - one, 2 * math.pi)
    return round(total / (2 * math.pi))


def sides(vertices: Points) -> list[tuple[tuple[float, float], tuple[float, float]]]:
    return list(pairwise([*vertices, vertices[0]]))


def nearest_of_border(vertices: Points, x: float, y: float) -> Vector:
    """The point of the sides that is nearest to (x, y)."""
    place, feet = np.array([x, y]), []
    for begin, end in sides(vertices):
        a, way = np.array(begin), np.subtract(end, begin)
        share = np.clip((place - a) @ way / (way @ way), 0.0, 1.0)
        feet.append(a + share * way)
    return min(feet, key=lambda foot: math.hypot(*(foot - place)))


def polygon_distance(vertices: Points, x: float, y: float) -> float:
    """The distance from the border, negative inside."""
    away = math.hypot(*(nearest_of_border(vertices, x, y) - (x, y)))
    return -away if winding(vertices, x, y) else away


def walked(start: float, way: float, length: float, wraps: bool) -> float:
    """Where one is who walks a way from `start`, turns round at both ends of a world of
    this length, or comes in again at the other end.
    """
    place, left, ahead = start, abs(way), 1 if way > 0 else -1
    while True:
        room = length - place if ahead > 0 else place
        if left <= room:
            return place + ahead * left
        left -= room
        place = length if ahead > 0 else 0.0
        if wraps:
            place = length - place
        else:
            ahead = -ahead
