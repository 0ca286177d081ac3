"""Figures: what they say, and that a repeat gives the same bytes."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from studies import SMALL, launched

from sweep.figures import metric_curves, save, saved_about
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


def test_files_say_what_they_show(figure: Figure, tmp_path: Path) -> None:
    about = {"Study": "small", "Trials": "6"}
    png, pdf = save(figure, tmp_path / "speed.v2", about)
    assert (png.name, pdf.name) == ("speed.v2.png", "speed.v2.pdf")
    assert saved_about(tmp_path / "speed.v2").items() >= about.items()
    assert b"Study: small" in pdf.read_bytes()
    assert b"Trials: 6" in pdf.read_bytes()
    assert len(list(tmp_path.iterdir())) == 2


@pytest.mark.parametrize("harm", ["no png", "no pdf", "torn png"])
def test_files_that_are_not_whole_say_nothing(figure: Figure, tmp_path: Path, harm: str) -> None:
    png, pdf = save(figure, tmp_path / "speed", {"Study": "small"})
    if harm == "torn png":
        png.write_bytes(b"torn")
    else:
        (png if harm == "no png" else pdf).unlink()
    assert saved_about(tmp_path / "speed") == {}


def test_a_watermark_is_large_pale_and_changes_no_layout(figure: Figure, tmp_path: Path) -> None:
    figure.draw_without_rendering()
    before = [axes.get_position().bounds for axes in figure.axes]
    save(figure, tmp_path / "speed", watermark="QUICK: FEW TRIALS")
    (mark,) = (text for text in figure.texts if text.get_text() == "QUICK: FEW TRIALS")
    after = [axes.get_position().bounds for axes in figure.axes]
    assert np.allclose(after, before)
    width, height = mark.get_window_extent().size / figure.bbox.size
    assert 0.6 < width < 1
    assert 0.4 < height <= 1
    assert mark.get_alpha() == 0.2
