"""Two metrics against each other, and the Pareto front."""

from functools import partial
from typing import NamedTuple

import numpy as np
import pandas as pd
from matplotlib import style
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from sweep.analysis import nondominated
from sweep.errors import ChoiceError
from sweep.figures.directions import Direction, direction, opposed_metrics
from sweep.figures.drawing import (
    draw_trials,
    legend_of,
    note,
    quantity,
    span,
    tidy_grid,
    title_panel,
    words,
)
from sweep.figures.marks import (
    TRIALS_NOTE,
    FigureMarks,
    MarkedAxis,
    MarkedPanel,
    allow_trials,
    colours_of,
    legend_of_marks,
    means_of,
    values_of_trials,
)
from sweep.figures.planning import Choices, FigureKind, Planned
from sweep.figures.selection import Facet, Selection, select
from sweep.figures.style import COLOURS, GREY, MARKERS, STYLE
from sweep.spec import Column, Over, column_over
from sweep.tables import Results

MOST_INTERVALS = 60


class Pareto(NamedTuple):
    """The contents of a Pareto figure.

    `directions` are the metrics on the axes, with directions. The values of the
    parameter `by` are colours. Each facet has a panel. If `trials` is true, the values
    of single trials are behind the means.
    """

    selection: Selection
    directions: tuple[Direction, Direction]
    by: str | None
    facets: list[Facet]
    trials: bool


def pareto_figure(
    study: Results,
    first: str | None = None,
    second: str | None = None,
    *,
    by: str | None = None,
    over: Over = "last",
    trials: bool = False,
) -> Figure:
    """Draw the means of two metrics at all points, and the Pareto front.

    Means have 95 % confidence intervals. A point dominates a second point if one mean
    is better and neither mean is worse. The front contains the points that are not
    dominated. Noise in the means makes a front look better than the true front.

    If parameters are sampled, the listed parameters become colours and panels, each
    with a separate front. Otherwise all points compete, unless `by` divides the points.

    Parameters
    ----------
    study : Results
    first, second : str, optional
        Metrics with directions: `coverage+` prefers high values, `coverage_cv-` low
        values. By default the first two objectives of a search; otherwise the first
        metric with better high values, and the first with better low values.
    by : str, optional
        Parameter of the colours.
    over : {"last", "half"}, default "last"
        Use the last frame of each trial, or the mean over the second half. Applies to
        named metrics only.
    trials : bool, default False
        Draw the values of each trial behind the means.

    Returns
    -------
    Figure

    Raises
    ------
    ChoiceError
        If a name is unknown, there are not two metrics, there is one point, or there
        are more than twelve panels, or more than 5,000 trials with `trials`.

    Examples
    --------
    >>> study = sweep.load("my/first")
    >>> axes = pareto_figure(study, "polarization+", "speed+").axes[0]
    >>> axes.get_xlabel(), axes.get_ylabel()
    ('polarization, more is better', 'speed (px/step), more is better')
    >>> points, front = axes.lines
    >>> front.get_xydata().round(2).tolist()
    [[0.58, 2.61]]
    """
    columns = [column_over(name, over) for name in (first, second) if name]
    return draw_pareto(pareto_layout(study, columns, by=by, trials=trials))


