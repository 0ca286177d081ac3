"""The scorecard as a figure: a forest plot of the tested claims of a publication."""

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
    """A row in the unit of its panel.

    `ours` is our estimate. `intervals` has two confidence intervals with line widths.
    `wide` is True for an expectation with two bounds.
    """

    row: Row
    wide: bool
    ours: float
    intervals: tuple[tuple[tuple[float, float], float], ...]
    text: str


def forest_figure(title: str, rows: Sequence[Row], family: int) -> Figure:
    """Return the forest plot of the rows that have a confidence interval.

    Parameters
    ----------
    title : str
        Title of the publication.
    rows : sequence of Row
        Rows in the order of the plot, at least one with a confidence interval.
    family : int
        Number of claims with simultaneous intervals.
    """
    drawn = [shown for row in rows if (shown := _scaled(row))]
    panels = [
        panel
        for wide in AXES
        if (panel := [shown for shown in drawn if shown.wide is wide])
    ]
    heights = [ROW * len(panel) + PANEL for panel in panels]
    with style.context(STYLE):
        figure = Figure(figsize=(8.6, sum(heights) + FRAME))
        places = figure.subplots(len(panels), 1, squeeze=False, height_ratios=heights)
        for axes, panel in zip(places[:, 0], panels, strict=True):
            _panel(axes, panel)
        name_verdicts(figure, places[0, 0], LOOK)
        places[0, 0].set_title(title)
        note(
            figure,
            "thick line: 95 % confidence interval; thin line: simultaneous interval"
            f" for the verdict (Bonferroni, {family} claims); {BAND}; hollow: a fit,"
            " not counted",
        )
    return figure


def _scaled(row: Row) -> Drawn | None:
    """Return a row in the unit of the panel; None without a measured value."""
    expect = row.claim.expect
    verdict = row.verdict
    measured = row.measured
    if not (expect and measured and verdict.interval and verdict.simultaneous):
        return None
    if isinstance(expect, OfOrder) or isinstance(measured.estimate, Scaling):
        return None
    ours = measured.estimate.value
    scaled = margins(expect, verdict.noticeable or 0.0)
    intervals = ((verdict.simultaneous, 0.8), (verdict.interval, 2.2))
    return Drawn(
        row=row,
        wide=scaled.wide,
        ours=scaled.place(ours),
        intervals=tuple((scaled.span(bounds), width) for bounds, width in intervals),
        text=f"{brief(ours)}  ({scaled.text})",
    )


def _panel(axes: Axes, panel: Sequence[Drawn]) -> None:
    """Draw rows below each other, with numbers on the right."""
    frame_panel(axes, wide=panel[0].wide)
    for place, drawn in enumerate(panel):
        look = LOOK[drawn.row.verdict.status]
        for span, width in drawn.intervals:
            draw_line(axes, place, span, colour=look[0], width=width)
        draw_mark(axes, place, drawn.ours, look, filled=drawn.row.claim.counted)
    name_rows(axes, [drawn.row.claim.id for drawn in panel])
    number_rows(axes, [drawn.text for drawn in panel])
