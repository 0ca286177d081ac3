"""Maps of a spec.

A map has shapes, is a built-in map with some obstacles changed, or is read from an
image or a ROS map.

    room:
      size: [10, 10]
      shapes:
        - disc: {x: 3, y: 4, radius: 0.5}
        - rectangle: {x: 6, y: 5, width: 2, height: 1}
        - polygon: {vertices: [[1, 8], [3, 8], [2, 9]]}
    aisle:
      from: cafeteria
      without: [3]                             # the third obstacle
      add:
        - disc: {x: 400, y: 300, radius: 20}
    lab: {image: lab.png, resolution: 0.05}  # dark pixels are occupied
    floor: {ros: floor.yaml}                 # a file of ROS's map_server

`resolution` is the length of a pixel. Lengths are in the model's unit of length. x and
y are the coordinates of the centre of a shape. The origin is the top left corner, and y
increases downwards. A path is relative to the folder of the spec. The image of a ROS
map is relative to the folder of the ROS file.
"""

import hashlib
import json
import math
import re
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from kernels.shapes import (
    Obstacle,
    Point,
    Polygon,
    Row,
    box_of,
    is_arena,
    velocity_of,
)
from sweep.spec.contents import Content, ListOf, Number, ReadLater, Text, Whole
from sweep.spec.copied_maps import (
    Copy,
    Obstacles,
    copy_of,
    obstacles_in,
    sizes,
)
from sweep.spec.document import Entry
from sweep.spec.images import ImageError, brightness, obstacles_of
from sweep.spec.keys import (
    Key,
    SectionOf,
    check_keys,
    keys_of,
    read_section,
    read_values,
    section_schema,
)
from sweep.spec.mistakes import Mistakes
from sweep.spec.polygons import (
    MOST_NUMBER,
    VELOCITY,
    VertexPolygon,
    polygon_as_written,
    polygon_from_json,
)
from sweep.spec.schema_parts import Schema, named, one_of, reference
from sweep.spec.strict_yaml import read_document
from sweep.text import unknown

MAP_NAME = re.compile(r"[a-z][a-z0-9_]*")
MOST_MAPS = 100
MOST_SHAPES = 100_000
MOST_LENGTH = 1e9
HALF = 0.5
"""Darkness, from 0 to 1, above which a pixel of an image is occupied."""
OCCUPIED = 0.65
"""Darkness, from 0 to 1, above which a pixel of a ROS map is occupied.

This value applies to maps without the key `occupied_thresh`.
"""

LENGTH = Number(above=0, most=MOST_LENGTH)
NUMBER = Whole(1)
ACROSS = "x coordinate of the centre, from the left"
DOWN = "y coordinate of the centre, from the top"


@dataclass(frozen=True)
class Disc:
    """A round obstacle in the form of a spec."""

    x: Annotated[float, Key(Number(), ACROSS, example="3")]
    y: Annotated[float, Key(Number(), DOWN, example="4")]
    radius: Annotated[float, Key(LENGTH, "radius", example="0.5")]
    velocity: Annotated[Point | None, VELOCITY] = None

    @property
    def obstacle(self) -> Obstacle:
        """The obstacle in the form of `kernels.shapes`."""
        disc = (self.x, self.y, self.radius, self.radius, 1.0)
        return disc + (self.velocity or ())


@dataclass(frozen=True)
class Rectangle:
    """A rectangular obstacle in the form of a spec."""

    x: Annotated[float, Key(Number(), ACROSS, example="6")]
    y: Annotated[float, Key(Number(), DOWN, example="5")]
    width: Annotated[float, Key(LENGTH, "width, along x", example="2")]
    height: Annotated[float, Key(LENGTH, "height, along y", example="1")]
    velocity: Annotated[Point | None, VELOCITY] = None

    @property
    def obstacle(self) -> Obstacle:
        """The obstacle in the form of `kernels.shapes`."""
        rectangle = (self.x, self.y, self.width / 2, self.height / 2, 0.0)
        return rectangle + (self.velocity or ())


@dataclass(frozen=True)
class Shape:
    """An obstacle, with exactly one of the keys."""

    disc: Annotated[
        Disc | None,
        Key(SectionOf(Disc), "a circle; a shape has one of three keys", otherwise=""),
    ] = None
    rectangle: Annotated[
        Rectangle | None,
        Key(SectionOf(Rectangle), "a rectangle, sides along x and y", otherwise=""),
    ] = None
    polygon: Annotated[
        VertexPolygon | None,
        Key(SectionOf(VertexPolygon), "a shape with vertices", otherwise=""),
    ] = None


