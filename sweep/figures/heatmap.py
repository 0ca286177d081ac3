"""A metric over two settings: the means of cells, and half the width of their
intervals.

Cells are points where the design is a grid, else bins.
"""

from functools import partial
from typing import NamedTuple

import numpy as np
import pandas as pd
from matplotlib import style
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure, SubFigure
from numpy.typing import NDArray

from sweep.analysis import CONFIDENCE
from sweep.analysis.intervals import group_bounds
from sweep.analysis.mean_bounds import equal
from sweep.errors import ChoiceError
from sweep.figures.drawing import note, quantity, span, tidy_grid, title_panel
from sweep.figures.marks import (
    MOST_IDS,
    FigureMarks,
    MarkedAxis,
    MarkedPanel,
    axis_of,
)
from sweep.figures.planning import Choices, FigureKind, Planned
from sweep.figures.scales import (
    Floats,
    bin_edges,
    cell_edges,
    is_logarithmic,
    label_setting,
    places,
)
from sweep.figures.selection import Facet, Selection, has_scale, recorded, select
from sweep.figures.style import STYLE
from sweep.spec.recorded import Column, Over, column_over
from sweep.tables.stored_study import StoredStudy

MOST_LISTED, MOST_DRAWN = 30, 12
"""A setting with more values is divided into bins: so many listed or sampled ones."""
FEWEST_BINS, MOST_BINS, POINTS_A_BIN = 3, 12, 10
LIGHT = 0.6
HEIGHTS = (2.6, 2.6, 2.1, 1.75)
"""The height of a row of one to four panels, in inches."""
WIDENED = 0.1
"""Of equal values the scale of colours reaches so far beyond, as a part of them."""
MOST_COUNTED = 2
"""In so many panels the number of points is written into each bin."""


class Cells(NamedTuple):
    """The cells of a panel: their edges along x and y, and for each cell (rows,
    columns) the mean, half the width of its interval, and the number of points.

    `places` has the number of the cell of each point, row after row, by its id.
    """

    x: Floats
    y: Floats
    mean: Floats
    half: Floats
    points: NDArray[np.int64]
    places: "pd.Series[int]"


class Heatmap(NamedTuple):
    """What a heatmap shows: a metric over the settings `x` and `y`, a panel a facet.

    `binned` are those of `x` and `y` that are divided into bins. `mixed` are other
    settings that differ between the points of a cell.
    """

    selection: Selection
    metric: str
    x: str
    y: str
    facets: list[Facet]
    binned: list[str]
    mixed: list[str]

    @property
    def averages(self) -> bool:
        """Whether a cell may hold several points."""
        return bool(self.binned or self.mixed)


def heatmap_figure(
    study: StoredStudy,
    metric: str,
    x: str | None = None,
    y: str | None = None,
    *,
    over: Over = "last",
) -> Figure:
    """The mean of `metric` over two settings, `x` and `y`, and beside it half the width
    of its 95 % interval.

    Without `x` and `y` they are the first two settings that are sampled, or the listed
    numbers with the most values. In a grid each cell is a point, and its mean is over
    replicates. A setting with more than 30 listed values, or 12 sampled ones, is
    divided into bins. The mean of a bin is over its points, whatever else is sampled; a
    bin without points is white. Other listed settings become panels. `over="half"`
    takes the mean over the last half of each trial. Raises ChoiceError for names that
    the study does not have, for fewer than two settings, and for more than twelve
    panels.
    """
    return draw_heatmap(heatmap_layout(study, column_over(metric, over), x, y))


