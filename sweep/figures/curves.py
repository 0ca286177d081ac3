"""Metrics against time: mean curves with confidence bands."""

from collections.abc import Iterable, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from matplotlib import colormaps, style
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm, Normalize, to_hex
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from sweep.analysis import curves
from sweep.errors import ChoiceError
from sweep.figures.drawing import (
    draw_trials,
    legend_of,
    note,
    quantity,
    title_panel,
    without_trials,
    words,
    y_label,
)
from sweep.figures.marks import (
    TRIALS_NOTE,
    FigureMarks,
    MarkedAxis,
    MarkedPanel,
    allow_trials,
    colours_of,
    legend_of_marks,
)
from sweep.figures.planning import Choices, FigureKind, Planned
from sweep.figures.scales import TickNumbers, is_logarithmic
from sweep.figures.selection import (
    MOST_COLOURS,
    Facet,
    Selection,
    among,
    has_scale,
    select,
)
from sweep.figures.style import COLOURS, LINE_STYLES, STYLE
from sweep.spec import Column, spelled
from sweep.tables import Results, as_names, stored_parts
from sweep.text import unknown

MOST_LINES = 60
"""The most values of a numeric parameter that a colour bar distinguishes."""
RESOLVED = 0.01
"""The width of a line, as a fraction of the height of a panel.

Lines of 1.4 points are drawn in panels of about 2 inches.
"""
LINE = "_line"


class Curves(NamedTuple):
    """The contents of a figure of curves.

    Each metric and facet has a panel, and each value of `by` a line in the panel.
    `time` is the unit of time of curves with different time steps, and "" for curves
    against the frame. If `trials` is true, the values of single trials are behind the
    means.
    """

    selection: Selection
    metrics: list[str]
    by: str | None
    facets: list[Facet]
    time: str
    trials: bool

    @property
    def x(self) -> MarkedAxis:
        """The axis of frames, or of times."""
        label = f"time ({self.time})" if self.time else "time (steps)"
        return MarkedAxis("frame", label)

    @property
    def panels(self) -> list[tuple[str, Facet]]:
        """The metric and the facet of each panel."""
        return [(metric, facet) for metric in self.metrics for facet in self.facets]


def metric_curves(
    study: Results,
    by: str | None = None,
    metrics: str | Sequence[str] = (),
    *,
    trials: bool = False,
) -> Figure:
    """Draw mean curves of series metrics against the frame, with a panel per metric.

    Bands are pointwise 95 % confidence intervals over trials. Further parameters that
    vary become panels. A panel without done trials shows a note. Curves with different
    time steps, such as those of a recording and of a model, are against the time.

    Parameters
    ----------
    study : Results
    by : str, optional
        Parameter with one line per value; by default the listed parameter with the
        fewest values. A legend shows up to 7 values, a colour bar up to 60 numbers.
    metrics : str or sequence of str, optional
        By default all series metrics.
    trials : bool, default False
        Draw the values of each trial behind the means.

    Returns
    -------
    Figure

    Raises
    ------
    ChoiceError
        If no series are stored, a name is unknown, or there are too many lines, panels
        or values of trials.

    Examples
    --------
    >>> figure = metric_curves(sweep.load("my/first"), by="separation_weight")
    >>> [axes.get_ylabel() for axes in figure.axes]
    ['speed (px/step)', 'polarization']
    >>> [line.get_label() for line in figure.axes[0].lines]
    ['0.5', '1', '2']
    """
    return draw_curves(curves_layout(study, by, as_names(metrics), trials=trials))


def curves_layout(
    study: Results,
    by: str | None,
    metrics: Sequence[str],
    *,
    trials: bool = False,
) -> Curves:
    """Return the layout of `metric_curves`, or raise ChoiceError.

    Parameters
    ----------
    study : Results
    by : str or None
    metrics : sequence of str
        All series metrics if empty.
    trials : bool, default False
        Show the values of trials.
    """
    selection = select(study)
    recorded = series_metrics(study)
    for name in metrics:
        if name not in recorded:
            raise ChoiceError(unknown("series metric", name, recorded), study.name)
    chosen = _lines(selection, by)
    panel_settings = selection.apart([chosen] if chosen else [])
    if mixed := selection.mixed([*([chosen] if chosen else []), *panel_settings]):
        raise ChoiceError(
            f"a curve would be a mean over {', '.join(mixed)};"
            f" allowed: up to {MOST_LINES} points; choose with by and where",
            study.name,
        )
    drawn = list(metrics) or recorded
    facets = selection.facets(panel_settings)
    remedy = "" if len(facets) > 1 else f"choose metrics, of {', '.join(drawn)}"
    selection.allow(len(drawn) * len(facets), panel_settings, "curves", remedy)
    if trials:
        allow_trials(selection, len(drawn) * len(study.series), "curves")
    time = _time_unit(selection)
    return Curves(selection, drawn, chosen, facets, time=time, trials=trials)