@dataclass(frozen=True)
class Size(Content[tuple[float, float]]):
    """The width and height of a world."""

    @property
    def words(self) -> str:
        """The allowed values in words."""
        return "[width, height]"

    def read(self, entry: Entry) -> tuple[float, float]:
        """Return the size of an entry, or raise SpecError for a wrong value."""
        if len(entry.entries()) != 2:
            raise entry.expected(self.words)
        width, height = (LENGTH.read(side) for side in entry.entries())
        return width, height

    def schema(self) -> Schema:
        """Return the JSON Schema of the allowed values."""
        return {
            "type": "array",
            "items": LENGTH.schema(),
            "minItems": 2,
            "maxItems": 2,
        }

    def write(self, value: tuple[float, float]) -> Any:
        """Return the size as a list."""
        return list(value)


def shape_schema() -> Schema:
    """Return the JSON Schema of a shape."""
    return section_schema(Shape) | one_of(["disc", "rectangle", "polygon"])


def _a_shape() -> Schema:
    return {"allOf": [reference("shape")]}


def _shapes_schema() -> Schema:
    return {"type": "array", "items": reference("shape")}


@dataclass(frozen=True)
class DrawnMap:
    """A map of shapes, in the form of a spec."""

    size: Annotated[
        tuple[float, float],
        Key(
            Size(),
            "[width, height] of the world, in the unit of length of the model",
            example="[10, 10]",
        ),
    ]
    shapes: Annotated[
        Entry,
        Key(
            ReadLater("a list of shapes", _shapes_schema, (Shape,), "[]"),
            "obstacles of the map",
            example="[{disc: {x: 3, y: 4, radius: 0.5}}]",
        ),
    ]


@dataclass(frozen=True)
class ChangedObstacle:
    """A shape that replaces an obstacle of a copied map."""

    number: Annotated[
        int, Key(NUMBER, "number of the obstacle in the map, from 1", example="5")
    ]
    to: Annotated[
        Entry,
        Key(
            ReadLater("a shape", _a_shape, (Shape,)),
            "new shape of the obstacle",
            example="{disc: {x: 3, y: 4, radius: 0.5}}",
        ),
    ]


def _changes_schema() -> Schema:
    return {"type": "array", "items": section_schema(ChangedObstacle)}


@dataclass(frozen=True)
class CopiedMap:
    """A built-in map with some obstacles changed, in the form of a spec."""

    source: Annotated[
        str,
        Key(
            Text("the name of a map"),
            "name of the built-in map that is copied; the map must have a size",
            name="from",
            example="cafeteria",
        ),
    ]
    without: Annotated[
        tuple[int, ...],
        Key(
            ListOf(NUMBER, "numbers"),
            "numbers of the obstacles that are left out",
            otherwise="none",
            example="[3]",
        ),
    ] = ()
    change: Annotated[
        Entry | None,
        Key(
            ReadLater("a list of changes", _changes_schema, (ChangedObstacle,), "[]"),
            "changed obstacles",
            otherwise="none",
            example="[{number: 5, to: {disc: {x: 3, y: 4, radius: 0.5}}}]",
        ),
    ] = None
    add: Annotated[
        Entry | None,
        Key(
            ReadLater("a list of shapes", _shapes_schema, (Shape,), "[]"),
            "further obstacles",
            otherwise="none",
            example="[{disc: {x: 3, y: 4, radius: 0.5}}]",
        ),
    ] = None


@dataclass(frozen=True)
class PicturedMap:
    """A map from an image, in the form of a spec."""

    image: Annotated[
        str,
        Key(
            Text("the path of a file"),
            "image whose dark pixels are occupied",
            example="lab.png",
        ),
    ]
    resolution: Annotated[float, Key(LENGTH, "length of a pixel", example="0.05")]


@dataclass(frozen=True)
class RosMap:
    """A map of ROS, in the form of a spec."""

    ros: Annotated[
        str,
        Key(
            Text("the path of a file"),
            "file of the ROS package map_server",
            example="floor.yaml",
        ),
    ]


MAP_FORMS = (DrawnMap, CopiedMap, PicturedMap, RosMap)


def maps_schema() -> Schema:
    """Return the JSON Schema of the maps of a spec."""
    forms = [section_schema(form) for form in MAP_FORMS]
    names = {"pattern": f"^{MAP_NAME.pattern}$", "not": reference("built_in_map")}
    return named({"anyOf": forms}, names)