def pareto_layout(
    study: Results,
    metrics: list[str],
    *,
    by: str | None,
    trials: bool = False,
) -> Pareto:
    """Return the layout of `pareto_figure`, or raise ChoiceError.

    Parameters
    ----------
    study : Results
    metrics : list of str
        Two columns of the trials, each with a direction; if empty, the default metrics.
    by : str or None
        Parameter of the colours.
    trials : bool, default False
        Show the values of trials.
    """
    selection = select(study)
    if not metrics:
        metrics = opposed_metrics(study)
    if len(metrics) != 2:
        raise ChoiceError(
            f"needs two metrics and has {len(metrics)};"
            " name two metrics with directions, for example"
            f" {' '.join(f'{name}+' for name in study.metrics[:2])}",
            study.name,
            "pareto",
        )
    first, second = (direction(study, text) for text in metrics)
    if first.metric == second.metric:
        raise ChoiceError(
            f"with {first.metric} twice; allowed: two different metrics",
            study.name,
            "pareto",
        )
    if len(selection.points) < 2:
        raise ChoiceError(
            "needs at least two points; the study has one", study.name, "pareto"
        )
    dividing = (
        selection.apart(selection.sampled)
        if selection.sampled
        else [name for name in selection.listed if name in selection.study.kept_apart]
    )
    colour = selection.colour(by, dividing, []) if by or dividing else None
    facets = selection.panels([name for name in dividing if name != colour], "pareto")
    if trials:
        allow_trials(selection, int(study.done.sum()), "pareto")
    return Pareto(selection, (first, second), colour, facets, trials=trials)


