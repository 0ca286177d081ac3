"""The form of the figure of a supplement: parameters as axes and colours.

The page draws the marks from the rows of the table of means.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import pandas as pd

from sweep.errors import ChoiceError
from sweep.figures import (
    MOST_BY_DEFAULT,
    MOST_COLOURS,
    Selection,
    axis_label,
    cell_boxes,
    has_scale,
    is_logarithmic,
    linear_part,
    metric_label,
    quantity,
)
from sweep.spec import Column
from sweep.tables import PointMeans, Results, spelled

Form = Literal["lines", "points", "cells", "rows"]


@dataclass(frozen=True)
class FigureForm:
    """The form of a figure, and the parameters of axes and colours.

    An empty string means no parameter. The forms are:

    - ``lines``: the metric against `x`, a curve per value of `by`
    - ``points``: like ``lines``, without the lines: points that agree in `x` and `by`
      differ in further parameters
    - ``cells``: the metric as a colour over `x` and `y`
    - ``rows``: the metric along x, and a row per point
    """

    form: Form
    x: str = ""
    y: str = ""
    by: str = ""


def form_of(selection: Selection, x: str, by: str) -> FigureForm:
    """Return the form that suits the parameters that vary.

    Parameters
    ----------
    selection : Selection
        The points of the figure.
    x : str
        The parameter that the user wants along the axis; "" for the parameter with the
        most values.
    by : str
        The parameter that the user wants as colour; "" for a suitable parameter.

    Raises
    ------
    ChoiceError
        If a parameter does not vary, if `x` has no numbers, or if `by` has too many
        values.
    """
    if x and not has_scale(selection.points[selection.setting(x)]):
        raise ChoiceError(
            f"x {x} has values that are not finite numbers; choose another parameter",
            selection.study.name,
        )
    names = [str(name) for name in selection.points]
    numbers = [name for name in names if has_scale(selection.points[name])]
    free = [name for name in numbers if name != by]
    across = x or max(free, key=lambda name: len(selection.values(name)), default="")
    if not across:
        return FigureForm("rows")
    differing = selection.apart([across])
    if by:
        _ = selection.colour(by, differing, [across])
        left = selection.apart([across, by])
        return FigureForm("points" if left else "lines", across, by=by)
    if len(selection.sampled) > 1:
        return FigureForm("points", across)
    if not differing:
        return FigureForm("lines", across)
    return _of_several(selection, across, differing, chosen=bool(x))


def _of_several(
    selection: Selection, across: str, differing: Sequence[str], *, chosen: bool
) -> FigureForm:
    """Return the form where points with an equal value of `across` differ.

    `differing` are the parameters that differ. `chosen` states that the user wants
    `across` on the axis.
    """
    first = differing[0]
    values = len(selection.values(first))
    if len(differing) == 1:
        if has_scale(selection.points[first]) and values > MOST_BY_DEFAULT:
            return FigureForm("cells", across, first)
        if values <= MOST_COLOURS:
            return FigureForm("lines", across, by=first)
    return FigureForm("points", across) if chosen else FigureForm("rows")


def figure_data(
    selection: Selection, form: FigureForm, table: PointMeans, column: Column
) -> dict[str, Any]:
    """Return the figure without the marks, ready for JSON.

    Parameters
    ----------
    selection : Selection
        The points of the figure.
    form : FigureForm
    table : PointMeans
        Means per point.
    column : Column
        The column of the metric.
    """
    study = selection.study
    name = str(column)
    counts = table.rows[f"{name}_n"]
    linear = linear_part(table.rows[name])
    each = {"cells": "one cell", "rows": "one row"}.get(form.form, "one mark")
    note = selection.note(
        f"{each} per point, {{n}} trials per point",
        counts,
        "mean with 95 % confidence interval",
        [name],
    )
    return {
        "form": form.form,
        "column": name,
        "metric": {
            "name": column.metric,
            "text": _text(study, column.metric),
            "unit": study.units.get(column.metric, ""),
        },
        "label": metric_label(quantity(study, name), linear),
        "linear": linear,
        "says": f"mean over {study.averaged}" if column.half else "at the last frame",
        "note": note,
        "x": _axis(selection, form.x),
        "y": _axis(selection, form.y),
        "by": _colours(selection, form.by),
    }


def cells_of(
    selection: Selection, form: FigureForm, column: Column
) -> dict[str, dict[str, Any]]:
    """Return the cell of each point with a value, by point id.

    Parameters
    ----------
    selection : Selection
        The points of the figure.
    form : FigureForm
    column : Column
        The column of the metric.

    Returns
    -------
    dict of str to dict
        Empty for another form than ``cells``. `box` has the left, right, lower and
        upper edge. Cells of a higher `order` lie over the other cells. `resolved` is as
        in `sweep.figures.FigureMarks`.
    """
    if form.form != "cells":
        return {}
    boxes = cell_boxes(selection, str(column), form.x, form.y)
    edges = boxes[["left", "right", "bottom", "top"]].to_numpy().tolist()
    return {
        point: {"box": box, "order": order, "resolved": bool(resolved)}
        for order, (point, box, resolved) in enumerate(
            zip(boxes["point"], edges, boxes["resolved"], strict=True)
        )
    }


def _text(study: Results, metric: str) -> str:
    """Return the description of a metric; for a derived metric, the name."""
    declared = study.known_metrics.get(metric)
    return declared.text if declared else metric.replace("_", " ")


def _axis(selection: Selection, name: str) -> dict[str, Any] | None:
    """Return an axis of numbers with the values."""
    if not name:
        return None
    values = np.array(selection.values(name), np.float64)
    logarithmic = bool(is_logarithmic(selection, name))
    return {
        "name": name,
        "label": axis_label(selection, name),
        "logarithmic": logarithmic,
        "values": values.tolist(),
    }


def _colours(selection: Selection, name: str) -> dict[str, Any] | None:
    if not name:
        return None
    return {
        "name": name,
        "label": quantity(selection.study, name),
        "values": [shown(value) for value in selection.values(name)],
    }


def shown(value: object) -> str:
    """Return the value of a parameter as text of the page."""
    return spelled(value).replace("_", " ") or "unchanged"


def named_row(row: "pd.Series[Any]", headings: Sequence[str]) -> str:
    """Return the words that distinguish a row from all other rows."""
    parts = [f"{name.replace('_', ' ')} {shown(row[name])}" for name in headings]
    return ", ".join(parts) or "the only point"