def heatmap_layout(
    study: StoredStudy,
    metric: str,
    x: str | None,
    y: str | None,
) -> Heatmap:
    """What `heatmap_figure` will show. Raises ChoiceError as it does."""
    selection = select(study)
    recorded(study, metric)
    given = [selection.setting(name) for name in (x, y) if name]
    if x and x == y:
        raise ChoiceError(
            f"with x and y both {x}; allowed: two settings", study.name, "heatmap"
        )
    listed = sorted(
        selection.apart(selection.sampled),
        key=lambda name: _preference(selection, name),
    )
    free = [*selection.sampled, *listed]
    chosen = [*given, *(name for name in free if name not in given)][:2]
    if len(chosen) < 2:
        raise ChoiceError(
            f"needs two settings that vary, and there is {len(chosen)}",
            study.name,
            "heatmap",
        )
    chosen = [selection.axis(name, "heatmap") for name in chosen]
    across, up = (chosen[0], chosen[1]) if x or not y else (chosen[1], chosen[0])
    others = selection.apart(list(dict.fromkeys([across, up, *selection.sampled])))
    facets = selection.panels(others, "heatmap")
    binned = [name for name in (across, up) if is_binned(selection, name)]
    mixed = (
        [name for name in selection.sampled if name not in (across, up)]
        if binned
        else []
    )
    mixed = mixed or selection.mixed([across, up, *others])
    return Heatmap(selection, metric, across, up, facets, binned, mixed)


def is_binned(selection: Selection, name: str) -> bool:
    """Whether cells are bins of a setting, and not its values."""
    most = MOST_DRAWN if name in selection.sampled else MOST_LISTED
    return has_scale(selection.points[name]) and len(selection.values(name)) > most


def _preference(selection: Selection, name: str) -> tuple[bool, int]:
    return not has_scale(selection.points[name]), -len(selection.values(name))


