"""Claims of different units in one figure, each in units of its margin.

A published number or range is at 0. The margin with the rounding is from -1 to 1. A
single bound has no margin. The distance to the expected side is in half-widths of the
simultaneous confidence interval. An interval to the right of 0 confirms the claim.
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
"""Distance from the published number, in margins, beyond which an arrow is drawn."""
ROW = 0.17
"""Height in inches of a row."""
PANEL = 0.75
"""Height in inches of a panel, without rows."""
FRAME = 1.0
"""Height in inches of a figure, without panels."""
LOOK: Mapping[Status, tuple[str, str]] = {
    "confirmed": (BLUE, "o"),
    "refuted": (VERMILION, "s"),
    "undecided": (PURPLE, "^"),
    "partial": (GREY, "D"),
}
AXES = {True: "ours - published (margins)", False: "beyond the bound (half-widths)"}
"""Axis labels of the two panels: claims with a width, and with a single bound."""
BAND = (
    "band: expected values (margin and rounding, or beyond a bound); arrow: farther"
    f" than {EDGE:g}"
)


class Margins(NamedTuple):
    """Scale of a claim in a figure: distance from the expectation, in margins.

    Attributes
    ----------
    wide : bool
        True for an expectation with two bounds.
    zero : float
        Value at 0.
    unit : float
        Size of one unit of the figure, negative to mirror the axis.
    text : str
        Expectation in words.
    """

    wide: bool
    zero: float
    unit: float
    text: str

    def place(self, value: float) -> float:
        """Return the position of a value."""
        return (value - self.zero) / self.unit

    def span(self, bounds: Iterable[float]) -> tuple[float, float]:
        """Return the position of an interval."""
        low, high = sorted(map(self.place, bounds))
        return low, high


def margins(expect: Numeric, half: float) -> Margins:
    """Return the scale of a claim with a simultaneous interval of half-width `half`."""
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
    """Draw the expectation, and label the axis."""
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
    """Draw the part of an interval that is within the panel.

    Parameters
    ----------
    axes : Axes
    height : float
        Vertical position.
    span : tuple of float
        Bounds of the interval, in units of the panel.
    colour : str
    width : float
        Line width in points.
    """
    low = max(span[0], -EDGE)
    high = min(span[1], EDGE)
    if low < high:
        axes.hlines(height, low, high, color=colour, linewidth=width)


def draw_mark(
    axes: Axes, height: float, place: float, look: tuple[str, str], *, filled: bool
) -> None:
    """Draw an estimate, or an arrow at the edge for an estimate beyond the panel.

    Parameters
    ----------
    axes : Axes
    height : float
        Vertical position.
    place : float
        Estimate, in units of the panel.
    look : tuple of str
        Colour and marker.
    filled : bool
        False for a hollow marker.
    """
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
    """Put the legend of verdicts above the figure.

    Parameters
    ----------
    figure : Figure
    axes : Axes
        Axes that get the empty lines of the legend.
    statuses : iterable of Status
        Verdicts to list.
    """
    for status in statuses:
        colour, marker = LOOK[status]
        axes.plot([], [], marker, markersize=4.0, color=colour, label=status)
    legend(figure, axes)
