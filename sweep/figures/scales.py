"""Axes of settings: linear and logarithmic scales of numbers, texts in their order, and
the edges of cells and bins.
"""

from collections.abc import Iterator, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Literal

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from numpy.typing import NDArray

from sweep.figures.drawing import quantity, words
from sweep.figures.selection import Selection, has_scale
from sweep.spec.axes import LOGSPACE
from sweep.spec.distributions import DISTRIBUTIONS
from sweep.spec.strict_yaml import parse_document

Floats = NDArray[np.float64]

DECADE = 10.0
LONG_NAMES = 12
MOST_TICKS = 12
LETTERS_OF_TICKS = 20
"""So many fit side by side below a panel."""


def places(selection: Selection, name: str, column: "pd.Series[float]") -> Floats:
    """Where values of a setting lie on its axis. A number lies at itself; what has no
    scale lies at 0, 1, ..., texts in the order of the spec.
    """
    if has_scale(selection.points[name]):
        return np.asarray(column, np.float64)
    order = {value: place for place, value in enumerate(selection.values(name))}
    return np.asarray([order[value] for value in column], np.float64)


def is_logarithmic(selection: Selection, name: str) -> bool:
    """Whether an axis of this setting is better logarithmic.

    That is so where the spec draws or spaces its values logarithmically. It is so for
    listed values over a decade or more, if their ratios are more even than their
    differences.
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
            for form in _forms(_document(selection.study.spec), name)
        )
    uneven = [
        float(np.std(steps) / np.mean(steps))
        for steps in (np.diff(np.log(values)), np.diff(values))
    ]
    return (
        len(values) > 2 and values[-1] >= DECADE * values[0] and uneven[0] < uneven[1]
    )


def cell_edges(values: Floats, *, logarithmic: bool = False) -> Floats:
    """The edges (k + 1,) of cells about k ascending values.

    An edge lies half-way between two values. The first and the last edge lie as far
    beyond the outer values.
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
    """The edges (number + 1,) of bins over the range of `values`, equally wide on a
    linear or a logarithmic scale.
    """
    space = np.geomspace if logarithmic else np.linspace
    return np.asarray(space(values.min(), values.max(), number + 1), np.float64)


def label_setting(
    selection: Selection, name: str, axes: Axes, direction: Literal["x", "y"] = "x"
) -> None:
    """Label an axis with the name and the unit of a setting, set its scale, and name
    its values where they have none.

    Ticks stand at listed values: at all of them, or at each second, third and so on
    where that is what fits.
    """
    axis = axes.xaxis if direction == "x" else axes.yaxis
    axis.set_label_text(quantity(selection.study, name))
    if not has_scale(selection.points[name]):
        names = [words(value) for value in selection.values(name)]
        axis.set_ticks(range(len(names)), names)
        if direction == "x" and _crowded(names):
            axes.tick_params(axis="x", labelrotation=40)
            for label in axes.get_xticklabels():
                label.set(ha="right", rotation_mode="anchor")
        axes.grid(visible=False, axis=direction)
        return
    if is_logarithmic(selection, name):
        (axes.set_xscale if direction == "x" else axes.set_yscale)("log")
    if name in selection.listed:
        values = [float(str(value)) for value in selection.values(name)]
        ticks = _that_fit(values, side_by_side=direction == "x")
        names = [f"{value:g}" for value in ticks]
        if direction == "x":
            names = _apart(ticks, names, logarithmic=is_logarithmic(selection, name))
        axis.set_ticks(ticks, names)
        axis.set_ticks([], minor=True)


def _apart(ticks: list[float], names: list[str], *, logarithmic: bool) -> list[str]:
    """The names of ticks on a panel, "" where one would run into that before it."""
    at = np.log(ticks) if logarithmic else np.array(ticks)
    letters = LETTERS_OF_TICKS * (at - at[0]) / (at[-1] - at[0] or 1.0)
    shown, end = list[str](), -np.inf
    for place, name in zip(letters, names, strict=True):
        fits = place - len(name) / 2.0 > end
        shown.append(name if fits else "")
        end = place + len(name) / 2.0 if fits else end
    return shown


def _that_fit(values: list[float], *, side_by_side: bool) -> list[float]:
    """Each k-th of ascending values, of as many as fit on an axis."""
    for every in range(1, len(values)):
        chosen = values[::every]
        letters = sum(len(f"{value:g}") + 1 for value in chosen)
        if len(chosen) <= MOST_TICKS and (
            not side_by_side or letters <= LETTERS_OF_TICKS
        ):
            return chosen
    return values[:1]


def _crowded(names: Sequence[str]) -> bool:
    return sum(len(name) for name in names) > LONG_NAMES


@lru_cache(maxsize=8)
def _document(spec: str) -> object:
    """A spec as plain values. Raises SpecError where it is none: it is stored, and may
    come from anyone.
    """
    return parse_document(spec, Path("the stored spec")).value


def _forms(value: object, name: str) -> Iterator[str]:
    """The keys of the mappings that stand below `name` anywhere in a spec, such as
    uniform or logspace.
    """
    if isinstance(value, dict):
        for key, child in value.items():
            if key == name and isinstance(child, dict):
                yield from (str(form) for form in child)
            yield from _forms(child, name)
