"""The phase diagram of a refined study: the boundary at which a mean crosses a level.

With one refined axis, a panel has the means against the axis, and the crossings as
bands. With two axes, a panel has the cells of the grid.
"""

from functools import partial
from typing import Any, Literal, NamedTuple

from matplotlib import style
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle

from sweep.errors import ChoiceError
from sweep.figures import (
    BLUE,
    GREY,
    MOST_PANELS,
    STYLE,
    VERMILION,
    Choices,
    FigureKind,
    Planned,
    legend_of,
    make_logarithmic,
    named,
    note,
    quantity,
    select,
    title_panel,
)
from sweep.methods.refinement.analysis import Boundary, find_boundary
from sweep.methods.refinement.rule import RefinedAxis
from sweep.tables import StoredStudy

MOST_AXES = 2
MOST_ACROSS = 3
MOST_TICKS = 9
LOOKS: dict[str, dict[str, Any]] = {
    "above": {"facecolor": "#f4d9b8", "edgecolor": "white"},
    "below": {"facecolor": "#cfe0ef", "edgecolor": "white"},
    "boundary": {"facecolor": "0.25", "edgecolor": "white"},
    "unresolved": {"facecolor": "white", "edgecolor": "0.45", "hatch": "////"},
}
"""Style of cells by state; without colours cells are light, dark and hatched."""


class Phase(NamedTuple):
    """Content of a phase diagram.

    Attributes
    ----------
    study : StoredStudy
    boundary : Boundary
    groups : dict
        The parameters of each group of points in words, by number. Each group is a
        panel.
    """

    study: StoredStudy
    boundary: Boundary
    groups: dict[int, str]


def phase_figure(study: StoredStudy) -> Figure:
    """Plot the phase diagram of a study whose spec has `refine`.

    With one refined axis, the figure shows the mean against the axis with its
    confidence interval, simultaneous for all looks. The level is a line. Each crossing
    is a band between the nearest points that are known to be on either side. With two
    axes, the figure shows the cells of the grid: on a side of the level, at the
    boundary, or unresolved. Further parameters that vary become panels.

    Raises
    ------
    ChoiceError
        The study has a fixed grid, more than two refined axes, or more than twelve
        panels.
    """
    return draw_phase(phase_layout(study))


def phase_layout(study: StoredStudy) -> Phase:
    """Return the content of `phase_figure`. Raises ChoiceError as `phase_figure`."""
    boundary = find_boundary(study)
    if len(boundary.rule.scales) > MOST_AXES:
        raise ChoiceError(
            f"has {len(boundary.rule.scales)} refined axes; allowed: up to {MOST_AXES}",
            study.name,
            "phase",
        )
    table = boundary.points.drop_duplicates("group").set_index("group")
    settings = [name for name in select(study).points if name in boundary.settings]
    groups = {
        int(str(group)): named((name, row[name]) for name in settings)
        for group, row in table.sort_index().iterrows()
    }
    if len(groups) > MOST_PANELS:
        raise ChoiceError(
            f"has {len(groups):,} panels, by {', '.join(settings)}; allowed: up to"
            f" {MOST_PANELS}; choose with where",
            study.name,
            "phase",
        )
    return Phase(study, boundary, groups)


