"""The figure of flocks of several sizes against a control parameter.

The figure shows the order, the susceptibility and the Binder cumulant.
"""

from functools import partial
from typing import Any

from matplotlib import style
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sweep.figures import (
    COLOURS,
    GREY,
    LINE_STYLES,
    MARKERS,
    STYLE,
    Choices,
    FigureKind,
    Planned,
    legend,
    note,
    quantity,
    select,
)
from sweep.methods.scaling.analysis import CURVES, Scaling, finite_size_scaling
from sweep.tables import StoredStudy
from sweep.text import so_many

WORDS = {
    "order": "mean {}",
    "susceptibility": "susceptibility",
    "binder": "Binder's cumulant",
}


def scaling_figure(
    study: StoredStudy, metric: str | None = None, by: str | None = None
) -> Figure:
    """Plot the mean order, the susceptibility and the Binder cumulant of several sizes.

    Each size has a line with confidence intervals. Bands show crossings of cumulants of
    neighbouring sizes. Crosses show peaks of the susceptibility.

    Parameters
    ----------
    study : StoredStudy
    metric : str, optional
        The order parameter, a recorded series; by default the first series.
    by : str, optional
        The control parameter; by default the only number that varies in addition to n.

    Returns
    -------
    Figure

    Raises
    ------
    ChoiceError
        The study has no sizes; see `sweep.methods.scaling.finite_size_scaling`.
    """
    return draw_scaling(study, finite_size_scaling(study, metric, by))


def draw_scaling(study: StoredStudy, scaling: Scaling) -> Figure:
    """Draw the figure of several sizes."""
    with style.context(STYLE):
        figure = Figure(figsize=(9.6, 3.9))
        panels = figure.subplots(1, len(CURVES))
        for axes, name in zip(panels, CURVES, strict=True):
            _curves(axes, scaling, name)
            axes.set_xlabel(quantity(study, scaling.control))
            axes.set_ylabel(WORDS[name].format(quantity(study, scaling.metric)))
        _peaks(panels[1], scaling)
        _crossings(panels[2], scaling)
        legend(figure, panels[0])
        note(figure, _note(study, scaling))
    return figure


def looks(number: int) -> dict[str, Any]:
    """Return the style of the line of a size."""
    return {
        "color": COLOURS[number % len(COLOURS)],
        "marker": MARKERS[number % len(MARKERS)],
        "linestyle": LINE_STYLES[number % len(LINE_STYLES)],
        "markersize": 3.5,
        "linewidth": 0.9,
    }


def _curves(axes: Axes, scaling: Scaling, name: str) -> None:
    for number, curve in enumerate(scaling.curves):
        means = getattr(curve, name)
        look = looks(number)
        low, high = means.bounds(scaling.confidence)
        axes.fill_between(curve.x, low, high, color=look["color"], alpha=0.2, lw=0)
        axes.plot(curve.x, means.value, label=f"n = {curve.n:,}", **look)


def _peaks(axes: Axes, scaling: Scaling) -> None:
    """Draw a cross at each peak, as wide and as high as the confidence intervals."""
    for number, peak in enumerate(scaling.peaks):
        if peak.why:
            continue
        axes.errorbar(
            peak.x,
            peak.height,
            xerr=[[peak.x - peak.low], [peak.high - peak.x]],
            yerr=[[peak.height - peak.height_low], [peak.height_high - peak.height]],
            color=looks(number)["color"],
            linewidth=2.2,
            zorder=4,
        )


def _crossings(axes: Axes, scaling: Scaling) -> None:
    """Draw a band for each crossing, and a line at the estimate."""
    for crossing in scaling.crossings:
        axes.axvspan(crossing.low, crossing.high, color=GREY, alpha=0.2, lw=0, zorder=0)
        axes.axvline(crossing.x, color=GREY, lw=0.8)


def _note(study: StoredStudy, scaling: Scaling) -> str:
    left = (
        "the first half of each trial"
        if scaling.burn_in is None
        else f"the first {scaling.burn_in:,} steps"
    )
    text = (
        f"{len(scaling.states):,} points of {{n}} trials, without {left}; 95 %"
        " confidence intervals;"
        " susceptibility: n (<m²> - <m>²), cumulant: 1 - <m⁴> / 3<m²>²"
        f" of m = {scaling.metric.replace('_', ' ')}; crosses: where the susceptibility"
        " peaks; bands: where cumulants cross; transition:"
        f" {scaling.order.order} ({scaling.order.why})"
    )
    if not scaling.stationary:
        flagged = int((scaling.states["problems"] != "").sum())
        text += f"; {so_many(flagged, 'point')} not stationary"
    return select(study).note(text, scaling.states["trials"])


def plan(study: StoredStudy, choices: Choices) -> list[Planned]:
    """Return a figure.

    ChoiceError if the study has no sizes, no series, or varies several further numbers.
    """
    scaling = chosen(study, choices)
    return [Planned(scaling.metric, partial(draw_scaling, study, scaling))]


def chosen(study: StoredStudy, choices: Choices) -> Scaling:
    """Return the analysis for choices: the metric, and `x` as control parameter."""
    metrics = [name.rstrip("+-") for name in choices.metrics]
    return finite_size_scaling(study, metrics[0] if metrics else None, choices.x)


KIND = FigureKind(
    "order, susceptibility and Binder's cumulant of several sizes", ("x",), plan
)
