"""Figures as plain data: marks that the results explorer draws and a reader can click.

The module of a kind makes the marks from the layout and the table of its figure, so
that both show the same numbers.
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
"""The most marks of one figure."""
MOST_IDS = 50
"""The most points of a cell that a mark names."""


class MarkedAxis(NamedTuple):
    """An axis of a panel.

    `names` are the names of the places 0, 1, ... if the values are not numbers. Ticks
    are at the `listed` values. Marks beyond `low` or `high` are drawn at the edge.
    """

    name: str
    label: str
    logarithmic: bool = False
    names: tuple[str, ...] = ()
    listed: tuple[float, ...] = ()
    low: float | None = None
    high: float | None = None


class MarkedLine(NamedTuple):
    """A line behind the marks, and a `text` that names it."""

    x: Sequence[float] = ()
    y: Sequence[float] = ()
    text: str = ""


class MarkedPanel(NamedTuple):
    """A panel: its title, its axes, and `marks` with one row per mark.

    `FigureMarks` describes the columns of the marks. `edges` are those of cells along x
    and y.
    """

    title: str
    x: MarkedAxis
    y: MarkedAxis
    marks: pd.DataFrame
    edges: tuple[list[float], list[float]] = ([], [])
    line: MarkedLine = MarkedLine()


class FigureMarks(NamedTuple):
    """The marks of a figure.

    `form` names the columns of `marks`.

        lines   x, y, low, high, n: a place on the line of its `colour`, with a band
        paths   the same; the places of one point are joined, in their order
        points  the same; x_low and x_high if x is a mean too; best is true for a mark
                on a front
        cells   column, row, y, half, n: half-width of the interval; points: their
                number; resolved: false if the interval is wider than each step to a
                neighbour

    `colour` is the index of a value in `values`, the values of `by`. `point` is the id
    of the point behind a mark, or several ids with a space between them. `metrics` have
    the form that `sweep plot --metric` takes. `note` is the text below the figure.
    `thinned` tells how many of the marks are left, "" if all are.
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
    """Return the axis of a parameter."""
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
    """Return the index of the colour of each point, by the ids of the points.

    Parameters
    ----------
    selection : Selection
    by : str or None
        Parameter whose values are colours; without one all points have colour 0.
    points : DataFrame
        One row per point, with the column `by`.
    """
    if not by:
        return pd.Series(0, points.index)
    order = {value: place for place, value in enumerate(selection.values(by))}
    return points[by].map(order).astype(int)


def legend_of_marks(
    selection: Selection, by: str | None
) -> tuple[str, tuple[str, ...]]:
    """Return the label of the parameter whose values are colours, and its values."""
    if not by:
        return "", ()
    return quantity(selection.study, by), tuple(map(words, selection.values(by)))


def means_of(
    table: pd.DataFrame,
    metric: str,
    axis: str = "y",
    ends: tuple[str, str] = ("low", "high"),
) -> dict[str, "pd.Series[float]"]:
    """Return the columns of marks that show the means of a metric.

    Parameters
    ----------
    table : DataFrame
        A table of `Selection.table`.
    metric : str
    axis : str, default "y"
        Name of the column of the means.
    ends : tuple of two str, default ("low", "high")
        Names of the columns with the bounds of the confidence intervals.

    Returns
    -------
    dict of str to Series
        The three columns, and "n", the number of values of each mean.
    """
    low, high = ends
    return {
        axis: table[metric],
        low: table[f"{metric}_low"],
        high: table[f"{metric}_high"],
        "n": table[f"{metric}_n"],
    }


def thinned(marks: FigureMarks) -> FigureMarks:
    """Return the figure with at most MOST_MARKS marks, evenly chosen.

    A mark of a cell is never left out. Raises ChoiceError for too many cells.
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
