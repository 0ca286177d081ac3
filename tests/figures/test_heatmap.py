"""Heatmaps: exact cells of a grid, bins of a sample with their counts, and half the
width of the intervals.
"""

import re
from collections.abc import Callable

import numpy as np
import pandas as pd
import pytest
from matplotlib.collections import QuadMesh
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from sweep.analysis import by_point, mean_interval
from sweep.errors import ChoiceError
from sweep.figures import heatmap_figure, scatter_figure
from sweep.figures.cells import cell_table, layers_of
from sweep.figures.heatmap import heatmap_layout
from sweep.figures.kinds import KINDS
from sweep.figures.marks import FigureMarks
from sweep.figures.planning import Choices
from sweep.figures.scales import _apart, cell_edges
from tests.plotted import ascending, made_up, shown, study, titles
from tests.sampled import axis


def values_of(figure: Figure) -> list[np.ndarray]:
    """The numbers in the cells of each panel, NaN where there is none: means first,
    then half widths.
    """
    meshes = [
        mesh
        for axes in figure.axes
        for mesh in axes.collections
        if axes.get_label() != "<colorbar>"
    ]
    return [
        np.ma.filled(np.ma.asarray(mesh.get_array(), np.float64), np.nan)
        for mesh in meshes
    ]


def test_cells_of_a_grid_are_those_of_the_table() -> None:
    figure = heatmap_figure(
        study("grid"), "speed", "alignment_weight", "separation_weight"
    )
    table = by_point(
        study("grid").trials,
        ["borders", "alignment_weight", "separation_weight"],
        ["speed"],
    )
    torus = table[table["borders"] == "torus"].assign(
        half=lambda rows: (rows["speed_high"] - rows["speed_low"]) / 2
    )
    means, _, halves, _ = values_of(figure)
    for found, column in ((means, "speed"), (halves, "half")):
        wanted = torus.pivot(
            index="separation_weight", columns="alignment_weight", values=column
        )
        np.testing.assert_array_equal(found, wanted.to_numpy())
    assert titles(figure) == ["borders = torus", "borders = bounded"] * 2
    assert (
        shown(figure)
        == "grid: one point per cell, 3 trials per point, mean with 95 % confidence"
        " interval; hatched: the confidence interval is wider than all steps to"
        " adjacent cells"
    )


def hatched(figure: Figure) -> set[tuple[float, float]]:
    """The middles of the hatched cells."""
    return {
        tuple(patch.get_center())
        for axes in figure.axes
        for patch in axes.patches
        if isinstance(patch, Rectangle) and patch.get_hatch()
    }


def _marks_of_explorer(name: str) -> FigureMarks:
    choices = Choices(("speed",), x="n", y="separation_weight")
    marks = KINDS["heatmap"].marks(study(name), choices)
    assert isinstance(marks, FigureMarks)
    return marks


def test_a_cell_is_hatched_where_its_neighbours_may_be_equal_to_it() -> None:
    """As in the explorer, which draws the same cells. In the table the interval of such
    a cell is wider than each step to a cell beside it.
    """
    figure = heatmap_figure(study("sized"), "speed", "n", "separation_weight")
    table = by_point(study("sized").trials, ["n", "separation_weight"], ["speed"])
    grid = table.set_index(["n", "separation_weight"])[["speed_high", "speed_low"]]
    mean = table.pivot(index="separation_weight", columns="n", values="speed")
    wide = (grid["speed_high"] - grid["speed_low"]).unstack(level="n")
    steps = np.full(mean.shape, 0.0)
    for row, column in np.ndindex(mean.shape):
        beside = [(row - 1, column), (row + 1, column)]
        beside += [(row, column - 1), (row, column + 1)]
        steps[row, column] = max(
            abs(mean.iat[place] - mean.iat[row, column])
            for place in beside
            if 0 <= place[0] < len(mean) and 0 <= place[1] < mean.shape[1]
        )
    wanted = np.argwhere(wide.to_numpy() > steps)
    (panel,) = _marks_of_explorer("sized").panels
    hidden = panel.marks[~panel.marks["resolved"]]
    assert 0 < len(wanted) < mean.size
    places = {(mean.index[row], mean.columns[column]) for row, column in wanted}
    assert {*zip(hidden["up"], hidden["across"], strict=True)} == places
    mesh = figure.axes[0].collections[0]
    assert isinstance(mesh, QuadMesh)
    corners = mesh.get_coordinates()
    middles = {
        tuple((corners[row, column] + corners[row + 1, column + 1]) / 2.0)
        for row, column in wanted
    }
    assert hatched(figure) == middles
    assert "hatched: the confidence interval is wider than" in shown(figure)


