"""A metric over two parameters: means and half-widths of the confidence intervals."""

from collections.abc import Callable, Iterable
from functools import partial
from itertools import chain

import numpy as np
import pandas as pd
from matplotlib import colormaps, style
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Colormap, ListedColormap, Normalize, SymLogNorm
from matplotlib.figure import Figure, SubFigure
from matplotlib.patches import Rectangle

from sweep.analysis import equal
from sweep.errors import ChoiceError
from sweep.figures.cells import Cells, Heatmap, binned, cell_table, layers_of, span_of
from sweep.figures.drawing import (
    note,
    quantity,
    span,
    tidy_grid,
    title_panel,
    y_label,
)
from sweep.figures.marks import FigureMarks, MarkedAxis, MarkedPanel, axis_of
from sweep.figures.planning import Choices, FigureKind, Planned
from sweep.figures.scales import (
    Floats,
    TickNumbers,
    axis_label,
    label_setting,
    linear_part,
    metric_label,
)
from sweep.figures.selection import Selection, has_scale, recorded, select
from sweep.figures.style import STYLE
from sweep.spec import Column, Over, column_over
from sweep.tables import Results

HATCH = "////"
UNRESOLVED = (
    "hatched: the confidence interval is wider than all steps to adjacent cells"
)
LIGHT = 0.6
HEIGHTS = (2.6, 2.6, 2.1, 1.75)
"""The height of a row of one to four panels, in inches."""
WIDENED = 0.1
"""The margin of the colour scale around equal values, as a fraction of the values."""
MOST_COUNTED = 2
"""The most panels in which each bin shows its number of points."""


def heatmap_figure(
    study: Results,
    metric: str,
    x: str | None = None,
    y: str | None = None,
    *,
    over: Over = "last",
) -> Figure:
    """Draw the mean of a metric over two parameters, and the half-width of the CI.

    In a grid each cell is a point, and the mean is over replicates. The points of a
    refined region have smaller cells. A parameter with more than 12 sampled values is
    divided into bins, and so are parameters with more than 30 listed values if there
    are more than 5,000 cells. The mean of a bin is over all points in the bin, also if
    the points differ in further sampled parameters. A bin without points is white.
    Further listed parameters become panels. Confidence intervals (CI) are at 95 %.

    Parameters
    ----------
    study : Results
    metric : str
        A recorded metric.
    x, y : str, optional
        Parameters of the axes; by default the first sampled parameters, then the listed
        numbers with the most values.
    over : {"last", "half"}, default "last"
        Use the last frame of each trial, or the mean over the second half.

    Returns
    -------
    Figure

    Raises
    ------
    ChoiceError
        If a name is unknown, fewer than two parameters vary, or there are more than
        twelve panels.

    Examples
    --------
    >>> spec = {"study": "my/grid", "model": "nguyen2024", "replicates": 3}
    >>> spec["fixed"] = {"n": 10, "steps": 20}
    >>> spec["sweep"] = {"alignment_weight": [0.1, 1], "separation_weight": [1, 2, 4]}
    >>> figure = heatmap_figure(sweep.run(spec), "polarization")
    >>> for colour_bar in figure.axes[1::2]:
    ...     print(colour_bar.get_ylabel())
    polarization
    half-width of the 95 % CI of
    polarization
    """
    return draw_heatmap(heatmap_layout(study, column_over(metric, over), x, y))


def heatmap_layout(
    study: Results,
    metric: str,
    x: str | None,
    y: str | None,
) -> Heatmap:
    """Return the layout of `heatmap_figure`, or raise ChoiceError.

    Parameters
    ----------
    study : Results
    metric : str
        Column of the trials.
    x, y : str or None
        Parameters as in `heatmap_figure`.
    """
    selection = select(study)
    recorded(study, metric)
    named = [selection.setting(name) for name in (x, y) if name]
    if x and x == y:
        raise ChoiceError(
            f"with x and y both {x}; allowed: two parameters", study.name, "heatmap"
        )
    listed = sorted(
        selection.apart(selection.sampled),
        key=lambda name: _preference(selection, name),
    )
    free = [*selection.sampled, *listed]
    chosen = [*named, *(name for name in free if name not in named)][:2]
    if len(chosen) < 2:
        raise ChoiceError(
            f"needs two varied parameters; the study has {len(chosen)}",
            study.name,
            "heatmap",
        )
    chosen = [selection.axis(name, "heatmap") for name in chosen]
    across, up = (chosen[0], chosen[1]) if x or not y else (chosen[1], chosen[0])
    panel_settings = selection.apart(
        list(dict.fromkeys([across, up, *selection.sampled]))
    )
    facets = selection.panels(panel_settings, "heatmap")
    bins = binned(selection, across, up)
    mixed = (
        [name for name in selection.sampled if name not in (across, up)] if bins else []
    )
    mixed = mixed or selection.mixed([across, up, *panel_settings])
    return Heatmap(
        selection, metric, across, up, facets=facets, binned=bins, mixed=mixed
    )


