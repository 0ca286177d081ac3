"""The scorecard as a picture: a forest plot of the tested claims of one document."""

from collections.abc import Sequence
from typing import NamedTuple

from matplotlib import style
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sweep.figures import STYLE, name_rows, note
from sweep.methods.scaling import Scaling
from sweep.published.judging import Row
from sweep.published.margins import (
    AXES,
    BAND,
    FRAME,
    LOOK,
    PANEL,
    ROW,
    draw_line,
    draw_mark,
    frame_panel,
    margins,
    name_verdicts,
    number_rows,
)
from sweep.published.verdicts import OfOrder, brief


class Drawn(NamedTuple):
    """A row in the unit of its panel: ours, and both intervals with their widths.

    `wide` is whether its expectation has two bounds, and so a width.
    """

    row: Row
    wide: bool
    ours: float
    intervals: tuple[tuple[tuple[float, float], float], ...]
    text: str


def forest_figure(title: str, rows: Sequence[Row], family: int) -> Figure:
    """The picture of the rows that have an interval, of which there is one or more.

    title   the name of the document
    rows    its rows, drawn in their order
    family  the number of claims whose intervals hold together
    """
    drawn = [one for row in rows if (one := _scaled(row))]
    panels = [
        found for wide in AXES if (found := [one for one in drawn if one.wide is wide])
    ]
    heights = [ROW * len(found) + PANEL for found in panels]
    with style.context(STYLE):
        figure = Figure(figsize=(8.6, sum(heights) + FRAME))
        places = figure.subplots(len(panels), 1, squeeze=False, height_ratios=heights)
        for axes, found in zip(places[:, 0], panels, strict=True):
            _panel(axes, found)
        name_verdicts(figure, places[0, 0], LOOK)
        places[0, 0].set_title(title)
        note(
            figure,
            "thick line: 95 % interval; thin line: the simultaneous interval that"
            f" decides (Bonferroni, {family} claims); {BAND}; hollow: a fit, not"
            " counted",
        )
    return figure


def _scaled(row: Row) -> Drawn | None:
    """A row in the unit of its panel; None where nothing was measured."""
    expect, verdict, found = row.claim.expect, row.verdict, row.measured
    if not (expect and found and verdict.interval and verdict.simultaneous):
        return None
    if isinstance(expect, OfOrder) or isinstance(found.estimate, Scaling):
        return None
    ours, scaled = found.estimate.value, margins(expect, verdict.noticeable or 0.0)
    intervals = ((verdict.simultaneous, 0.8), (verdict.interval, 2.2))
    return Drawn(
        row,
        scaled.wide,
        scaled.place(ours),
        tuple((scaled.span(bounds), width) for bounds, width in intervals),
        f"{brief(ours)}  ({scaled.text})",
    )


def _panel(axes: Axes, found: Sequence[Drawn]) -> None:
    """Draw rows below each other, with their numbers on the right."""
    frame_panel(axes, wide=found[0].wide)
    for place, one in enumerate(found):
        look = LOOK[one.row.verdict.status]
        for span, width in one.intervals:
            draw_line(axes, place, span, look[0], width)
        draw_mark(axes, place, one.ours, look, filled=one.row.claim.counted)
    name_rows(axes, [one.row.claim.id for one in found])
    number_rows(axes, [one.text for one in found])