REFINED = """[
  {cohesion_weight: [1, 2, 3], separation_weight: [4, 6, 8]},
  {cohesion_weight: [2, 2.5, 3], separation_weight: [6, 7, 8]},
  {cohesion_weight: [2.75], separation_weight: [6, 7, 8]}]"""
"""A grid, whose upper right quarter is refined, and a column of it once more."""
AROUND = {1: (0.5, 1.5), 2: (1.5, 2.5), 3: (2.5, 3.5)}
"""Edges of cells of the first grid along x. Those of a finer column are halves."""


def test_cells_of_a_refined_region_lie_over_those_of_the_first_grid() -> None:
    """Each cell of the first grid keeps its size, so that no place is left white."""
    made = made_up(REFINED, ascending)
    marks = KINDS["heatmap"].marks(
        made, Choices(("speed",), x="cohesion_weight", y="separation_weight")
    )
    assert isinstance(marks, FigureMarks)
    cells = marks.panels[0].marks
    edges = {
        (row.across, row.up): (row.left, row.right, row.bottom, row.top)
        for row in cells.itertuples()
    }
    for x, (left, right) in AROUND.items():
        for y in (4, 6, 8):
            assert edges[x, y] == (left, right, y - 1, y + 1)
    assert edges[2.5, 7] == (2.25, 2.75, 6.5, 7.5)
    assert edges[2.75, 7] == (2.625, 2.875, 6.5, 7.5)
    last = cells[cells["across"].isin([2.5, 2.75]) | (cells["up"] == 7)]
    assert last.index.min() == 9  # the first grid is drawn first
    assert len(cells) == 9 + 5 + 3
    x, y = np.meshgrid(np.linspace(0.51, 3.49, 40), np.linspace(3.01, 8.99, 40))
    figure = heatmap_figure(made, "speed", "cohesion_weight", "separation_weight")
    assert np.all(sum(_has(mesh, x, y) for mesh in figure.axes[0].collections))


