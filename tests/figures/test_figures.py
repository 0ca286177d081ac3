"""Figures: what they say, and that a repeat gives the same bytes."""

import re
from copy import copy
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from sweep.analysis import curves
from sweep.analysis.sequential import Width
from sweep.errors import ChoiceError
from sweep.figures import metric_curves, save, saved_about
from sweep.figures.saving import FORMATS, about_study
from sweep.methods.adaptive.rule import Until
from sweep.tables.stored_study import StoredStudy
from tests import plotted
from tests.studies import SMALL, launched


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
        ("time (steps)", "speed (px/step)"),
        ("time (steps)", "flock radius (px)"),
        ("time (steps)", "dispersion (px)"),
    ]


def test_the_legend_names_the_swept_values(figure: Figure) -> None:
    (legend,) = figure.legends
    assert legend.get_title().get_text() == "separation weight"
    assert [text.get_text() for text in legend.get_texts()] == ["0.5", "1"]


def test_the_interval_and_the_number_of_trials_are_named(figure: Figure) -> None:
    texts = [text.get_text() for text in figure.texts]
    lines = "\n".join([*texts, figure.get_supxlabel()]).splitlines()
    said = "small: 3 trials per curve, mean with pointwise 95 % confidence interval"
    assert said in lines


def test_files_say_what_they_show(tmp_path: Path) -> None:
    about = {"Study": "small", "Trials": "6"}
    png, pdf = save(Figure((1, 1)), tmp_path / "speed.v2", about)
    assert (png.name, pdf.name) == ("speed.v2.png", "speed.v2.pdf")
    assert saved_about(tmp_path / "speed.v2").items() >= about.items()
    assert b"Study: small" in pdf.read_bytes()
    assert b"Trials: 6" in pdf.read_bytes()
    assert len(list(tmp_path.iterdir())) == 2


def test_curves_are_those_of_the_table_and_trials_not_done_are_counted(
    study: StoredStudy,
) -> None:
    lost = study.trials["trial_id"].iloc[0]
    part = copy(study)
    part.trials = study.trials.assign(
        status=study.trials["status"].where(study.trials["trial_id"] != lost, "failed")
    )
    part.series = study.series
    figure = metric_curves(part, metrics=["dispersion"])
    table = curves(part.series, part.trials, "separation_weight", "dispersion")
    drawn = np.concatenate([line.get_xydata() for line in figure.axes[0].lines])
    np.testing.assert_array_equal(drawn, table[["frame", "mean"]].to_numpy())
    said = (
        "small: 2 to 3 trials per curve, mean with pointwise 95 % confidence interval;"
        " 1 of 6 trials not done"
    )
    assert plotted.shown(figure).startswith(f"{said} dispersion: 2 to 5 skewed values")
    part.provenance = part.provenance | {
        "until": Until({"speed": Width(1.0)}, 0.95, 2, 3).as_json()
        | {"nominal_confidence": 0.98}
    }
    said = (
        "small: 2 to 3 trials per curve, mean with pointwise 95 % confidence interval,"
        " valid for fixed numbers of trials"
    )
    assert plotted.shown(metric_curves(part, metrics=["speed"])).startswith(said)


def test_curves_that_one_of_them_hides_are_counted(study: StoredStudy) -> None:
    """By the means that are drawn: nearer than a line is wide in every frame."""

    def note(apart: float) -> str:
        part = copy(study)
        own = dict(zip(study.trials["trial_id"], study.trials["point"], strict=True))
        second = study.series["trial_id"].map(own) == study.trials["point"].iloc[-1]
        frames = study.series["frame"]
        values = 5.0 + frames / frames.max() * 5.0  # an axis from 0 to 10
        part.series = study.series.assign(
            speed=values + np.where(second & (frames == frames.max()), apart, 0.0)
        )
        return plotted.shown(metric_curves(part, metrics=["speed"]))

    sentence = "curves coincide within the width of a line: 2 of 2 (speed)"
    assert note(0.0).endswith(sentence)
    assert note(0.09).endswith(sentence)
    assert "coincide" not in note(0.2)


def test_a_panel_without_done_trials_says_so_and_has_no_part_in_the_scale() -> None:
    part = copy(plotted.study("grid"))
    lost = part.trials["alignment_weight"] == 1
    part.trials = part.trials.assign(status=part.trials["status"].mask(lost, "failed"))
    figure = metric_curves(part.where(borders="torus"), "separation_weight", ["speed"])
    empty = [axes for axes in figure.axes if not axes.lines]
    assert [text.get_text() for axes in empty for text in axes.texts] == [
        "no trial done"
    ]
    assert len(empty) == 1
    assert len({axes.get_ylim() for axes in figure.axes if axes.lines}) == 1


def test_what_is_no_line_is_a_panel_on_the_same_scale() -> None:
    figure = metric_curves(plotted.study("grid"), metrics=["speed"])
    assert plotted.legend_texts(figure) == ["torus", "bounded"]
    assert len(figure.axes) == 9
    assert (
        plotted.titles(figure)[0] == "separation weight = 0.5, alignment weight = 0.01"
    )
    assert len({axes.get_ylim() for axes in figure.axes}) == 1