def draw_phase(layout: Phase) -> Figure:
    """Draw the figure of a layout."""
    study, boundary, groups = layout
    settings = list(boundary.rule.scales)
    panel = _curve if len(settings) == 1 else _cells
    with style.context(STYLE):
        across = min(MOST_ACROSS, len(groups))
        down = -(-len(groups) // across)
        figure = Figure(figsize=(max(4.6, 2.5 * across), 1.1 + 2.4 * down))
        grid = figure.subplots(down, across, sharex=True, sharey=True, squeeze=False)
        for axes, (group, title) in zip(grid.flat, groups.items(), strict=False):
            panel(axes, layout, group)
            title_panel(axes, [title], across)
            _scaled(axes, boundary.rule.scales[settings[0]], "x")
            if len(settings) > 1:
                _scaled(axes, boundary.rule.scales[settings[1]], "y")
        for axes in grid.flat[len(groups) :]:
            axes.set_axis_off()
        metric = quantity(study, boundary.rule.metric)
        up = quantity(study, settings[1]) if len(settings) > 1 else f"mean {metric}"
        for axes in grid[-1]:
            axes.set_xlabel(quantity(study, settings[0]))
        for axes in grid[:, 0]:
            axes.set_ylabel(up)
        legend_of(figure, *_legend(layout, metric))
        note(figure, _note(layout))
    return figure


def _scaled(axes: Axes, scale: RefinedAxis, which: Literal["x", "y"]) -> None:
    """Set the scale of an axis, and ticks at the values of the spec if these fit."""
    if scale.geometric:
        make_logarithmic(axes, which)
    if len(scale.values) <= MOST_TICKS:
        axis = axes.xaxis if which == "x" else axes.yaxis
        axis.set_ticks(scale.values, [f"{value:g}" for value in scale.values])
        axis.set_ticks([], minor=True)


def _curve(axes: Axes, layout: Phase, group: int) -> None:
    """Draw the means of a group against the refined axis, and the crossings."""
    boundary = layout.boundary
    (name,) = boundary.rule.scales
    table = boundary.points[boundary.points["group"] == group].sort_values(name)
    axes.errorbar(
        table[name],
        table["mean"],
        yerr=[table["mean"] - table["low"], table["high"] - table["mean"]],
        fmt="o-",
        color=BLUE,
        markersize=3,
        linewidth=0.8,
        elinewidth=0.8,
    )
    if not boundary.rule.steepest:
        axes.axhline(boundary.rule.level, color=GREY, linewidth=0.8, linestyle="--")
    assert boundary.crossings is not None
    crossings = boundary.crossings[boundary.crossings["group"] == group]
    for _, crossing in crossings.iterrows():
        axes.axvspan(
            crossing["low"],
            crossing["high"],
            color=VERMILION,
            alpha=0.25,
            lw=0,
            hatch=None if crossing["resolved"] else "////",
        )
        axes.axvline(crossing["estimate"], color=VERMILION, linewidth=0.9)


def _cells(axes: Axes, layout: Phase, group: int) -> None:
    """Draw the cells and the points of a group."""
    boundary = layout.boundary
    x, y = boundary.rule.scales
    for _, cell in boundary.cells[boundary.cells["group"] == group].iterrows():
        left = cell[f"{x}_low"]
        low = cell[f"{y}_low"]
        width = cell[f"{x}_high"] - left
        height = cell[f"{y}_high"] - low
        looks = LOOKS[cell["state"]]
        axes.add_patch(Rectangle((left, low), width, height, linewidth=0.4, **looks))
    table = boundary.points[boundary.points["group"] == group]
    axes.plot(table[x], table[y], ".", color="0.1", markersize=1.5)
    axes.grid(visible=False)
    ends = [boundary.rule.scales[name].values for name in (x, y)]
    axes.set(xlim=(ends[0][0], ends[0][-1]), ylim=(ends[1][0], ends[1][-1]))


def _legend(layout: Phase, metric: str) -> tuple[list[Artist], list[str]]:
    boundary = layout.boundary
    level = f"{metric} = {boundary.rule.level:g}"
    if boundary.crossings is None:
        states = {
            "above": f"mean {metric} above {boundary.rule.level:g}",
            "below": "below",
            "boundary": "boundary",
            "unresolved": "unresolved",
        }
        shown = [name for name in states if (boundary.cells["state"] == name).any()]
        patches: list[Artist] = [Patch(linewidth=0.4, **LOOKS[name]) for name in shown]
        return patches, [states[name] for name in shown]
    handles: list[Artist] = [
        Line2D([], [], color=GREY, linewidth=0.8, linestyle="--"),
        Patch(facecolor=VERMILION, alpha=0.25),
    ]
    if boundary.rule.steepest:
        return handles[1:], ["where the mean changes most, with confidence interval"]
    return handles, [level, "crossing, with confidence interval"]


def _note(layout: Phase) -> str:
    boundary = layout.boundary
    rule = boundary.rule
    counts = layout.study.plan["point"].value_counts().field("counts").to_pylist()
    left = boundary.cells[boundary.cells["state"] == "unresolved"]
    subject = "a band" if boundary.crossings is not None else "the boundary"
    statement = (
        "a band contains the position with"
        if rule.steepest
        else f"{subject} is between points on either side of {rule.level:g} with"
    )
    text = (
        f"{len(boundary.points):,} points of {{n}} trials; {statement}"
        f" {100.0 * rule.confidence:g} % confidence, simultaneously"
    )
    for why, cells in left.groupby("why"):
        text += f"; {len(cells):,} of {len(boundary.cells):,} cells unresolved: {why}"
    return select(layout.study).note(text, counts)


def plan(study: StoredStudy, choices: Choices) -> list[Planned]:
    """Return a figure.

    Raises ChoiceError if the study has a fixed grid, or was refined by another metric.
    """
    layout = phase_layout(study)
    metric = layout.boundary.rule.metric
    if other := [name for name in choices.metrics if name.rstrip("+-") != metric]:
        raise ChoiceError(
            f"shows {metric}, which refined the grid, and not {', '.join(other)}",
            study.name,
            "phase",
        )
    return [Planned(metric, partial(draw_phase, layout))]


KIND = FigureKind("where a mean crosses a level, of a refined study", (), plan)
