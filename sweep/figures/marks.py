"""Figures as plain data: marks that the results explorer draws and a reader can click.

The module of a kind makes the marks from the layout and the table of the figure, so
that marks and figure show equal numbers.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd

from sweep.errors import ChoiceError
from sweep.figures.drawing import quantity, words
from sweep.figures.scales import (
    axis_label,
    is_logarithmic,
    linear_part,
    metric_label,
)
from sweep.figures.selection import Selection, has_scale
from sweep.figures.style import COLOURS

MOST_MARKS = 5000
"""The most marks of one figure."""
MOST_IDS = 50
"""The most points of a cell that a mark names."""
MOST_TRIALS = 5000
"""The most values of single trials in one figure."""
TRIALS_NOTE = "\nsmall dots: single trials"


class MarkedAxis(NamedTuple):
    """An axis of a panel.

    `names` are the names of the positions 0, 1, ... if the values are not numbers.
    Ticks are at the `listed` values. Marks beyond `low` or `high` are drawn at the
    edge. An axis with a `linear` part ends the part at ±`linear`, and is logarithmic
    beyond; see `sweep.figures.scales.linear_part`.
    """

    name: str
    label: str
    logarithmic: bool = False
    names: tuple[str, ...] = ()
    listed: tuple[float, ...] = ()
    low: float | None = None
    high: float | None = None
    linear: float = 0.0


class MarkedLine(NamedTuple):
    """A line behind the marks, with the label `text`."""

    x: Sequence[float] = ()
    y: Sequence[float] = ()
    text: str = ""


class MarkedPanel(NamedTuple):
    """A panel: title, axes, and `marks` with a row per mark.

    `FigureMarks` describes the columns of the marks. `span` has the left, right, lower
    and upper end of the cells of all panels; it is empty for other marks. `trials` has
    a row per value of a single trial, with the columns x, y, colour, trial, replicate
    and point; it is None for a figure without trials.
    """

    title: str
    x: MarkedAxis
    y: MarkedAxis
    marks: pd.DataFrame
    span: tuple[float, ...] = ()
    line: MarkedLine = MarkedLine()
    trials: pd.DataFrame | None = None


class FigureMarks(NamedTuple):
    """The marks of a figure.

    `form` determines the columns of `marks`:

    - "lines": x, y, low, high and n. A mark is a position on the line of a `colour`,
      with a band.
    - "paths": as "lines". The positions of one point are joined in order.
    - "points": as "lines", with x_low and x_high if x is a mean too. `best` is true for
      a mark on a front.
    - "cells": the columns of `sweep.figures.cells.cell_table`. Later cells lie over
      earlier cells.

    `colour` is the index of a value in `values`, the values of `by`. `point` is the id
    of the point behind a mark, or several ids with spaces in between. `metrics` have
    the form that `sweep plot --metric` takes. `note` is the text below the figure.
    `thinned` reports how many marks are left, and is "" if all marks are left.
    `linear` is the end of the linear part of the colours of cells, as on a
    `MarkedAxis`.
    """

    form: str
    metrics: tuple[str, ...]
    panels: list[MarkedPanel]
    note: str
    by: str = ""
    values: tuple[str, ...] = ()
    colours: tuple[str, ...] = COLOURS
    thinned: str = ""
    linear: float = 0.0


def axis_of(selection: Selection, name: str) -> MarkedAxis:
    """Return the axis of a parameter."""
    label = axis_label(selection, name)
    if has_scale(selection.points[name]):
        listed = selection.values(name) if name in selection.listed else ()
        ticks = tuple(float(str(value)) for value in listed)
        logarithmic = bool(is_logarithmic(selection, name))
        return MarkedAxis(name, label, logarithmic, listed=ticks)
    names = tuple(words(value) for value in selection.values(name))
    return MarkedAxis(name, label, names=names)


def axis_of_metric(
    selection: Selection, name: str, values: "pd.Series[float]"
) -> MarkedAxis:
    """Return the axis of a metric, on a scale that suits the values.

    Parameters
    ----------
    selection : Selection
    name : str
        Column of the metric.
    values : Series
        The values in all panels of the figure.
    """
    linear = linear_part(values)
    label = metric_label(quantity(selection.study, name), linear)
    return MarkedAxis(name, label, linear=linear)


def colours_of(
    selection: Selection, by: str | None, points: pd.DataFrame
) -> "pd.Series[int]":
    """Return the index of the colour of each point, by the ids of the points.

    Parameters
    ----------
    selection : Selection
    by : str or None
        Parameter of the colours; if None, all points have colour 0.
    points : DataFrame
        Rows are points, with the column `by`.
    """
    if not by:
        return pd.Series(0, points.index)
    order = {value: place for place, value in enumerate(selection.values(by))}
    return points[by].map(order).astype(int)


def legend_of_marks(
    selection: Selection, by: str | None
) -> tuple[str, tuple[str, ...]]:
    """Return the label and the values of the parameter of the colours."""
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


def values_of_trials(
    selection: Selection, by: str | None, metrics: Mapping[str, str]
) -> pd.DataFrame:
    """Return the values of metrics of each trial of which the means are drawn.

    Parameters
    ----------
    selection : Selection
    by : str or None
        Parameter of the colours.
    metrics : mapping of str to str
        Metrics by the name of the axis: "x" or "y".

    Returns
    -------
    DataFrame
        A row per done trial with a finite value of each metric. The columns are the
        axes, colour, trial, replicate and point.
    """
    done = selection.trials[selection.study.done]
    values = done[[*metrics.values()]].to_numpy(np.float64)
    finite = done[np.isfinite(values).all(axis=1)]
    points = selection.points.loc[finite["point"]]
    columns = {
        **{axis: finite[name].to_numpy(np.float64) for axis, name in metrics.items()},
        "colour": colours_of(selection, by, points).to_numpy(),
        "trial": finite["trial_id"].to_numpy(),
        "replicate": finite["replicate"].to_numpy(),
        "point": finite["point"].to_numpy(),
    }
    return pd.DataFrame(columns)


def allow_trials(selection: Selection, number: int, kind: str) -> None:
    """Raise ChoiceError for more than MOST_TRIALS values of single trials.

    Parameters
    ----------
    selection : Selection
    number : int
        Number of values in the figure.
    kind : str
        Kind of the figure, for the error.
    """
    if number > MOST_TRIALS:
        raise ChoiceError(
            f"has {number:,} values of trials; allowed: up to {MOST_TRIALS:,};"
            f" choose with where, {selection.example([*selection.points])}",
            selection.study.name,
            kind,
        )


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
