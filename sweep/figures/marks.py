"""Figures as plain data: the marks that a page draws and that a reader can click.

The module of a kind makes the marks from the same layout and the same table as its
picture, so that both show the same numbers.
"""

from collections.abc import Sequence
from typing import NamedTuple

import pandas as pd

from sweep.errors import ChoiceError
from sweep.figures.drawing import quantity, words
from sweep.figures.scales import is_logarithmic
from sweep.figures.selection import Selection, has_scale
from sweep.figures.style import COLOURS

MOST_MARKS = 5000
"""So many marks are made for one figure."""
MOST_IDS = 50
"""So many points of a cell are named."""


class MarkedAxis(NamedTuple):
    """An axis: its label, whether its scale is logarithmic, and the names of the places
    0, 1, ... where its values are no numbers. Ticks stand at the `listed` values. What
    lies beyond `low` or `high` is drawn at the edge.
    """

    name: str
    label: str
    logarithmic: bool = False
    names: tuple[str, ...] = ()
    listed: tuple[float, ...] = ()
    low: float | None = None
    high: float | None = None


class MarkedLine(NamedTuple):
    """A line behind the marks, through these places, and what it is."""

    x: Sequence[float] = ()
    y: Sequence[float] = ()
    text: str = ""


class MarkedPanel(NamedTuple):
    """A panel: its title, its axes, a row a mark, see `FigureMarks`, and a line."""

    title: str
    x: MarkedAxis
    y: MarkedAxis
    marks: pd.DataFrame
    edges: tuple[list[float], list[float]] = ([], [])
    line: MarkedLine = MarkedLine()


class FigureMarks(NamedTuple):
    """The marks of a figure.

    `form` says what a row of `marks` is, by its columns.

        lines   x, y, low, high, n: a place on the line of its `colour`, with a band
        paths   the same; the places of one point are joined, in their order
        points  the same; x_low and x_high where x is a mean too; best where it lies on
                a front
        cells   column, row, y, half, n: half the width of the interval; points, how
                many; resolved, whether a step to a neighbour is wider than the interval

    `colour` is the number of one of `values`, the values of `by`; `point` the id of the
    point behind a mark, or several with a space between them. `metrics` are those
    shown, as `sweep plot --metric` takes them. `note` is what the figure says of
    itself, and `thinned` how many marks stand for how many, "" for all.
    """

    form: str
    metrics: tuple[str, ...]
    panels: list[MarkedPanel]
    note: str
    by: str = ""
    values: tuple[str, ...] = ()
    colours: tuple[str, ...] = COLOURS
    thinned: str = ""


def axis_of(selection: Selection, name: str) -> MarkedAxis:
    """The axis of a setting."""
    label = quantity(selection.study, name)
    if has_scale(selection.points[name]):
        listed = selection.values(name) if name in selection.listed else ()
        ticks = tuple(float(str(value)) for value in listed)
        logarithmic = bool(is_logarithmic(selection, name))
        return MarkedAxis(name, label, logarithmic, listed=ticks)
    names = tuple(words(value) for value in selection.values(name))
    return MarkedAxis(name, label, names=names)


def colours_of(
    selection: Selection, by: str | None, points: pd.DataFrame
) -> "pd.Series[int]":
    """The number of the colour of each of these points, by their ids."""
    if not by:
        return pd.Series(0, points.index)
    order = {value: place for place, value in enumerate(selection.values(by))}
    return points[by].map(order).astype(int)


def legend_of_marks(
    selection: Selection, by: str | None
) -> tuple[str, tuple[str, ...]]:
    """The name of what colours stand for, and its values in words."""
    if not by:
        return "", ()
    return quantity(selection.study, by), tuple(map(words, selection.values(by)))


def means_of(
    table: pd.DataFrame,
    metric: str,
    axis: str = "y",
    ends: tuple[str, str] = ("low", "high"),
) -> dict[str, "pd.Series[float]"]:
    """The columns of the means of a metric with their intervals, and of how many
    values.
    """
    low, high = ends
    return {
        axis: table[metric],
        low: table[f"{metric}_low"],
        high: table[f"{metric}_high"],
        "n": table[f"{metric}_n"],
    }


def thinned(marks: FigureMarks) -> FigureMarks:
    """At most MOST_MARKS marks, evenly chosen; what stands for a whole cell is never
    left out: too many of those raise ChoiceError.
    """
    total = sum(len(panel.marks) for panel in marks.panels)
    if total <= MOST_MARKS:
        return marks
    if marks.form == "cells":
        raise ChoiceError(
            f"has {total:,} cells; allowed: up to {MOST_MARKS:,}; choose with where"
        )
    every = -(-total // MOST_MARKS)
    panels = [panel._replace(marks=panel.marks.iloc[::every]) for panel in marks.panels]
    return marks._replace(panels=panels, thinned=f"1 of {every:,} marks of {total:,}")