@dataclass(frozen=True)
class OwnMap:
    """A custom map of a spec.

    Attributes
    ----------
    size : (float, float)
        Width and height, in the unit of length of the model.
    obstacles : tuple of Obstacle
        Obstacles in the form of `kernels.worlds`.
    """

    size: tuple[float, float]
    obstacles: Obstacles

    @cached_property
    def digest(self) -> str:
        """Hash of the obstacles, 32 hexadecimal digits."""
        if any(isinstance(row, Polygon) or len(row) > 5 for row in self.obstacles):
            content = json.dumps(self.as_json()["obstacles"]).encode()
        else:
            content = np.array(self.obstacles, "<f8").tobytes()
        return hashlib.sha256(content).hexdigest()[:32]

    def as_json(self) -> dict[str, Any]:
        """Return the map as lists; a polygon is a mapping, as in a spec."""
        obstacles = [
            polygon_as_written(row) if isinstance(row, Polygon) else row
            for row in self.obstacles
        ]
        return {"size": self.size, "obstacles": obstacles}


def from_json(stored: Any) -> OwnMap:
    """Return the map that `as_json` wrote.

    Raises ValueError, with the mistake, for all other values.
    """
    try:
        width, height = np.array(stored["size"], np.float64).tolist()
        rows = tuple(map(_row_from_json, stored["obstacles"]))
    except (ValueError, TypeError, KeyError, OverflowError):
        raise ValueError("the map has no size, or no table of obstacles") from None
    if not (0 < width < math.inf and 0 < height < math.inf):
        raise ValueError(f"the size of the map is {width} x {height}")
    if len(rows) > MOST_SHAPES:
        raise ValueError(
            f"the map has {len(rows):,} shapes; at most {MOST_SHAPES:,} are allowed"
        )
    obstacles = tuple(
        polygon_from_json(row) if isinstance(row, dict) else row for row in rows
    )
    for obstacle in obstacles:
        x, y, half_width, half_height, disc = _box(obstacle)
        lengths = min(half_width, half_height) > 0 and disc in (0.0, 1.0)
        if not lengths or not _meets(obstacle, width, height):
            raise ValueError(
                f"a shape at {x}, {y} of {half_width} x {half_height} is not valid, or"
                " outside of the world"
            )
    return OwnMap((width, height), obstacles)


def _row_from_json(stored: Any) -> dict[str, Any] | Row:
    """Return the numbers of a disc or a rectangle; a polygon unchanged."""
    if isinstance(stored, dict):
        return stored
    row = tuple(map(float, stored))
    if len(row) not in (5, 7) or not all(abs(v) <= MOST_NUMBER for v in row[5:]):
        raise ValueError
    return row


def maps_from_json(stored: Any, built_in: Collection[str]) -> dict[str, OwnMap]:
    """Return the maps by name from the results of `as_json` by name.

    Raises ValueError as `from_json`, and for a name that is not allowed or `built_in`.
    """
    if not isinstance(stored, dict):
        raise ValueError("the maps are not a mapping of names to maps")
    maps = {}
    for name, content in stored.items():
        if not MAP_NAME.fullmatch(name) or name in built_in:
            raise ValueError(f'"{name}" is not an allowed name of a custom map')
        try:
            maps[name] = from_json(content)
        except ValueError as error:
            raise ValueError(f'"{name}": {error}') from None
    return maps


def read_maps(
    entry: Entry | None, folder: Path, built_in: Collection[str]
) -> dict[str, OwnMap]:
    """Return the custom maps by name.

    Parameters
    ----------
    entry : Entry or None
        The value of `maps`.
    folder : Path
        Paths are relative to this folder.
    built_in : collection of str
        Names of built-in maps, which no custom map may have.

    Raises
    ------
    SpecError
        If a map is not allowed. All mistakes are reported together.
    """
    if entry is None:
        return {}
    entries = dict(entry.mapping())
    if len(entries) > MOST_MAPS:
        message = (
            f"the study has {len(entries):,} maps; at most {MOST_MAPS} are allowed"
        )
        raise entry.error(message)
    maps: dict[str, OwnMap] = {}
    mistakes = Mistakes()
    for name, child in entries.items():
        with mistakes.noted():
            _check_name(name, child, built_in)
            maps[name] = _map(name, child, folder)
    mistakes.check()
    return maps


def _check_name(name: str, entry: Entry, built_in: Collection[str]) -> None:
    if not MAP_NAME.fullmatch(name):
        raise entry.error(
            f'map "{name}" is not allowed: a name has lower-case letters, digits and'
            ' "_", and begins with a letter'
        )
    if name in built_in:
        raise entry.error(f'"{name}" is a built-in map: choose a different name')


