"""Polygons of a spec, given by vertices, with sides that do not cross.

Geometry libraries report the crossing point. A user needs the numbers of the crossing
sides, so this module finds the numbers.
"""

from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.shapes import Point, Polygon
from sweep.spec.contents import Content, Number, OneOf
from sweep.spec.document import Entry
from sweep.spec.keys import Key
from sweep.spec.schema_parts import Schema

LEAST_VERTICES = 3
MOST_VERTICES = 1000
INSIDE = "inside"
OUTSIDE = "outside"
MOST_NUMBER = 10**15
"""Largest coordinate. The square of a larger coordinate may overflow."""
NUMBER = Number(least=-MOST_NUMBER, most=MOST_NUMBER)

Floats = NDArray[np.float64]


class Segments(NamedTuple):
    """Sides of a polygon from (ax, ay) to (bx, by), numbers or arrays."""

    ax: Any
    ay: Any
    bx: Any
    by: Any


@dataclass(frozen=True)
class Pair(Content[Point]):
    """Two numbers up to MOST_NUMBER, along x and along y."""

    @property
    def words(self) -> str:
        """The allowed values in words."""
        return "[x, y]"

    def read(self, entry: Entry) -> Point:
        """Return the pair of an entry, or raise SpecError for a wrong value."""
        if not isinstance(entry.value, list) or len(entry.value) != 2:
            raise entry.expected(self.words)
        x, y = (NUMBER.read(coordinate) for coordinate in entry.entries())
        return x, y

    def schema(self) -> Schema:
        """Return the JSON Schema of the allowed values."""
        return {
            "type": "array",
            "items": NUMBER.schema(),
            "minItems": 2,
            "maxItems": 2,
        }

    def write(self, value: Point) -> Any:
        """Return the pair as a list."""
        return list(value)


PAIR = Pair()


@dataclass(frozen=True)
class Vertices(Content[tuple[Point, ...]]):
    """The vertices of a polygon, in the order of the sides."""

    @property
    def words(self) -> str:
        """The allowed values in words."""
        return f"a list of {LEAST_VERTICES} to {MOST_VERTICES} vertices [x, y]"

    def read(self, entry: Entry) -> tuple[Point, ...]:
        """Return the vertices of an entry, or raise SpecError for a wrong value."""
        listed = entry.entries()
        if not LEAST_VERTICES <= len(listed) <= MOST_VERTICES:
            length = f"a list of {len(listed)}"
            raise entry.error(f'"{entry.name}" must be {self.words}, not {length}')
        vertices = tuple(map(PAIR.read, listed))
        if flaw := flaw_of(vertices):
            raise entry.error(f"the polygon has {flaw}")
        return vertices

    def schema(self) -> Schema:
        """Return the JSON Schema of the allowed values."""
        return {
            "type": "array",
            "items": PAIR.schema(),
            "minItems": LEAST_VERTICES,
            "maxItems": MOST_VERTICES,
        }

    def write(self, value: tuple[Point, ...]) -> Any:
        """Return the vertices as lists."""
        return [list(vertex) for vertex in value]


VELOCITY = Key(PAIR, "[x, y], length/time", otherwise="obstacle_speed")


@dataclass(frozen=True)
class VertexPolygon:
    """An obstacle of any shape in the form of a spec."""

    vertices: Annotated[
        tuple[Point, ...],
        Key(
            Vertices(),
            "vertices in the order round the polygon, in either direction",
            example="[[0, 0], [4, 0], [2, 3]]",
        ),
    ]
    solid: Annotated[
        str,
        Key(
            OneOf("side", [INSIDE, OUTSIDE]),
            "inside: an obstacle. outside: an arena, where all space outside of the"
            " polygon is solid",
        ),
    ] = INSIDE
    velocity: Annotated[Point | None, VELOCITY] = None

    @property
    def obstacle(self) -> Polygon:
        """The obstacle in the form of `kernels.shapes`."""
        return Polygon(self.vertices, self.solid == OUTSIDE, self.velocity)


def polygon_as_written(polygon: Polygon) -> dict[str, Any]:
    """Return a polygon in the form of a spec."""
    keys: dict[str, Any] = {"vertices": [list(vertex) for vertex in polygon.vertices]}
    if polygon.is_arena:
        keys["solid"] = OUTSIDE
    if polygon.velocity:
        keys["velocity"] = list(polygon.velocity)
    return keys


