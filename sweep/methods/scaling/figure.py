"""Flocks of several sizes against a setting: their order, its susceptibility and
Binder's cumulant, with what these tell of a transition.
"""

from functools import partial
from typing import Any

from matplotlib import style
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sweep.figures.drawing import legend, note, quantity
from sweep.figures.planning import Choices, FigureKind, Planned
from sweep.figures.selection import select
from sweep.figures.style import COLOURS, GREY, LINE_STYLES, MARKERS, STYLE
from sweep.methods.scaling.analysis import CURVES, Scaling, finite_size_scaling
from sweep.tables.stored_study import StoredStudy
from sweep.text import so_many

WORDS = {
    "order": "mean {}",
    "susceptibility": "susceptibility",
    "binder": "Binder's cumulant",
}


def scaling_figure(
    study: StoredStudy, metric: str | None = None, by: str | None = None
) -> Figure:
    """The mean of an order parameter, its susceptibility and Binder's cumulant against
    a setting, a line for each size with its intervals.

    Bands stand where cumulants of neighbouring sizes cross, and where the
    susceptibility peaks. Raises ChoiceError as
    `sweep.methods.scaling.finite_size_scaling`.
    """
    return draw_scaling(study, finite_size_scaling(study, metric, by))


def draw_scaling(study: StoredStudy, found: Scaling) -> Figure:
    """The figure of what is known of the sizes."""
    with style.context(STYLE):
        figure = Figure(figsize=(9.6, 3.9))
        panels = figure.subplots(1, len(CURVES))
        for axes, name in zip(panels, CURVES, strict=True):
            _curves(axes, found, name)
            axes.set_xlabel(quantity(study, found.control))
            axes.set_ylabel(WORDS[name].format(quantity(study, found.metric)))
        _peaks(panels[1], found)
        _crossings(panels[2], found)
        legend(figure, panels[0])
        note(figure, _note(study, found))
    return figure


def looks(number: int) -> dict[str, Any]:
    """How the line of a size is drawn."""
    return {
        "color": COLOURS[number % len(COLOURS)],
        "marker": MARKERS[number % len(MARKERS)],
        "linestyle": LINE_STYLES[number % len(LINE_STYLES)],
        "markersize": 3.5,
        "linewidth": 0.9,
    }


def _curves(axes: Axes, found: Scaling, name: str) -> None:
    for number, one in enumerate(found.curves):
        means, look = getattr(one, name), looks(number)
        low, high = means.bounds(found.confidence)
        axes.fill_between(one.x, low, high, color=look["color"], alpha=0.2, lw=0)
        axes.plot(one.x, means.value, label=f"n = {one.n:,}", **look)


def _peaks(axes: Axes, found: Scaling) -> None:
    """A cross at each peak, as wide and as high as its intervals."""
    for number, peak in enumerate(found.peaks):
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


def _crossings(axes: Axes, found: Scaling) -> None:
    """A band for each crossing, and a line in it."""
    for one in found.crossings:
        axes.axvspan(one.low, one.high, color=GREY, alpha=0.2, lw=0, zorder=0)
        axes.axvline(one.x, color=GREY, lw=0.8)


def _note(study: StoredStudy, found: Scaling) -> str:
    left = (
        "the first half of each trial does"
        if found.burn_in is None
        else f"the first {found.burn_in:,} steps do"
    )
    text = (
        f"{len(found.states):,} points of {{n}} trials, of which {left} not count;"
        " 95 % intervals; susceptibility: n (<m²> - <m>²), cumulant: 1 - <m⁴> / 3<m²>²"
        f" of m = {found.metric.replace('_', ' ')}; crosses: where the susceptibility"
        " peaks; bands: where cumulants cross; transition:"
        f" {found.order.order} ({found.order.why})"
    )
    if not found.stationary:
        flagged = int((found.states["problems"] != "").sum())
        text += f"; {so_many(flagged, 'point')} not stationary"
    return select(study).note(text, found.states["trials"])


def plan(study: StoredStudy, choices: Choices) -> list[Planned]:
    """One figure. Raises ChoiceError where the study has no sizes, no series, or varies
    more than one other number.
    """
    found = chosen(study, choices)
    return [Planned(found.metric, partial(draw_scaling, study, found))]


def chosen(study: StoredStudy, choices: Choices) -> Scaling:
    """What is known of the sizes by what was chosen: the metric, and `x`."""
    names = [name.rstrip("+-") for name in choices.metrics]
    return finite_size_scaling(study, names[0] if names else None, choices.x)


KIND = FigureKind(
    "order, susceptibility and Binder's cumulant of several sizes", ("x",), plan
)