def _time_unit(selection: Selection) -> str:
    """Return the unit of time if time steps differ, and units do not; else ""."""
    trials = selection.trials
    if "dt" not in trials or trials["dt"].nunique() < 2:
        return ""
    units = {
        spelled("time", part.known.models[part.provenance["model"]])
        for part in stored_parts(selection.study)
    }
    return units.pop() if len(units) == 1 else ""


def series_metrics(study: Results) -> list[str]:
    """Return the metrics stored frame by frame. Raises ChoiceError without any."""
    if not study.series_metrics:
        raise ChoiceError(
            f"has no series; record: {{series: [{study.metrics[0]}]}} stores series",
            study.name,
        )
    return study.series_metrics


def _lines(selection: Selection, by: str | None) -> str | None:
    """Return the parameter of the lines, or None if no listed parameter varies.

    Raises ChoiceError for too many lines.
    """
    listed = selection.apart([])
    if not by and not listed:
        return None
    name = selection.setting(by) if by else listed[0]
    most = MOST_LINES if has_scale(selection.points[name]) else MOST_COLOURS
    if (number := len(selection.values(name))) > most:
        few = [
            other for other in listed if len(selection.values(other)) <= MOST_COLOURS
        ]
        offer = (
            f"by one of {', '.join(few)}"
            if few
            else f"with where, {selection.example([name])}"
        )
        raise ChoiceError(
            f"by {name}, which has {number:,}"
            f" values; allowed: up to {most}; choose {offer}",
            selection.study.name,
            "curves",
        )
    return name


