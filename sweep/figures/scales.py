"""Axes: scales of numbers, strings in order, edges of cells and bins.

A scale is linear, logarithmic, or linear around 0 and logarithmic beyond.
"""

from collections.abc import Iterator, Sequence
from functools import lru_cache
from pathlib import Path
from textwrap import wrap
from typing import Any, Literal

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.ticker import LogFormatterSciNotation, NullFormatter
from numpy.typing import ArrayLike, NDArray

from sweep.figures.drawing import quantity, words
from sweep.figures.selection import Selection, has_scale
from sweep.spec import DISTRIBUTIONS, LOGSPACE, parse_document
from sweep.tables import stored_parts

Floats = NDArray[np.float64]

DECADE = 10.0
LONG_NAMES = 12
"""The most characters of names that stay upright below a panel."""
LONG_LINE = 16
"""The most characters of a line of a turned name."""
MOST_TICKS = 12
LETTERS_OF_TICKS = 20
"""The most characters of ticks that fit side by side below a panel."""
CROWDED = 0.8
"""The fraction of values that a linear axis must not press together."""
PRESSED = 0.1
"""The fraction of a linear axis in which values are pressed together."""
FEWEST_CROWDED = 5
ROUNDING = 1e-12
"""The size below which a value counts as 0, relative to the largest value."""
PLAIN_POWERS = (-3, 4)
"""The powers of ten that ticks of logarithmic axes write as numbers."""
RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def places(selection: Selection, name: str, column: "pd.Series[float]") -> Floats:
    """Return the positions of values of a parameter on an axis.

    The position of a number is the number. Values without a scale have the positions 0,
    1, ...; strings are in the order of the spec.

    Parameters
    ----------
    selection : Selection
    name : str
        Name of the parameter.
    column : Series
        Values of the parameter.
    """
    if has_scale(selection.points[name]):
        return np.asarray(column, np.float64)
    order = {value: place for place, value in enumerate(selection.values(name))}
    return np.asarray([order[value] for value in column], np.float64)


def is_logarithmic(selection: Selection, name: str) -> bool:
    """Return True if a logarithmic axis suits a parameter better than a linear one.

    A logarithmic axis suits values that the spec samples or spaces logarithmically. A
    logarithmic axis also suits listed values over a decade or more, if the ratios are
    more even than the differences.
    """
    if not has_scale(selection.points[name]):
        return False
    values = np.array(selection.values(name), np.float64)
    if values[0] <= 0.0:
        return False
    if name in selection.sampled:
        return any(
            form == LOGSPACE
            or (form in DISTRIBUTIONS and DISTRIBUTIONS[form].logarithmic)
            for part in stored_parts(selection.study)
            for form in _forms(_document(part.spec), name)
        )
    uneven = [
        float(np.std(steps) / np.mean(steps))
        for steps in (np.diff(np.log(values)), np.diff(values))
    ]
    return (
        len(values) > 2 and values[-1] >= DECADE * values[0] and uneven[0] < uneven[1]
    )


def linear_part(values: ArrayLike) -> float:
    """Return the end of the linear part of the axis of a metric; 0 for a linear axis.

    A linear axis suits unless a few values press the other values together. That is so
    if four fifths of at least five values other than 0 are below a tenth of the
    largest value. All sizes are without the sign. Then the axis is linear up to the
    largest power of ten that four fifths of the values reach, and logarithmic beyond.
    """
    sizes = np.sort(np.abs(np.asarray(values, np.float64)).ravel())
    sizes = sizes[np.isfinite(sizes)]
    sizes = sizes[sizes > ROUNDING * sizes.max(initial=0.0)]
    if len(sizes) < FEWEST_CROWDED:
        return 0.0
    most = sizes[int(np.ceil(CROWDED * len(sizes))) - 1]
    if most >= PRESSED * sizes[-1]:
        return 0.0
    return float(DECADE ** np.floor(np.log10(most)))


def metric_label(label: str, linear: float) -> str:
    """Return the label of the axis of a metric, with the end of the linear part."""
    if not linear:
        return label
    return f"{label}, log scale beyond ±{number_text(linear)}"


def number_text(value: float) -> str:
    """Return a number at a tick of a logarithmic axis, such as 0.01, 500 or 10⁻⁷."""
    sign = "\N{MINUS SIGN}" if value < 0.0 else ""
    size = abs(value)
    power = int(np.floor(np.log10(size) + ROUNDING)) if size else 0
    low, high = PLAIN_POWERS
    if low <= power <= high:
        return f"{sign}{size:g}"
    times = f"{size / DECADE**power:g}"
    factor = "" if times == "1" else f"{times}\N{MULTIPLICATION SIGN}"
    return f"{sign}{factor}10{str(power).translate(RAISED)}"


class TickNumbers(LogFormatterSciNotation):
    """Numbers at the ticks of logarithmic axes, in letters of one size.

    The raised letters of matplotlib would be smaller than journals print.
    """

    def __call__(self, x: float, pos: int | None = None) -> str:
        """Return the text of a tick, or "" for a tick without a number."""
        return number_text(x) if super().__call__(x, pos) else ""