def draw_pareto(layout: Pareto) -> Figure:
    """Draw the figure of a layout."""
    selection, (first, second), _, facets, _ = layout
    table = selection.table([first.metric, second.metric])
    with style.context(STYLE):
        across = min(2 if len(facets) in (2, 4) else 3, len(facets))
        down = -(-len(facets) // across)
        figure = Figure(
            figsize=(
                (4.4, 4.0)
                if across == 1
                else (7.2, 1.0 + (3.1 if across == 2 else 2.4) * down)
            )
        )
        panels = figure.subplots(down, across, sharex=True, sharey=True, squeeze=False)
        for axes, facet in zip(tidy_grid(panels, len(facets)), facets, strict=True):
            _panel(axes, layout, table.loc[facet.points])
            axes.set(xlabel=_label(selection, first), ylabel=_label(selection, second))
            title_panel(axes, [facet.title], across)
        _legend(figure, layout)
        note(figure, _note(layout, table))
    return figure


def _panel(axes: Axes, layout: Pareto, table: pd.DataFrame) -> None:
    first, second = layout.directions
    by = layout.by
    if layout.trials:
        draw_trials(axes, _trials(layout, table), COLOURS.__getitem__)
    for place, value in enumerate(layout.selection.values(by) if by else [None]):
        part = table[table[by] == value] if by else table
        colour = COLOURS[place]
        marker = MARKERS[place]
        means = part[[first.metric, second.metric]].to_numpy(np.float64)
        best = part[nondominated(means, [first.high, second.high])].sort_values(
            first.metric
        )
        few = len(part) <= MOST_INTERVALS
        _intervals(axes, part if few else best, layout.directions, colour)
        axes.plot(
            part[first.metric],
            part[second.metric],
            linestyle="none",
            marker=marker,
            color=colour,
            markersize=4 if few else 1.6,
            alpha=1.0 if few else 0.35,
            markeredgewidth=0,
            rasterized=not few,
        )
        # Towards better values of the first metric, the front keeps the value of the
        # second metric up to the next point.
        axes.plot(
            best[first.metric],
            best[second.metric],
            drawstyle="steps-pre" if first.high else "steps-post",
            color=colour,
            linewidth=1.0,
            marker=marker,
            markersize=4,
            markerfacecolor="white",
        )


def _trials(layout: Pareto, table: pd.DataFrame) -> pd.DataFrame:
    """Return the values of the trials of a panel; see `MarkedPanel`."""
    first, second = layout.directions
    metrics = {"x": first.metric, "y": second.metric}
    values = values_of_trials(layout.selection, layout.by, metrics)
    return values[values["point"].isin(table.index)]


def _intervals(
    axes: Axes,
    table: pd.DataFrame,
    directions: tuple[Direction, Direction],
    colour: str,
) -> None:
    (x, x_low, x_high), (y, y_low, y_high) = (
        [table[aim.metric + end].to_numpy(np.float64) for end in ("", "_low", "_high")]
        for aim in directions
    )
    axes.hlines(y, x_low, x_high, color=colour, linewidth=0.8, alpha=0.5)
    axes.vlines(x, y_low, y_high, color=colour, linewidth=0.8, alpha=0.5)


def _legend(figure: Figure, layout: Pareto) -> None:
    by = layout.by
    selection = layout.selection
    values = [words(value) for value in selection.values(by)] if by else ["points"]
    marks = [
        Line2D([], [], linestyle="none", marker=marker, color=colour)
        for marker, colour, _ in zip(MARKERS, COLOURS, values, strict=False)
    ]
    front = Line2D(
        [], [], marker="o", markerfacecolor="white", color=GREY if by else COLOURS[0]
    )
    title = quantity(selection.study, by) if by else None
    columns = 2 if len(layout.facets) == 1 else 4
    labels = [*values, "not dominated"]
    legend_of(figure, [*marks, front], labels, title, columns=columns)


def _label(selection: Selection, aim: Direction) -> str:
    return (
        f"{quantity(selection.study, aim.metric)},"
        f" {'more' if aim.high else 'less'} is better"
    )


def _note(layout: Pareto, table: pd.DataFrame) -> str:
    metrics = [aim.metric for aim in layout.directions]
    sizes = [len(facet.points) for facet in layout.facets]
    drawn = "" if max(sizes) <= MOST_INTERVALS else " of the front"
    text = f"{span(sizes)} points per panel, {{n}} trials per point"
    interval = f"means with 95 % confidence intervals{drawn}, not simultaneous"
    note = layout.selection.note(text, table[f"{metrics[0]}_n"], interval, metrics)
    return note + (TRIALS_NOTE if layout.trials else "")


def plan(study: Results, choices: Choices) -> list[Planned]:
    """Plan one figure of two metrics. Raises ChoiceError if the kind does not suit."""
    directions = (
        choices
        if choices.metrics
        else choices._replace(metrics=tuple(opposed_metrics(study)))
    )
    metrics = directions.columns(study) if directions.metrics else []
    layout = pareto_layout(study, metrics, by=choices.by, trials=choices.trials)
    return [
        Planned(
            "-".join(aim.metric for aim in layout.directions),
            partial(draw_pareto, layout),
        )
    ]


def marks(study: Results, choices: Choices) -> FigureMarks:
    """Return the figure as marks, in which `best` marks the points of fronts."""
    metrics = choices.metrics or tuple(opposed_metrics(study))
    columns = choices._replace(metrics=metrics).columns(study) if metrics else []
    layout = pareto_layout(study, columns, by=choices.by, trials=choices.trials)
    selection = layout.selection
    first, second = layout.directions
    table = selection.table([first.metric, second.metric])
    panels = [
        MarkedPanel(
            facet.title,
            MarkedAxis(first.metric, _label(selection, first)),
            MarkedAxis(second.metric, _label(selection, second)),
            _marked(layout, table.loc[facet.points]),
            trials=_trials(layout, table.loc[facet.points]) if layout.trials else None,
        )
        for facet in layout.facets
    ]
    legend, values = legend_of_marks(selection, layout.by)
    shown = tuple(
        f"{Column.read(aim.metric).metric}{'+' if aim.high else '-'}"
        for aim in (first, second)
    )
    note = _note(layout, table)
    return FigureMarks("points", shown, panels, note, by=legend, values=values)


def _marked(layout: Pareto, table: pd.DataFrame) -> pd.DataFrame:
    first, second = layout.directions
    colours = colours_of(layout.selection, layout.by, table)
    best = pd.Series(False, table.index)
    for _, part in table.groupby(colours):
        means = part[[first.metric, second.metric]].to_numpy(np.float64)
        best[part.index] = nondominated(means, [first.high, second.high])
    columns = {
        **means_of(table, first.metric, "x", ("x_low", "x_high")),
        **means_of(table, second.metric),
        "colour": colours,
        "best": best,
        "point": table.index,
    }
    return pd.DataFrame(columns, index=table.index)


KIND = FigureKind(
    "two metrics against each other, and the Pareto front",
    ("by", "trials"),
    plan,
    marks=marks,
)
