"""A metric against each parameter that varies: means of points.

Means have confidence intervals if a panel has few points.
"""

from functools import partial
from typing import NamedTuple

import numpy as np
import pandas as pd
from matplotlib import style
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from sweep.analysis import rank_estimate
from sweep.errors import ChoiceError
from sweep.figures.drawing import (
    draw_trials,
    estimated,
    legend_of,
    note,
    quantity,
    span,
    title_panel,
    words,
    y_label,
)
from sweep.figures.marks import (
    TRIALS_NOTE,
    FigureMarks,
    MarkedAxis,
    MarkedPanel,
    allow_trials,
    axis_of,
    axis_of_metric,
    colours_of,
    legend_of_marks,
    means_of,
    values_of_trials,
)
from sweep.figures.planning import Choices, FigureKind, Planned
from sweep.figures.scales import (
    Floats,
    is_logarithmic,
    label_setting,
    make_logarithmic,
    places,
)
from sweep.figures.selection import (
    Facet,
    Selection,
    has_scale,
    is_number,
    recorded,
    select,
)
from sweep.figures.style import COLOURS, MARKERS, STYLE
from sweep.spec import Column, Over, column_over
from sweep.tables import Results

MOST_INTERVALS = 60
"""The most points of a panel with confidence intervals; more points are dots."""
LARGEST_SHIFT = 0.3
"""Largest shift of points of equal value, as a fraction of the gap between values."""
PARTS = (0.01, 0.03)
"""The bounds of the largest shift, as fractions of the width of an axis of numbers."""


class Panel(NamedTuple):
    """A panel: the parameter on the x axis, and the points."""

    name: str
    facet: Facet


class Scatter(NamedTuple):
    """The contents of a scatter figure.

    The values of the parameter `by` are colours. The panels of a facet are in one row.
    If `trials` is true, the values of single trials are behind the means.
    """

    selection: Selection
    metric: str
    by: str | None
    rows: list[list[Panel]]
    trials: bool


def scatter_figure(
    study: Results,
    metric: str,
    x: str | None = None,
    *,
    by: str | None = None,
    over: Over = "last",
    trials: bool = False,
) -> Figure:
    """Draw the mean of a metric at all points against parameters.

    In a panel of up to 60 points means have 95 % confidence intervals. Titles show
    Spearman's correlation over the points, with a confidence interval. Listed
    parameters that are on no axis become colours and panels.

    Parameters
    ----------
    study : Results
    metric : str
        A recorded metric.
    x : str, optional
        Parameter of the x axis; by default each sampled parameter has a panel, or else
        each listed parameter.
    by : str, optional
        Parameter of the colours; by default the first listed parameter with at most
        three values.
    over : {"last", "half"}, default "last"
        Use the last frame of each trial, or the mean over the second half.
    trials : bool, default False
        Draw the value of each trial behind the means.

    Returns
    -------
    Figure

    Raises
    ------
    ChoiceError
        If a name is unknown, no parameter varies, or there are more than twelve panels,
        or more than 5,000 values of trials.

    Examples
    --------
    >>> figure = scatter_figure(sweep.load("my/first"), "polarization")
    >>> axes = figure.axes[0]
    >>> axes.get_xlabel(), axes.get_ylabel()
    ('separation weight', 'polarization')
    >>> means = axes.lines[0]
    >>> means.get_xydata().round(2).tolist()
    [[0.5, 0.57], [1.0, 0.3], [2.0, 0.58]]
    """
    column = column_over(metric, over)
    return draw_scatter(scatter_layout(study, column, x, by=by, trials=trials))


def scatter_layout(
    study: Results,
    metric: str,
    x: str | None,
    *,
    by: str | None,
    trials: bool = False,
) -> Scatter:
    """Return the layout of `scatter_figure`, or raise ChoiceError.

    Parameters
    ----------
    study : Results
    metric : str
        Column of the trials.
    x, by : str or None
        Parameters as in `scatter_figure`.
    trials : bool, default False
        Show the values of trials.
    """
    selection = select(study)
    recorded(study, metric)
    if selection.setting(x) in selection.sampled if x else selection.sampled:
        settings = [x] if x else [name for name in selection.sampled if name != by]
        dividing = selection.apart(selection.sampled)
        colour = selection.colour(by, dividing, settings)
        facets = selection.facets([name for name in dividing if name != colour])
        rows = [[Panel(name, facet) for name in settings] for facet in facets]
    else:
        dividing = selection.apart([x]) if x else selection.apart([])
        colour = (
            selection.colour(by, dividing, [x] if x else [])
            if x or by or len(dividing) > 1
            else None
        )
        settings = [x] if x else [name for name in dividing if name != colour]
        rows = [
            [Panel(name, facet)]
            for name in settings
            for facet in _facets(selection, name, colour)
        ]
    for name in settings:
        selection.axis(name, "scatter")
    if not rows:
        raise ChoiceError(
            "needs a varied parameter; the study has none", study.name, "scatter"
        )
    free = [name for name in (*dividing, x) if name not in (None, colour)]
    selection.allow(
        sum(map(len, rows)),
        free,
        "scatter",
        "" if x else f"choose with x, one of {', '.join(settings)}, or where",
    )
    if trials:
        allow_trials(selection, len(settings) * int(study.done.sum()), "scatter")
    return Scatter(selection, metric, colour, rows, trials=trials)


