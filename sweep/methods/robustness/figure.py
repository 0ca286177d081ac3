"""What variants make of the conclusions of a study: below each other the differences of
its points, as they are and with each variant.
"""

from functools import partial
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from matplotlib import style
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sweep.errors import ChoiceError
from sweep.figures.drawing import (
    draw_values,
    legend,
    name_rows,
    named,
    note,
    quantity,
)
from sweep.figures.planning import Choices, FigureKind, Planned
from sweep.figures.selection import select
from sweep.figures.style import COLOURS, GREY, MARKERS, STYLE, VERMILION
from sweep.methods.robustness.analysis import (
    AS_IT_IS,
    TURNS,
    UNJUDGED,
    Validity,
    check_conclusions,
)
from sweep.spec.recorded import Column, Over, is_half
from sweep.tables.stored_study import StoredStudy

MOST_ROWS, MOST_COLUMNS = 60, 6
ROW, MARK, FRAME, WIDTH = 0.16, 0.075, 1.5, 7.2
"""Inches: between rows, between the marks of a row, around the panel, and across."""


class Conclusions(NamedTuple):
    """What the figure of one column shows."""

    found: Validity
    column: str


def validity_figure(
    study: StoredStudy, metric: str, *, over: Over = "last", half: bool = False
) -> Figure:
    """The differences of each point to the first one along an axis in one metric, with
    their intervals: in the study, and with each time step, neighbour search and order
    of updates that `validate` asks for. `over="half"` takes means over the last half of
    a trial; `half=True` is its older form.

    Raises ChoiceError for a study without `validate`, and for more than 60 differences.
    """
    return draw_validity(validity_layout(study, metric, half=is_half(over, half)))


def validity_layout(
    study: StoredStudy, metric: str, *, half: bool = False
) -> Conclusions:
    """What `validity_figure` will show. Raises ChoiceError as it does."""
    found = check_conclusions(study, metric, half=half)
    if len(found.conclusions) > MOST_ROWS:
        raise ChoiceError(
            f"has {len(found.conclusions):,} differences; allowed: up to {MOST_ROWS};"
            " choose with where",
            study.name,
            "validity",
        )
    return Conclusions(found, str(found.rows["metric"].iloc[0]))


def draw_validity(layout: Conclusions) -> Figure:
    """The figure of a layout."""
    found, conclusions = layout.found, layout.found.conclusions
    per = len(found.variants) + 1
    with style.context(STYLE):
        height = FRAME + len(conclusions) * (ROW + MARK * per)
        figure = Figure(figsize=(WIDTH, height))
        axes = figure.subplots()
        axes.axvline(0.0, color=GREY, linewidth=0.8)
        _rows(axes, found, per)
        name_rows(axes, [_name(found, row) for _, row in conclusions.iterrows()])
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
        axes.set_xlabel(f"difference of mean {quantity(found.study, layout.column)}")
        legend(figure, axes, MOST_COLUMNS)
        note(figure, _note(found))
    return figure


def _rows(axes: Axes, found: Validity, per: int) -> None:
    """Draw the differences, variant by variant."""
    words = [AS_IT_IS, *found.variants.values()]
    shown = found.rows[found.rows["outcome"] != UNJUDGED]
    for number, (name, label) in enumerate(
        zip([AS_IT_IS, *found.variants], words, strict=True)
    ):
        table = shown[shown["variant"] == name]
        if table.empty:
            continue
        places = table.index.to_numpy() // per + 0.7 * ((number + 0.5) / per - 0.5)
        values = (table["difference"], table["low"], table["high"])
        colour = GREY if number == 0 else COLOURS[(number - 1) % len(COLOURS)]
        marker = MARKERS[number % len(MARKERS)]
        draw_values(axes, places, values, colour, marker, label)


def _name(found: Validity, row: "pd.Series[Any]") -> str:
    point = named((name, row[name]) for name in found.settings)
    return f"{point}\nagainst {str(row['against']).replace('_', ' ')}"


def _note(found: Validity) -> str:
    counts = found.study.trials["point"].value_counts().to_numpy(np.int64)
    text = (
        "lines: intervals, all of which hold together with"
        f" {100 * found.confidence:g} % (Bonferroni); {{n}} trials a point"
    )
    for name, bits in found.bits.items():
        text += (
            f"; {found.variants[name]}: {bits.same:,} of {bits.trials:,} trials have"
            " the same bits"
        )
    return select(found.study).note(text, counts)


def plan(study: StoredStudy, choices: Choices) -> list[Planned]:
    """A figure a metric. Raises ChoiceError where the study has no variants."""
    asked = [(name, Column.read(name)) for name in choices.plain(study)]
    layouts = {
        name: validity_layout(study, one.metric, half=one.half) for name, one in asked
    }
    return [Planned(name, partial(draw_validity, one)) for name, one in layouts.items()]


KIND = FigureKind("whether conclusions hold with other numerics", (), plan)
