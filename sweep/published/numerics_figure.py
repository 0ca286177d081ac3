"""What numerics do to the claims of a document, as one picture: beside each other each
claim with another time step, another order of updates and another seed.
"""

from collections.abc import Sequence
from typing import NamedTuple

from matplotlib import style
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sweep.figures import GREY, STYLE, VERMILION, name_rows, note
from sweep.published.claims import Claim
from sweep.published.margins import (
    AXES,
    BAND,
    FRAME,
    LOOK,
    PANEL,
    ROW,
    Margins,
    draw_line,
    draw_mark,
    frame_panel,
    margins,
    name_verdicts,
    number_rows,
)
from sweep.published.turned import DocumentVariants, Estimated, Turned
from sweep.published.verdicts import OfOrder, Status, brief

LABELS, COLUMN = 4.2, 2.2
"""Inches: the width of the texts beside all columns, and of a column."""
BELOW = 0.28
"""How far below the estimate without a change that of the variant stands, in rows."""
JUDGED: tuple[Status, ...] = ("confirmed", "refuted", "undecided")


class Compared(NamedTuple):
    """A claim, where its values lie, and what was measured without a change."""

    claim: str
    margins: Margins
    estimate: Estimated


def numerics_figure(
    title: str, claims: Sequence[Claim], found: DocumentVariants, family: int
) -> Figure:
    """The picture of the claims that have an interval, one or more: see `compared`.

    title   the name of the document
    claims  its claims, drawn in their order
    found   what its numerics turned
    family  the number of claims whose intervals hold together
    """
    rows = compared(claims, found)
    panels = [
        shown
        for wide in AXES
        if (shown := [one for one in rows if one.margins.wide is wide])
    ]
    tried = found.tried("numerics")
    heights = [ROW * len(shown) + PANEL for shown in panels]
    with style.context(STYLE):
        size = LABELS + COLUMN * len(tried), sum(heights) + FRAME
        figure = Figure(figsize=size)
        places = figure.subplots(
            len(panels), len(tried), squeeze=False, height_ratios=heights
        )
        for line, shown in zip(places, panels, strict=True):
            for axes, one in zip(line, tried.values(), strict=True):
                _panel(axes, shown, found, one)
            name_rows(line[0], [one.claim for one in shown])
            for axes in line[1:]:
                axes.tick_params(axis="y", labelleft=False)
            number_rows(line[-1], [_text(one) for one in shown])
        for axes, (name, one) in zip(places[0], tried.items(), strict=True):
            axes.set_title(f"{name}\n{one.description}", fontsize=8)
        # Above the names of the columns, which have two lines.
        places[0, 0].set_title(f"{title}\n\n", loc="left")
        name_verdicts(figure, places[0, 0], JUDGED)
        note(
            figure,
            "grey: without a change; coloured: with it; lines: the simultaneous"
            f" intervals that decide (Bonferroni, {family} claims); red ground: another"
            f" verdict; right: without a change (expected), n trials; {BAND}",
        )
    return figure


def compared(claims: Sequence[Claim], found: DocumentVariants) -> list[Compared]:
    """The claims that have an interval without a change, in their order."""
    return [
        Compared(claim.id, margins(claim.expect, (one["high"] - one["low"]) / 2.0), one)
        for claim in claims
        if claim.expect
        and not isinstance(claim.expect, OfOrder)
        and (one := found.estimates.get(claim.id))
    ]


def _text(row: Compared) -> str:
    one = row.estimate
    return f"{brief(one['ours'])}  ({row.margins.text}), n = {one['trials']:,}"


def _panel(
    axes: Axes, rows: Sequence[Compared], found: DocumentVariants, variant: Turned
) -> None:
    """Draw rows below each other, as they are and with a variant."""
    frame_panel(axes, wide=rows[0].margins.wide)
    for place, row in enumerate(rows):
        _draw(axes, place - BELOW / 2.0, row.margins, row.estimate, (GREY, "."))
        if row.claim in variant.turned:
            ground = (place - 0.5, place + 0.5)
            axes.axhspan(*ground, color=VERMILION, alpha=0.15, zorder=0.5, linewidth=0)
        status = variant.turned.get(row.claim, found.before[row.claim])
        estimate = variant.estimates.get(row.claim)
        if estimate and status in LOOK:
            _draw(axes, place + BELOW / 2.0, row.margins, estimate, LOOK[status])
        else:
            said = "not judged" if row.claim in variant.unjudged else status
            axes.text(
                0.02,
                place + BELOW,
                said,
                transform=axes.get_yaxis_transform(),
                fontsize=6,
                color=GREY,
                va="center",
            )
    name_rows(axes, [""] * len(rows))


def _draw(
    axes: Axes,
    height: float,
    scaled: Margins,
    estimate: Estimated,
    look: tuple[str, str],
) -> None:
    span = scaled.span((estimate["low"], estimate["high"]))
    draw_line(axes, height, span, look[0], 0.8)
    draw_mark(axes, height, scaled.place(estimate["ours"]), look, filled=True)