def _has(mesh: object, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Whether places lie in a cell that a mesh colours."""
    assert isinstance(mesh, QuadMesh)
    corners = mesh.get_coordinates()
    column = np.searchsorted(corners[0, :, 0], x) - 1
    row = np.searchsorted(corners[:, 0, 1], y) - 1
    array = np.ma.filled(np.ma.asarray(mesh.get_array(), np.float64), np.nan)
    rows, columns = array.shape
    within = (column >= 0) & (column < columns) & (row >= 0) & (row < rows)
    there = ~np.isnan(array[np.clip(row, 0, rows - 1), np.clip(column, 0, columns - 1)])
    return np.asarray(within & there, np.int64)


def test_a_cell_is_compared_with_the_finer_cells_beside_it() -> None:
    """The mean grows by 10 from column to column of the first grid, and by 5 to a finer
    one. An interval of 8 hides the steps about the middle, and no other.
    """
    designs = (
        "{cohesion_weight: [0, 1, 2], separation_weight: [0, 1, 2]}",
        "{cohesion_weight: [0.5, 1, 1.5], separation_weight: [0.5, 1, 1.5]}",
    )

    def mean(settings: pd.DataFrame) -> np.ndarray:
        return 10.0 * settings["cohesion_weight"].to_numpy()

    made = made_up(f"[{', '.join(designs)}]", mean)
    layout = heatmap_layout(made, "speed", "cohesion_weight", "separation_weight")
    table = layout.selection.table(["speed"])
    table = table.assign(speed_low=table["speed"] - 4, speed_high=table["speed"] + 4)
    cells = cell_table(layout, layers_of(layout, table), table)
    hidden = cells[~cells["resolved"]]
    fine = {(x, y) for x in (0.5, 1.0, 1.5) for y in (0.5, 1.0, 1.5)}
    beside = {(0.0, 1.0), (2.0, 1.0)}  # cells of the first grid, beside finer ones
    assert set(zip(hidden["across"], hidden["up"], strict=True)) == fine | beside


def test_a_grid_that_is_not_whole_has_one_layer() -> None:
    first = "{cohesion_weight: [1, 2], separation_weight: [4, 6]}"
    other = "{cohesion_weight: [3], separation_weight: [6, 8]}"
    made = made_up(f"[{first}, {other}]", ascending)
    figure = heatmap_figure(made, "speed", "cohesion_weight", "separation_weight")
    (mesh,) = figure.axes[0].collections
    assert isinstance(mesh, QuadMesh)
    assert np.ma.count_masked(np.ma.asarray(mesh.get_array())) == 9 - 6


def test_a_phase_diagram_of_a_hundred_values_has_a_cell_for_each() -> None:
    values = ", ".join(str(value) for value in range(101))
    made = made_up(f"n: [10, 20, 40], cohesion_weight: [{values}]", ascending)
    (means,) = values_of(heatmap_figure(made, "speed", "cohesion_weight", "n"))
    assert means.shape == (3, 101)
    assert not np.isnan(means).any()


def scales(figure: Figure) -> list[tuple[float, float]]:
    """What the colours of each panel reach from and to, and those of each bar: means
    first, then half widths.
    """
    return [
        (
            (float(mesh.norm.vmin), float(mesh.norm.vmax))
            if axes.get_label() != "<colorbar>"
            else axes.get_ylim()
        )
        for axes in figure.axes
        for mesh in axes.collections[:1]
    ]


@pytest.mark.parametrize("value", [0.0, 12.5, -3.0])
def test_a_metric_that_is_equal_everywhere_has_one_colour(value: float) -> None:
    """But for rounding, as 0.1 + 0.2 and 0.3 are. The bar has the same colour, and one
    number. Equal values have no interval, whose half width would be drawn beside.
    """
    grid = made_up(
        "n: [3, 4], cohesion_weight: [0, 1], borders: [torus, bounded]", ascending
    )
    rounding = np.arange(len(grid.trials)) % 2 * value * 2e-16
    grid.trials["speed"] = value + rounding
    figure = heatmap_figure(grid, "speed", "n", "cohesion_weight")
    found = scales(figure)
    assert len(found) == 3
    assert len(set(found)) == 1
    low, high = found[0]
    assert low <= value < high
    assert high - low == pytest.approx(0.2 * (abs(value) or 1.0))
    figure.draw_without_rendering()
    *panels, bar = figure.axes
    (number,) = bar.get_yticks()
    assert number == pytest.approx(value)
    colours = {
        tuple(mesh.to_rgba(number))
        for mesh in (*(axes.collections[0] for axes in panels), bar.collections[-1])
    }
    assert len(colours) == 1
    assert len(bar.collections[-1].get_cmap().colors) == 1


def test_names_of_ticks_do_not_run_into_each_other() -> None:
    """By where they stand, on a logarithmic axis too."""
    ticks = [0.5, 0.75, 1.0, 1.5, 2.0, 3.0]
    names = [f"{tick:g}" for tick in ticks]
    wanted = ["0.5", "", "1", "1.5", "2", "3"]
    assert _apart(ticks, names, logarithmic=False) == wanted
    assert _apart(ticks, names, logarithmic=True) == names
    assert _apart([7.0], ["7"], logarithmic=False) == ["7"]


def test_ticks_stand_at_the_values_that_were_swept() -> None:
    grid = made_up(
        "n: [90, 180, 270, 360], cohesion_weight: [0.0001, 0.001, 0.01, 0.1, 1]",
        ascending,
    )
    axes = heatmap_figure(grid, "speed", "n", "cohesion_weight").axes[0]
    assert axes.get_xticks().tolist() == [90, 180, 270, 360]
    assert axes.get_yscale() == "log"
    assert [text.get_text() for text in axes.get_yticklabels()] == [
        *("0.0001", "0.001", "0.01", "0.1", "1")
    ]
    assert axes.get_yticks(minor=True).tolist() == []
    values = list(range(10, 351, 20))
    many = made_up(f"n: {values}, cohesion_weight: [1, 2]", ascending)
    axes = heatmap_figure(many, "speed", "n", "cohesion_weight").axes[0]
    assert axes.get_xticks().tolist() == [10, 90, 170, 250, 330]


def test_axes_and_colour_bars_are_labelled() -> None:
    figure = heatmap_figure(
        study("grid").where(borders="torus"),
        "speed",
        "alignment_weight",
        "separation_weight",
    )
    left, right = figure.subfigs
    assert (left.get_supxlabel(), left.get_supylabel()) == (
        "alignment weight, log scale",
        "separation weight",
    )
    bars = [
        axes.get_ylabel() for axes in figure.axes if axes.get_label() == "<colorbar>"
    ]
    assert bars == ["speed (px/step)", "half-width of the 95 % CI of\nspeed (px/step)"]
    assert figure.axes[0].get_xscale() == "log"
    assert right.axes[0].get_yscale() == "linear"


def test_bins_are_means_over_their_points_and_empty_ones_are_white() -> None:
    made = made_up(axis("random", 90))
    figure = heatmap_figure(made, "speed")
    means, halves = values_of(figure)
    assert means.shape == (3, 3)
    points = made.trials.groupby("point").first()
    inside = points[
        (points["separation_weight"] < 1 / 3) & (points["alignment_weight"] > 2 / 3)
    ]
    value, _, high, n = mean_interval(inside["speed"])
    # The bins reach from the smallest to the largest value, so that a point at an edge
    # may be in the next.
    assert abs(means[2, 0] - value) < 0.5
    assert abs(halves[2, 0] - (high - value)) < 0.5
    counts = [int(text.get_text()) for axes in figure.axes for text in axes.texts]
    assert sum(counts) == 90
    assert abs(counts[-3] - n) <= 2
    assert "each cell is the mean of" in shown(figure)
    assert "which also differ in cohesion weight" in shown(figure)


def test_a_bin_without_points_has_no_colour() -> None:
    sparse = made_up(axis("random", 14), ascending)
    table = heatmap_figure(sparse, "speed")
    means, _ = values_of(table)
    assert np.isnan(means).any()
    assert "white: no point" in shown(table)


def test_points_without_a_value_leave_their_cell_empty() -> None:
    grid = made_up("n: [3, 4], cohesion_weight: [0, 1]", ascending)
    grid.trials.loc[
        grid.trials["point"] == grid.trials["point"][0], ["status", "speed"]
    ] = "failed", np.nan
    grid.trials["speed"] += 0.01 * np.arange(len(grid.trials))
    means, halves = values_of(heatmap_figure(grid, "speed", "n", "cohesion_weight"))
    assert np.isnan(means).sum() == np.isnan(halves).sum() == 1


@pytest.mark.parametrize(
    ("name", "choices", "message"),
    [
        ("small", {}, "heatmap needs two varied parameters; the study has 1"),
        (
            "grid",
            {"x": "borders", "y": "borders"},
            "heatmap with x and y both borders; allowed: two parameters",
        ),
        (
            "grid",
            {"y": "border"},
            'unknown varied parameter "border"; did you mean "borders"?',
        ),
    ],
)
def test_wrong_choices_say_what_is_allowed(
    name: str, choices: dict, message: str
) -> None:
    with pytest.raises(ChoiceError) as error:
        heatmap_figure(study(name), "speed", **choices)
    assert message in str(error.value)


@pytest.mark.parametrize(
    ("logarithmic", "values_", "edges"),
    [
        (False, [1.0, 2.0, 4.0], [0.5, 1.5, 3.0, 5.0]),
        (True, [1.0, 4.0], [0.5, 2.0, 8.0]),
        (False, [3.0], [2.0, 4.0]),
    ],
)
def test_edges_lie_half_way_between_values(
    logarithmic: bool, values_: list, edges: list
) -> None:
    np.testing.assert_allclose(
        cell_edges(np.array(values_), logarithmic=logarithmic), edges
    )


ENDLESS = "obstacle_range: [10, 1.0e308, .inf], drag: [0, 0.5]"
"""Numbers that no axis can place."""


def test_numbers_too_far_out_for_an_axis_are_named() -> None:
    figure = heatmap_figure(made_up(ENDLESS, ascending), "speed", "obstacle_range")
    figure.draw_without_rendering()
    (means,) = values_of(figure)
    np.testing.assert_array_equal(means, [[0, 2, 4], [1, 3, 5]])
    names = [label.get_text() for label in figure.axes[0].get_xticklabels()]
    assert names == ["10", "1e+308", "unlimited"]


@pytest.mark.parametrize("draw", [heatmap_figure, scatter_figure])
def test_too_many_of_them_are_an_error_that_says_what_to_choose(
    draw: Callable[..., Figure],
) -> None:
    many = "obstacle_range: {logspace: [1, 1.0e151, 31]}, drag: [0, 0.5]"
    sentence = (
        "cannot place the 31 values of obstacle_range, some of which are beyond 1e+150;"
        " choose with where, for example obstacle_range=1"
    )
    with pytest.raises(ChoiceError, match=re.escape(sentence)):
        draw(made_up(many, ascending), "speed", x="obstacle_range")
    draw(made_up(many.replace("151", "150"), ascending), "speed", x="obstacle_range")