def _facets(selection: Selection, name: str, colour: str | None) -> list[Facet]:
    return selection.facets(
        [other for other in selection.apart([name]) if other != colour]
    )


def draw_scatter(layout: Scatter) -> Figure:
    """Draw the figure of a layout."""
    selection, metric, by, *_ = layout
    table = selection.table([metric])
    panels = _rows(layout)
    y = axis_of_metric(selection, metric, table[metric])
    with style.context(STYLE):
        figure = Figure(figsize=_size(panels))
        grid = figure.subplots(len(panels), len(panels[0]), sharey=True, squeeze=False)
        for row, line in zip(grid, panels, strict=True):
            for axes, panel in zip(
                row, [*line, *[None] * (len(row) - len(line))], strict=True
            ):
                if panel is None:
                    axes.set_axis_off()
                    continue
                correlations = _panel(
                    axes, layout, panel, table.loc[panel.facet.points]
                )
                title_panel(axes, [panel.facet.title, *correlations], len(row))
                label_setting(selection, panel.name, axes)
                if axes is row[0]:
                    axes.set_ylabel(y_label(y.label))
        for axes in grid.flat if y.linear else ():
            make_logarithmic(axes, "y", linear=y.linear)
        if by:
            _legend(figure, layout)
        correlated = any(
            "\N{GREEK SMALL LETTER RHO}" in axes.get_title() for axes in figure.axes
        )
        note(figure, _note(layout, table, correlated=correlated))
    return figure


def _rows(layout: Scatter) -> list[list[Panel]]:
    """Return the panels in rows of the figure.

    If several parameters are shown, each facet has a row. Else a row has up to three
    panels.
    """
    panels = [panel for row in layout.rows for panel in row]
    across = (
        len(layout.rows[0])
        if 1 < len(layout.rows[0]) <= 4 and len(layout.rows) > 1
        else min(3, len(panels))
    )
    return [panels[start : start + across] for start in range(0, len(panels), across)]


def _size(panels: list[list[Panel]]) -> tuple[float, float]:
    across = len(panels[0])
    return (4.0 if across == 1 else 7.2), 0.9 + (
        3.0 if across == 1 else 2.15 if across < 4 else 1.9
    ) * len(panels)


def _panel(axes: Axes, layout: Scatter, panel: Panel, table: pd.DataFrame) -> list[str]:
    """Draw the points of a panel, and return the rank correlations for the title."""
    selection, metric, by, *_ = layout
    groups = selection.values(by) if by else [None]
    few = table[metric].notna().sum() <= MOST_INTERVALS
    column = selection.points[panel.name]
    parts = [table[table[by] == value] if by else table for value in groups]
    beside = _side_by_side(selection, panel.name, pd.concat(parts))
    correlations = []
    if layout.trials:
        trials = _trials(layout, panel)
        shifted = trials.assign(x=trials["point"].map(beside))
        draw_trials(axes, shifted, COLOURS.__getitem__)
    for place, (value, part) in enumerate(zip(groups, parts, strict=True)):
        at = places(selection, panel.name, part[panel.name])
        shown = np.asarray(beside.loc[part.index], np.float64)
        _points(
            axes,
            shown,
            part,
            metric,
            colour=COLOURS[place],
            marker=MARKERS[place],
            few=few,
        )
        if (
            is_number(column)
            and (
                correlation := rank_estimate(at, part[metric].to_numpy(np.float64))
            ).testable
        ):
            text = estimated(correlation.value, *correlation.interval())
            correlations.append(
                f"\N{GREEK SMALL LETTER RHO} = {text}"
                + (f" ({words(value)})" if by else "")
            )
    return correlations


def _trials(layout: Scatter, panel: Panel) -> pd.DataFrame:
    """Return the values of the trials of a panel; see `MarkedPanel`."""
    selection = layout.selection
    values = values_of_trials(selection, layout.by, {"y": layout.metric})
    rows = values[values["point"].isin(panel.facet.points)]
    column = selection.points.loc[rows["point"], panel.name]
    return rows.assign(x=places(selection, panel.name, column))


