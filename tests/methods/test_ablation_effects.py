"""Paired effects of an axis that ablates, and the figure of them."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from sweep.errors import ChoiceError
from sweep.figures import Choices, effects_figure, paired_effects
from sweep.figures.kinds import plan_figures
from sweep.tables.stored_study import StoredStudy
from tests.studies import launched

ABLATING = """
study: ablating
model: nguyen2024
preset: as_run
fixed: {n: 12, steps: 9, n_obstacles: 2}
sweep:
  detail: {ablate: as_written}
  cohesion_weight: [1, 2]
replicates: 4
seed: 5
streams: {noise: common}
"""
DETAILS = 10


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> StoredStudy:
    return launched(ABLATING, tmp_path_factory.mktemp("effects"))


def pairs(
    study: StoredStudy, setting: str, value: object
) -> tuple[np.ndarray, np.ndarray]:
    """Speeds at cohesion weight 2 without any change, and with one setting changed, by
    replicate.
    """
    trials = study.trials[study.trials["cohesion_weight"] == 2]
    others = [name for name in study.varied if name not in (setting, "cohesion_weight")]
    unchanged = trials.iloc[0]
    same = (trials[others] == unchanged[others]).all(axis=1)
    before, after = (
        trials[same & (trials[setting] != value)],
        trials[same & (trials[setting] == value)],
    )
    return before.sort_values("replicate")["speed"].to_numpy(), after.sort_values(
        "replicate"
    )["speed"].to_numpy()


def test_an_effect_is_the_mean_of_paired_differences(study: StoredStudy) -> None:
    table = paired_effects(study, "as_written", ["speed"], "cohesion_weight")
    assert len(table) == 2 * (DETAILS + 1)
    assert set(table["n"]) == {4}
    row = table[(table["detail"] == "drag") & (table["cohesion_weight"] == 2)].iloc[0]
    before, after = pairs(study, "drag", 0.0)
    assert row["value"] == pytest.approx((after - before).mean())
    assert row["low"] < row["value"] < row["high"]


def test_a_factor_is_a_geometric_mean_of_paired_ratios(study: StoredStudy) -> None:
    table = paired_effects(
        study, "as_written", ["speed"], "cohesion_weight", factor=True
    )
    row = table[(table["detail"] == "drag") & (table["cohesion_weight"] == 2)].iloc[0]
    before, after = pairs(study, "drag", 0.0)
    assert row["value"] == pytest.approx(np.exp(np.log(after / before).mean()))
    assert 0.0 < row["low"] < row["value"] < row["high"]


def test_intervals_are_wider_the_more_there_are(study: StoredStudy) -> None:
    one = paired_effects(study, "as_written", ["speed"], "cohesion_weight")
    two = paired_effects(
        study, "as_written", ["speed", "dispersion"], "cohesion_weight"
    )
    two = two[two["metric"] == "speed"].reset_index(drop=True)
    width, wider = one["high"] - one["low"], two["high"] - two["low"]
    assert (wider[width > 0] > width[width > 0]).all()
    assert (width > 0).any()


@pytest.mark.parametrize("factor", [False, True])
def test_the_figure_names_details_values_units_and_numbers(
    study: StoredStudy, factor: bool
) -> None:
    metrics, names = (
        {"speed": "speed", "dispersion": "dispersion"},
        {1.0: "weight 1", 2.0: "weight 2"},
    )
    figure = effects_figure(
        study, "as_written", metrics, "cohesion_weight", names, factor=factor
    )
    panel = figure.axes[0]
    rows = [label.get_text() for label in panel.get_yticklabels()]
    assert len(rows) == DETAILS + 1
    assert "drag: 0" in rows
    assert "obstacle range: unlimited" in rows
    assert "range inclusive: yes" in rows
    assert rows[-1] == "all: as written"
    assert panel.get_title().startswith("speed\nunchanged (px/step):\n")
    assert panel.get_xlabel() == ("factor" if factor else "change (px/step)")
    said = figure.get_supxlabel()
    assert "ablating: 4 pairs" in said
    assert "95 % confidence interval (Bonferroni, 44 comparisons)" in said
    assert [text.get_text() for text in figure.legends[0].get_texts()] == [
        "weight 1",
        "weight 2",
    ]
    drawn(figure)


def drawn(figure: Figure) -> None:
    """Draw it, which would warn of what does not fit."""
    figure.canvas.draw()


REAL = """
study: real
model: nguyen2024
preset: as_run
fixed: {n: 12, steps: 20, n_obstacles: 2}
sweep:
  real:
    ablate:
      slow: {motor_lag: 3}
      late: {sensing_delay: 3, sensing_period: 2}
      deaf: {radio_range: 30}
    leave_out: true
