"""Pieces of figures: what they show, where, and that nothing to show is no error."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PatchCollection, PolyCollection
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from kernels.shapes import Polygon
from sweep.figures import (
    BLUE,
    draw_flock,
    draw_map,
    draw_values,
    draw_visits,
    legend,
    name_rows,
    note,
)
from sweep.trial.world import Paths, TrialWorld
from tests.studies import COVERING, launched

WORLD = TrialWorld(
    40.0, 30.0, np.array([[10.0, 20.0, 5.0, 5.0, 1.0], [30.0, 5.0, 4.0, 2.0, 0.0]])
)


@pytest.fixture
def axes() -> Axes:
    return Figure().subplots()


def test_a_map_has_its_size_its_unit_and_its_obstacles(axes: Axes) -> None:
    draw_map(axes, WORLD, "m")
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("x (m)", "y (m)")
    assert (axes.get_xlim(), axes.get_ylim()) == ((0.0, 40.0), (30.0, 0.0))
    assert axes.get_aspect() == 1.0
    (shapes,) = axes.collections
    assert isinstance(shapes, PatchCollection)
    corners = [
        path.get_extents().get_points().ravel().tolist() for path in shapes.get_paths()
    ]
    np.testing.assert_allclose(corners, [[5, 15, 15, 25], [26, 3, 34, 7]], atol=1e-9)


def test_a_map_can_have_y_upwards_and_no_obstacles(axes: Axes) -> None:
    draw_map(axes, WORLD._replace(obstacles=np.empty((0, 5))), "m", downwards=False)
    assert axes.get_ylim() == (0.0, 30.0)
    assert axes.collections[0].get_paths() == []


POLYGONS = {
    0: Polygon(((5.0, 5.0), (15.0, 5.0), (10.0, 12.0))),
    1: Polygon(((2.0, 2.0), (38.0, 2.0), (38.0, 20.0), (2.0, 28.0)), True),
}


def test_a_polygon_is_filled_inside_and_an_arena_outside(axes: Axes) -> None:
    """In whichever direction the vertices run: by the pixels of the picture."""
    for turned in (1, -1):
        shapes = {
            m: one._replace(vertices=one.vertices[::turned])
            for m, one in POLYGONS.items()
        }
        axes.clear()
        draw_map(axes, WORLD._replace(polygons=shapes), "m", face="red")
        figure = axes.figure
        canvas = FigureCanvasAgg(figure)
        canvas.draw()
        pixels = np.asarray(canvas.buffer_rgba())
        for place, solid in (
            *(((10, 7), True), ((5, 10), False), ((20, 15), False)),
            *(((1, 15), True), ((30, 28), True), ((39, 1), True)),
        ):
            across, up = axes.transData.transform(place)
            red = pixels[len(pixels) - round(up), round(across)].tolist()
            assert (red[:3] == [255, 0, 0]) == solid


def test_obstacles_that_move_are_drawn_where_they_are() -> None:
    paths = Paths(np.array([[1.0, 0.0], [0.0, -1.0]]), 0.5, False)
    world = WORLD._replace(polygons={1: POLYGONS[0]}, paths=paths).at(4)
    assert world.obstacles[:, :2].tolist() == [[12, 20], [30, 3]]
    assert world.polygons[1].vertices == ((5, 3), (15, 3), (10, 10))
    assert world.paths is None
    assert WORLD.at(4) is WORLD


def test_a_boid_is_a_triangle_that_points_where_it_flies(axes: Axes) -> None:
    draw_flock(
        axes, np.array([[10.0, 1.0], [20.0, 2.0], [0.0, 0.0], [-3.0, 0.0]]), length=3.0
    )
    (triangles,) = axes.collections
    assert isinstance(triangles, PolyCollection)
    flying, resting = (path.vertices[:3] for path in triangles.get_paths())
    np.testing.assert_allclose(flying, [[10, 18], [11, 21], [9, 21]], atol=1e-12)
    np.testing.assert_allclose(resting, [[3, 2], [0, 3], [0, 1]], atol=1e-12)


def test_no_boids_are_no_error(axes: Axes) -> None:
    draw_flock(axes, np.empty((4, 0)), length=3.0)
    assert axes.collections[0].get_paths() == []


def test_visits_lie_where_their_pixels_are_and_obstacles_are_outlined(
    axes: Axes, tmp_path: Path
) -> None:
    study = launched(COVERING, tmp_path)
    trial, visits = study.heatmaps.iloc[0]
    image = draw_visits(axes, visits, study.world(trial), most=3.0)
    assert image.get_extent() == [-0.5, 799.5, 599.5, -0.5]
    drawn = np.ma.asarray(image.get_array())
    assert drawn.mask.sum() == (visits < 1).sum()
    assert drawn.sum() == visits[visits > 0].sum() > 0
    outlines, insides = axes.collections
    assert len(outlines.get_paths()) == len(insides.get_paths()) == 18
    assert to_hex(outlines.get_edgecolor()[0]) == BLUE.lower()
    assert to_hex(insides.get_facecolor()[0]) == "#ffffff"


def test_values_have_their_intervals_and_an_unknown_one_is_left_out(axes: Axes) -> None:
    draw_values(
        axes, [0, 1], ([1.0, 2.0], [0.5, np.nan], [1.5, np.nan]), BLUE, label="ours"
    )
    (line,) = axes.lines
    np.testing.assert_array_equal(line.get_xydata(), [[1.0, 0.0], [2.0, 1.0]])
    known, unknown = (
        segment.tolist() for segment in axes.collections[0].get_segments()
    )
    assert known == [[0.5, 0.0], [1.5, 0.0]]
    assert unknown == []
    axes.figure.canvas.draw()


def test_no_values_are_no_error(axes: Axes) -> None:
    draw_values(axes, [], ([], [], []), BLUE)
    name_rows(axes, [])
    axes.figure.canvas.draw()


def test_rows_go_down_and_carry_their_names(axes: Axes) -> None:
    name_rows(axes, ["one", "other"])
    assert [label.get_text() for label in axes.get_yticklabels()] == ["one", "other"]
    low, high = axes.get_ylim()
    assert low > 1.0 > 0.0 > high


@pytest.mark.parametrize("width", [4.0, 7.2])
@pytest.mark.parametrize("letters", [3, 30, 140])
def test_a_legend_lies_within_its_figure(width: float, letters: int) -> None:
    """Whole names, in fewer columns or broken, and panels as high as without it."""
    figure = Figure(figsize=(width, 3.0), layout="constrained")
    axes = figure.subplots()
    names = [f"{'ab ' * (letters // 3)}{place}" for place in range(5)]
    for name in names:
        axes.plot([0.0, 1.0], label=name)
    legend(figure, axes, 5)
    FigureCanvasAgg(figure).draw()
    (made,) = figure.legends
    extent, size = made.get_window_extent(), figure.bbox
    assert extent.x0 >= 0.0
    assert extent.x1 <= size.width
    texts = [text.get_text().replace("\n", " ") for text in made.get_texts()]
    assert texts == names
    most = {3: 5, 30: 2, 140: 1}[letters]
    assert most - (width < 5.0) <= made._ncols or most == 1
    assert axes.get_window_extent().height > 0.6 * 3.0 * figure.dpi


def test_a_figure_has_a_legend_and_says_what_it_rests_on(axes: Axes) -> None:
    draw_values(axes, [0], ([1.0], [0.5], [1.5]), BLUE, label="ours")
    figure = axes.figure
    assert isinstance(figure, Figure)
    legend(figure, axes)
    note(figure, "40 trials, mean with 95 % interval")
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["ours"]
    assert figure.get_supxlabel() == "40 trials, mean with 95 % interval"