def _map(name: str, entry: Entry, folder: Path) -> OwnMap:
    entry.keys([key.name for key in keys_of(*MAP_FORMS)])
    forms = [form for form in READERS if form in entry.value]
    if len(forms) != 1:
        raise entry.error(f'"{name}" needs one of {", ".join(READERS)}')
    return READERS[forms[0]](entry, folder)


def _drawn(entry: Entry, _folder: Path) -> OwnMap:
    mistakes = Mistakes()
    values = _part_values(DrawnMap, entry, mistakes)
    size = values.get("size")
    shapes = mistakes.read(_obstacles, entry, values.get("shapes"), size)
    mistakes.check()
    assert size
    return OwnMap(size, shapes or ())


def _part_values(part: type[Any], entry: Entry, mistakes: Mistakes) -> dict[str, Any]:
    """Return the values of a part of a map, with defaults; note mistakes."""
    with mistakes.noted():
        check_keys(entry, part)
    return read_values(part, entry, mistakes)


def _obstacles(
    entry: Entry, listed: Entry | None, size: tuple[float, float] | None
) -> Obstacles:
    """Return the obstacles of a list of shapes of the map `entry`.

    The size of the map is None if it is wrong.
    """
    shapes = listed.items() if listed else []
    if len(shapes) > MOST_SHAPES:
        raise entry.error(
            f'"{entry.name}" has {len(shapes):,} shapes;'
            f" at most {MOST_SHAPES:,} are allowed"
        )
    obstacles: list[Obstacle] = []
    mistakes = Mistakes()
    for shape in shapes:
        with mistakes.noted():
            obstacles.append(_obstacle(shape, size))
    mistakes.check()
    return tuple(obstacles)


def _copied(entry: Entry, _folder: Path) -> OwnMap:
    mistakes = Mistakes()
    size_of = sizes()
    values = _part_values(CopiedMap, entry, mistakes)
    name = values.get("source")
    size = None
    with mistakes.noted():
        if name is not None:
            if name not in size_of:
                raise entry.child("from").error(unknown("map to copy", name, size_of))
            size = size_of[name]
    without = values["without"]
    changed = mistakes.read(_changed, values["change"], without, size) or {}
    added = mistakes.read(_obstacles, entry, values["add"], size) or ()
    for number in [*without, *changed] if size else []:
        with mistakes.noted():
            if number > (count := len(obstacles_in(name))):
                raise entry.error(f"there is no obstacle {number}: {name} has {count}")
    mistakes.check()
    assert name
    assert size
    replacing = {number - 1: obstacle for number, obstacle in changed.items()}
    out = tuple(number - 1 for number in without)
    return OwnMap(size, Copy(name, out, replacing, added).obstacles)


def _changed(
    entry: Entry | None, without: Sequence[int], size: tuple[float, float] | None
) -> dict[int, Obstacle]:
    """Return the changed obstacles by the numbers of the replaced obstacles."""
    changed: dict[int, Obstacle] = {}
    mistakes = Mistakes()
    for change in entry.items() if entry else []:
        with mistakes.noted():
            number, obstacle = _change(change, size)
            if number in [*without, *changed]:
                raise change.error(f"obstacle {number} is changed or left out twice")
            changed[number] = obstacle
    mistakes.check()
    return changed


def _change(entry: Entry, size: tuple[float, float] | None) -> tuple[int, Obstacle]:
    """Return the number of an obstacle, and the obstacle that replaces it."""
    entry.mapping()
    mistakes = Mistakes()
    values = _part_values(ChangedObstacle, entry, mistakes)
    obstacle = mistakes.read(_obstacle, values["to"], size) if "to" in values else None
    mistakes.check()
    assert obstacle
    return values["number"], obstacle


def map_as_written(map_: OwnMap) -> dict[str, Any]:
    """Return a map in the form of a spec.

    The form is a copy of a built-in map, if at most half of the obstacles differ.
    Otherwise the form lists all shapes.
    """
    if (copy := copy_of(map_.size, map_.obstacles)) is None:
        shapes = [shape_as_written(obstacle) for obstacle in map_.obstacles]
        return {"size": list(map_.size), "shapes": shapes}
    changes = [
        {"number": number + 1, "to": shape_as_written(obstacle)}
        for number, obstacle in copy.changed.items()
    ]
    parts = {
        "without": [number + 1 for number in copy.without],
        "change": changes,
        "add": [shape_as_written(obstacle) for obstacle in copy.added],
    }
    return {"from": copy.name} | {key: part for key, part in parts.items() if part}