replicates: 5
seed: 5
streams: {noise: common}
record: {metrics: [speed, dispersion]}
"""


@pytest.fixture(scope="module")
def real(tmp_path_factory: pytest.TempPathFactory) -> StoredStudy:
    return launched(REAL, tmp_path_factory.mktemp("real"))


def speeds(study: StoredStudy, *details: str) -> np.ndarray:
    """The speeds of the trials that have these details alone, by replicate."""
    settings = {
        "motor_lag": 3 * ("slow" in details),
        "sensing_delay": 3 * ("late" in details),
        "radio_range": 30 if "deaf" in details else np.inf,
    }
    trials = study.trials
    same = np.logical_and.reduce([trials[name] == x for name, x in settings.items()])
    return trials[same].sort_values("replicate")["speed"].to_numpy()


def test_a_detail_is_added_to_nothing_and_to_all_others(real: StoredStudy) -> None:
    table = paired_effects(real, "real", ["speed"])
    assert set(table["n"]) == {5}
    found = table.set_index(["detail", "added_to"])["value"].to_dict()
    everything = speeds(real, "slow", "late", "deaf")
    wanted = {
        ("slow", "nothing"): speeds(real, "slow") - speeds(real),
        ("late", "nothing"): speeds(real, "late") - speeds(real),
        ("deaf", "nothing"): speeds(real, "deaf") - speeds(real),
        ("slow", "all others"): everything - speeds(real, "late", "deaf"),
        ("late", "all others"): everything - speeds(real, "slow", "deaf"),
        ("deaf", "all others"): everything - speeds(real, "slow", "late"),
        ("all", "nothing"): everything - speeds(real),
    }
    assert found == {
        key: pytest.approx(pairs.mean(), abs=1e-12) for key, pairs in wanted.items()
    }
    assert table["value"].round(9).nunique() > 3


def test_the_figure_of_details_has_those_first_that_matter_most(
    real: StoredStudy,
) -> None:
    ((_, planned),) = plan_figures(real, ["effects"], Choices()).figures
    figure = planned.draw()
    rows = [label.get_text() for label in figure.axes[0].get_yticklabels()]
    table = paired_effects(real, "real", ["speed", "dispersion"])
    speed = table[(table["metric"] == "speed") & (table["detail"] != "all")]
    sizes = speed.assign(size=speed["value"].abs()).groupby("detail")["size"].max()
    order = list(sizes.sort_values(ascending=False).index)
    assert [row.partition("\n")[0] for row in rows] == [*order, "all"]
    said = {row.partition("\n")[0]: row.partition("\n")[2] for row in rows}
    assert said["slow"] == "motor lag 3 step"
    assert (
        said["late"].replace("\n", " ") == "sensing delay 3 step, sensing period 2 step"
    )
    assert said["deaf"] == "radio range 30 px"
    assert [text.get_text() for text in figure.legends[0].get_texts()] == [
        "added alone",
        "added to all others",
    ]
    assert "real: 5 pairs" in figure.get_supxlabel()
    assert "14 comparisons" in figure.get_supxlabel()
    drawn(figure)


def test_a_setting_that_varies_too_has_marks_of_its_own(study: StoredStudy) -> None:
    choices = Choices(metrics=("speed",))
    ((_, planned),) = plan_figures(study, ["effects"], choices).figures
    figure = planned.draw()
    assert [text.get_text() for text in figure.legends[0].get_texts()] == [
        "cohesion weight 1",
        "cohesion weight 2",
    ]


def test_more_settings_that_vary_are_refused(tmp_path: Path) -> None:
    spec = REAL.replace("sweep:", "sweep:\n  drag: [0, 0.1]\n  n_obstacles: [0, 2]")
    spec = spec.replace(", n_obstacles: 2}", "}").replace(
        "replicates: 5", "replicates: 2"
    )
    several = launched(spec, tmp_path)
    with pytest.raises(ChoiceError, match=r"by several parameters.*drag, n_obs"):
        plan_figures(several, ["effects"], Choices())
    ((_, planned),) = plan_figures(
        several.where(drag=0), ["effects"], Choices()
    ).figures
    assert planned.draw().legends
