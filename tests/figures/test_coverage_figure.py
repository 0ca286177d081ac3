"""Figures of visits: the mean of the trials of a point, with coverage and CV."""

from copy import copy
from pathlib import Path

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from sweep.analysis import mean_interval
from sweep.analysis.sequential import Width
from sweep.errors import ChoiceError
from sweep.figures import coverage_figure
from sweep.figures.drawing import draw_visits, estimated
from sweep.methods.adaptive.rule import Until
from sweep.trial.world import TrialWorld
from tests.plotted import shown, study, titles
from tests.studies import SMALL, launched


def test_each_panel_is_the_mean_of_the_trials_of_a_point() -> None:
    figure = coverage_figure(study("covering"))
    trials, heatmaps = (
        study("covering").trials,
        study("covering").heatmaps.set_index("trial_id")["visits"],
    )
    first = trials[trials["cohesion_weight"] == 0.1]
    wanted = np.mean(
        [np.maximum(heatmaps[trial], 0) for trial in first["trial_id"]], axis=0
    )
    panel = figure.axes[0]
    np.testing.assert_allclose(np.ma.filled(panel.images[0].get_array(), 0.0), wanted)
    assert (panel.get_xlabel(), panel.get_ylabel()) == ("x (px)", "y (px)")
    value, low, high, _ = mean_interval(first["coverage"])
    assert titles(figure)[0].startswith(
        f"cohesion weight = 0.1 coverage {estimated(value, low, high)} % CV "
    )


def test_panels_share_a_scale_and_the_note_says_of_how_many_trials() -> None:
    figure = coverage_figure(study("covering"))
    first, second, bar = figure.axes
    assert first.images[0].get_clim() == second.images[0].get_clim()
    assert bar.get_ylabel() == "mean visits per pixel"
    assert len(first.collections[0].get_paths()) == 18
    assert (
        shown(figure)
        == "covering: mean of 2 trials per panel, coverage and CV with 95 % confidence"
        " interval; white: never visited; blue: obstacles"
    )


def test_obstacles_that_touch_have_one_outline() -> None:
    """Such as the rows of pixels of an image: what they surround is drawn over the
    outlines within.
    """
    rows = np.array([[50.0, 30.0 + 2.0 * k, 30.0, 1.0, 0.0] for k in range(20)])
    world = TrialWorld(100.0, 100.0, rows)
    figure = Figure(figsize=(2, 2), dpi=100)
    canvas = FigureCanvasAgg(figure)
    axes = figure.add_axes((0, 0, 1, 1))
    draw_visits(axes, np.zeros((100, 100)), world, most=1.0)
    canvas.draw()
    picture = np.asarray(canvas.buffer_rgba())[:, :, :3]
    inside = picture[65:130, 60:140]
    assert (inside == 255).all()
    assert (picture[60:136, 36:44].min(axis=(1, 2)) < 200).all()


def test_where_none_are_stored_the_error_says_what_keeps_them() -> None:
    with pytest.raises(
        ChoiceError,
        match=(
            r"study small: has no heatmaps; record: \{heatmaps: true\} stores heatmaps"
        ),
    ):
        coverage_figure(study("small"))


def test_obstacles_that_differ_between_trials_are_not_outlined_and_count_for_no_visit(
    tmp_path: Path,
) -> None:
    spec = SMALL.replace(
        "series: [speed], every: 2", "metrics: [coverage], heatmaps: true"
    )
    varying = launched(
        spec.replace("n: 12,", "n: 12, n_obstacles: 3, obstacle_radius: 60,"), tmp_path
    )
    figure = coverage_figure(varying.where(separation_weight=1))
    visits = np.stack(
        varying.heatmaps["visits"][varying.trials["separation_weight"] == 1].tolist()
    )
    wanted = np.ma.masked_less(visits, 0).mean(axis=0).filled(0.0)
    np.testing.assert_allclose(
        np.ma.filled(figure.axes[0].images[0].get_array(), 0.0), wanted
    )
    assert figure.axes[0].collections[0].get_paths() == []
    assert shown(figure).endswith(
        "white: never visited; obstacles differ between trials"
    )


def test_a_point_none_of_whose_trials_is_done_has_an_empty_panel() -> None:
    part = copy(study("covering"))
    lost = part.trials["cohesion_weight"] == 0.2
    part.trials = part.trials.assign(status=part.trials["status"].mask(lost, "timeout"))
    figure = coverage_figure(part)
    assert [len(axes.images) for axes in figure.axes[:2]] == [1, 0]
    assert [text.get_text() for text in figure.axes[1].texts] == ["no trial done"]
    assert titles(figure)[1] == "cohesion weight = 0.2"
    assert "mean of 0 to 2 trials per panel" in shown(figure)
    assert "2 of 4 trials not done" in shown(figure)


def test_coverage_that_chose_the_number_of_trials_has_its_repeated_interval() -> None:
    part = copy(study("covering"))
    part.provenance = part.provenance | {
        "until": Until({"coverage": Width(1.0)}, 0.9, 2, 4).as_json()
        | {"nominal_confidence": 0.97}
    }
    figure = coverage_figure(part)
    values = part.trials["coverage"][part.trials["cohesion_weight"] == 0.1]
    value, low, high, _ = mean_interval(values, 0.97)
    assert f"coverage {estimated(value, low, high)} % CV" in titles(figure)[0]
    assert "; coverage decided the number of trials: repeated 90 %" in shown(figure)
