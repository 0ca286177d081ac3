"""Several studies in one figure, told apart, with the numbers of each."""

from pathlib import Path

import numpy as np
import pytest

from sweep.errors import ChoiceError
from sweep.figures import heatmap_figure, metric_curves, save, saved_about
from sweep.figures.asked import check_shared, plot_arguments
from sweep.figures.kinds import KINDS
from sweep.figures.planning import Choices
from sweep.figures.saving import about_study
from sweep.figures.scatter import scatter_figure
from sweep.tables.joined import JoinedStudies
from sweep.tables.stored_study import StoredStudy
from tests.commands import sweep
from tests.plotted import legend_texts, shown, study, titles
from tests.studies import SMALL, launched

OTHER = SMALL.replace("study: small", "study: more/other").replace(
    "replicates: 3", "replicates: 2"
)
FEWER = SMALL.replace("study: small", "study: fewer").replace(
    "record: {series: [speed]", "record: {metrics: [dispersion], series: [dispersion]"
)

ONLY = FEWER.replace("fewer", "only").replace("dispersion", "speed")


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("several")
    for spec in (SMALL, OTHER, FEWER, ONLY):
        launched(spec, folder)
    return folder


def joined(results: Path, *names: str) -> JoinedStudies:
    return JoinedStudies([StoredStudy(name, results) for name in names])


def test_curves_of_two_studies_are_lines_with_the_number_of_each(results: Path) -> None:
    """The lines are those of each study alone, though their trials share their ids."""
    both = joined(results, "small", "more/other")
    figure = metric_curves(both)
    assert legend_texts(figure) == ["small (6 trials)", "more/other (4 trials)"]
    drawn = [
        line.get_ydata() for axes in figure.axes for line in axes.lines if axes.lines
    ]
    alone = [
        line.get_ydata()
        for name in ("small", "more/other")
        for axes in metric_curves(StoredStudy(name, results)).axes
        for line in axes.lines
    ]
    assert len(drawn) == len(alone) == 4
    for line in alone:
        assert any(np.array_equal(line, other) for other in drawn)
    assert shown(figure).startswith("small and more/other: 2 to 3 trials per curve")


ZONES = """\
study: fine
model: couzin2002
fixed: {n: 8, steps: 20, dt: 0.1}
replicates: 2
record: {series: [polarization], every: 5}
"""


def test_curves_with_different_time_steps_are_against_the_time(tmp_path: Path) -> None:
    """A frame of one study is at another time than that of the other."""
    launched(ZONES, tmp_path)
    launched(ZONES.replace("fine", "coarse").replace("dt: 0.1", "dt: 0.2"), tmp_path)
    swept = ZONES.replace("fine", "swept").replace(", dt: 0.1", "")
    launched(swept + "sweep: {dt: [0.1, 0.2]}\n", tmp_path)
    for drawn in (joined(tmp_path, "fine", "coarse"), StoredStudy("swept", tmp_path)):
        (axes,) = metric_curves(drawn).axes
        ends = sorted(line.get_xdata()[-1] for line in axes.lines)
        assert ends == pytest.approx([2.0, 4.0])
        assert axes.get_xlabel() == "time (s)"
    assert KINDS["curves"].marks
    marks = KINDS["curves"].marks(StoredStudy("swept", tmp_path), Choices())
    (panel,) = marks.panels
    assert panel.x.label == "time (s)"
    assert panel.marks["x"].max() == pytest.approx(4.0)
    (axes,) = metric_curves(StoredStudy("fine", tmp_path)).axes
    assert axes.get_xlabel() == "time (steps)"


def test_a_condition_after_a_study_holds_for_this_study(results: Path) -> None:
    weight = StoredStudy("small", results).points["separation_weight"].iloc[0]
    names = [f"small:separation_weight={weight}", "more/other", "curves"]
    asked = plot_arguments(names, results, [])
    first, second = asked.study.parts
    assert first.chosen == {"separation_weight": weight}
    assert (second.restricted, asked.kinds) == (False, ["curves"])
    with pytest.raises(ChoiceError, match='unknown parameter "nois"'):
        plot_arguments(["small", "more/other:nois=1"], results, [])


def test_points_of_two_studies_have_their_own_colours(results: Path) -> None:
    both = joined(results, "small", "more/other")
    figure = scatter_figure(both, "speed", "separation_weight")
    assert legend_texts(figure) == ["small (6 trials)", "more/other (4 trials)"]
    marks = [line for line in figure.axes[0].lines if line.get_marker() != "None"]
    for mark, name in zip(marks, ("small", "more/other"), strict=True):
        wanted = StoredStudy(name, results).trials.groupby("separation_weight")["speed"]
        assert mark.get_ydata() == pytest.approx(wanted.mean().to_numpy())


