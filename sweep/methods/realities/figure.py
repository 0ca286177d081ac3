"""The figure of the reality gap: scores in the design world and in the realities."""

from functools import partial

import numpy as np
import pandas as pd
from matplotlib import style
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sweep.errors import ChoiceError
from sweep.figures import (
    BLUE,
    COLOURS,
    GREEN,
    GREY,
    STYLE,
    VERMILION,
    Choices,
    FigureKind,
    Planned,
    draw_values,
    legend,
    name_rows,
    note,
    quantity,
    words,
)
from sweep.methods.realities.analysis import RealityGap, reality_gap
from sweep.tables import StoredStudy

MOST_ROWS = 30
BAND = 0.3
"""Half of the height of the band of realities in a row."""


def gap_figure(study: StoredStudy, metric: str | None = None) -> Figure:
    """Draw the score of each controller in the design world and in each reality.

    Each controller has a row. Grey dots are realities. Markers with 95 % confidence
    intervals are the design world, the mean of the realities, and the worst tenth. The
    right panel has the fraction of the variance over realities that each imperfection
    explains.

    Parameters
    ----------
    study : StoredStudy
    metric : str, optional
        A column of trials, optionally with the better direction, such as "coverage+".
        By default the first recorded metric.

    Returns
    -------
    Figure

    Raises
    ------
    ChoiceError
        The spec has no realities, or there are more than 30 controllers.
    """
    return draw_gap(_checked(study, metric))


def _checked(study: StoredStudy, metric: str | None) -> RealityGap:
    gap = reality_gap(study, metric)
    if len(gap.controllers) > MOST_ROWS:
        raise ChoiceError(
            f"has {len(gap.controllers):,} controllers; allowed: up to {MOST_ROWS};"
            " choose with where",
            study.name,
        )
    return gap


def draw_gap(gap: RealityGap) -> Figure:
    """Draw the figure of a gap."""
    with style.context(STYLE):
        height = 1.7 + 0.42 * len(gap.controllers)
        figure = Figure(figsize=(7.2, height))
        scores, parts = figure.subplots(1, 2, width_ratios=(3, 2), sharey=True)
        _scores(scores, gap)
        _imperfections(parts, gap)
        controllers = [each.controller for each in gap.controllers]
        name_rows(scores, controllers)
        scores.tick_params(axis="y", labelsize=7)
        scores.set_xlabel(quantity(gap.study, gap.metric))
        parts.set_xlabel("total Sobol index")
        parts.set_xlim(0.0, 1.0)
        legend(figure, scores)
        note(
            figure,
            f"{gap.study.name}: {gap.draws} realities; {gap.better} values are better;"
            " lines: 95 % confidence intervals",
        )
    return figure


def _scores(axes: Axes, gap: RealityGap) -> None:
    places = np.arange(len(gap.controllers), dtype=np.float64)
    draws = np.linspace(-BAND, BAND, gap.draws)
    for number in range(len(gap.controllers)):
        axes.plot(
            gap.scores.realities(number),
            number + draws,
            linestyle="none",
            marker=".",
            markersize=2.0,
            color=GREY,
            alpha=0.6,
            label="" if number else "reality",
        )
    sides = {
        "design world": ([each.design for each in gap.controllers], VERMILION, "D"),
        "mean of realities": ([each.realities for each in gap.controllers], BLUE, "o"),
        "worst tenth": ([each.worst_tenth for each in gap.controllers], GREEN, "s"),
    }
    for step, (label, (intervals, colour, marker)) in enumerate(sides.items(), -1):
        value, low, high, _ = np.array(intervals).T
        heights = places + step * BAND / 2
        ends = (value, low, high)
        draw_values(axes, heights, ends, colour, marker=marker, label=label)


def _imperfections(axes: Axes, gap: RealityGap) -> None:
    imperfections = [str(name) for name in gap.scores.imperfections]
    step = 2 * BAND / len(imperfections)
    for place, name in enumerate(imperfections):
        table = pd.DataFrame(
            [each.indices.table.iloc[place] for each in gap.controllers]
        )
        ends = (table["total"], table["total_low"], table["total_high"])
        heights = np.arange(len(table)) + step * (place - (len(imperfections) - 1) / 2)
        colour = COLOURS[place % len(COLOURS)]
        draw_values(axes, heights, ends, colour, label=words(name))
    if any(each.indices.reason for each in gap.controllers):
        _write_unknown(axes, gap)
    axes.legend(fontsize=6.5)


def _write_unknown(axes: Axes, gap: RealityGap) -> None:
    """Write into the rows of controllers without indices that the indices are unknown.

    The report of `sweep gap` has the reasons.
    """
    for row, each in enumerate(gap.controllers):
        if each.indices.reason:
            axes.text(0.5, row, "not known", color=GREY, fontsize=6.5, ha="center")


def plan(study: StoredStudy, choices: Choices) -> list[Planned]:
    """Return a figure per metric.

    Raises ChoiceError for a study without realities.
    """
    return [
        Planned(metric.rstrip("+-"), partial(draw_gap, _checked(study, metric)))
        for metric in choices.columns(study)
    ]


KIND = FigureKind(
    "scores of controllers in the design world and in sampled realities", (), plan
)