def test_more_than_seven_numbers_are_a_bar_of_colours(tmp_path: Path) -> None:
    spec = SMALL.replace("[0.5, 1]", "{linspace: [0.5, 2, 8]}").replace(
        "replicates: 3", "replicates: 1"
    )
    figure = metric_curves(launched(spec, tmp_path))
    panel, bar = figure.axes
    assert (len(panel.lines), figure.legends) == (8, [])
    assert bar.get_ylabel() == "separation weight"
    assert len({line.get_color() for line in panel.lines}) == 8


def test_a_metric_below_zero_is_not_cut_off(study: StoredStudy) -> None:
    part = copy(study)
    part.series = study.series.assign(speed=-study.series["speed"])
    low, _ = metric_curves(part, metrics=["speed"]).axes[0].get_ylim()
    assert low <= part.series["speed"].min()


@pytest.mark.parametrize(
    ("name", "choices", "message"),
    [
        (
            "small",
            {"metrics": ["sped"]},
            'study small: unknown series metric "sped"; did you mean "speed"?',
        ),
        (
            "drawn",
            {},
            "study drawn: has no series; record: {series: [speed]} stores series",
        ),
        (
            "grid",
            {"by": "border"},
            'unknown varied parameter "border"; did you mean "borders"?',
        ),
        (
            "grid",
            {},
            (
                "curves has 18 panels, by separation_weight (3 values) and"
                " alignment_weight (3 values)"
            ),
        ),
        (
            "ablated",
            {},
            (
                "curves by detail, which has 12 values; allowed: up to 7; choose with"
                " where, for example detail="
            ),
        ),
    ],
)
def test_wrong_choices_of_curves_say_what_is_allowed(
    name: str, choices: dict, message: str
) -> None:
    with pytest.raises(ChoiceError) as error:
        metric_curves(plotted.study(name), **choices)
    assert message in str(error.value)


def test_curves_are_no_means_over_what_is_sampled(tmp_path: Path) -> None:
    spec = SMALL.replace(
        "  separation_weight: [0.5, 1]",
        "  separation_weight: {uniform: [0, 1], points: 3}\n  n: [3, 4]",
    )
    drawn = launched(spec.replace("n: 12, ", ""), tmp_path)
    with pytest.raises(
        ChoiceError,
        match="a curve would be a mean over separation_weight; allowed: up to 60",
    ):
        metric_curves(drawn)
    assert [
        len(axes.lines) for axes in metric_curves(drawn, "separation_weight").axes
    ] == [3, 3]


@pytest.mark.parametrize("name", FORMATS)
def test_every_format_has_the_same_bytes_again_and_says_what_it_shows(
    study: StoredStudy, tmp_path: Path, name: str
) -> None:
    about = about_study(study)
    first, again = (
        save(
            metric_curves(study, metrics=["speed"]),
            tmp_path / part,
            about,
            formats=[name],
        )[0].read_bytes()
        for part in ("a", "b")
    )
    assert first == again
    for value in ("small", about["Spec hash"], about["kernels_sha"], "6"):
        assert value.encode() in first
    assert {path.name for path in tmp_path.iterdir()} == {f"a.{name}", f"b.{name}"}


def test_texts_are_texts_in_files_for_journals(figure: Figure, tmp_path: Path) -> None:
    """Journals want fonts embedded as TrueType, and no outlines in place of texts."""
    svg, pdf = save(figure, tmp_path / "speed", formats=["svg", "pdf"])
    label = figure.axes[0].get_xlabel()
    assert label
    texts = re.findall(r"<text[^>]*>([^<]*)</text>", svg.read_text())
    assert any(label in text for text in texts)
    content = pdf.read_bytes()
    assert b"/Type3" not in content
    assert b"/CIDFontType2" in content  # TrueType


@pytest.mark.parametrize("harm", ["no png", "no pdf", "torn png"])
def test_files_that_are_not_whole_say_nothing(tmp_path: Path, harm: str) -> None:
    png, pdf = save(Figure((1, 1)), tmp_path / "speed", {"Study": "small"})
    if harm == "torn png":
        png.write_bytes(b"torn")
    else:
        (png if harm == "no png" else pdf).unlink()
    assert saved_about(tmp_path / "speed") == {}


def test_a_watermark_is_large_pale_and_changes_no_layout(
    figure: Figure, tmp_path: Path
) -> None:
    save(figure, tmp_path / "plain", formats=["svg"])
    before = [axes.get_position().bounds for axes in figure.axes]
    save(figure, tmp_path / "speed", None, "QUICK: FEW TRIALS", ["svg"])
    (mark,) = (text for text in figure.texts if text.get_text() == "QUICK: FEW TRIALS")
    after = [axes.get_position().bounds for axes in figure.axes]
    assert np.allclose(after, before)
    figure.draw_without_rendering()
    width, height = mark.get_window_extent().size / figure.bbox.size
    assert 0.6 < width < 1
    assert 0.4 < height <= 1
    assert mark.get_alpha() == 0.2