def draw_heatmap(layout: Heatmap) -> Figure:
    """The figure of a layout."""
    selection, metric = layout.selection, layout.metric
    table = selection.table([metric])
    cells = [_cells(layout, table.loc[facet.points]) for facet in layout.facets]
    name = quantity(selection.study, metric)
    known = any(np.isfinite(one.half).any() for one in cells)
    with style.context(STYLE):
        single, down = len(cells) == 1, -(-len(cells) // _across(layout))
        number = 2 if known else 1
        width = 7.2 if known or not single else 4.2
        figure = Figure(
            figsize=(
                width,
                3.3 if single else 1.0 + number * down * HEIGHTS[_across(layout) - 1],
            )
        )
        blocks = figure.subfigures(
            *((1, number) if single else (number, 1)), squeeze=False
        )
        _block(
            blocks.flat[0], layout, cells, [one.mean for one in cells], name, "viridis"
        )
        if known:
            halves = [one.half for one in cells]
            _block(
                blocks.flat[1],
                layout,
                cells,
                halves,
                f"half the 95 % interval of\n{name}",
                "magma",
            )
        note(figure, _note(layout, table, cells))
    return figure


def _across(layout: Heatmap) -> int:
    return min(
        4 if len(layout.facets) in (4, 7, 8, 10, 11, 12) else 3, len(layout.facets)
    )


def _block(
    block: SubFigure,
    layout: Heatmap,
    cells: list[Cells],
    values: list[Floats],
    words: str,
    colours: str,
) -> None:
    """One panel a facet with a common scale of colours, which `words` names."""
    across = _across(layout)
    panels = block.subplots(
        -(-len(cells) // across), across, sharex=True, sharey=True, squeeze=False
    )
    scale = _scale(values)
    for axes, facet, one, value in zip(
        tidy_grid(panels, len(cells)), layout.facets, cells, values, strict=True
    ):
        _mesh(axes, one, value, scale, colours)
        label_setting(layout.selection, layout.x, axes)
        label_setting(layout.selection, layout.y, axes, "y")
        axes.set(xlabel="", ylabel="")
        title_panel(axes, facet.title.split(", "), across)
        if layout.averages and len(cells) <= MOST_COUNTED and colours == "magma":
            _count(axes, one, scale(value))
    block.supxlabel(quantity(layout.selection.study, layout.x), fontsize=9)
    block.supylabel(quantity(layout.selection.study, layout.y), fontsize=9)
    block.colorbar(
        ScalarMappable(scale, colours),
        ax=list(panels.ravel()),
        label=words,
        shrink=0.9,
        pad=0.02,
    )


def _scale(values: list[Floats]) -> Normalize:
    """The scale of colours of all panels.

    It is widened where all values are equal, but for rounding: then they have one
    colour, and the bar has numbers that can be read.
    """
    known = np.concatenate([value[np.isfinite(value)] for value in values])
    if not len(known):
        return Normalize(0.0, 1.0)
    low, high = float(known.min()), float(known.max())
    if equal(low, high):
        room = WIDENED * (abs(high) or 1.0)
        low, high = low - (room if low else 0.0), high + room
    return Normalize(low, high)


def _mesh(
    axes: Axes, cells: Cells, value: Floats, scale: Normalize, colours: str
) -> None:
    axes.grid(visible=False)
    shown = np.ma.masked_invalid(value)
    axes.pcolormesh(
        cells.x,
        cells.y,
        shown,
        cmap=colours,
        norm=scale,
        rasterized=True,
        linewidth=0,
    )


def _count(axes: Axes, cells: Cells, shade: Floats) -> None:
    """Write the number of points into each cell that has any.

    `shade` says how light a cell is, from 0, dark, to 1, so that the number can be
    read.
    """
    x, y = (
        _middles(edges, axis.get_scale() == "log")
        for edges, axis in ((cells.x, axes.xaxis), (cells.y, axes.yaxis))
    )
    for row, column in np.argwhere(cells.points > 0):
        colour = (
            "black"
            if shade[row, column] > LIGHT or np.isnan(shade[row, column])
            else "white"
        )
        number = str(cells.points[row, column])
        axes.text(
            x[column],
            y[row],
            number,
            color=colour,
            fontsize=5,
            ha="center",
            va="center",
        )


def _middles(edges: Floats, logarithmic: bool) -> Floats:
    return np.asarray(
        (
            np.sqrt(edges[1:] * edges[:-1])
            if logarithmic
            else (edges[1:] + edges[:-1]) / 2
        ),
        np.float64,
    )


def _cells(layout: Heatmap, table: pd.DataFrame) -> Cells:
    """The cells of the points of a panel. A cell of one point has the interval of that
    point, a cell of several points that of their mean.
    """
    metric = layout.metric
    known = table[table[metric].notna()]
    number = int(np.clip(np.sqrt(len(known) / POINTS_A_BIN), FEWEST_BINS, MOST_BINS))
    (x, columns), (y, rows) = (
        _divided(layout.selection, name, known, number) for name in (layout.x, layout.y)
    )
    shape = (len(y) - 1, len(x) - 1)
    mean, half, points = (
        np.full(shape, np.nan),
        np.full(shape, np.nan),
        np.zeros(shape, np.int64),
    )
    keys = rows * shape[1] + columns
    groups = known.groupby(keys)[metric]
    count = groups.size()
    places = np.asarray(count.index)
    points.ravel()[places], mean.ravel()[places] = count, groups.mean()
    if layout.averages:
        of = layout.selection.study.distributions[metric]
        low, high = group_bounds(groups, CONFIDENCE, of)
        half.ravel()[places] = (high - low) / 2.0
    else:
        half.ravel()[keys] = (known[f"{metric}_high"] - known[f"{metric}_low"]) / 2.0
    return Cells(x, y, mean, half, points, pd.Series(keys, known.index))


def _divided(
    selection: Selection, name: str, table: pd.DataFrame, number: int
) -> tuple[Floats, NDArray[np.int64]]:
    """The edges of the cells of a setting, about its values or in bins, and in which of
    them each point lies.
    """
    every = np.unique(places(selection, name, selection.points[name]))
    logarithmic = is_logarithmic(selection, name)
    edges = (
        bin_edges(every, number, logarithmic=logarithmic)
        if is_binned(selection, name)
        else cell_edges(every, logarithmic=logarithmic)
    )
    inside = np.digitize(places(selection, name, table[name]), edges) - 1
    return edges, np.clip(inside, 0, len(edges) - 2)


def _note(layout: Heatmap, table: pd.DataFrame, cells: list[Cells]) -> str:
    counts = np.concatenate(
        [one.points[one.points > 0] for one in cells] or [np.zeros(1, np.int64)]
    )
    trials = table[f"{layout.metric}_n"]
    if not layout.averages:
        text = "one point a cell, {n} trials a point"
        return layout.selection.about(
            text, trials, "mean with 95 % interval", [layout.metric]
        )
    others = ", ".join(name.replace("_", " ") for name in layout.mixed)
    text = (
        f"each cell the mean of {span(counts)}"
        f" points{f', which differ in {others} too' if others else ''};"
    )
    return layout.selection.about(
        f"{text}\n{{n}} trials a point, 95 % interval of the mean over points; white:"
        " no point",
        trials,
        shown=[layout.metric],
    )


def plan(study: StoredStudy, choices: Choices) -> list[Planned]:
    """One figure of each metric. Raises ChoiceError where the study has none."""
    names = choices.plain(study)
    layouts = [heatmap_layout(study, name, choices.x, choices.y) for name in names]
    return [
        Planned(name, partial(draw_heatmap, layout))
        for name, layout in zip(names, layouts, strict=True)
    ]


def marks(study: StoredStudy, choices: Choices) -> FigureMarks:
    """The figure of the first metric as marks, a cell each."""
    metric = choices.plain(study)[0]
    layout = heatmap_layout(study, metric, choices.x, choices.y)
    selection = layout.selection
    table = selection.table([metric])
    cells = [_cells(layout, table.loc[facet.points]) for facet in layout.facets]
    x, y = (_marked_axis(layout, name) for name in (layout.x, layout.y))
    panels = [
        MarkedPanel(
            facet.title,
            x,
            y,
            _marked(metric, one, table.loc[facet.points]),
            (one.x.tolist(), one.y.tolist()),
        )
        for facet, one in zip(layout.facets, cells, strict=True)
    ]
    note = _note(layout, table, cells)
    shown = (Column.read(metric).metric,)
    return FigureMarks("cells", shown, panels, note, quantity(selection.study, metric))


def _marked_axis(layout: Heatmap, name: str) -> MarkedAxis:
    """The axis of a setting: a bin stands at none of its values."""
    axis = axis_of(layout.selection, name)
    return axis._replace(listed=()) if name in layout.binned else axis


def _marked(metric: str, cells: Cells, table: pd.DataFrame) -> pd.DataFrame:
    """A row a cell that has a point."""
    rows, columns = np.nonzero(cells.points)
    keys = rows * cells.mean.shape[1] + columns
    ids = cells.places.index.to_series().groupby(cells.places)
    trials = table.loc[cells.places.index, f"{metric}_n"].groupby(cells.places)
    return pd.DataFrame(
        {
            "column": columns,
            "row": rows,
            "y": cells.mean[rows, columns],
            "half": cells.half[rows, columns],
            "n": trials.sum().reindex(keys).to_numpy(),
            "points": cells.points[rows, columns],
            "resolved": _resolved(cells)[rows, columns],
            "point": ids.agg(lambda of: " ".join(of[:MOST_IDS])).reindex(keys).array,
        }
    )


def _resolved(cells: Cells) -> NDArray[np.bool_]:
    """Whether the interval of a cell is narrower than the largest step to a cell beside
    it. Without an interval, or without such a cell, it counts as resolved.
    """
    padded = np.pad(cells.mean, 1, constant_values=np.nan)
    beside = [padded[1:-1, 2:], padded[1:-1, :-2], padded[2:, 1:-1], padded[:-2, 1:-1]]
    steps = np.abs(np.stack(beside) - cells.mean)
    largest = np.nanmax(np.where(np.isnan(steps), -np.inf, steps), axis=0)
    return np.asarray(~((2 * cells.half > largest) & np.isfinite(largest)), np.bool_)


KIND = FigureKind(
    "a metric over two settings", ("x", "y"), plan, of_several=True, marks=marks
)
