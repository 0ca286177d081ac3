"""Section `sizes` of a spec: flocks of several sizes, in worlds that grow with them.

It is an axis of the settings `n`, `width` and `height`, which vary together. All
functions raise SpecError, with file and line, for values that are not allowed.
"""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Literal, get_args

import numpy as np

from sweep.spec.axes import Axis, by_design
from sweep.spec.contents import ListOf, Number, OneOf, Whole
from sweep.spec.document import Entry
from sweep.spec.keys import Key, read_section
from sweep.spec.mistakes import Mistakes
from sweep.spec.settings import NotAllowedError, Setting, Value, Values

Kept = Literal["density", "box"]
NUMBER = "n"
SIDES = ("width", "height")


@dataclass(frozen=True, kw_only=True)
class Sizes:
    """The keys of the section."""

    n: Annotated[
        tuple[int, ...],
        Key(
            ListOf(Whole(1), "whole numbers from 1, ascending"),
            "numbers of boids, two or more of them, ascending",
            example="[64, 256, 1024]",
        ),
    ]
    keep: Annotated[
        Kept,
        Key(
            OneOf("quantity to keep", get_args(Kept)),
            "density: `width` and `height` grow with the root of `n`; box: they stay",
            example="box",
        ),
    ] = "density"
    density: Annotated[
        float | None,
        Key(
            Number(above=0, note="boids in a unit of area"),
            "that all worlds have; their shape is that of the preset",
            otherwise="that of the preset, its n in its width and height",
            example="0.4",
        ),
    ] = None

    @property
    def settings(self) -> tuple[str, ...]:
        """The settings to which the section gives values."""
        return (NUMBER, *SIDES) if self.keep == "density" else (NUMBER,)


def read_section_sizes(entry: Entry | None) -> Sizes | None:
    """Return the section, each value checked alone; None if there is none."""
    if entry is None:
        return None
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


def with_sizes(
    root: Entry,
    section: Sizes,
    axes: tuple[Axis, ...],
    preset: Mapping[str, Value],
    settings: Mapping[str, Setting],
) -> tuple[Axis, ...]:
    """Return axes with the axis of sizes first in each design.

    Parameters
    ----------
    root : Entry
        The whole spec.
    section : Sizes
    axes : tuple of Axis
    preset : mapping
        Values of the preset by setting.
    settings : mapping
        Settings by name.

    Returns
    -------
    tuple of Axis
    """
    entry = root.child("sizes")
    if any(axis.name == entry.name for axis in axes):
        raise entry.error(f'an axis of "sweep" is named "{entry.name}" too: rename it')
    axis = Axis(
        entry.name, _columns(entry, section, preset, settings), place=entry.place
    )
    return tuple(
        member
        for number, design in enumerate(by_design(axes))
        for member in (replace(axis, design=number), *design)
    )


def _columns(
    entry: Entry,
    section: Sizes,
    preset: Mapping[str, Value],
    settings: Mapping[str, Setting],
) -> dict[str, Values]:
    """Return the values of each setting, row by row.

    sqrt(n / density) is the side of a square world, with results identical to an
    expression under `derive`.
    """
    mistakes = Mistakes()
    columns: dict[str, Values] = {}
    n = np.array(section.n, np.float64)
    numbers: dict[str, list[object]] = {NUMBER: [*section.n]}
    if section.keep == "density":
        boids, width, height = (float(preset[name]) for name in (NUMBER, *SIDES))
        density = section.density or boids / (width * height)
        with np.errstate(over="ignore", invalid="ignore"):  # refused as what they are
            areas = n / density
            numbers["width"] = np.sqrt(areas * (width / height)).tolist()
            numbers["height"] = np.sqrt(areas * (height / width)).tolist()
    for name, values in numbers.items():
        with mistakes.noted():
            try:
                columns[name] = settings[name].column(values)
            except NotAllowedError as error:
                raise entry.child("n").child(error.index).error(str(error)) from None
    mistakes.check()
    return columns


def check_sizes(
    root: Entry, section: Sizes, maps: Iterable[str], sized: Collection[str]
) -> None:
    """Raise SpecError if worlds cannot grow.

    Parameters
    ----------
    root : Entry
        The whole spec.
    section : Sizes
    maps : iterable of str
        Maps that trials use.
    sized : collection of str
        Maps that have a width and height of their own, which cannot grow.
    """
    if section.keep != "density":
        return
    for name in maps:
        if name in sized:
            raise root.child("sizes").error(
                f'the map "{name}" has a width and a height of its own, which cannot'
                ' grow with n: choose a map without, or write "keep: box"'
            )
