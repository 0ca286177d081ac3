"""Parallel coordinates: a vertical axis for each sampled parameter and for a metric.

Each point is a line. The best points are in colour.
"""

from functools import partial
from typing import NamedTuple

import numpy as np
import pandas as pd
from matplotlib import style
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, MaxNLocator

from sweep.errors import ChoiceError
from sweep.figures.directions import Direction, direction
from sweep.figures.drawing import (
    legend_of,
    note,
    quantity,
    span,
    title_panel,
    words,
)
from sweep.figures.planning import Choices, FigureKind, Planned
from sweep.figures.scales import Floats, is_logarithmic, places
from sweep.figures.selection import Facet, Selection, has_scale, select
from sweep.figures.style import STYLE, VERMILION
from sweep.spec import Over, column_over
from sweep.tables import Results

BEST = 0.05
INK = 3.5
"""The opacity of lines, times the square root of their number."""
MOST_NAMES_ON_A_LINE = 5


class Parallel(NamedTuple):
    """The contents of a figure of parallel coordinates: a panel per facet."""

    selection: Selection
    direction: Direction
    facets: list[Facet]


class Upright(NamedTuple):
    """A vertical axis: heights of the points from 0 to 1, and ticks with names."""

    heights: Floats
    ticks: Floats
    names: list[str]


def parallel_figure(
    study: Results,
    metric: str,
    *,
    over: Over = "last",
) -> Figure:
    """Draw points as lines over all sampled parameters and the mean of a metric.

    The best 5 % of the points of a panel are in colour. A parameter that the spec
    samples logarithmically has a logarithmic axis. Listed parameters become panels.

    Parameters
    ----------
    study : Results
    metric : str
        A metric, optionally with a direction: `coverage+` prefers the highest values,
        `coverage_cv-` the lowest.
    over : {"last", "half"}, default "last"
        Use the last frame of each trial, or the mean over the second half.

    Returns
    -------
    Figure

    Raises
    ------
    ChoiceError
        If a name is unknown, no parameter is sampled, or there are more than twelve
        panels.

    Examples
    --------
    >>> spec = {"study": "my/sampled", "model": "nguyen2024", "replicates": 1}
    >>> spec["fixed"] = {"n": 10, "steps": 20}
    >>> weights = {"separation_weight": {"uniform": [0, 2]}}
    >>> spec["sweep"] = {"weights": {"sample": "random", "points": 20, **weights}}
    >>> figure = parallel_figure(sweep.run(spec), "polarization+")
    >>> [text.get_text() for text in figure.legends[0].get_texts()]
    ['5 % with the highest polarization', 'other points']
    """
    return draw_parallel(parallel_layout(study, column_over(metric, over)))


def parallel_layout(
    study: Results,
    metric: str,
) -> Parallel:
    """Return the layout of `parallel_figure`, or raise ChoiceError."""
    selection = select(study)
    chosen = direction(study, metric)
    if not selection.sampled:
        raise ChoiceError(
            "needs an axis that samples parameters; the study has no such axis",
            study.name,
            "parallel",
        )
    for name in selection.sampled:
        selection.axis(name, "parallel")
    return Parallel(
        selection,
        chosen,
        selection.panels(selection.apart(selection.sampled), "parallel"),
    )


