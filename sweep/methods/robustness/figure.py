"""The figure of the conclusions of a study in its variants.

The figure has one row per conclusion, with the difference in the study and in each
variant.
"""

from functools import partial
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from matplotlib import style
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sweep.errors import ChoiceError
from sweep.figures import (
    COLOURS,
    GREY,
    MARKERS,
    STYLE,
    VERMILION,
    Choices,
    FigureKind,
    Planned,
    draw_values,
    legend,
    name_rows,
    named,
    note,
    quantity,
    select,
)
from sweep.methods.robustness.analysis import (
    AS_IT_IS,
    TURNS,
    UNJUDGED,
    Validity,
    check_conclusions,
)
from sweep.spec import Column, Over, is_half
from sweep.tables import StoredStudy

MOST_ROWS = 60
MOST_COLUMNS = 6
ROW = 0.16
"""Distance between rows, in inches."""
MARK = 0.075
"""Distance between the marks of a row, in inches."""
FRAME = 1.5
"""Height around the panel, in inches."""
WIDTH = 7.2
"""Width of the figure, in inches."""


class Conclusions(NamedTuple):
    """Content of the figure of one column."""

    validity: Validity
    column: str


def validity_figure(
    study: StoredStudy, metric: str, *, over: Over = "last", half: bool = False
) -> Figure:
    """Plot the differences between each point and the first point along an axis.

    The figure shows the differences of one metric with confidence intervals, in the
    study and in each variant of `validate`: time step, neighbour search and order of
    updates.

    Parameters
    ----------
    study : StoredStudy
        A study whose spec has `validate`.
    metric : str
    over : {"last", "half"}, default "last"
        Last frames, or means over the second half of each trial.
    half : bool, default False
        The older form of `over="half"`.

    Returns
    -------
    Figure

    Raises
    ------
    ChoiceError
        The spec has no `validate`, or there are more than 60 differences.
    """
    return draw_validity(validity_layout(study, metric, half=is_half(over, half)))


def validity_layout(
    study: StoredStudy, metric: str, *, half: bool = False
) -> Conclusions:
    """Return the content of `validity_figure`.

    Parameters
    ----------
    study : StoredStudy
    metric : str
    half : bool, default False
        Take means over the second half of each trial, not the last frame.

    Returns
    -------
    Conclusions

    Raises
    ------
    ChoiceError
        The spec has no `validate`, or there are more than 60 differences.
    """
    validity = check_conclusions(study, metric, half=half)
    if len(validity.conclusions) > MOST_ROWS:
        raise ChoiceError(
            f"has {len(validity.conclusions):,} differences; allowed: up to"
            f" {MOST_ROWS}; choose with where",
            study.name,
            "validity",
        )
    return Conclusions(validity, str(validity.rows["metric"].iloc[0]))


def draw_validity(layout: Conclusions) -> Figure:
    """Draw the figure of a layout."""
    validity = layout.validity
    conclusions = validity.conclusions
    per_row = len(validity.variants) + 1
    with style.context(STYLE):
        height = FRAME + len(conclusions) * (ROW + MARK * per_row)
        figure = Figure(figsize=(WIDTH, height))
        axes = figure.subplots()
        axes.axvline(0.0, color=GREY, linewidth=0.8)
        _rows(axes, validity, per_row)
        name_rows(axes, [_name(validity, row) for _, row in conclusions.iterrows()])
        axes.tick_params(axis="y", labelsize=7)
        for place, outcome in enumerate(conclusions["outcome"]):
            if outcome == TURNS:
                span = (place - 0.5, place + 0.5)
                axes.axhspan(*span, color=VERMILION, alpha=0.15, lw=0, zorder=0.5)
            axes.text(
                1.01,
                place,
                outcome,
                transform=axes.get_yaxis_transform(),
                fontsize=7,
                va="center",
            )
        axes.set_xlabel(f"difference of mean {quantity(validity.study, layout.column)}")
        legend(figure, axes, MOST_COLUMNS)
        note(figure, _note(validity))
    return figure


def _rows(axes: Axes, validity: Validity, per_row: int) -> None:
    """Draw the differences, variant by variant."""
    descriptions = [AS_IT_IS, *validity.variants.values()]
    shown = validity.rows[validity.rows["outcome"] != UNJUDGED]
    for number, (name, label) in enumerate(
        zip([AS_IT_IS, *validity.variants], descriptions, strict=True)
    ):
        table = shown[shown["variant"] == name]
        if table.empty:
            continue
        offset = 0.7 * ((number + 0.5) / per_row - 0.5)
        draw_values(
            axes,
            table.index.to_numpy() // per_row + offset,
            (table["difference"], table["low"], table["high"]),
            GREY if number == 0 else COLOURS[(number - 1) % len(COLOURS)],
            marker=MARKERS[number % len(MARKERS)],
            label=label,
        )


def _name(validity: Validity, row: "pd.Series[Any]") -> str:
    point = named((name, row[name]) for name in validity.settings)
    return f"{point}\nagainst {str(row['against']).replace('_', ' ')}"


def _note(validity: Validity) -> str:
    counts = validity.study.trials["point"].value_counts().to_numpy(np.int64)
    text = (
        f"lines: simultaneous {100 * validity.confidence:g} % confidence intervals"
        " (Bonferroni); {n} trials per point"
    )
    for name, bits in validity.bits.items():
        text += (
            f"; {validity.variants[name]}: {bits.same:,} of {bits.trials:,} trials"
            " bitwise identical"
        )
    return select(validity.study).note(text, counts)


def plan(study: StoredStudy, choices: Choices) -> list[Planned]:
    """Return a figure per metric. ChoiceError if the study has no variants."""
    columns = [(name, Column.read(name)) for name in choices.plain(study)]
    layouts = {
        name: validity_layout(study, column.metric, half=column.half)
        for name, column in columns
    }
    return [
        Planned(name, partial(draw_validity, layout))
        for name, layout in layouts.items()
    ]


KIND = FigureKind("whether conclusions hold with different numerics", (), plan)