def _side_by_side(
    selection: Selection, name: str, table: pd.DataFrame
) -> "pd.Series[float]":
    """Return the positions of points on the axis of a parameter, by point id.

    Points of equal value are side by side, in the order of `table`, so that no interval
    is hidden.
    """
    at = pd.Series(places(selection, name, table[name]), table.index)
    if at.is_unique:
        return at
    logarithmic = is_logarithmic(selection, name)
    at = at.map(np.log) if logarithmic else at
    values = np.unique(at)
    room = LARGEST_SHIFT
    if has_scale(selection.points[name]) and len(values) > 1:
        gap = np.diff(values).min()
        width = values[-1] - values[0]
        room = width * float(np.clip(LARGEST_SHIFT * gap / width, *PARTS))
    groups = at.groupby(at)
    number = groups.cumcount()
    among = groups.transform("size")
    shifted = at + room * (2 * number - among + 1) / among
    return shifted.map(np.exp) if logarithmic else shifted


def _points(
    axes: Axes,
    at: Floats,
    table: pd.DataFrame,
    metric: str,
    colour: str,
    marker: str,
    *,
    few: bool,
) -> None:
    value, low, high = (
        table[f"{metric}{end}"].to_numpy(np.float64) for end in ("", "_low", "_high")
    )
    if few:
        axes.vlines(at, low, high, color=colour, linewidth=1.2)
        axes.plot(
            at, value, linestyle="none", marker=marker, markersize=4, color=colour
        )
    else:
        axes.scatter(
            at, value, s=4, color=colour, alpha=0.4, linewidths=0, rasterized=True
        )


def _legend(figure: Figure, layout: Scatter) -> None:
    selection = layout.selection
    by = layout.by
    assert by is not None
    labels = [words(value) for value in selection.values(by)]
    marks = [
        Line2D([], [], linestyle="none", marker=m, color=c)
        for m, c, _ in zip(MARKERS, COLOURS, labels, strict=False)
    ]
    legend_of(figure, marks, labels, quantity(selection.study, by))


def _note(layout: Scatter, table: pd.DataFrame, *, correlated: bool) -> str:
    selection = layout.selection
    metric = layout.metric
    sizes = [
        int(table.loc[panel.facet.points, metric].notna().sum())
        for row in layout.rows
        for panel in row
    ]
    some = min(sizes) <= MOST_INTERVALS
    drawn = "mean with 95 % confidence interval" if some else ""
    text = (
        f"{span(sizes)} points per panel, {{n}} trials per"
        f" point{'' if some else ', each the mean'}"
    )
    correlation = (
        "\n\N{GREEK SMALL LETTER RHO}:"
        " Spearman's rank correlation over the points, with 95 % confidence interval"
    )
    return (
        selection.note(
            text,
            table[f"{metric}_n"],
            drawn,
            metrics=[metric] if some else [],
            shown=[metric],
        )
        + (correlation if correlated else "")
        + (TRIALS_NOTE if layout.trials else "")
    )


def plan(study: Results, choices: Choices) -> list[Planned]:
    """Plan one figure per metric. Raises ChoiceError if the kind does not suit."""
    metrics = choices.plain(study)
    layouts = [
        scatter_layout(study, name, choices.x, by=choices.by, trials=choices.trials)
        for name in metrics
    ]
    return [
        Planned(name, partial(draw_scatter, layout))
        for name, layout in zip(metrics, layouts, strict=True)
    ]


def marks(study: Results, choices: Choices) -> FigureMarks:
    """Return the figure of the first metric as marks.

    Lines join the marks if the values of all parameters on x axes are listed numbers.
    """
    metric = choices.plain(study)[0]
    layout = scatter_layout(
        study, metric, choices.x, by=choices.by, trials=choices.trials
    )
    selection = layout.selection
    table = selection.table([metric])
    y = axis_of_metric(selection, metric, table[metric])
    panels = [
        _marked(layout, panel, table.loc[panel.facet.points], y)
        for row in layout.rows
        for panel in row
    ]
    names = [panel.name for row in layout.rows for panel in row]
    joined = all(
        has_scale(selection.points[name]) and name in selection.listed for name in names
    )
    note = _note(layout, table, correlated=False)
    form = "lines" if joined else "points"
    shown = (Column.read(metric).metric,)
    legend, values = legend_of_marks(selection, layout.by)
    return FigureMarks(form, shown, panels, note, by=legend, values=values)


def _marked(
    layout: Scatter, panel: Panel, table: pd.DataFrame, y: MarkedAxis
) -> MarkedPanel:
    selection = layout.selection
    metric = layout.metric
    columns = {
        "x": places(selection, panel.name, table[panel.name]),
        **means_of(table, metric),
        "colour": colours_of(selection, layout.by, table),
        "point": table.index,
    }
    rows = pd.DataFrame(columns, index=table.index).sort_values("x", kind="stable")
    trials = _trials(layout, panel) if layout.trials else None
    x = axis_of(selection, panel.name)
    return MarkedPanel(panel.facet.title, x, y, rows, trials=trials)


KIND = FigureKind(
    "a metric against each parameter",
    ("by", "x", "trials"),
    plan,
    of_several=True,
    marks=marks,
)