def polygon_from_json(stored: Any) -> Polygon:
    """Return the polygon that `polygon_as_written` wrote.

    Raises ValueError, with the mistake, for all other values.
    """
    try:
        rows = np.array(stored["vertices"], np.float64).reshape(-1, 2)
        solid = stored.get("solid", INSIDE)
        velocity = stored.get("velocity")
        if velocity is not None:
            vx, vy = map(float, velocity)
            velocity = vx, vy
    except (ValueError, TypeError, KeyError, OverflowError, AttributeError):
        raise ValueError("a polygon has no list of vertices") from None
    vertices = tuple((x, y) for x, y in rows.tolist())
    if not LEAST_VERTICES <= len(vertices) <= MOST_VERTICES:
        raise ValueError(f"a polygon has {len(vertices)} vertices")
    numbers = [*rows.ravel().tolist(), *(velocity or ())]
    small = all(abs(number) <= MOST_NUMBER for number in numbers)
    if not small or solid not in (INSIDE, OUTSIDE) or (velocity and solid == OUTSIDE):
        raise ValueError(
            f"a polygon has numbers beyond {MOST_NUMBER:g}, a value of solid that is"
            f" neither {INSIDE} nor {OUTSIDE}, or is an arena with a velocity"
        )
    if flaw := flaw_of(vertices):
        raise ValueError(f"a polygon has {flaw}")
    return Polygon(vertices, solid == OUTSIDE, velocity)


def flaw_of(vertices: tuple[Point, ...]) -> str:
    """Return in words why finite vertices are not a polygon; "" for a polygon."""
    x, y = np.array(vertices, np.float64).T
    sides = Segments(x, y, np.roll(x, -1), np.roll(y, -1))
    along_x = sides.bx - x
    along_y = sides.by - y
    still = np.flatnonzero((along_x == 0.0) & (along_y == 0.0))
    if still.size:
        return f"a side of length 0: {_words(vertices, int(still[0]))}"
    if not _turn(x[0], y[0], x[1], y[1], x=x, y=y).any():
        return "the area 0: all vertices are on one line"
    for i in range(len(vertices) - 1):
        side = Segments(*(float(part[i]) for part in sides))
        later = Segments(*(part[i + 1 :] for part in sides))
        met = _meet(side, later)
        # Consecutive segments share a vertex, and may not share a further point.
        met[0] = _folds(along_x, along_y, i, i + 1)
        if i == 0:
            met[-1] = _folds(along_x, along_y, len(vertices) - 1, 0)
        if met.any():
            other = i + 1 + int(np.argmax(met))
            first = _words(vertices, i)
            second = _words(vertices, other)
            return f"sides that cross: {first}, and {second}"
    return ""


def _words(vertices: tuple[Point, ...], k: int) -> str:
    """Return side k, counted from 0, in words."""
    ax, ay = vertices[k]
    bx, by = vertices[(k + 1) % len(vertices)]
    return f"side {k + 1}, from ({ax:g}, {ay:g}) to ({bx:g}, {by:g})"


def _turn(ax: Any, ay: Any, bx: Any, by: Any, x: Any, y: Any) -> Any:
    """Return twice the signed area of triangles.

    The area is positive if (x, y) is left of the line from a to b.
    """
    return (bx - ax) * (y - ay) - (by - ay) * (x - ax)


def _folds(along_x: Floats, along_y: Floats, first: int, second: int) -> bool:
    """Return whether the side `second` folds back onto the preceding side `first`."""
    turn = along_x[first] * along_y[second] - along_y[first] * along_x[second]
    onward = along_x[first] * along_x[second] + along_y[first] * along_y[second]
    return bool(turn == 0.0 and onward < 0.0)


def _meet(side: Segments, many: Segments) -> NDArray[np.bool_]:
    """Return, for many sides, whether the side has a point in common with `side`."""
    from_side = [
        np.sign(_turn(*side, x, y)) for x, y in ((many.ax, many.ay), (many.bx, many.by))
    ]
    from_many = [
        np.sign(_turn(*many, x, y)) for x, y in ((side.ax, side.ay), (side.bx, side.by))
    ]
    apart = (from_side[0] * from_side[1] > 0) | (from_many[0] * from_many[1] > 0)
    beside = _beside(side.ax, side.bx, many.ax, many.bx) | _beside(
        side.ay, side.by, many.ay, many.by
    )
    meets: NDArray[np.bool_] = ~(apart | beside)
    return meets


def _beside(a: float, b: float, c: Floats, d: Floats) -> NDArray[np.bool_]:
    """Return whether the intervals [c, d] have no point in common with [a, b]."""
    beside: NDArray[np.bool_] = (np.maximum(c, d) < min(a, b)) | (
        np.minimum(c, d) > max(a, b)
    )
    return beside
