"""What figures show of a study: which points, and how the settings that vary are shared
out.
"""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sweep.analysis import mean_interval
from sweep.analysis.sequential import Width
from sweep.errors import ChoiceError
from sweep.figures.selection import select
from sweep.methods.adaptive.rule import Until
from tests.plotted import study
from tests.sampled import axis, study_of
from tests.studies import IMPOSSIBLE, launched


def flat(settings: pd.DataFrame) -> np.ndarray:
    """A metric that depends on nothing."""
    return np.zeros(len(settings))


def test_settings_with_the_fewest_values_come_first_and_sampled_ones_apart() -> None:
    assert select(study("grid")).listed == [
        "borders",
        "separation_weight",
        "alignment_weight",
    ]
    drawn = select(study("drawn"))
    assert (drawn.listed, drawn.sampled) == (
        ["n"],
        ["separation_weight", "alignment_weight", "cohesion_weight"],
    )


def test_what_is_set_together_tells_points_apart_by_one_setting() -> None:
    together = study_of(
        "both: {zip: {n: [3, 4], cohesion_weight: [0.1, 0.2]}}, separation_weight: [0,"
        " 1, 2]",
        flat,
    )
    assert select(together).apart([]) == ["n", "separation_weight"]
    assert select(together).apart(["cohesion_weight"]) == ["separation_weight"]


def test_an_ablation_varies_in_one_setting() -> None:
    selection = select(study("ablated"))
    assert list(selection.points.columns) == ["detail"]
    assert selection.values("detail")[0] == ""
    assert selection.values("detail")[-1] == "all"


def test_points_that_would_be_averaged_over_are_named() -> None:
    assert select(study("grid")).mixed(["borders", "alignment_weight"]) == [
        "separation_weight"
    ]
    assert (
        select(study("grid")).mixed(
            ["borders", "alignment_weight", "separation_weight"]
        )
        == []
    )


def test_where_chooses_points_and_leaves_what_still_varies() -> None:
    selection = select(study("grid").where(borders="torus", separation_weight=2))
    assert list(selection.points.columns) == ["alignment_weight"]
    assert (len(selection.points), len(selection.trials), selection.planned) == (
        3,
        9,
        9,
    )
    assert set(selection.trials["borders"]) == {"torus"}
    said = selection.note("{n} trials", [3])
    assert said == "grid, borders = torus, separation weight = 2: 3 trials"


def test_panels_are_in_the_order_of_their_values() -> None:
    turned = study_of(
        "n: [9, 3], both: {zip: {update: [synchronous, sequential], cohesion_weight:"
        " [1, 0]}}",
        flat,
    )
    facets = select(turned).facets(["n", "update"])
    assert [facet.title for facet in facets] == [
        "n = 3, update = synchronous",
        "n = 3, update = sequential",
        "n = 9, update = synchronous",
        "n = 9, update = sequential",
    ]


def test_a_table_has_the_means_of_the_trials() -> None:
    made = study_of(
        axis("random", 5), noise=lambda rng, shape: rng.normal(size=shape), replicates=4
    )
    table = select(made).table(["speed"])
    np.testing.assert_allclose(
        table["speed"], made.trials.groupby("point", sort=False)["speed"].mean()
    )
    assert set(table["speed_n"]) == {4}


def test_trials_that_are_not_done_are_counted() -> None:
    made = study_of(axis("random", 5))
    made.trials.loc[:2, "status"] = "failed"
    assert (
        select(made).note("{n} trials", [2])
        == "made_up: 2 trials; 3 of 10 trials not done"
    )


def test_the_metric_that_chose_the_number_of_trials_has_its_repeated_interval() -> None:
    made = study_of(
        axis("random", 5), noise=lambda rng, shape: rng.normal(size=shape), replicates=4
    )
    rule = Until({"speed": Width(1.0)}, 0.9, 2, 4)
    made.provenance["until"] = rule.as_json() | {"nominal_confidence": 0.97}
    selection = select(made)
    point, row = next(iter(selection.table(["speed"]).iterrows()))
    _, low, high, _ = mean_interval(
        made.trials["speed"][made.trials["point"] == point], 0.97
    )
    np.testing.assert_allclose(
        row[["speed_low", "speed_high"]].astype(float), [low, high]
    )
    said = selection.note("{n} trials", [4], "mean with 95 % interval", ["speed"])
    assert said.endswith(
        "4 trials, mean with 95 % interval; speed decided the number of trials:"
        " repeated 90 % confidence interval"
    )
    assert "repeated" not in selection.note(
        "{n} trials", [4], "mean with 95 % interval", ["dispersion"]
    )


def test_a_study_without_results_says_so(tmp_path: Path) -> None:
    failed = launched(IMPOSSIBLE, tmp_path)
    with pytest.raises(
        ChoiceError, match="study small: no trial is done, so there is nothing to draw"
    ):
        select(failed)
