"""Phase diagrams of refined studies."""

from pathlib import Path

import pytest
from matplotlib.patches import Rectangle

from sweep.design.jobs import Job
from sweep.errors import ChoiceError
from sweep.figures import KINDS, Choices, phase_figure
from sweep.loaded import LoadedStudy
from tests.methods.test_refine import LINE, PLANE, beyond, edge_at, launched
from tests.searches import replace_trials


@pytest.fixture
def jobs(monkeypatch: pytest.MonkeyPatch) -> list[Job]:
    return replace_trials(monkeypatch, beyond)


@pytest.mark.usefixtures("jobs")
def test_a_line_has_means_and_a_band_for_its_crossing(tmp_path: Path) -> None:
    study = launched(LINE, tmp_path)
    found = study.boundary()
    figure = phase_figure(study)
    (axes,) = figure.axes
    x, y = axes.lines[0].get_data()
    table = found.points.sort_values("separation_weight")
    assert [*x] == [*table["separation_weight"]]
    assert [*y] == [*table["mean"]]
    assert axes.get_xlabel() == "separation weight"
    assert axes.get_ylabel() == "mean speed (px/step)"
    assert [label.get_text() for label in axes.get_xticklabels()] == ["0", "0.5", "1"]
    (band,) = [patch for patch in axes.patches if isinstance(patch, Rectangle)]
    assert found.crossings is not None
    (one,) = found.crossings.to_dict("records")
    assert band.get_x() == one["low"]
    assert band.get_x() + band.get_width() == pytest.approx(one["high"])
    said = figure.get_supxlabel().replace("\n", " ")
    most = study.plan["point"].to_pandas().value_counts().max()
    assert f"small: {len(table)} points of 3 to {most} trials" in said
    assert "on either side of 2 with 95 % confidence, simultaneously" in said


@pytest.mark.usefixtures("jobs")
def test_a_plane_has_a_rectangle_for_each_cell(tmp_path: Path) -> None:
    study = launched(PLANE.replace("budget: 300", "budget: 90"), tmp_path)
    found = study.boundary()
    figure = phase_figure(study)
    (axes,) = figure.axes
    cells = [patch for patch in axes.patches if isinstance(patch, Rectangle)]
    assert len(cells) == len(found.cells)
    corners = {(cell.get_x(), cell.get_y()) for cell in cells}
    ends = ["cohesion_weight_low", "separation_weight_low"]
    assert corners == {*found.cells[ends].itertuples(index=False, name=None)}
    hatched = sum(bool(cell.get_hatch()) for cell in cells)
    assert hatched == (found.cells["state"] == "unresolved").sum() > 0
    assert axes.get_xscale() == "log"
    x, y = found.points["cohesion_weight"], found.points["separation_weight"]
    assert axes.get_xlim() == (x.min(), x.max())
    assert axes.get_ylim() == (y.min(), y.max())
    (legend,) = figure.legends
    names = [text.get_text() for text in legend.get_texts()]
    assert names[0] == "mean speed (px/step) above 2"
    assert names[-1] == "unresolved"
    assert "cells unresolved: the budget is spent" in figure.get_supxlabel().replace(
        "\n", " "
    )


@pytest.mark.usefixtures("jobs")
def test_groups_are_panels(tmp_path: Path) -> None:
    spec = PLANE.replace("axes: [cohesion_weight, ", "axes: [")
    figure = phase_figure(launched(spec, tmp_path))
    shown = [axes for axes in figure.axes if axes.get_title()]
    titles = [f"cohesion weight = {value:g}" for value in (0.01, 0.1, 1.0)]
    assert [axes.get_title() for axes in shown] == titles
    for axes, weight in zip(shown, (0.01, 0.1, 1.0), strict=True):
        (band,) = axes.patches
        assert isinstance(band, Rectangle)
        edge = edge_at({"cohesion_weight": weight})
        assert band.get_x() <= edge <= band.get_x() + band.get_width()


@pytest.mark.usefixtures("jobs")
def test_other_metrics_are_refused(tmp_path: Path) -> None:
    study = launched(LINE, tmp_path)
    kind = KINDS["phase"]
    assert not kind.suits(study, Choices())
    assert "shows speed" in kind.suits(study, Choices(("dispersion",)))


def test_more_than_two_axes_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    replace_trials(monkeypatch, beyond)
    spec = PLANE.replace("sweep:", "sweep:\n  alignment_weight: [0, 1]").replace(
        "axes: [", "axes: [alignment_weight, "
    )
    study: LoadedStudy = launched(spec, tmp_path)
    with pytest.raises(ChoiceError, match="has 3 refined axes; allowed: up to 2"):
        phase_figure(study)
