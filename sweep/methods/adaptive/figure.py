"""The figure of half-widths of confidence intervals against numbers of trials."""

from functools import partial
from typing import NamedTuple

import numpy as np
import pandas as pd
from matplotlib import style
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import NullLocator

from sweep.analysis import by_point
from sweep.errors import ChoiceError
from sweep.figures import (
    COLOURS,
    GREY,
    STYLE,
    Choices,
    FigureKind,
    FigureMarks,
    MarkedAxis,
    MarkedLine,
    MarkedPanel,
    Planned,
    Selection,
    colours_of,
    legend_of,
    legend_of_marks,
    make_logarithmic,
    note,
    quantity,
    recorded,
    select,
    words,
)
from sweep.spec import Column, Over, column_over
from sweep.tables import StoredStudy
from sweep.text import so_many

FEWEST = 6
"""With fewer trials a point has at most three half-widths, which show no slope."""
LOWEST = 1e-3
"""The least half-width that stretches the axis, relative to the median half-width."""
MOST_PLAIN = 60
"""Up to this number, lines are opaque; more lines are pale."""


class Narrowing(NamedTuple):
    """The layout of a figure of half-widths.

    Colours show the values of the parameter `by`.
    """

    selection: Selection
    metric: str
    by: str | None


def narrowing_figure(
    study: StoredStudy,
    metric: str,
    *,
    by: str | None = None,
    over: Over = "last",
) -> Figure:
    """Draw half-widths of confidence intervals against numbers of trials.

    Each point has a line, and the two scales are logarithmic. The intervals are
    confidence intervals of the mean of the first 3, 4, 6, 8, 12, ... done trials with a
    value. Trials are ordered by replicate number. The last interval uses all trials
    with a value, like `study.means`. The dashed line has the slope -1/2 of independent
    values with a known standard deviation. With few trials Student's factor makes
    intervals wider.

    Parameters
    ----------
    study : StoredStudy
    metric : str
    by : str, optional
        Parameter whose values are colours.
    over : {"last", "half"}, default "last"
        The last frame, or the mean over the second half of each trial.

    Returns
    -------
    Figure

    Raises
    ------
    ChoiceError
        If the study does not have a name, or no point has `FEWEST` trials.
    """
    column = column_over(metric, over)
    return draw_narrowing(narrowing_layout(study, column, by=by))


def narrowing_layout(study: StoredStudy, metric: str, *, by: str | None) -> Narrowing:
    """Return the layout that `narrowing_figure` draws.

    Parameters
    ----------
    study : StoredStudy
    metric : str
        Column of the trials.
    by : str or None
        Parameter whose values are colours.

    Returns
    -------
    Narrowing

    Raises
    ------
    ChoiceError
        As for `narrowing_figure`.
    """
    selection = select(study)
    recorded(study, metric)
    if (most := int(selection.trials["replicate"].max()) + 1) < FEWEST:
        raise ChoiceError(
            f"needs {FEWEST} trials per point; the study has at most {most}",
            study.name,
            "narrowing",
        )
    return Narrowing(
        selection, metric, selection.colour(by, selection.apart([]), shown=[])
    )


def draw_narrowing(layout: Narrowing) -> Figure:
    """Draw the figure of a layout."""
    widths = half_widths(layout)
    drawn = _drawn(widths)
    with style.context(STYLE):
        figure = Figure(figsize=(4.8, 3.9))
        axes = figure.subplots()
        _lines(axes, layout, drawn)
        line = _reference(drawn)
        axes.plot(line.x, line.y, color=GREY, linestyle="--", linewidth=1.0)
        if len(drawn):  # an axis without a number above 0 cannot be logarithmic
            make_logarithmic(axes, "x")
            make_logarithmic(axes, "y")
            axes.set_ylim(bottom=_low(drawn))
        ticks = _looks(int(drawn["n"].max()) if len(drawn) else FEWEST)
        axes.set_xticks(ticks, [f"{tick:,}" for tick in ticks])
        axes.xaxis.set_minor_locator(NullLocator())
        axes.set_xlabel("trials")
        axes.set_ylabel(_label(layout))
        _legend(figure, layout)
        note(figure, _note(layout, widths))
    return figure


def half_widths(layout: Narrowing) -> pd.DataFrame:
    """Return the half-widths of a figure, one row per point and number of trials.

    Columns: `point`, `n`, and `half`, the half-width of the confidence interval of the
    first `n` trials.
    """
    selection, metric, _ = layout
    trials = selection.trials
    measured = trials[(trials["status"] == "done") & trials[metric].notna()]
    measured = measured.sort_values("replicate", kind="stable")
    number = measured.groupby("point", sort=False).cumcount() + 1
    most = int(number.max()) if len(measured) else 0
    looks = _looks(most)
    parts = []
    for look in [*looks, *({most} - set(looks))]:
        means = by_point(
            measured[number <= look],
            ["point"],
            [metric],
            repeated=selection.study.repeated,
            distributions=selection.study.distributions,
        )
        n = means[f"{metric}_n"]
        shown = (n == look) | ((look == most) & ~n.isin(looks))
        half = (means[f"{metric}_high"] - means[f"{metric}_low"]) / 2.0
        part = {"point": means["point"], "n": n, "half": half}
        parts.append(pd.DataFrame(part)[shown])
    return pd.concat(parts, ignore_index=True)