def _preference(selection: Selection, name: str) -> tuple[bool, int]:
    return not has_scale(selection.points[name]), -len(selection.values(name))


def draw_heatmap(layout: Heatmap) -> Figure:
    """Draw the figure of a layout."""
    selection = layout.selection
    metric = layout.metric
    table = selection.table([metric])
    panels = [layers_of(layout, table.loc[facet.points]) for facet in layout.facets]
    name = quantity(selection.study, metric)
    has_widths = any(np.isfinite(cells.half).any() for cells in chain(*panels))
    with style.context(STYLE):
        single = len(panels) == 1
        down = -(-len(panels) // _across(layout))
        number = 2 if has_widths else 1
        width = 7.2 if has_widths or not single else 4.2
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
            blocks.flat[0],
            layout,
            panels,
            _means,
            write=_hatch,
            label=name,
            colours="viridis",
        )
        if has_widths:
            counted = layout.averages and len(panels) <= MOST_COUNTED
            _block(
                blocks.flat[1],
                layout,
                panels,
                _halves,
                write=_count if counted else _nothing,
                label=f"half-width of the 95 % CI of\n{name}",
                colours="magma",
            )
        note(figure, _note(layout, table, panels))
    return figure


def _means(cells: Cells) -> Floats:
    return cells.mean


def _halves(cells: Cells) -> Floats:
    return cells.half


def _across(layout: Heatmap) -> int:
    return min(
        4 if len(layout.facets) in (4, 7, 8, 10, 11, 12) else 3, len(layout.facets)
    )


