"""The scorecard as a picture: a forest plot of the tested claims of one document.

Rows of different units stand in one picture. A published number or range is at 0 and
its margin, with the rounding, reaches from -1 to 1. Of a single bound, where no margin
is, the distance to the expected side is shown in half widths of the simultaneous
interval: an interval to the right of 0 confirms it.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from matplotlib import style
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sweep.figures import (
    BLUE,
    GREY,
    PURPLE,
    STYLE,
    VERMILION,
    legend,
    name_rows,
    note,
)
from sweep.published.judging import Row
from sweep.published.verdicts import Below, Status, Value, Within, brief, region

EDGE = 4.0
"""What lies farther from the published number than so many margins is an arrow."""
ROW, PANEL, FRAME = 0.17, 0.75, 1.0
"""Inches: the height of a row, what a panel needs beside rows, and the figure beside
panels.
"""
LOOK: Mapping[Status, tuple[str, str]] = {
    "confirmed": (BLUE, "o"),
    "refuted": (VERMILION, "s"),
    "undecided": (PURPLE, "^"),
    "partial": (GREY, "D"),
}


class Drawn(NamedTuple):
    """A row in the unit of its panel: ours, and the bounds of both intervals.

    `wide` is whether its expectation has two bounds, and so a width.
    """

    row: Row
    wide: bool
    ours: float
    interval: tuple[float, float]
    simultaneous: tuple[float, float]
    text: str


def forest_figure(title: str, rows: Sequence[Row], family: int) -> Figure:
    """The picture of the rows that have an interval, of which there is one or more.

    title   the name of the document
    rows    its rows, drawn in their order
    family  the number of claims whose intervals hold together
    """
    drawn = [one for row in rows if (one := _scaled(row))]
    panels = [
        (found, words)
        for wide, words in (
            (True, "ours - published (margins)"),
            (False, "beyond the bound (half widths)"),
        )
        if (found := [one for one in drawn if one.wide is wide])
    ]
    heights = [ROW * len(found) + PANEL for found, _ in panels]
    with style.context(STYLE):
        figure = Figure(figsize=(8.6, sum(heights) + FRAME))
        places = figure.subplots(len(panels), 1, squeeze=False, height_ratios=heights)
        for axes, (found, words) in zip(places[:, 0], panels, strict=True):
            _panel(axes, found, words)
        _legend(figure, places[0, 0])
        places[0, 0].set_title(title)
        note(
            figure,
            "thick line: 95 % interval; thin line: the simultaneous interval that"
            f" decides (Bonferroni, {family} claims); band: what is expected, a margin"
            " with the rounding or all beyond a bound; arrow: farther than"
            f" {EDGE:g}; hollow: a fit, not counted",
        )
    return figure


def _scaled(row: Row) -> Drawn | None:
    """A row in the unit of its panel; None where nothing was measured."""
    expect, verdict, found = row.claim.expect, row.verdict, row.measured
    if not (expect and found and verdict.interval and verdict.simultaneous):
        return None
    allowed, ours = region(expect), found.estimate.value
    half = verdict.noticeable or 1.0
    if isinstance(expect, Value):
        zero, unit, text = expect.value, allowed.half_width, f"{brief(expect.value)}"
        text += f" ± {brief(expect.margin)}" if expect.margin else ""
    elif isinstance(expect, Within):
        zero, unit = (expect.low + expect.high) / 2.0, allowed.half_width
        text = f"{brief(expect.low)} to {brief(expect.high)}"
    else:
        zero, below = expect.bound, isinstance(expect, Below)
        unit, text = (-half if below else half), f"{'<>'[not below]} {brief(zero)}"
    unit = unit or half

    def scaled(bounds: tuple[float, float]) -> tuple[float, float]:
        low, high = sorted((bound - zero) / unit for bound in bounds)
        return low, high

    return Drawn(
        row,
        isinstance(expect, Value | Within),
        (ours - zero) / unit,
        scaled(verdict.interval),
        scaled(verdict.simultaneous),
        f"{brief(ours)}  ({text})",
    )


def _panel(axes: Axes, found: Sequence[Drawn], words: str) -> None:
    """Draw rows below each other, with their numbers on the right."""
    band = (-1.0, 1.0) if found[0].wide else (0.0, EDGE)
    axes.axvspan(*band, color="0.92", zorder=0)
    axes.axvline(0.0, color="0.4", linewidth=0.8)
    for place, one in enumerate(found):
        _draw(axes, place, one)
    name_rows(axes, [one.row.claim.id for one in found])
    axes.set_xlim(-EDGE * 1.03, EDGE * 1.03)
    axes.set_xlabel(words, fontsize=8)
    axes.tick_params(axis="y", labelsize=6.5)
    axes.tick_params(axis="x", labelsize=7.5)
    numbers = axes.secondary_yaxis("right")
    numbers.set_yticks(range(len(found)), [one.text for one in found])
    numbers.tick_params(length=0, labelsize=6.5)
    numbers.spines["right"].set_visible(False)


def _draw(axes: Axes, place: int, one: Drawn) -> None:
    colour, marker = LOOK[one.row.verdict.status]
    for (low, high), width in ((one.simultaneous, 0.8), (one.interval, 2.2)):
        low, high = max(low, -EDGE), min(high, EDGE)
        if low < high:
            axes.hlines(place, low, high, color=colour, linewidth=width)
    if abs(one.ours) > EDGE:
        marker = ">" if one.ours > 0 else "<"
    face = colour if one.row.claim.counted else "white"
    x = min(max(one.ours, -EDGE), EDGE)
    axes.plot(x, place, marker, markersize=4.0, color=colour, markerfacecolor=face)


def _legend(figure: Figure, axes: Axes) -> None:
    for status, (colour, marker) in LOOK.items():
        axes.plot([], [], marker, markersize=4.0, color=colour, label=status)
    legend(figure, axes)