def draw_parallel(layout: Parallel) -> Figure:
    """Draw the figure of a layout."""
    selection, chosen, facets = layout
    table = selection.table([chosen.metric])
    number = len(selection.sampled) + 1
    with style.context(STYLE):
        across = min(2 if number <= 4 else 1, len(facets))
        down = -(-len(facets) // across)
        figure = Figure(figsize=(7.2, 1.0 + down * (1.9 if len(facets) > 4 else 2.9)))
        panels = figure.subplots(down, across, squeeze=False).ravel()
        counts = [
            _panel(axes, layout, table.loc[facet.points])
            for axes, facet in zip(panels, facets, strict=False)
        ]
        for axes, facet in zip(panels, facets, strict=False):
            title_panel(axes, [facet.title], across)
        for axes in panels[len(facets) :]:
            axes.set_axis_off()
        lines = [Line2D([], [], color=VERMILION), Line2D([], [], color="0.6")]
        better = (
            f"{BEST:.0%} with the {'highest' if chosen.high else 'lowest'}"
            f" {quantity(selection.study, chosen.metric)}"
        )
        legend_of(figure, lines, [better.replace("%", " %", 1), "other points"])
        text = (
            f"{span(shown for shown, _ in counts)} points per panel, each the mean of"
            " {n} trials"
        )
        left_out = sum(unknown for _, unknown in counts)
        text += f"; {left_out:,} without a value left out" if left_out else ""
        trials = table[f"{chosen.metric}_n"]
        note(figure, selection.note(text, trials, shown=[chosen.metric]))
    return figure


def _panel(axes: Axes, layout: Parallel, table: pd.DataFrame) -> tuple[int, int]:
    """Draw a panel, and return the numbers of points with and without a value."""
    selection, chosen, _ = layout
    measured = table[table[chosen.metric].notna()]
    uprights = [_upright(selection, name, measured[name]) for name in selection.sampled]
    uprights.append(_linear(measured[chosen.metric].to_numpy(np.float64)))
    heights = np.stack([upright.heights for upright in uprights], axis=1)
    lines = np.stack(
        [np.broadcast_to(np.arange(len(uprights)), heights.shape), heights], axis=2
    )
    order = np.argsort(
        measured[chosen.metric].to_numpy() * (-1.0 if chosen.high else 1.0),
        kind="stable",
    )
    best = order[: int(np.ceil(BEST * len(measured)))]
    rest = order[len(best) :]
    _lines(
        axes,
        lines[rest],
        "0.35",
        alpha=min(0.6, INK / np.sqrt(max(len(rest), 1))),
        width=0.6,
    )
    _lines(
        axes,
        lines[best],
        VERMILION,
        alpha=min(0.9, 2.0 * INK / np.sqrt(max(len(best), 1))),
        width=0.9,
    )
    for place, upright in enumerate(uprights):
        _axis(axes, place, upright)
    labels = [
        quantity(selection.study, name) for name in (*selection.sampled, chosen.metric)
    ]
    breaks = " " if len(labels) > MOST_NAMES_ON_A_LINE else " ("
    axes.set_xticks(
        range(len(labels)),
        [name.replace(breaks, f"\n{breaks[1:]}") for name in labels],
        fontsize=7.5,
    )
    axes.set(xlim=(-0.25, len(labels) - 0.75), ylim=(-0.04, 1.04), yticks=[])
    axes.tick_params(axis="x", length=0)
    axes.grid(visible=False)
    axes.spines[:].set_visible(False)
    return len(measured), len(table) - len(measured)


def _lines(axes: Axes, lines: Floats, colour: str, alpha: float, width: float) -> None:
    axes.add_collection(
        LineCollection(
            list(lines), colors=colour, alpha=alpha, linewidths=width, rasterized=True
        )
    )


def _axis(axes: Axes, place: int, upright: Upright) -> None:
    axes.plot([place, place], [0, 1], color="0.1", linewidth=0.9, zorder=3)
    for height, name in zip(upright.ticks, upright.names, strict=True):
        axes.plot(
            [place - 0.02, place],
            [height, height],
            color="0.1",
            linewidth=0.9,
            zorder=3,
        )
        box = {"facecolor": "white", "alpha": 1.0, "pad": 0.6, "linewidth": 0}
        axes.text(
            place - 0.035,
            height,
            name,
            ha="right",
            va="center",
            fontsize=6.5,
            bbox=box,
            zorder=4,
        )


def _upright(selection: Selection, name: str, column: "pd.Series[float]") -> Upright:
    """Return the axis of a parameter, which spans all values in the figure."""
    values = places(selection, name, column)
    every = places(selection, name, selection.points[name])
    if not has_scale(selection.points[name]):
        last = max(every.max(), 1.0)
        labels = [words(value) for value in selection.values(name)]
        return Upright(values / last, np.arange(len(labels)) / last, labels)
    if is_logarithmic(selection, name):
        ticks = [
            float(tick) for tick in LogLocator().tick_values(every.min(), every.max())
        ]
        return _scaled(
            np.log(values),
            np.log(every),
            [tick for tick in ticks if every.min() <= tick <= every.max()],
            log=True,
        )
    return _linear(values, every)


def _linear(values: Floats, every: Floats | None = None) -> Upright:
    spanned = values if every is None else every
    low, high = (
        (float(spanned.min()), float(spanned.max())) if len(spanned) else (0.0, 1.0)
    )
    ticks = [
        float(tick)
        for tick in MaxNLocator(4).tick_values(low, high)
        if low <= tick <= high
    ]
    return _scaled(values, np.array([low, high]), ticks, log=False)


def _scaled(values: Floats, every: Floats, ticks: list[float], *, log: bool) -> Upright:
    low = float(every.min())
    high = float(every.max())
    width = high - low or 1.0
    at = np.log(ticks) if log else np.array(ticks, np.float64)
    return Upright(
        (values - low) / width, (at - low) / width, [f"{tick:g}" for tick in ticks]
    )


def plan(study: Results, choices: Choices) -> list[Planned]:
    """Plan one figure per metric. Raises ChoiceError if the kind does not suit."""
    layouts = [parallel_layout(study, name) for name in choices.columns(study)]
    return [
        Planned(layout.direction.metric, partial(draw_parallel, layout))
        for layout in layouts
    ]


KIND = FigureKind(
    "all sampled parameters and a metric, with the best points in colour", (), plan
)