def test_cells_of_two_studies_are_in_panels_of_their_own(tmp_path: Path) -> None:
    """Also where no cell of one is a cell of the other."""
    spec = SMALL.replace("steps: 9", "steps: 2").replace(
        "replicates: 3", "replicates: 2"
    )
    two = spec.replace("sweep:\n", "sweep:\n  n: [4, 6]\n").replace("n: 12, ", "")
    launched(two, tmp_path)
    launched(
        two.replace("study: small", "study: other").replace("[0.5, 1]", "[0.75, 1.5]"),
        tmp_path,
    )
    both = joined(tmp_path, "small", "other")
    figure = heatmap_figure(both, "speed")
    assert titles(figure)[:2] == [
        "study = small (8 trials)",
        "study = other (8 trials)",
    ]
    for axes in figure.axes[:2]:
        (mesh,) = axes.collections
        assert np.ma.count(mesh.get_array()) == 4
    points = scatter_figure(both, "speed", "separation_weight")
    assert legend_texts(points) == ["small (8 trials)", "other (8 trials)"]


def test_a_setting_that_one_study_fixes_has_its_value_there(results: Path) -> None:
    """A map of one study over two settings, beside a study that varies one of them."""
    grid = study("grid").where(borders="torus")
    both = JoinedStudies([grid, StoredStudy("small", results)])
    assert both.varied == ["study", "separation_weight", "alignment_weight"]
    points = both.points[both.points["study"] == "small (6 trials)"]
    assert points["alignment_weight"].nunique() == 1
    assert len(both.points) == 11
    figure = heatmap_figure(both, "speed", "separation_weight", "alignment_weight")
    assert shown(figure).startswith("grid and small: one point per cell")
    assert set(titles(figure)) == {
        "study = grid (borders = torus; 27 trials)",
        "study = small (6 trials)",
    }


def test_the_note_says_in_which_fixed_settings_studies_differ(results: Path) -> None:
    """What varies in one of them stands on an axis or as a colour."""
    assert joined(results, "small", "more/other").differ == {}
    assert "differ" not in shown(metric_curves(joined(results, "small", "more/other")))
    grid = study("grid").where(borders="bounded")
    both = JoinedStudies([StoredStudy("small", results), grid])
    assert both.differ == {"steps": [9, 8], "borders": ["torus", "bounded"]}
    for figure in (
        heatmap_figure(both, "speed", "separation_weight", "alignment_weight"),
        scatter_figure(both, "speed", "separation_weight"),
        metric_curves(both, "separation_weight"),
    ):
        said = shown(figure)
        assert "; the studies differ in steps (9; 8), borders (torus; bounded)" in said


def test_metrics_that_are_not_the_same_are_left_out_with_the_reason(
    results: Path,
) -> None:
    assert joined(results, "small", "fewer").metrics == ["dispersion"]
    with pytest.raises(ChoiceError) as error:
        joined(results, "fewer", "only")
    assert error.value.reason == (
        "the studies have no metric in common: dispersion is not recorded in only;"
        " speed is not recorded in fewer"
    )
    other = StoredStudy("more/other", results)
    other.units = other.units | {"speed": "m/s"}
    both = JoinedStudies([StoredStudy("small", results), other])
    assert both.left_out == {"speed": "is in px/step in small, in m/s in more/other"}
    assert "speed" not in both.metrics
    with pytest.raises(ChoiceError, match="speed is in px/step in small, in m/s in"):
        check_shared(both, ["speed"])


def test_a_kind_for_one_study_says_so(results: Path) -> None:
    both = joined(results, "small", "more/other")
    for name, kind in KINDS.items():
        reason = kind.suits(both, Choices())
        together = name in ("curves", "scatter", "heatmap", "profiles")
        assert ("shows one study at a time" in reason) != together, name


@pytest.mark.slow
def test_the_command_tells_studies_from_kinds(results: Path) -> None:
    command = ["plot", "small", "more/other", "curves", "--results", str(results)]
    done = sweep(results, *command)
    assert done.returncode == 0
    (path,) = map(Path, done.stdout.split())
    assert path == results / "small" / "figures" / "with-more-other" / "curves.png"
    both = joined(results, "small", "more/other")
    (png, _) = save(metric_curves(both), results / "again", about_study(both))
    about = saved_about(png.with_suffix(""))
    assert about["Study"] == "small and more/other"
    assert about["Trials"] == "6, 4"
    without = sweep(results, *command[:3], *command[4:], "--why")
    assert "shows one study at a time" in without.stderr
    assert "scatter-speed.png" in without.stdout


def test_all_that_is_wrong_with_names_is_said_at_once(results: Path) -> None:
    done = sweep(
        results,
        *("plot", "small", "smal", "curve", "more/other", "--results", str(results)),
        *("--where", "separation_wieght > 0"),
    )
    assert done.returncode == 2
    said = done.stderr.splitlines()
    assert 'unknown kind "smal"' in said[0]
    assert 'has no study of that name; did you mean "small"?' in said[0]
    assert 'unknown kind "curve"; did you mean "curves"?' in said[1]
    assert [line.split(":")[0] for line in said[2:]] == [
        "study small",
        "study more/other",
    ]
    twice = sweep(results, "plot", "small", "small/", "--results", str(results))
    assert twice.returncode == 2
    assert twice.stderr == 'study "small" is named twice\n'


def test_a_study_with_the_name_of_a_kind_has_a_slash(results: Path) -> None:
    launched(SMALL.replace("study: small", "study: curves"), results)
    command = ["plot", "small", "curves/", "scatter", "--metric", "speed"]
    done = sweep(results, *command, "--results", str(results))
    assert done.stdout.strip().endswith("small/figures/with-curves/scatter-speed.png")
