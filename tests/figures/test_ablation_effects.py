"""Paired effects of an axis that ablates, and the figure of them."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from sweep.figures import effects_figure, paired_effects
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
    assert "simultaneous 95 % interval (Bonferroni, 44 comparisons)" in said
    assert [text.get_text() for text in figure.legends[0].get_texts()] == [
        "weight 1",
        "weight 2",
    ]
    drawn(figure)


def drawn(figure: Figure) -> None:
    """Draw it, which would warn of what does not fit."""
    figure.canvas.draw()