def make_logarithmic(
    axes: Axes, direction: Literal["x", "y"], *, linear: float = 0.0
) -> None:
    """Make an axis logarithmic.

    Parameters
    ----------
    axes : Axes
    direction : {"x", "y"}
    linear : float, default 0.0
        The end of the linear part of the axis; 0 for none.
    """
    scale: dict[str, Any] = {"linthresh": linear} if linear else {}
    set_scale = axes.set_xscale if direction == "x" else axes.set_yscale
    set_scale("symlog" if linear else "log", **scale)
    axis = axes.xaxis if direction == "x" else axes.yaxis
    axis.set_major_formatter(TickNumbers())
    axis.set_minor_formatter(NullFormatter() if linear else TickNumbers())
    axes.autoscale_view(scalex=direction == "x", scaley=direction == "y")


def cell_edges(values: Floats, *, logarithmic: bool = False) -> Floats:
    """Return the edges (k + 1,) of cells around k ascending values.

    Inner edges are half-way between two values. An outer value has equal distances from
    the inner and the outer edge of the cell.
    """
    at = np.log(values) if logarithmic else np.asarray(values, np.float64)
    if len(at) == 1:
        return (
            np.exp([at[0] - 1.0, at[0] + 1.0])
            if logarithmic
            else np.array([at[0] - 1.0, at[0] + 1.0])
        )
    middle = (at[1:] + at[:-1]) / 2
    edges = np.concatenate([[2 * at[0] - middle[0]], middle, [2 * at[-1] - middle[-1]]])
    return np.exp(edges) if logarithmic else edges


def bin_edges(values: Floats, number: int, *, logarithmic: bool = False) -> Floats:
    """Return the edges of bins of equal width.

    Parameters
    ----------
    values : ndarray
        The bins divide the range of these values.
    number : int
        Number of bins.
    logarithmic : bool, default False
        Make the widths equal on a logarithmic scale.

    Returns
    -------
    ndarray, shape (number + 1,)
    """
    space = np.geomspace if logarithmic else np.linspace
    return np.asarray(space(values.min(), values.max(), number + 1), np.float64)


def axis_label(selection: Selection, name: str) -> str:
    """Return the label of the axis of a parameter: name, unit, and a log scale."""
    scale = ", log scale" if is_logarithmic(selection, name) else ""
    return f"{quantity(selection.study, name)}{scale}"


def label_setting(
    selection: Selection, name: str, axes: Axes, direction: Literal["x", "y"] = "x"
) -> None:
    """Set the label, the scale and the ticks of an axis of a parameter.

    The label has the name, the unit, and "log scale". Ticks of values without a scale
    are names. Listed values get ticks: all values, or every second, third and so on, as
    many as fit.

    Parameters
    ----------
    selection : Selection
    name : str
        Name of the parameter.
    axes : Axes
    direction : {"x", "y"}, default "x"
    """
    axis = axes.xaxis if direction == "x" else axes.yaxis
    axis.set_label_text(axis_label(selection, name))
    if not has_scale(selection.points[name]):
        labels = [words(value) for value in selection.values(name)]
        turned = direction == "x" and _crowded(labels)
        if turned:
            labels = ["\n".join(wrap(text, LONG_LINE)) for text in labels]
        axis.set_ticks(range(len(labels)), labels)
        if turned:
            axes.tick_params(axis="x", labelrotation=40)
            for label in axes.get_xticklabels():
                label.set(ha="right", rotation_mode="anchor")
        axes.grid(visible=False, axis=direction)
        return
    if is_logarithmic(selection, name):
        make_logarithmic(axes, direction)
    if name in selection.listed:
        values = [float(str(value)) for value in selection.values(name)]
        ticks = _that_fit(values, side_by_side=direction == "x")
        labels = [f"{value:g}" for value in ticks]
        if direction == "x":
            labels = _apart(ticks, labels, logarithmic=is_logarithmic(selection, name))
        axis.set_ticks(ticks, labels)
        axis.set_ticks([], minor=True)


def _apart(ticks: list[float], labels: list[str], *, logarithmic: bool) -> list[str]:
    """Return the names of ticks on a panel, "" for a name that would overlap."""
    at = np.log(ticks) if logarithmic else np.array(ticks)
    letters = LETTERS_OF_TICKS * (at - at[0]) / (at[-1] - at[0] or 1.0)
    shown = list[str]()
    end = -np.inf
    for place, name in zip(letters, labels, strict=True):
        fits = place - len(name) / 2.0 > end
        shown.append(name if fits else "")
        end = place + len(name) / 2.0 if fits else end
    return shown


def _that_fit(values: list[float], *, side_by_side: bool) -> list[float]:
    """Return every k-th of ascending values, with the smallest k so that ticks fit."""
    for every in range(1, len(values)):
        chosen = values[::every]
        letters = sum(len(f"{value:g}") + 1 for value in chosen)
        if len(chosen) <= MOST_TICKS and (
            not side_by_side or letters <= LETTERS_OF_TICKS
        ):
            return chosen
    return values[:1]


def _crowded(labels: Sequence[str]) -> bool:
    return sum(len(name) for name in labels) > LONG_NAMES


@lru_cache(maxsize=8)
def _document(spec: str) -> object:
    """Read a stored spec as plain values.

    Raises SpecError for a string that is not a spec, since a store may be untrusted.
    """
    return parse_document(spec, Path("the stored spec")).value


def _forms(value: object, name: str) -> Iterator[str]:
    """Return the keys of all mappings below a name in a spec, such as uniform."""
    if isinstance(value, dict):
        for key, child in value.items():
            if key == name and isinstance(child, dict):
                yield from (str(form) for form in child)
            yield from _forms(child, name)