def _looks(most: int) -> list[int]:
    """Return 3, 4, 6, 8, 12, ... up to `most`."""
    powers = [2**k for k in range(1, most.bit_length())]
    return sorted(n for k in powers for n in (k, k * 3 // 2) if 2 < n <= most)


def _drawn(widths: pd.DataFrame) -> pd.DataFrame:
    """Return the half-widths that a logarithmic axis can show."""
    positive = np.isfinite(widths["half"]) & (widths["half"] > 0.0)
    drawn: pd.DataFrame = widths[positive]
    return drawn


def _low(drawn: pd.DataFrame) -> float | None:
    """Return the lower end of the axis if half-widths are far below the median."""
    near = drawn["half"] >= LOWEST * drawn["half"].median()
    return None if near.all() else float(drawn["half"][near].min())


def _reference(drawn: pd.DataFrame) -> MarkedLine:
    """Return the dashed line, of slope -1/2.

    The line goes through a median half-width, at the largest number of trials that half
    of the points have.
    """
    if drawn.empty:
        return MarkedLine()
    counts = drawn.groupby("n")["half"].agg(["size", "median"])
    common = counts[counts["size"] >= drawn["point"].nunique() / 2.0]
    n = float(common.index.max() if len(common) else counts.index.max())
    half = float(counts["median"][n])
    ends = (float(counts.index.min()), float(counts.index.max()))
    y = [half * float(np.sqrt(n / end)) for end in ends]
    return MarkedLine(ends, y, "slope \N{MINUS SIGN}1/2")


def _lines(axes: Axes, layout: Narrowing, drawn: pd.DataFrame) -> None:
    selection = layout.selection
    colours = colours_of(selection, layout.by, selection.points)
    groups = drawn.sort_values("n", kind="stable").groupby("point", sort=False)
    lines = {point: widths[["n", "half"]].to_numpy(float) for point, widths in groups}
    many = len(lines) > MOST_PLAIN
    collection = LineCollection(
        [*lines.values()],
        colors=[COLOURS[colours[point]] for point in lines],
        linewidths=0.6 if many else 1.2,
        alpha=0.3 if many else 1.0,
        rasterized=many,
    )
    axes.add_collection(collection)


def _legend(figure: Figure, layout: Narrowing) -> None:
    selection = layout.selection
    by = layout.by
    values = selection.values(by) if by else []
    handles = [Line2D([], [], color=COLOURS[place]) for place in range(len(values))]
    reference = Line2D([], [], color=GREY, linestyle="--", linewidth=1.0)
    legend_of(
        figure,
        [*handles, reference],
        [*map(words, values), "slope \N{MINUS SIGN}1/2"],
        quantity(selection.study, by) if by else None,
    )


def _label(layout: Narrowing) -> str:
    return f"half-width of {quantity(layout.selection.study, layout.metric)}"


def _note(layout: Narrowing, widths: pd.DataFrame) -> str:
    selection, metric, _ = layout
    counts = widths.groupby("point")["n"].max()
    drawn = _drawn(widths)
    without = widths["point"].nunique() - drawn["point"].nunique()
    low = _low(drawn)
    below = 0 if low is None else drawn["point"][drawn["half"] < low].nunique()
    text = selection.note(
        f"{so_many(len(counts), 'point')}, {{n}} trials per point, in the order of"
        " replicates",
        counts,
        "half of the 95 % confidence interval of the mean",
        [metric],
    )
    for number, reason in [
        (without, "no half-width above 0"),
        (below, "half-widths below the axis"),
    ]:
        have = "have" if number > 1 else "has"
        text += f"\n{so_many(number, 'point')} {have} {reason}" if number else ""
    return text


def plan(study: StoredStudy, choices: Choices) -> list[Planned]:
    """Return a figure per metric. Raises ChoiceError as `narrowing_figure`."""
    metrics = choices.plain(study)
    layouts = [narrowing_layout(study, name, by=choices.by) for name in metrics]
    return [
        Planned(name, partial(draw_narrowing, layout))
        for name, layout in zip(metrics, layouts, strict=True)
    ]


def marks(study: StoredStudy, choices: Choices) -> FigureMarks:
    """Return the figure of the first metric as marks."""
    metric = choices.plain(study)[0]
    layout = narrowing_layout(study, metric, by=choices.by)
    widths = half_widths(layout)
    selection = layout.selection
    drawn = _drawn(widths)
    colours = colours_of(selection, layout.by, selection.points)
    columns = {
        "x": drawn["n"],
        "y": drawn["half"],
        "low": np.nan,
        "high": np.nan,
        "n": drawn["n"],
        "colour": drawn["point"].map(colours).astype(int),
        "point": drawn["point"],
    }
    panel = MarkedPanel(
        "",
        MarkedAxis("trials", "trials", logarithmic=True),
        MarkedAxis("half_width", _label(layout), logarithmic=True, low=_low(drawn)),
        pd.DataFrame(columns),
        line=_reference(drawn),
    )
    shown = (Column.read(metric).metric,)
    by, values = legend_of_marks(selection, layout.by)
    text = _note(layout, widths)
    return FigureMarks("paths", shown, [panel], text, by=by, values=values)


KIND = FigureKind(
    "half-width of each confidence interval against the number of trials",
    ("by",),
    plan,
    marks=marks,
    of_precision=True,
)
