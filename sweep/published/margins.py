"""Claims of different units in one picture: each in the margins of its expectation.

A published number or range is at 0 and its margin, with the rounding, reaches from -1
to 1. Of a single bound, where no margin is, the distance to the expected side is shown
in half widths of the simultaneous interval: an interval to the right of 0 confirms it.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sweep.figures import BLUE, GREY, PURPLE, VERMILION, legend
from sweep.published.verdicts import (
    Below,
    Numeric,
    Status,
    Value,
    Within,
    brief,
    region,
)

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
AXES = {True: "ours - published (margins)", False: "beyond the bound (half widths)"}
"""What the two panels show: claims with a width, and those with a single bound."""
BAND = (
    "band: what is expected, a margin with the rounding or all beyond a bound; arrow:"
    f" farther than {EDGE:g}"
)


class Margins(NamedTuple):
    """Where values of a claim lie in a picture: how many margins from what is expected.

    wide  whether the expectation has two bounds, and so a width
    zero  the value at 0
    unit  what one unit of the picture is
    text  what is expected, in words
    """

    wide: bool
    zero: float
    unit: float
    text: str

    def place(self, value: float) -> float:
        """Where a value lies."""
        return (value - self.zero) / self.unit

    def span(self, bounds: Iterable[float]) -> tuple[float, float]:
        """Where an interval lies."""
        low, high = sorted(map(self.place, bounds))
        return low, high


def margins(expect: Numeric, half: float) -> Margins:
    """Those of a claim; `half` is half the width of its simultaneous interval."""
    half = half or 1.0
    width = region(expect).half_width or half
    if isinstance(expect, Value):
        text = brief(expect.value)
        text += f" ± {brief(expect.margin)}" if expect.margin else ""
        return Margins(True, expect.value, width, text)
    if isinstance(expect, Within):
        text = f"{brief(expect.low)} to {brief(expect.high)}"
        return Margins(True, (expect.low + expect.high) / 2.0, width, text)
    below = isinstance(expect, Below)
    text = f"{'<>'[not below]} {brief(expect.bound)}"
    return Margins(False, expect.bound, -half if below else half, text)


def frame_panel(axes: Axes, *, wide: bool) -> None:
    """Draw what is expected, and name the axis."""
    axes.axvspan(*((-1.0, 1.0) if wide else (0.0, EDGE)), color="0.92", zorder=0)
    axes.axvline(0.0, color="0.4", linewidth=0.8)
    axes.set_xlim(-EDGE * 1.03, EDGE * 1.03)
    axes.set_xlabel(AXES[wide], fontsize=8)
    axes.tick_params(axis="y", labelsize=6.5)
    axes.tick_params(axis="x", labelsize=7.5)


def number_rows(axes: Axes, texts: Sequence[str]) -> None:
    """Write a text on the right of each row."""
    numbers = axes.secondary_yaxis("right")
    numbers.set_yticks(range(len(texts)), texts)
    numbers.tick_params(length=0, labelsize=6.5)
    numbers.spines["right"].set_visible(False)


def draw_line(
    axes: Axes, height: float, span: tuple[float, float], colour: str, width: float
) -> None:
    """Draw what of an interval lies within the panel."""
    low, high = max(span[0], -EDGE), min(span[1], EDGE)
    if low < high:
        axes.hlines(height, low, high, color=colour, linewidth=width)


def draw_mark(
    axes: Axes, height: float, place: float, look: tuple[str, str], *, filled: bool
) -> None:
    """Draw an estimate; an arrow at the edge if it lies beyond."""
    colour, marker = look
    if abs(place) > EDGE:
        marker = ">" if place > 0 else "<"
    axes.plot(
        min(max(place, -EDGE), EDGE),
        height,
        marker,
        markersize=4.0,
        color=colour,
        markerfacecolor=colour if filled else "white",
    )


def name_verdicts(figure: Figure, axes: Axes, statuses: Iterable[Status]) -> None:
    """Put the legend of these verdicts above the figure."""
    for status in statuses:
        colour, marker = LOOK[status]
        axes.plot([], [], marker, markersize=4.0, color=colour, label=status)
    legend(figure, axes)
