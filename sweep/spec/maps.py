"""The maps of a spec: drawn with shapes, or read from an image or from a ROS map.

    room:
      size: [10, 10]
      shapes:
        - disc: {x: 3, y: 4, radius: 0.5}
        - rectangle: {x: 6, y: 5, width: 2, height: 1}
    lab: {image: lab.png, resolution: 0.05}  # dark pixels are occupied
    floor: {ros: floor.yaml}                 # a file of ROS's map_server

`resolution` is the length of a pixel. Lengths are in the unit of the model; x and y are
those of a centre. Files stand relative to the spec's folder, and the image of a ROS map
relative to that of its own file. The origin is the top left corner, and y grows
downwards.
"""

import hashlib
import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kernels.worlds import MAPS
from sweep.spec.document import Entry
from sweep.spec.images import ImageError, brightness, obstacles_of
from sweep.spec.strict_yaml import read_document

MAP_NAME = re.compile(r"[a-z][a-z0-9_]*")
MOST_MAPS = 100
MOST_SHAPES = 100_000
MOST_LENGTH = 1e9
HALF, OCCUPIED = 0.5, 0.65
"""How dark an occupied pixel is at least, as a part of black: in an image, and in a ROS
map that does not say.
"""

Obstacles = tuple[tuple[float, float, float, float, float], ...]


@dataclass(frozen=True)
class OwnMap:
    """A map that a spec brings: its width and height, and its obstacles as
    kernels.worlds has them.
    """

    size: tuple[float, float]
    obstacles: Obstacles

    @cached_property
    def digest(self) -> str:
        """32 hexadecimal digits that stand for the obstacles."""
        return hashlib.sha256(np.array(self.obstacles, "<f8").tobytes()).hexdigest()[
            :32
        ]

    def as_json(self) -> dict[str, Any]:
        """The map as plain lists."""
        return {"size": self.size, "obstacles": self.obstacles}


def from_json(stored: Any) -> OwnMap:
    """The map that `as_json` wrote. Raises ValueError, with what is wrong, for what is
    none.
    """
    try:
        width, height = np.array(stored["size"], np.float64).tolist()
        obstacles = np.array(stored["obstacles"], np.float64).reshape(-1, 5)
    except (ValueError, TypeError, KeyError, OverflowError):
        raise ValueError("it has no size, or no table of obstacles") from None
    if not (0 < width < math.inf and 0 < height < math.inf):
        raise ValueError(f"its size is {width} x {height}")
    if len(obstacles) > MOST_SHAPES:
        raise ValueError(
            f"it has {len(obstacles):,} shapes; at most {MOST_SHAPES:,} are allowed"
        )
    rows = tuple((x, y, a, b, disc) for x, y, a, b, disc in obstacles.tolist())
    for x, y, half_width, half_height, disc in rows:
        lengths = min(half_width, half_height) > 0 and disc in (0.0, 1.0)
        if not lengths or not _meets(
            x, y, half_width, half_height, bool(disc), width, height
        ):
            raise ValueError(
                f"a shape at {x}, {y} of {half_width} x {half_height} is none, or"
                " outside"
            )
    return OwnMap((width, height), rows)


def maps_from_json(stored: Any) -> dict[str, OwnMap]:
    """The maps by name that were written each by `as_json`. Raises ValueError as
    `from_json`.
    """
    if not isinstance(stored, dict):
        raise ValueError("they are no maps by name")
    found = {}
    for name, about in stored.items():
        if not MAP_NAME.fullmatch(name) or name in MAPS:
            raise ValueError(f'"{name}" is no name of a map of a spec')
        try:
            found[name] = from_json(about)
        except ValueError as error:
            raise ValueError(f'"{name}": {error}') from None
    return found


def read_maps(entry: Entry | None, folder: Path) -> dict[str, OwnMap]:
    """The maps by name; files stand relative to `folder`. Raises SpecError for what is
    no map.
    """
    if entry is None:
        return {}
    entries = dict(entry.mapping())
    if len(entries) > MOST_MAPS:
        message = (
            f"the study has {len(entries):,} maps; at most {MOST_MAPS} are allowed"
        )
        raise entry.error(message)
    return {name: _map(name, child, folder) for name, child in entries.items()}


def _map(name: str, entry: Entry, folder: Path) -> OwnMap:
    if not MAP_NAME.fullmatch(name):
        raise entry.error(
            f'map "{name}" is not allowed: names of small letters, digits and "_",'
            " a letter first"
        )
    if name in MAPS:
        raise entry.error(
            f'"{name}" is a map already: one of your own needs another name'
        )
    entry.keys(["size", "shapes", "image", "resolution", "ros"])
    forms = [form for form in READERS if form in entry.value]
    if len(forms) != 1:
        raise entry.error(f'"{name}" needs one of {", ".join(READERS)}')
    return READERS[forms[0]](entry, folder)