def shape_as_written(obstacle: Obstacle) -> dict[str, dict[str, Any]]:
    """Return an obstacle in the form of a spec."""
    if isinstance(obstacle, Polygon):
        return {"polygon": polygon_as_written(obstacle)}
    x, y, half_width, half_height, is_round = obstacle[:5]
    moves = {"velocity": list(obstacle[5:])} if len(obstacle) > 5 else {}
    if is_round:
        return {"disc": {"x": x, "y": y, "radius": half_width, **moves}}
    sides = {"width": 2 * half_width, "height": 2 * half_height}
    return {"rectangle": {"x": x, "y": y, **sides, **moves}}


def _obstacle(entry: Entry, size: tuple[float, float] | None) -> Obstacle:
    check_keys(entry, Shape)
    if len(entry.value) != 1:
        raise entry.error("a shape needs exactly one of disc, rectangle and polygon")
    (kind,) = entry.value
    mistakes = Mistakes()
    shape = read_values(Shape, entry, mistakes)
    mistakes.check()
    obstacle: Obstacle = shape[kind].obstacle
    if is_arena(obstacle) and velocity_of(obstacle):
        raise entry.child(kind).error("an arena cannot move: remove velocity")
    if size and not _meets(obstacle, *size):
        width, height = size
        raise entry.child(kind).error(
            f"the {kind} is outside the world, which is {width:g} x {height:g}"
        )
    return obstacle


def _box(obstacle: Obstacle) -> Row:
    """Return the bounding rectangle of a polygon; a disc or a rectangle unchanged."""
    return box_of(obstacle) if isinstance(obstacle, Polygon) else obstacle[:5]


def _meets(obstacle: Obstacle, width: float, height: float) -> bool:
    """Return whether a part of an obstacle is within the world.

    A polygon counts as the bounding rectangle. False for numbers that are not finite.
    """
    x, y, half_width, half_height, disc = _box(obstacle)
    beside = max(-x, x - width, 0.0)
    beyond = max(-y, y - height, 0.0)
    if disc and not math.hypot(beside, beyond) < half_width:
        return False
    return (
        math.isfinite(x + y + half_width + half_height)
        and beside < half_width
        and beyond < half_height
    )


def _pictured(entry: Entry, folder: Path) -> OwnMap:
    resolution = read_section(PicturedMap, entry).resolution
    image = entry.child("image")
    dark = 255.0 - _pixels(image, folder) > HALF * 255.0
    return _of_pixels(image, dark, resolution)


def _ros(entry: Entry, folder: Path) -> OwnMap:
    """Return a ROS map, read as map_server does in trinary mode.

    Unknown pixels count as free. The key `origin` is not used: the origin of a world is
    the corner of the map.
    """
    path = folder / read_section(RosMap, entry).ros
    try:
        is_file = path.is_file()
    except OSError as error:
        raise entry.child("ros").error(f"cannot be read: {error.strerror}") from None
    if not is_file:
        raise entry.child("ros").error(
            f'there is no file "{path.name}" in {path.parent}'
        )
    root = read_document(path)
    for key in ("image", "resolution"):
        if not isinstance(root.value, dict) or key not in root.value:
            raise entry.child("ros").error(
                f'"{path.name}" is not a ROS map: the key "{key}" is missing'
            )
    mode = root.get("mode")
    threshold = root.get("occupied_thresh")
    negate = root.get("negate")
    if mode:
        mode.one_of("mode", ["trinary"])
    least = threshold.number() if threshold else OCCUPIED
    if threshold and not 0 <= least <= 1:
        raise threshold.expected("a number from 0 to 1")
    light = _pixels(root.child("image"), path.parent)
    occupancy = (light if negate and negate.whole(0, 1) else 255.0 - light) / 255.0
    return _of_pixels(
        root.child("image"), occupancy > least, LENGTH.read(root.child("resolution"))
    )


def _pixels(entry: Entry, folder: Path) -> NDArray[np.float64]:
    try:
        return brightness(folder / entry.text())
    except ImageError as error:
        raise entry.error(f'the image "{entry.value}" {error}') from None


def _of_pixels(entry: Entry, occupied: NDArray[np.bool_], resolution: float) -> OwnMap:
    obstacles = obstacles_of(occupied, resolution)
    if len(obstacles) > MOST_SHAPES:
        message = (
            f"needs {len(obstacles):,} rectangles;"
            f" at most {MOST_SHAPES:,} are allowed: use a coarser image"
        )
        raise entry.error(f'the image "{entry.value}" {message}')
    rows, columns = occupied.shape
    return OwnMap(
        (columns * resolution, rows * resolution), tuple(map(tuple, obstacles.tolist()))
    )


READERS: dict[str, Callable[[Entry, Path], OwnMap]] = {
    "shapes": _drawn,
    "from": _copied,
    "image": _pictured,
    "ros": _ros,
}
