"""Where the mean of a metric crosses a level: the phase diagram of a refined study.

With one refined axis a panel has the means against it and the crossings as bands; with
two it has the cells of the grid.
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
from sweep.figures.drawing import legend_of, named, note, quantity, title_panel
from sweep.figures.planning import Choices, FigureKind, Planned
from sweep.figures.selection import MOST_PANELS, select
from sweep.figures.style import BLUE, GREY, STYLE, VERMILION
from sweep.methods.refinement.analysis import Boundary, find_boundary
from sweep.methods.refinement.rule import RefinedAxis
from sweep.tables.stored_study import StoredStudy

MOST_AXES, MOST_ACROSS, MOST_TICKS = 2, 3, 9
LOOKS: dict[str, dict[str, Any]] = {
    "above": {"facecolor": "#f4d9b8", "edgecolor": "white"},
    "below": {"facecolor": "#cfe0ef", "edgecolor": "white"},
    "boundary": {"facecolor": "0.25", "edgecolor": "white"},
    "unresolved": {"facecolor": "white", "edgecolor": "0.45", "hatch": "////"},
}
"""How cells of each state are drawn; a reader without colours sees light, dark and
hatched ones.
"""


class Phase(NamedTuple):
    """What a phase diagram shows: a boundary, with a panel for each group of points, by
    its number and with its settings in words.
    """

    study: StoredStudy
    found: Boundary
    groups: dict[int, str]


def phase_figure(study: StoredStudy) -> Figure:
    """The phase diagram of a study whose spec has `refine`.

    With one refined axis: the mean against it with its interval at all looks, the level
    as a line, and each crossing as a band between the nearest points that surely lie on
    either side. With two axes: the cells of the grid, on one side of the level, at the
    boundary, or not resolved. Other settings that vary become panels. Raises
    ChoiceError for a study with a fixed grid, for more than two refined axes and for
    more than twelve panels.
    """
    return draw_phase(phase_layout(study))


def phase_layout(study: StoredStudy) -> Phase:
    """What `phase_figure` will show. Raises ChoiceError as it does."""
    found = find_boundary(study)
    if len(found.rule.scales) > MOST_AXES:
        raise ChoiceError(
            f"has {len(found.rule.scales)} refined axes; allowed: up to {MOST_AXES}",
            study.name,
            "phase",
        )
    table = found.points.drop_duplicates("group").set_index("group")
    others = [name for name in select(study).points if name in found.settings]
    groups = {
        int(str(group)): named((name, row[name]) for name in others)
        for group, row in table.sort_index().iterrows()
    }
    if len(groups) > MOST_PANELS:
        raise ChoiceError(
            f"has {len(groups):,} panels, by {', '.join(others)}; allowed: up to"
            f" {MOST_PANELS}; choose with where",
            study.name,
            "phase",
        )
    return Phase(study, found, groups)


def draw_phase(layout: Phase) -> Figure:
    """The figure of a layout."""
    study, found, groups = layout
    names = list(found.rule.scales)
    panel = _curve if len(names) == 1 else _cells
    with style.context(STYLE):
        across = min(MOST_ACROSS, len(groups))
        down = -(-len(groups) // across)
        figure = Figure(figsize=(max(4.6, 2.5 * across), 1.1 + 2.4 * down))
        grid = figure.subplots(down, across, sharex=True, sharey=True, squeeze=False)
        for axes, (group, title) in zip(grid.flat, groups.items(), strict=False):
            panel(axes, layout, group)
            title_panel(axes, [title], across)
            _scaled(axes, found.rule.scales[names[0]], "x")
            if len(names) > 1:
                _scaled(axes, found.rule.scales[names[1]], "y")
        for axes in grid.flat[len(groups) :]:
            axes.set_axis_off()
        metric = quantity(study, found.rule.metric)
        up = quantity(study, names[1]) if len(names) > 1 else f"mean {metric}"
        for axes in grid[-1]:
            axes.set_xlabel(quantity(study, names[0]))
        for axes in grid[:, 0]:
            axes.set_ylabel(up)
        legend_of(figure, *_legend(layout, metric))
        note(figure, _note(layout))
    return figure


def _scaled(axes: Axes, scale: RefinedAxis, which: Literal["x", "y"]) -> None:
    """Give an axis its scale, and ticks at the values of the spec if they fit."""
    if scale.geometric:
        (axes.set_xscale if which == "x" else axes.set_yscale)("log")
    if len(scale.values) <= MOST_TICKS:
        axis = axes.xaxis if which == "x" else axes.yaxis
        axis.set_ticks(scale.values, [f"{value:g}" for value in scale.values])
        axis.set_ticks([], minor=True)


def _curve(axes: Axes, layout: Phase, group: int) -> None:
    """The means of a group against the refined axis, and its crossings."""
    found, (name,) = layout.found, layout.found.rule.scales
    table = found.points[found.points["group"] == group].sort_values(name)
    low, high = table["mean"] - table["low"], table["high"] - table["mean"]
    axes.errorbar(
        table[name],
        table["mean"],
        yerr=[low, high],
        fmt="o-",
        color=BLUE,
        markersize=3,
        linewidth=0.8,
        elinewidth=0.8,
    )
    if not found.rule.steepest:
        axes.axhline(found.rule.level, color=GREY, linewidth=0.8, linestyle="--")
    assert found.crossings is not None
    for _, one in found.crossings[found.crossings["group"] == group].iterrows():
        hatch = None if one["resolved"] else "////"
        axes.axvspan(
            one["low"], one["high"], color=VERMILION, alpha=0.25, lw=0, hatch=hatch
        )
        axes.axvline(one["estimate"], color=VERMILION, linewidth=0.9)


def _cells(axes: Axes, layout: Phase, group: int) -> None:
    """The cells of a group, and its points."""
    found, (x, y) = layout.found, layout.found.rule.scales
    for _, cell in found.cells[found.cells["group"] == group].iterrows():
        left, low = cell[f"{x}_low"], cell[f"{y}_low"]
        width, height = cell[f"{x}_high"] - left, cell[f"{y}_high"] - low
        looks = LOOKS[cell["state"]]
        axes.add_patch(Rectangle((left, low), width, height, linewidth=0.4, **looks))
    table = found.points[found.points["group"] == group]
    axes.plot(table[x], table[y], ".", color="0.1", markersize=1.5)
    axes.grid(visible=False)
    ends = [found.rule.scales[name].values for name in (x, y)]
    axes.set(xlim=(ends[0][0], ends[0][-1]), ylim=(ends[1][0], ends[1][-1]))


def _legend(layout: Phase, metric: str) -> tuple[list[Artist], list[str]]:
    found = layout.found
    level = f"{metric} = {found.rule.level:g}"
    if found.crossings is None:
        states = {
            "above": f"mean {metric} above {found.rule.level:g}",
            "below": "below",
            "boundary": "boundary",
            "unresolved": "unresolved",
        }
        shown = [name for name in states if (found.cells["state"] == name).any()]
        patches: list[Artist] = [Patch(linewidth=0.4, **LOOKS[name]) for name in shown]
        return patches, [states[name] for name in shown]
    handles: list[Artist] = [
        Line2D([], [], color=GREY, linewidth=0.8, linestyle="--"),
        Patch(facecolor=VERMILION, alpha=0.25),
    ]
    if found.rule.steepest:
        return handles[1:], ["where the mean changes most, with its interval"]
    return handles, [level, "crossing, with its interval"]


def _note(layout: Phase) -> str:
    found, rule = layout.found, layout.found.rule
    counts = layout.study.plan["point"].value_counts().field("counts").to_pylist()
    left = found.cells[found.cells["state"] == "unresolved"]
    what = "a band" if found.crossings is not None else "the boundary"
    said = (
        "a band has the place with"
        if rule.steepest
        else f"{what} lies between points on either side of {rule.level:g} with"
    )
    text = (
        f"{len(found.points):,} points of {{n}} trials; {said}"
        f" {100.0 * rule.confidence:g} %, all of them together"
    )
    for why, cells in left.groupby("why"):
        text += f"; {len(cells):,} of {len(found.cells):,} cells unresolved: {why}"
    return select(layout.study).note(text, counts)


def plan(study: StoredStudy, choices: Choices) -> list[Planned]:
    """One figure. Raises ChoiceError where the study has a fixed grid, and for metrics
    by which it was not refined.
    """
    layout = phase_layout(study)
    metric = layout.found.rule.metric
    if other := [name for name in choices.metrics if name.rstrip("+-") != metric]:
        raise ChoiceError(
            f"is of {metric}, which refined the grid, and not of {', '.join(other)}",
            study.name,
            "phase",
        )
    return [Planned(metric, partial(draw_phase, layout))]


KIND = FigureKind("where a mean crosses a level, of a refined study", (), plan)
