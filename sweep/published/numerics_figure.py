"""Figure of the effect of numerics on the claims of a publication.

Each claim is drawn side by side with another time step, another order of updates and
another seed.
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

LABELS = 4.2
"""Width in inches of the texts next to all columns."""
COLUMN = 2.2
"""Width in inches of a column."""
BELOW = 0.28
"""Distance in rows of the estimate of a variant below the unchanged estimate."""
JUDGED: tuple[Status, ...] = ("confirmed", "refuted", "undecided")


class Compared(NamedTuple):
    """A claim, the scale in the figure, and the estimate without a change."""

    claim: str
    margins: Margins
    estimate: Estimated


def numerics_figure(
    title: str, claims: Sequence[Claim], variants: DocumentVariants, family: int
) -> Figure:
    """Return the figure of the claims that have a confidence interval: see `compared`.

    Parameters
    ----------
    title : str
        Title of the publication.
    claims : sequence of Claim
        Claims in the order of the figure, at least one with a confidence interval.
    variants : DocumentVariants
        Effects of the numerics of the publication.
    family : int
        Number of claims with simultaneous intervals.
    """
    rows = compared(claims, variants)
    panels = [
        shown
        for wide in AXES
        if (shown := [row for row in rows if row.margins.wide is wide])
    ]
    tried = variants.tried("numerics")
    heights = [ROW * len(shown) + PANEL for shown in panels]
    with style.context(STYLE):
        size = LABELS + COLUMN * len(tried), sum(heights) + FRAME
        figure = Figure(figsize=size)
        places = figure.subplots(
            len(panels), len(tried), squeeze=False, height_ratios=heights
        )
        for line, shown in zip(places, panels, strict=True):
            for axes, variant in zip(line, tried.values(), strict=True):
                _panel(axes, shown, variants, variant)
            name_rows(line[0], [row.claim for row in shown])
            for axes in line[1:]:
                axes.tick_params(axis="y", labelleft=False)
            number_rows(line[-1], [_text(row) for row in shown])
        for axes, (name, variant) in zip(places[0], tried.items(), strict=True):
            axes.set_title(f"{name}\n{variant.description}", fontsize=8)
        # Above the names of the columns, which have two lines.
        places[0, 0].set_title(f"{title}\n\n", loc="left")
        name_verdicts(figure, places[0, 0], JUDGED)
        note(
            figure,
            "grey: without a change; coloured: with the change; lines: simultaneous"
            f" intervals for the verdict (Bonferroni, {family} claims); red ground:"
            f" another verdict; right: without a change (expected), n trials; {BAND}",
        )
    return figure


def compared(claims: Sequence[Claim], variants: DocumentVariants) -> list[Compared]:
    """Return, in order, the claims that have an interval without a change."""
    return [
        Compared(
            claim.id,
            margins(claim.expect, (estimate["high"] - estimate["low"]) / 2.0),
            estimate,
        )
        for claim in claims
        if claim.expect
        and not isinstance(claim.expect, OfOrder)
        and (estimate := variants.estimates.get(claim.id))
    ]


def _text(row: Compared) -> str:
    estimate = row.estimate
    return (
        f"{brief(estimate['ours'])}  ({row.margins.text}), n = {estimate['trials']:,}"
    )


def _panel(
    axes: Axes, rows: Sequence[Compared], variants: DocumentVariants, variant: Turned
) -> None:
    """Draw rows below each other, without a change and with a variant."""
    frame_panel(axes, wide=rows[0].margins.wide)
    for place, row in enumerate(rows):
        _draw(axes, place - BELOW / 2.0, row.margins, row.estimate, look=(GREY, "."))
        if row.claim in variant.turned:
            ground = (place - 0.5, place + 0.5)
            axes.axhspan(*ground, color=VERMILION, alpha=0.15, zorder=0.5, linewidth=0)
        status = variant.turned.get(row.claim, variants.before[row.claim])
        estimate = variant.estimates.get(row.claim)
        if estimate and status in LOOK:
            height = place + BELOW / 2.0
            _draw(axes, height, row.margins, estimate, look=LOOK[status])
        else:
            text = "not judged" if row.claim in variant.unjudged else status
            axes.text(
                0.02,
                place + BELOW,
                text,
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
    draw_line(axes, height, span, colour=look[0], width=0.8)
    draw_mark(axes, height, scaled.place(estimate["ours"]), look, filled=True)
