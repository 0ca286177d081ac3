"""The figure of hysteresis: means on the way up and down, and the loop between them.

The figure shows a study whose chains go in two directions.
"""

from functools import partial
from typing import NamedTuple

import numpy as np
from matplotlib import style
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sweep.analysis import mean_interval, with_interval
from sweep.errors import ChoiceError
from sweep.figures import (
    BLUE,
    GREY,
    MOST_PANELS,
    STYLE,
    VERMILION,
    Choices,
    FigureKind,
    Planned,
    legend,
    named,
    note,
    quantity,
    select,
    title_panel,
)
from sweep.methods.hysteresis.analysis import FoundLoop, find_loops
from sweep.spec import Column, Over, is_half
from sweep.tables import StoredStudy

MOST_ACROSS = 3
WAYS = {"up": (BLUE, "o-"), "down": (VERMILION, "s--")}


class Loops(NamedTuple):
    """The layout of a figure of a metric, with a panel per group of chains."""

    study: StoredStudy
    metric: str
    panels: list[FoundLoop]


def hysteresis_figure(
    study: StoredStudy, metric: str, *, over: Over = "last", half: bool = False
) -> Figure:
    """Plot a metric against the continued axis, on the way up and down.

    Bands are 95 % confidence intervals of the means over chains. The title has the area
    of the loop with its confidence interval. The background is grey between the values
    at which the increasing and the decreasing branch differ. Further parameters that
    vary become panels.

    Parameters
    ----------
    study : StoredStudy
    metric : str
    over : {"last", "half"}, default "last"
        The last frame of each link, or the mean over its second half.
    half : bool, default False
        The older form of `over="half"`.

    Returns
    -------
    Figure

    Raises
    ------
    ChoiceError
        The study has no loop, see `sweep.methods.hysteresis.find_loops`, or more than
        twelve groups of chains.
    """
    (layout,) = hysteresis_layout(study, (metric,), half=is_half(over, half))
    return draw_hysteresis(layout)


def hysteresis_layout(
    study: StoredStudy, metrics: tuple[str, ...], *, half: bool = False
) -> list[Loops]:
    """Return a layout per metric.

    Parameters
    ----------
    study : StoredStudy
    metrics : tuple of str
        Names of metrics; () for all recorded metrics.
    half : bool, default False
        Means over the second half of each link, instead of the last frame.

    Returns
    -------
    list of Loops

    Raises
    ------
    ChoiceError
        As `hysteresis_figure`.
    """
    loops = find_loops(study, metrics, half=half)
    names = dict.fromkeys(loop.metric for loop in loops)
    layouts = [
        Loops(study, name, [loop for loop in loops if loop.metric == name])
        for name in names
    ]
    panels = len(layouts[0].panels)
    if panels > MOST_PANELS:
        raise ChoiceError(
            f"has {panels:,} panels; allowed: up to {MOST_PANELS}; choose with where",
            study.name,
            "hysteresis",
        )
    return layouts


def draw_hysteresis(layout: Loops) -> Figure:
    """Draw the figure of a layout."""
    study, metric, panels = layout
    assert study.about.continued
    with style.context(STYLE):
        across = min(MOST_ACROSS, len(panels))
        down = -(-len(panels) // across)
        figure = Figure(figsize=(max(4.6, 2.8 * across), 1.1 + 2.5 * down))
        grid = figure.subplots(down, across, sharex=True, sharey=True, squeeze=False)
        for axes, loop in zip(grid.flat, panels, strict=False):
            _panel(axes, study, loop)
            title_panel(axes, [named(loop.settings.items()), _area(loop)], across)
        for axes in grid.flat[len(panels) :]:
            axes.set_axis_off()
        for axes in grid[-1]:
            axes.set_xlabel(quantity(study, study.about.continued["axis"]))
        for axes in grid[:, 0]:
            axes.set_ylabel(f"mean {quantity(study, metric)}")
        legend(figure, grid.flat[0])
        note(figure, _note(layout))
    return figure


def _panel(axes: Axes, study: StoredStudy, loop: FoundLoop) -> None:
    apart = loop.values[loop.loop.apart]
    if len(apart):
        axes.axvspan(
            apart.min(), apart.max(), color=GREY, alpha=0.2, lw=0, label="differ"
        )
    for (way, (colour, line)), rows in zip(
        WAYS.items(), (loop.up, loop.down), strict=True
    ):
        distribution = study.distributions[loop.metric]
        means = [mean_interval(column, distribution=distribution) for column in rows.T]
        value, low, high = (
            np.array([getattr(mean, name) for mean in means])
            for name in ("value", "low", "high")
        )
        axes.plot(loop.values, value, line, color=colour, markersize=3, label=way)
        axes.fill_between(loop.values, low, high, color=colour, alpha=0.2, lw=0)


def _area(loop: FoundLoop) -> str:
    area = loop.loop.area
    return f"area {with_interval(area.value, area.low, area.high)}"


def _note(layout: Loops) -> str:
    counts = [panel.loop.chains for panel in layout.panels]
    text = (
        "{n} trials per value and direction, one per chain; bands: 95 % confidence"
        " intervals of means over chains; area: of down minus up, over complete chains;"
        " grey: range of values at which up and down differ (95 %, simultaneous)"
    )
    metrics = [str(Column.read(layout.metric))]
    return select(layout.study).note(text, counts, shown=metrics)


def plan(study: StoredStudy, choices: Choices) -> list[Planned]:
    """Return a figure per metric.

    Raises ChoiceError for a study whose chains do not go up and down.
    """
    metrics = tuple(Column.read(name).metric for name in choices.plain(study))
    return [
        Planned(layout.metric, partial(draw_hysteresis, layout))
        for layout in hysteresis_layout(study, metrics, half=choices.half)
    ]


KIND = FigureKind("a metric on the way up and down, and the loop between", (), plan)