def draw_curves(layout: Curves) -> Figure:
    """Draw the figure of a layout."""
    selection, metrics, by, facets, *_ = layout
    panels = layout.panels
    tables = [_means(layout, metric, facet) for metric, facet in panels]
    with style.context(STYLE):
        across = min(3 if len(facets) > 2 else 2, len(panels))
        down = -(-len(panels) // across)
        figure = Figure(figsize=(max(3.6 * min(across, 2), 4.2), 2.5 * down + 0.7))
        grid = figure.subplots(down, across, squeeze=False).ravel()
        for axes, (metric, facet), table in zip(grid, panels, tables, strict=False):
            _curve_panel(axes, layout, metric, facet, table=table)
            title_panel(axes, [facet.title], across)
        for place, axes in enumerate(grid):
            repeated = len(metrics) == 1 and place % across > 0
            axes.yaxis.label.set_visible(not repeated)
        for start in range(0, len(panels), len(facets)):
            _one_scale(grid[start : start + len(facets)])
        for axes in grid[len(panels) :]:
            axes.set_axis_off()
        if by and _coloured(layout):
            figure.colorbar(
                ScalarMappable(_norm(layout), "viridis"),
                ax=list(grid),
                label=quantity(selection.study, by),
                format=TickNumbers() if is_logarithmic(selection, by) else None,
            )
        elif by:
            labels = [words(value) for value in selection.values(by)]
            handles = [
                Line2D([], [], **_looks(layout, place)) for place in range(len(labels))
            ]
            title = quantity(selection.study, by)
            legend_of(figure, handles, labels, title)
        note(figure, _note(layout, tables))
    return figure


def _note(layout: Curves, tables: Sequence[pd.DataFrame]) -> str:
    selection = layout.selection
    trials = selection.trials
    counts = trials[trials["status"] == "done"].groupby("point").size()
    interval = "mean with pointwise 95 % confidence interval"
    if selection.study.repeated:
        interval += ", valid for fixed numbers of trials"
    note = selection.note(
        "{n} trials per curve", counts, interval, shown=layout.metrics
    )
    note += _coinciding(layout, tables)
    return note + (TRIALS_NOTE if layout.trials else "")


def _coinciding(layout: Curves, tables: Sequence[pd.DataFrame]) -> str:
    """Return the note about curves that one of them hides, or "".

    Curves coincide if no two means of a frame are farther apart than a line is wide.
    `tables` has the curves of each panel.
    """
    texts = []
    for metric in layout.metrics:
        panels = [
            (facet.title, table)
            for (name, facet), table in zip(layout.panels, tables, strict=True)
            if name == metric
        ]
        width = RESOLVED * _height([table for _, table in panels])
        for title, table in panels:
            if sizes := _sizes_of_groups(table, width):
                named_metric = len(layout.metrics) > 1 or not title
                names = [metric.replace("_", " ") if named_metric else "", title]
                place = ", ".join(filter(None, names))
                number = table[LINE].nunique()
                texts.append(f"{' and '.join(map(str, sizes))} of {number} ({place})")
    if not texts:
        return ""
    return f"\ncurves coincide within the width of a line: {', '.join(texts)}"


def _height(tables: Sequence[pd.DataFrame]) -> float:
    """Return the height of the axis that panels of a metric share."""
    values = pd.concat(tables)[["mean", "low", "high"]].to_numpy(np.float64)
    values = values[np.isfinite(values)]
    if not len(values):
        return 0.0
    positive = all(table.empty or table["mean"].min() >= 0.0 for table in tables)
    return float(values.max() - (0.0 if positive else values.min()))


def _sizes_of_groups(table: pd.DataFrame, width: float) -> list[int]:
    """Return the sizes of groups of curves that coincide with a first curve."""
    groups: list[list[pd.Series[float]]] = []
    for _, rows in table.groupby(LINE, sort=False):
        curve = rows.set_index("x")["mean"]
        for group in groups:
            first = group[0]
            if first.index.equals(curve.index) and np.allclose(
                first, curve, rtol=0.0, atol=width, equal_nan=True
            ):
                group.append(curve)
                break
        else:
            groups.append([curve])
    return [len(group) for group in groups if len(group) > 1]


def _curve_panel(
    axes: Axes, layout: Curves, metric: str, facet: Facet, *, table: pd.DataFrame
) -> None:
    selection = layout.selection
    by = layout.by
    lines: dict[object, pd.DataFrame] = dict(iter(table.groupby(LINE, sort=False)))
    if layout.trials:
        trials = _trials(layout, metric, facet)
        draw_trials(
            axes, trials, lambda number: to_hex(_looks(layout, number)["color"])
        )
    for number, value in enumerate(selection.values(by) if by else [""]):
        if value not in lines:
            continue
        curve = lines[value]
        (line,) = axes.plot(
            curve["x"], curve["mean"], label=words(value), **_looks(layout, number)
        )
        axes.fill_between(
            curve["x"],
            curve["low"],
            curve["high"],
            color=line.get_color(),
            alpha=0.2,
            lw=0,
        )
    axes.set_xlabel(layout.x.label)
    axes.set_ylabel(y_label(quantity(selection.study, metric)))
    if table.empty:
        without_trials(axes)
    elif table["mean"].min() >= 0.0:
        axes.set_ylim(bottom=0)
    axes.margins(x=0)


def _means(layout: Curves, metric: str, facet: Facet) -> pd.DataFrame:
    """Return the curves of a panel.

    The columns are x (frame or time), mean, low, high, n and the value of `by`.
    """
    selection = layout.selection
    by = layout.by
    trials = among(selection.trials, facet.points)
    trials = trials.assign(
        **{LINE: trials["point"].map(selection.points[by]) if by else ""}
    )
    distribution = selection.study.distributions[metric]
    table = curves(
        selection.study.series, trials, LINE, metric, distribution=distribution
    )
    table["x"] = table["frame"]
    if layout.time:
        # dt varies between points, so the trials of a line have one value.
        table["x"] *= table[LINE].map(trials.groupby(LINE)["dt"].first())
    return table


def _trials(layout: Curves, metric: str, facet: Facet) -> pd.DataFrame:
    """Return the values of the trials of a panel; see `MarkedPanel`."""
    selection = layout.selection
    trials = selection.trials[selection.study.done]
    own = trials[trials["point"].isin(facet.points)]
    rows = selection.study.series.merge(own, on="trial_id", suffixes=("", "_at_end"))
    finite = rows[np.isfinite(rows[metric].to_numpy(np.float64))]
    points = selection.points.loc[finite["point"]]
    columns = {
        "x": finite["frame"] * (finite["dt"] if layout.time else 1),
        "y": finite[metric],
        "colour": colours_of(selection, layout.by, points).to_numpy(),
        "trial": finite["trial_id"],
        "replicate": finite["replicate"],
        "point": finite["point"],
    }
    return pd.DataFrame(columns)


def _looks(layout: Curves, number: int) -> dict[str, Any]:
    """Return the colour and style of the line with this number."""
    if _coloured(layout) and layout.by:
        values = np.array(layout.selection.values(layout.by), np.float64)
        return {
            "color": colormaps["viridis"](_norm(layout)(values)[number]),
            "linewidth": 1.0,
        }
    return {
        "color": COLOURS[number],
        "linestyle": LINE_STYLES[number % len(LINE_STYLES)],
    }


def _one_scale(panels: Iterable[Axes]) -> None:
    """Give all panels of a metric equal y limits."""
    drawn = [axes for axes in panels if axes.lines]
    limits = np.array([axes.get_ylim() for axes in drawn])
    for axes in drawn:
        axes.set_ylim(limits[:, 0].min(), limits[:, 1].max())


def _coloured(layout: Curves) -> bool:
    """Return True if a colour bar, and not a legend, distinguishes the lines."""
    return (
        layout.by is not None and len(layout.selection.values(layout.by)) > MOST_COLOURS
    )


def _norm(layout: Curves) -> Normalize:
    assert layout.by is not None
    values = np.asarray(layout.selection.points[layout.by], np.float64)
    kind = LogNorm if is_logarithmic(layout.selection, layout.by) else Normalize
    return kind(float(values.min()), float(values.max()))


def plan(study: Results, choices: Choices) -> list[Planned]:
    """Plan one figure of all metrics, or a figure per metric if parameters need panels.

    Raises ChoiceError if the study has no curves.
    """
    drawn = (
        [Column.read(name).metric for name in choices.plain(study)]
        if choices.metrics
        else series_metrics(study)
    )
    first = curves_layout(study, choices.by, drawn[:1])
    groups = [drawn] if len(first.facets) == 1 else [[name] for name in drawn]
    layouts = [
        curves_layout(study, choices.by, group, trials=choices.trials)
        for group in groups
    ]
    labels = (
        [""]
        if len(groups) == 1 and not choices.metrics
        else ["-".join(group) for group in groups]
    )
    return [
        Planned(label, partial(draw_curves, layout))
        for label, layout in zip(labels, layouts, strict=True)
    ]


def marks(study: Results, choices: Choices) -> FigureMarks:
    """Return the figure of the first chosen or first series metric as marks."""
    names = [Column.read(name).metric for name in choices.plain(study)]
    chosen = names[:1] if choices.metrics else series_metrics(study)[:1]
    layout = curves_layout(study, choices.by, chosen, trials=choices.trials)
    selection = layout.selection
    by = layout.by
    (metric,) = layout.metrics
    y = MarkedAxis(metric, quantity(selection.study, metric))
    tables = [_means(layout, metric, facet) for facet in layout.facets]
    panels = [
        MarkedPanel(
            facet.title,
            layout.x,
            y,
            _marked(layout, facet, table),
            trials=_trials(layout, metric, facet) if layout.trials else None,
        )
        for facet, table in zip(layout.facets, tables, strict=True)
    ]
    numbers = range(len(selection.values(by)) if by else 1)
    colours = tuple(to_hex(_looks(layout, number)["color"]) for number in numbers)
    legend, values = legend_of_marks(selection, by)
    return FigureMarks(
        "lines",
        (metric,),
        panels,
        _note(layout, tables),
        by=legend,
        values=values,
        colours=colours,
    )


def _marked(layout: Curves, facet: Facet, table: pd.DataFrame) -> pd.DataFrame:
    selection = layout.selection
    by = layout.by
    values = selection.values(by) if by else [""]
    order = {value: number for number, value in enumerate(values)}
    points = selection.points.loc[facet.points]
    behind = points[by] if by else pd.Series("", points.index)
    ids = {value: point for point, value in behind.items()}
    columns = {
        "x": table["x"],
        "y": table["mean"],
        "low": table["low"],
        "high": table["high"],
        "n": table["n"],
        "colour": table[LINE].map(order).astype(int),
        "point": table[LINE].map(ids),
    }
    return pd.DataFrame(columns)


KIND = FigureKind(
    "each series metric against time: mean and confidence band",
    ("by", "trials"),
    plan,
    of_several=True,
    marks=marks,
)