def _block(
    block: SubFigure,
    layout: Heatmap,
    panels: list[list[Cells]],
    values: Callable[[Cells], Floats],
    *,
    write: Callable[[Axes, Cells, Floats], None],
    label: str,
    colours: str,
) -> None:
    """Draw a panel per facet, with a common colour scale that has the label `label`.

    Finer layers of cells lie over coarser layers. `write` marks the cells of a layer,
    for which it gets their lightness from 0 (dark) to 1.
    """
    across = _across(layout)
    grid = block.subplots(
        -(-len(panels) // across), across, sharex=True, sharey=True, squeeze=False
    )
    finite = _finite(map(values, chain(*panels)))
    scale, linear = _scale(finite)
    constant = len(finite) > 0 and bool(equal(finite.min(), finite.max()))
    ramp: Colormap = colormaps[colours]
    shown = ListedColormap([ramp(0.5)]) if constant else ramp
    for axes, facet, layers in zip(
        tidy_grid(grid, len(panels)), layout.facets, panels, strict=True
    ):
        for cells in layers:
            _mesh(axes, cells, values(cells), scale, colours=shown)
        for cells in layers:
            write(axes, cells, scale(values(cells)))
        label_setting(layout.selection, layout.x, axes)
        label_setting(layout.selection, layout.y, axes, "y")
        axes.set(xlabel="", ylabel="")
        title_panel(axes, facet.title.split(", "), across)
    block.supxlabel(axis_label(layout.selection, layout.x), fontsize=9)
    block.supylabel(axis_label(layout.selection, layout.y), fontsize=9)
    block.colorbar(
        ScalarMappable(scale, shown),
        ax=list(grid.ravel()),
        label=y_label(metric_label(label, linear)) if linear else label,
        ticks=finite[:1] if constant else None,
        format=TickNumbers() if linear else None,
        shrink=0.9,
        pad=0.02,
    )


def _finite(values: Iterable[Floats]) -> Floats:
    """Return the finite values of all cells."""
    return np.concatenate([value[np.isfinite(value)] for value in values])


def _scale(finite: Floats) -> tuple[Normalize, float]:
    """Return the colour scale of finite values, and the end of its linear part.

    Values that are equal except for rounding have the colour in the middle.
    """
    if not len(finite):
        return Normalize(0.0, 1.0), 0.0
    low = float(finite.min())
    high = float(finite.max())
    if equal(low, high):
        room = WIDENED * (abs(high) or 1.0)
        return Normalize(low - room, high + room), 0.0
    if linear := linear_part(finite):
        return SymLogNorm(linear, vmin=low, vmax=high), linear
    return Normalize(low, high), 0.0


def _mesh(
    axes: Axes, cells: Cells, value: Floats, scale: Normalize, colours: Colormap
) -> None:
    axes.grid(visible=False)
    shown = np.ma.masked_invalid(np.where(cells.shown, value, np.nan))
    axes.pcolormesh(
        cells.x,
        cells.y,
        shown,
        cmap=colours,
        norm=scale,
        rasterized=True,
        linewidth=0,
    )


def _hatch(axes: Axes, cells: Cells, shade: Floats) -> None:
    """Hatch the cells that are not resolved.

    `shade` (rows, columns) is the lightness of cells, from 0 (dark) to 1.
    """
    for row, column in np.argwhere(~cells.resolved):
        left, right = cells.x[column : column + 2]
        low, high = cells.y[row : row + 2]
        cell = Rectangle(
            (left, low),
            right - left,
            high - low,
            fill=False,
            hatch=HATCH,
            linewidth=0,
            edgecolor="0.35" if shade[row, column] > LIGHT else "0.85",
        )
        axes.add_patch(cell)


def _nothing(_axes: Axes, _cells: Cells, _shade: Floats) -> None:
    """Leave cells as they are."""


def _count(axes: Axes, cells: Cells, shade: Floats) -> None:
    """Write the number of points into each cell with points.

    `shade` (rows, columns) is the lightness of cells, from 0 (dark) to 1. The lightness
    determines the colour of the number, so that the number is readable.
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


def _note(layout: Heatmap, table: pd.DataFrame, panels: list[list[Cells]]) -> str:
    layers = [*chain(*panels)]
    counts = np.concatenate(
        [cells.points[cells.points > 0] for cells in layers] or [np.zeros(1, np.int64)]
    )
    trials = table[f"{layout.metric}_n"]
    hatched = any((~cells.resolved).any() for cells in layers)
    hatches = f";\n{UNRESOLVED}" if hatched else ""
    if not layout.averages:
        text = "one point per cell, {n} trials per point"
        return layout.selection.note(
            text,
            trials,
            f"mean with 95 % confidence interval{hatches}",
            [layout.metric],
        )
    mixed = ", ".join(name.replace("_", " ") for name in layout.mixed)
    text = (
        f"each cell is the mean of {span(counts)}"
        f" points{f', which also differ in {mixed}' if mixed else ''};"
    )
    return layout.selection.note(
        f"{text}\n{{n}} trials per point, 95 % confidence interval of the mean over"
        f" points; white: no point{hatches}",
        trials,
        shown=[layout.metric],
    )


def plan(study: Results, choices: Choices) -> list[Planned]:
    """Plan one figure per metric. Raises ChoiceError if a heatmap does not suit."""
    metrics = choices.plain(study)
    layouts = [heatmap_layout(study, name, choices.x, choices.y) for name in metrics]
    return [
        Planned(name, partial(draw_heatmap, layout))
        for name, layout in zip(metrics, layouts, strict=True)
    ]


def marks(study: Results, choices: Choices) -> FigureMarks:
    """Return the figure of the first metric as marks, with a mark per cell."""
    metric = choices.plain(study)[0]
    layout = heatmap_layout(study, metric, choices.x, choices.y)
    selection = layout.selection
    table = selection.table([metric])
    layers = [layers_of(layout, table.loc[facet.points]) for facet in layout.facets]
    x, y = (_marked_axis(layout, name) for name in (layout.x, layout.y))
    span = span_of([*chain(*layers)])
    panels = [
        MarkedPanel(
            facet.title,
            x,
            y,
            cell_table(layout, cells, table.loc[facet.points]),
            span=span,
        )
        for facet, cells in zip(layout.facets, layers, strict=True)
    ]
    note = _note(layout, table, layers)
    shown = (Column.read(metric).metric,)
    linear = linear_part(_finite(map(_means, chain(*layers))))
    by = metric_label(quantity(selection.study, metric), linear)
    return FigureMarks("cells", shown, panels, note, by=by, linear=linear)


def _marked_axis(layout: Heatmap, name: str) -> MarkedAxis:
    """Return the axis of a parameter, without ticks at listed values if binned."""
    axis = axis_of(layout.selection, name)
    return axis._replace(listed=()) if name in layout.binned else axis


KIND = FigureKind(
    "a metric over two parameters", ("x", "y"), plan, of_several=True, marks=marks
)