def _drawn(entry: Entry, _folder: Path) -> OwnMap:
    entry.keys(["size", "shapes"], required=["size", "shapes"])
    size = entry.child("size")
    if len(size.entries()) != 2:
        raise size.expected("[width, height]")
    width, height = (_positive(side) for side in size.entries())
    shapes = entry.child("shapes").items()
    if len(shapes) > MOST_SHAPES:
        raise entry.error(
            f'"{entry.name}" has {len(shapes):,} shapes;'
            f" at most {MOST_SHAPES:,} are allowed"
        )
    return OwnMap(
        (width, height), tuple(_shape(shape, width, height) for shape in shapes)
    )


def _shape(
    entry: Entry, width: float, height: float
) -> tuple[float, float, float, float, float]:
    entry.keys(["disc", "rectangle"])
    if len(entry.value) != 1:
        raise entry.error("a shape is either a disc or a rectangle")
    kind = next(iter(entry.value))
    shape = entry.child(kind)
    sizes = ["radius"] if kind == "disc" else ["width", "height"]
    shape.keys(["x", "y", *sizes], required=["x", "y", *sizes])
    x, y = shape.child("x").number(), shape.child("y").number()
    lengths = [_positive(shape.child(name)) for name in sizes]
    half_width, half_height = (
        lengths * 2 if kind == "disc" else (lengths[0] / 2, lengths[1] / 2)
    )
    if not _meets(x, y, half_width, half_height, kind == "disc", width, height):
        raise shape.error(
            f"the {kind} lies outside the world, which is {width:g} x {height:g}"
        )
    return x, y, half_width, half_height, float(kind == "disc")


def _meets(
    x: float,
    y: float,
    half_width: float,
    half_height: float,
    disc: bool,
    width: float,
    height: float,
) -> bool:
    """Whether some of a shape lies within the world;
    nothing that is not finite does.
    """
    beside, beyond = max(-x, x - width, 0.0), max(-y, y - height, 0.0)
    if disc and not math.hypot(beside, beyond) < half_width:
        return False
    return (
        math.isfinite(x + y + half_width + half_height)
        and beside < half_width
        and beyond < half_height
    )


def _positive(entry: Entry) -> float:
    length = entry.number()
    if not 0 < length <= MOST_LENGTH:
        raise entry.expected(f"a number above 0, at most {MOST_LENGTH:g}")
    return length


def _pictured(entry: Entry, folder: Path) -> OwnMap:
    entry.keys(["image", "resolution"], required=["image", "resolution"])
    grey = _pixels(entry.child("image"), folder)
    return _of_pixels(
        entry.child("image"),
        255.0 - grey > HALF * 255.0,
        _positive(entry.child("resolution")),
    )


def _ros(entry: Entry, folder: Path) -> OwnMap:
    """ROS's map_server in its trinary mode: what is not known to be occupied counts as
    free.

    The origin is read by no one: the world begins in the corner of its map.
    """
    entry.keys(["ros"])
    path = folder / entry.child("ros").text()
    try:
        there = path.is_file()
    except OSError as error:
        raise entry.child("ros").error(f"cannot be read: {error.strerror}") from None
    if not there:
        raise entry.child("ros").error(
            f'there is no file "{path.name}" in {path.parent}'
        )
    root = read_document(path)
    for key in ("image", "resolution"):
        if not isinstance(root.value, dict) or key not in root.value:
            raise entry.child("ros").error(
                f'"{path.name}" is no ROS map: it has no key "{key}"'
            )
    mode, threshold, negate = (
        root.get("mode"),
        root.get("occupied_thresh"),
        root.get("negate"),
    )
    if mode:
        mode.one_of("mode", ["trinary"])
    least = threshold.number() if threshold else OCCUPIED
    if threshold and not 0 <= least <= 1:
        raise threshold.expected("a number from 0 to 1")
    light = _pixels(root.child("image"), path.parent)
    occupancy = (light if negate and negate.whole(0, 1) else 255.0 - light) / 255.0
    return _of_pixels(
        root.child("image"), occupancy > least, _positive(root.child("resolution"))
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
            f" at most {MOST_SHAPES:,} are allowed: make it coarser"
        )
        raise entry.error(f'the image "{entry.value}" {message}')
    rows, columns = occupied.shape
    return OwnMap(
        (columns * resolution, rows * resolution), tuple(map(tuple, obstacles.tolist()))
    )


READERS: dict[str, Callable[[Entry, Path], OwnMap]] = {
    "shapes": _drawn,
    "image": _pictured,
    "ros": _ros,
}
