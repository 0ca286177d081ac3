"""Figures and tables of studies of which only a share of the trials is stored."""

from collections.abc import Callable
from pathlib import Path

import pytest
from matplotlib.figure import Figure

from sweep.campaigns.launching import launch
from sweep.cli.reporting import print_report
from sweep.design.design import expand
from sweep.design.jobs import Jobs
from sweep.errors import ChoiceError
from sweep.figures import heatmap_figure, parallel_figure, pareto_figure
from sweep.figures.scatter import scatter_figure
from sweep.figures.selection import select
from sweep.store.shares import Share
from sweep.tables.joined import JoinedStudies
from sweep.tables.means import point_means
from sweep.tables.means_text import means_report
from sweep.tables.stored_study import StoredStudy
from sweep.workers.executors import Serial
from tests.plotted import DRAWN, GRID, shown
from tests.studies import SMALL, read

OTHER = GRID.replace("study: grid", "study: other")
OF_ONE: dict[str, Callable[[StoredStudy], Figure]] = {
    "scatter": lambda study: scatter_figure(study, "speed"),
    "heatmap": lambda study: heatmap_figure(study, "speed"),
    "pareto": lambda study: pareto_figure(study, "speed+", "dispersion-"),
    "parallel": lambda study: parallel_figure(study, "speed+"),
}


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A sixth of the trials of `drawn`, `grid` and `other`, and none of `small`."""
    folder = tmp_path_factory.mktemp("incomplete")
    for spec, number in ((DRAWN, 1), (GRID, 1), (OTHER, 3)):
        launch(read(spec), folder, Serial(), share=Share(number, 6))
    small = read(SMALL)
    ids = [job.trial_id for job in Jobs(small, expand(small))]
    shares = (Share(number, len(ids) + 1) for number in range(1, len(ids) + 2))
    empty = next(share for share in shares if not share.has(ids).any())
    launch(small, folder, Serial(), share=empty)
    return folder


def gap(study: StoredStudy) -> str:
    """What a note says of the points without a trial."""
    points = set(study.plan["point"].to_pylist())
    untried = len(points - set(study.trials["point"]))
    assert untried > 1
    return f"; {untried} of {len(points)} points have no trial yet"


@pytest.mark.parametrize("kind", OF_ONE)
def test_a_figure_of_one_study_leaves_out_points_without_a_trial(
    results: Path, kind: str
) -> None:
    study = StoredStudy("drawn", results)
    assert gap(study) in shown(OF_ONE[kind](study))


@pytest.mark.parametrize("kind", ["scatter", "heatmap"])
def test_a_figure_of_two_studies_leaves_them_out_too(results: Path, kind: str) -> None:
    chosen = [
        StoredStudy(name, results).where(borders="torus") for name in ("grid", "other")
    ]
    both = JoinedStudies(chosen)
    assert gap(both) in shown(OF_ONE[kind](both))


def test_only_points_with_a_trial_are_drawn(results: Path) -> None:
    study = StoredStudy("drawn", results)
    panel = scatter_figure(study, "speed").axes[0]
    part = study.trials[study.trials["n"] == 6]
    assert len(panel.lines[0].get_ydata()) == part["point"].nunique()


def test_a_setting_with_one_value_so_far_says_that_points_have_no_trial(
    results: Path,
) -> None:
    study = StoredStudy("grid", results)
    half = study.trials["borders"] == "torus"
    study.trials = study.trials[half]
    with pytest.raises(ChoiceError) as error:
        select(study).setting("borders")
    assert error.value.reason.startswith(
        "borders has one value at all points with a trial; "
    )
    assert error.value.reason.endswith(gap(study)[2:])


def test_settings_are_shared_out_as_in_the_whole_study(results: Path) -> None:
    """Two points differ in two settings, and one of them would tell them apart."""
    study = StoredStudy("grid", results).where(borders="torus")
    points = study.points
    rows = zip(points["separation_weight"], points["alignment_weight"], strict=True)
    ids = {row: point for point, row in zip(points.index, rows, strict=True)}
    first = study.trials.iloc[[0, 0]]
    study.trials = first.assign(point=[ids[0.5, 0.01], ids[1, 0.1]])
    assert select(study).apart([]) == ["separation_weight", "alignment_weight"]


def test_a_study_without_any_trial_says_so(results: Path) -> None:
    none = StoredStudy("small", results)
    with pytest.raises(ChoiceError, match="no trial is done, so there is nothing"):
        select(none)
    with pytest.raises(ChoiceError, match="study small: no trial is stored yet"):
        JoinedStudies([StoredStudy("grid", results), none])


def test_the_caption_of_a_table_says_what_is_missing(
    results: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    study = StoredStudy("grid", results)
    print_report(means_report(study, point_means(study, ["speed"])))
    missing = f"{54 - len(study.trials)} of 54 trials missing{gap(study)}\n"
    assert missing in capsys.readouterr().out
    none = StoredStudy("small", results)
    print_report(means_report(none, point_means(none, ["speed"])))
    wanted = "6 of 6 trials missing; 2 of 2 points have no trial yet\n"
    assert wanted in capsys.readouterr().out
