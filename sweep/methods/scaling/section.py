"""Section `sizes` of a spec: flocks of several sizes, in worlds that grow with n.

The section is an axis of the parameters `n`, `width` and `height`, which vary together.
All functions raise SpecError, with file and line, for values that are not allowed.
"""

from dataclasses import dataclass
from typing import Annotated, Literal, get_args

import numpy as np

from sweep.spec import (
    Axis,
    Entry,
    Key,
    LaterSectionOf,
    ListOf,
    Mistakes,
    NotAllowedError,
    Number,
    OneOf,
    SpecContext,
    SpecSection,
    Values,
    Whole,
    read_section,
)

Kept = Literal["density", "box"]
NUMBER = "n"
SIDES = ("width", "height")


@dataclass(frozen=True, kw_only=True)
class Sizes:
    """The keys of the section."""

    n: Annotated[
        tuple[int, ...],
        Key(
            ListOf(Whole(1), "integers from 1, ascending"),
            "two or more numbers of boids, ascending",
            example="[64, 256, 1024]",
        ),
    ]
    keep: Annotated[
        Kept,
        Key(
            OneOf("quantity to keep", get_args(Kept)),
            "density: `width` and `height` grow with the root of `n`; box: constant",
            example="box",
        ),
    ] = "density"
    density: Annotated[
        float | None,
        Key(
            Number(above=0, note="boids per unit of area"),
            "density of all worlds; the shape of a world comes from the preset",
            otherwise="density of the preset: n per width times height",
            example="0.4",
        ),
    ] = None


KEY = Key(
    LaterSectionOf(Sizes),
    "an axis of flocks of several sizes, in worlds that grow with `n`; combined with"
    " the axes of `sweep`, as the first axis",
    name="sizes",
    otherwise="none",
)


def read_sizes(root: Entry, _context: SpecContext) -> Sizes:
    """Return the section, with separate checks of each value."""
    entry = root.child(KEY.name)
    section = read_section(Sizes, entry)
    if len(section.n) < 2 or sorted({*section.n}) != [*section.n]:
        listed = ", ".join(map(str, section.n))
        raise entry.child("n").error(
            f'"n" must be two or more numbers of boids, ascending, not [{listed}]'
        )
    if section.density is not None and section.keep != "density":
        raise entry.child("density").error(
            f'"keep: {section.keep}" keeps width and height: leave "density" out'
        )
    return section


def _axis(root: Entry, section: Sizes, context: SpecContext) -> Axis:
    """Return the axis of the sizes."""
    entry = root.child(KEY.name)
    return Axis(entry.name, _columns(entry, section, context), place=entry.place)


def _columns(entry: Entry, section: Sizes, context: SpecContext) -> dict[str, Values]:
    """Return the values of each parameter, row by row.

    sqrt(n / density) is the side of a square world, with results identical to an
    expression under `derive`.
    """
    mistakes = Mistakes()
    preset = context.preset
    columns: dict[str, Values] = {}
    n = np.array(section.n, np.float64)
    numbers: dict[str, list[object]] = {NUMBER: [*section.n]}
    if section.keep == "density":
        boids, width, height = (float(preset[name]) for name in (NUMBER, *SIDES))
        density = section.density or boids / (width * height)
        with np.errstate(over="ignore", invalid="ignore"):  # rejected below
            areas = n / density
            numbers["width"] = np.sqrt(areas * (width / height)).tolist()
            numbers["height"] = np.sqrt(areas * (height / width)).tolist()
    for name, values in numbers.items():
        with mistakes.noted():
            try:
                columns[name] = context.settings[name].column(values)
            except NotAllowedError as error:
                raise entry.child("n").child(error.index).error(str(error)) from None
    mistakes.check()
    return columns


def _check(root: Entry, section: Sizes, context: SpecContext) -> None:
    """Raise SpecError if worlds cannot grow, because the map of a trial has a size."""
    if section.keep != "density":
        return
    for name in _maps_used(context):
        drawn = context.maps.get(name) or context.metrics.catalogue.maps[name]
        if drawn.size:
            raise root.child(KEY.name).error(
                f'the map "{name}" has a fixed width and height, which cannot grow with'
                ' n: choose a map without a size, or write "keep: box"'
            )


def _maps_used(context: SpecContext) -> list[str]:
    """Return the maps of the points of a study."""
    axes = context.axes or ()
    swept = [axis.columns["map"] for axis in axes if "map" in axis.columns]
    if not swept:
        return [str(context.fixed.get("map", context.preset["map"]))]
    return [*dict.fromkeys(str(name) for column in swept for name in column.tolist())]


SECTION = SpecSection(
    KEY,
    read=read_sizes,
    axis=_axis,
    check=_check,
)
