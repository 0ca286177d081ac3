"""The cells of a heatmap: their edges, means and intervals.

Cells are points if the design is a grid, else bins. Points of a refined region have
smaller cells than the points of the first grid. So cells come in layers: each layer is
drawn over the coarser layers before.
"""

from collections.abc import Collection
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sweep.analysis import CONFIDENCE, group_bounds
from sweep.figures.marks import MOST_IDS, MOST_MARKS
from sweep.figures.scales import (
    Floats,
    bin_edges,
    cell_edges,
    is_logarithmic,
    places,
)
from sweep.figures.selection import Facet, Selection, has_scale

MOST_DRAWN = 12
"""The most values of a sampled parameter that are not divided into bins."""
MOST_LISTED = 30
"""The most values of a listed parameter that are never divided into bins."""
FEWEST_BINS = 3
MOST_BINS = 12
POINTS_A_BIN = 10


class Heatmap(NamedTuple):
    """The contents of a heatmap: a metric over two parameters, a panel per facet.

    `binned` lists which of `x` and `y` are divided into bins. `mixed` lists further
    parameters that differ between the points of a cell.
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
        """True if a cell may hold several points."""
        return bool(self.binned or self.mixed)


class Cells(NamedTuple):
    """The cells of a layer of a panel, from which a heatmap is drawn.

    `x` (columns + 1,) and `y` (rows + 1,) are edges. `mean`, `half` and `points` (rows,
    columns) are the mean, the half-width of the confidence interval, and the number of
    points. `shown` (rows, columns) is true for cells of this layer; the other cells
    belong to coarser layers. `resolved` (rows, columns) is false for a cell of this
    layer whose interval is wider than each step to a neighbour. `ids` maps the id of
    each point to the number of the cell, row after row.
    """

    x: Floats
    y: Floats
    mean: Floats
    half: Floats
    points: NDArray[np.int64]
    shown: NDArray[np.bool_]
    resolved: NDArray[np.bool_]
    ids: "pd.Series[int]"

    @property
    def steps(self) -> Floats:
        """The steps of the mean to the four neighbours (4, rows, columns)."""
        padded = np.pad(self.mean, 1, constant_values=np.nan)
        neighbours = [
            padded[1:-1, 2:],
            padded[1:-1, :-2],
            padded[2:, 1:-1],
            padded[:-2, 1:-1],
        ]
        return np.asarray(np.abs(np.stack(neighbours) - self.mean), np.float64)


def binned(selection: Selection, x: str, y: str) -> list[str]:
    """Return which of two parameters are divided into bins.

    Listed values are divided only if there are too many cells for a figure.

    Parameters
    ----------
    selection : Selection
    x, y : str
        Names of the parameters.
    """
    numbers = {name: len(selection.values(name)) for name in (x, y)}
    sampled = {name for name in numbers if name in selection.sampled}
    cells = [
        min(number, MOST_BINS) if name in sampled else number
        for name, number in numbers.items()
    ]
    crowded = cells[0] * cells[1] > MOST_MARKS
    return [
        name
        for name, number in numbers.items()
        if has_scale(selection.points[name])
        and (
            number > MOST_DRAWN if name in sampled else crowded and number > MOST_LISTED
        )
    ]


def layers_of(layout: Heatmap, table: pd.DataFrame) -> list[Cells]:
    """Return the cells of the points of a panel, coarser layers first.

    Parameters
    ----------
    layout : Heatmap
    table : DataFrame
        The rows of the panel in the table of `Selection.table`.
    """
    measured = table[table[layout.metric].notna()]
    if layout.averages:
        return _with_resolved([_means_of_points(layout, measured)])
    points = layout.selection.points
    levels = _levels(layout.selection, layout.x, layout.y)
    level_of = pd.concat(
        [points[name].map(levels[name]).fillna(0) for name in levels], axis=1
    ).max(axis=1)
    levels_shown = sorted(set(level_of))
    return _with_resolved(
        [_layer(layout, measured, level_of, level) for level in levels_shown]
    )


def _with_resolved(layers: list[Cells]) -> list[Cells]:
    """Return layers that know which of their cells are resolved.

    The neighbour of a cell in a direction is the neighbour in the finest layer that has
    one: that is the cell beside it in the figure. A cell without an interval or a
    neighbour counts as resolved.
    """
    steps = pd.DataFrame(columns=range(4), dtype=np.float64)
    for cells in reversed(layers):
        own = cells.steps.reshape(4, -1)[:, cells.ids.to_numpy()].T
        steps = steps.combine_first(pd.DataFrame(own, cells.ids.index, range(4)))
    return [_resolving(cells, steps.max(axis=1)) for cells in layers]


def _resolving(cells: Cells, largest: "pd.Series[float]") -> Cells:
    """Return cells that know whether they are resolved, by the largest steps."""
    step = np.full(cells.mean.shape, np.nan)
    step.ravel()[cells.ids.to_numpy()] = largest[cells.ids.index]
    wide = cells.shown & (2 * cells.half > step)
    return cells._replace(resolved=np.asarray(~wide, np.bool_))


def span_of(layers: list[Cells]) -> tuple[float, float, float, float]:
    """Return the left, right, lower and upper end of all cells.

    Parameters
    ----------
    layers : list of Cells
    """
    x = np.concatenate([cells.x for cells in layers])
    y = np.concatenate([cells.y for cells in layers])
    return float(x.min()), float(x.max()), float(y.min()), float(y.max())


def cell_table(
    layout: Heatmap, layers: list[Cells], table: pd.DataFrame
) -> pd.DataFrame:
    """Return a table with a row per cell that is shown.

    Parameters
    ----------
    layout : Heatmap
    layers : list of Cells
        The result of `layers_of`.
    table : DataFrame
        The rows of the panel in the table of `Selection.table`.

    Returns
    -------
    DataFrame
        The columns are:

        - left, right, bottom and top: the edges
        - across and up: the position of the point, NaN on an axis with bins
        - y and half: the mean, and the half-width of the confidence interval
        - n and points: the numbers of trials and of points
        - resolved: false if the interval is wider than each step to an adjacent cell
        - point: the ids of the points
    """
    return pd.concat(
        [_rows(layout, cells, table) for cells in layers], ignore_index=True
    )


def cell_boxes(selection: Selection, metric: str, x: str, y: str) -> pd.DataFrame:
    """Return the table of `cell_table` for points, without bins and panels.

    Parameters
    ----------
    selection : Selection
        Points that differ in the two parameters only.
    metric : str
        Column of the trials.
    x, y : str
        Names of the parameters.
    """
    layout = Heatmap(selection, metric, x, y, facets=[], binned=[], mixed=[])
    table = selection.table([metric])
    return cell_table(layout, layers_of(layout, table), table)


def _rows(layout: Heatmap, cells: Cells, table: pd.DataFrame) -> pd.DataFrame:
    rows, columns = np.nonzero((cells.points > 0) & cells.shown)
    keys = rows * cells.mean.shape[1] + columns
    ids = cells.ids.index.to_series().groupby(cells.ids)
    trials = table.loc[cells.ids.index, f"{layout.metric}_n"].groupby(cells.ids)
    first = ids.first().reindex(keys)
    across, up = (_positions(layout, name, first) for name in (layout.x, layout.y))
    return pd.DataFrame(
        {
            "left": cells.x[columns],
            "right": cells.x[columns + 1],
            "bottom": cells.y[rows],
            "top": cells.y[rows + 1],
            "across": across,
            "up": up,
            "y": cells.mean[rows, columns],
            "half": cells.half[rows, columns],
            "n": trials.sum().reindex(keys).to_numpy(),
            "points": cells.points[rows, columns],
            "resolved": cells.resolved[rows, columns],
            "point": ids.agg(lambda cell: " ".join(cell[:MOST_IDS]))
            .reindex(keys)
            .array,
        }
    )


def _positions(layout: Heatmap, name: str, points: "pd.Series[str]") -> Floats:
    """Return the positions of points on the axis of a parameter; NaN for bins."""
    if name in layout.binned:
        return np.full(len(points), np.nan)
    selection = layout.selection
    return places(selection, name, selection.points[name].loc[[*points]])


def _means_of_points(layout: Heatmap, measured: pd.DataFrame) -> Cells:
    """Return cells with several points; the interval is for the mean over points."""
    metric = layout.metric
    selection = layout.selection
    number = int(np.clip(np.sqrt(len(measured) / POINTS_A_BIN), FEWEST_BINS, MOST_BINS))
    (x, columns), (y, rows) = (
        _divided(
            selection,
            measured[name],
            among=selection.points[name],
            number=number if name in layout.binned else None,
        )
        for name in (layout.x, layout.y)
    )
    keys = rows * (len(x) - 1) + columns
    groups = measured.groupby(keys)[metric]
    distribution = selection.study.distributions[metric]
    low, high = group_bounds(groups, CONFIDENCE, distribution)
    count = groups.size()
    filled = np.asarray(count.index)
    cells = _empty(x, y, pd.Series(keys, measured.index))
    cells.points.ravel()[filled] = count
    cells.mean.ravel()[filled] = groups.mean()
    cells.half.ravel()[filled] = (high - low) / 2.0
    return cells


def _layer(
    layout: Heatmap, measured: pd.DataFrame, level_of: "pd.Series[float]", level: float
) -> Cells:
    """Return the grid of all points up to a level, with the cells of the level shown.

    The cell of a point has the confidence interval of the point.
    """
    metric = layout.metric
    selection = layout.selection
    within = selection.points[level_of <= level]
    own = measured[level_of[measured.index] <= level]
    (x, columns), (y, rows) = (
        _divided(selection, own[name], among=within[name])
        for name in (layout.x, layout.y)
    )
    keys = rows * (len(x) - 1) + columns
    cells = _empty(x, y, pd.Series(keys, own.index))
    cells.points.ravel()[keys] = 1
    cells.mean.ravel()[keys] = own[metric]
    cells.half.ravel()[keys] = (own[f"{metric}_high"] - own[f"{metric}_low"]) / 2.0
    cells.shown.ravel()[keys] = level_of[own.index] == level
    return cells


def _empty(x: Floats, y: Floats, ids: "pd.Series[int]") -> Cells:
    """Return cells with these edges and no point."""
    shape = (len(y) - 1, len(x) - 1)
    mean = np.full(shape, np.nan)
    half = np.full(shape, np.nan)
    points = np.zeros(shape, np.int64)
    every = np.ones(shape, np.bool_)
    return Cells(
        x, y, mean, half, points=points, shown=every, resolved=every.copy(), ids=ids
    )


def _divided(
    selection: Selection,
    column: "pd.Series[float]",
    among: "pd.Series[float]",
    number: int | None = None,
) -> tuple[Floats, NDArray[np.int64]]:
    """Return the edges of the cells of a parameter, and the cell of each point.

    Parameters
    ----------
    selection : Selection
    column : Series
        Values of the parameter at the points, with the name of the parameter.
    among : Series
        Edges are around these values of the parameter.
    number : int, optional
        Edges divide the range of values into this number of bins.
    """
    name = str(column.name)
    every = np.unique(places(selection, name, among))
    logarithmic = is_logarithmic(selection, name)
    edges = (
        cell_edges(every, logarithmic=logarithmic)
        if number is None
        else bin_edges(every, number, logarithmic=logarithmic)
    )
    inside = np.digitize(places(selection, name, column), edges) - 1
    return edges, np.clip(inside, 0, len(edges) - 2)


def _levels(selection: Selection, x: str, y: str) -> dict[str, dict[float, int]]:
    """Return the level of each value of two parameters; 0 for the first grid.

    The first grid has the values that occur at both ends of the other parameter. Values
    between two values of the first grid have level 1 in the middle, level 2 in the
    middle of the halves, and so on. If the first grid lacks a point, all levels are 0.
    """
    flat: dict[str, dict[float, int]] = {x: {}, y: {}}
    if not all(has_scale(selection.points[name]) for name in (x, y)):
        return flat
    designed = selection.designed[[x, y]].dropna().drop_duplicates()
    first = {
        name: _at_both_ends(designed, name, other) for name, other in ((x, y), (y, x))
    }
    size = int((designed[x].isin(first[x]) & designed[y].isin(first[y])).sum())
    lacks = size < len(first[x]) * len(first[y])
    if lacks or min(len(values) for values in first.values()) < 2:
        return flat
    return {
        name: _halving(
            np.unique(np.asarray(designed[name], np.float64)),
            first[name],
            logarithmic=is_logarithmic(selection, name),
        )
        for name in (x, y)
    }


def _at_both_ends(designed: pd.DataFrame, name: str, other: str) -> set[float]:
    """Return the values of a parameter at the least and largest value of another."""
    ends = (designed[other].min(), designed[other].max())
    low, high = (set(designed.loc[designed[other] == end, name]) for end in ends)
    return low & high


def _halving(
    values: Floats, first: Collection[float], *, logarithmic: bool
) -> dict[float, int]:
    """Return the levels of ascending values, of which `first` have level 0."""
    at = np.log(values) if logarithmic else values
    levels = dict.fromkeys(values.tolist(), 0)
    fixed = np.flatnonzero(np.isin(values, [*first])).tolist()
    bounds = [-1, *fixed, len(values)]
    waiting = [(low, high, 1) for low, high in pairwise(bounds)]
    while waiting:
        low, high, level = waiting.pop()
        if high - low < 2:
            continue
        inner = np.arange(low + 1, high)
        outer = low < 0 or high == len(values)
        middle = at[inner].mean() if outer else (at[low] + at[high]) / 2.0
        chosen = int(inner[np.argmin(np.abs(at[inner] - middle))])
        levels[float(values[chosen])] = level
        waiting += [(low, chosen, level + 1), (chosen, high, level + 1)]
    return levels
