"""Figures: what they say, and that a repeat gives the same bytes."""

from pathlib import Path

import pytest
from matplotlib.figure import Figure
from studies import SMALL, launched

from sweep.figures import metric_curves, save
from sweep.study import StoredStudy


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> StoredStudy:
    spec = SMALL.replace("[speed]", "[speed, flock_radius, dispersion]")
    return launched(spec, tmp_path_factory.mktemp("figures"))


@pytest.fixture
def figure(study: StoredStudy) -> Figure:
    return metric_curves(study, "separation_weight")


def test_every_axis_has_its_quantity_and_unit(figure: Figure) -> None:
    labels = [(axes.get_xlabel(), axes.get_ylabel()) for axes in figure.axes[:3]]
    assert labels == [
        ("frame (steps)", "speed (px/step)"),
        ("frame (steps)", "flock radius (px)"),
        ("frame (steps)", "dispersion (px)"),
    ]


def test_the_legend_names_the_swept_values(figure: Figure) -> None:
    (legend,) = figure.legends
    assert legend.get_title().get_text() == "separation weight"
    assert [text.get_text() for text in legend.get_texts()] == ["0.5", "1"]


def test_the_interval_and_the_number_of_trials_are_named(figure: Figure) -> None:
    texts = [text.get_text() for text in figure.texts]
    assert "small: 3 trials a curve, mean with pointwise 95 % interval" in [*texts, figure.get_supxlabel()]


def test_a_repeat_gives_the_same_bytes(study: StoredStudy, tmp_path: Path) -> None:
    first = [path.read_bytes() for path in save(metric_curves(study, "separation_weight"), tmp_path / "a")]
    again = [path.read_bytes() for path in save(metric_curves(study, "separation_weight"), tmp_path / "b")]
    assert first == again
