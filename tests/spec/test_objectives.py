"""Statistics of a candidate's trials have their known values, in either direction."""

import json
import math

import numpy as np
import pytest
from scipy.stats import norm

from sweep.methods.search.objectives import Constraint, Objective, Statistic

MEAN, WORST = Statistic("mean"), Statistic("worst")
GRID = (np.arange(20_000) + 0.5) / 20_000
"""As even as values can be: their sample quantiles are those of the distribution."""


def test_the_mean_is_over_all_blocks_and_scenarios() -> None:
    assert MEAN.of(np.array([[1.0, 2.0], [3.0, 10.0]]), maximize=True) == 4.0


def test_the_worst_is_the_smallest_if_more_is_better_else_the_largest() -> None:
    values = np.array([[1.0, 2.0], [3.0, 10.0]])
    assert WORST.of(values, maximize=True) == 1.0
    assert WORST.of(values, maximize=False) == 10.0


@pytest.mark.parametrize("maximize", [True, False])
def test_a_quantile_is_numpys_whatever_the_direction(maximize: bool) -> None:
    assert (
        Statistic("quantile", 0.25).of(
            np.array([[0.0, 1.0], [2.0, 10.0]]), maximize=maximize
        )
        == 0.75
    )


@pytest.mark.parametrize("share", [0.05, 0.2, 0.5, 1.0])
def test_cvar_of_uniform_values_is_half_the_share_from_the_worse_end(
    share: float,
) -> None:
    assert Statistic("cvar", share).of(GRID, maximize=True) == pytest.approx(
        share / 2, abs=1e-9
    )
    assert Statistic("cvar", share).of(GRID, maximize=False) == pytest.approx(
        1.0 - share / 2, abs=1e-9
    )


@pytest.mark.parametrize("share", [0.05, 0.2, 0.5])
def test_cvar_of_normal_values_is_the_density_at_the_quantile_over_the_share(
    share: float,
) -> None:
    expected = norm.pdf(norm.ppf(share)) / share
    values = norm.ppf(GRID)
    assert Statistic("cvar", share).of(values, maximize=True) == pytest.approx(
        -expected, abs=2e-3
    )
    assert Statistic("cvar", share).of(values, maximize=False) == pytest.approx(
        expected, abs=2e-3
    )


def test_cvar_weighs_the_last_value_by_its_fraction() -> None:
    values = np.array([4.0, 1.0, 3.0, 2.0])
    assert Statistic("cvar", 0.25).of(values, maximize=True) == 1.0
    assert Statistic("cvar", 0.375).of(values, maximize=True) == pytest.approx(
        (1.0 + 0.5 * 2.0) / 1.5
    )
    assert Statistic("cvar", 0.01).of(values, maximize=True) == pytest.approx(1.0)
    assert Statistic("cvar", 1.0).of(values, maximize=False) == 2.5


@pytest.mark.parametrize(
    "statistic", [MEAN, WORST, Statistic("quantile", 0.1), Statistic("cvar", 0.2)]
)
def test_no_value_and_a_missing_value_are_not_known(statistic: Statistic) -> None:
    assert math.isnan(statistic.of(np.empty((0, 2)), maximize=True))
    assert math.isnan(statistic.of(np.array([[1.0, np.nan]]), maximize=True))
    assert statistic.of(np.array([[7.0]]), maximize=False) == 7.0


def test_a_constraint_is_violated_by_as_much_as_lies_beyond_its_bound() -> None:
    collisions = np.array([[0.0, 0.0], [3.0, 1.0]])
    assert Constraint("collisions", 0.0, True, WORST).violation(collisions) == 3.0
    assert Constraint("collisions", 2.0, True, MEAN).violation(collisions) == -1.0
    assert Constraint("speed", 0.5, False, WORST).violation(collisions) == 0.5
    assert math.isnan(
        Constraint("speed", 0.5, False, MEAN).violation(np.array([[np.nan]]))
    )


@pytest.mark.parametrize(
    ("statistic", "words"),
    [
        (MEAN, "mean"),
        (WORST, "worst"),
        (Statistic("quantile", 0.1), "quantile 0.1"),
        (Statistic("cvar", 0.2), "CVaR 0.2"),
    ],
)
def test_they_are_written_in_words_and_read_back_from_json(
    statistic: Statistic, words: str
) -> None:
    assert str(statistic) == words
    objective = Objective("coverage", True, statistic)
    constraint = Constraint("collisions", 2.5, True, statistic)
    assert Objective.from_json(json.loads(json.dumps(objective.as_json()))) == objective
    assert (
        Constraint.from_json(json.loads(json.dumps(constraint.as_json()))) == constraint
    )
