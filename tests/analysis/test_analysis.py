"""Estimates against analytic answers."""

import numpy as np
import pandas as pd
import pytest
from scipy.stats import spearmanr, ttest_ind

from sweep.analysis import by_point, curves, mean_estimate, mean_interval, rank_estimate
from tests.cases import slow_but


def test_the_interval_is_students() -> None:
    """For 1, 2, 3: mean 2, standard error 1/sqrt(3), and t of two degrees of freedom at
    97.5 % is 4.302653.
    """
    mean, low, high, n = mean_interval(np.array([1.0, 2.0, 3.0]))
    assert (mean, n) == (2.0, 3)
    assert high - mean == pytest.approx(4.302653 / np.sqrt(3), rel=1e-6)
    assert mean - low == pytest.approx(high - mean)


@pytest.mark.parametrize("n", slow_but([3], [2, 3, 10]))
def test_intervals_of_normal_values_cover_the_truth_as_often_as_they_say(
    n: int,
) -> None:
    """4000 intervals; two-sided bound at 4 standard errors, so one false alarm in
    16,000.
    """
    rng = np.random.default_rng(1)
    intervals = [mean_interval(values) for values in rng.normal(3.0, 2.0, (4000, n))]
    share = np.mean([low <= 3.0 <= high for _, low, high, _ in intervals])
    assert abs(share - 0.95) < 4 * np.sqrt(0.95 * 0.05 / 4000)


def test_one_value_has_no_interval_and_missing_values_do_not_count() -> None:
    mean, low, high, n = mean_interval(np.array([np.nan, 4.0]))
    assert (mean, n) == (4.0, 1)
    assert np.isnan([low, high]).all()
    assert mean_interval(np.array([np.nan]))[3] == 0


def trials() -> pd.DataFrame:
    return pd.DataFrame(
        {
            "trial_id": list("abcd"),
            "point": ["p", "p", "q", "q"],
            "weight": [0.5, 0.5, 1.0, 1.0],
            "status": ["done", "done", "done", "failed"],
            "speed": [1.0, 3.0, 5.0, np.nan],
        }
    )


def test_points_keep_their_order_and_count_what_is_not_done() -> None:
    table = by_point(trials(), ["weight"], ["speed"])
    assert list(table["weight"]) == [0.5, 1.0]
    assert list(table["speed"]) == [2.0, 5.0]
    assert list(table["speed_n"]) == [2, 1]
    assert list(table["not_done"]) == [0, 1]


def test_curves_are_means_by_frame_with_the_same_interval() -> None:
    series = pd.DataFrame(
        {"trial_id": list("aabb"), "frame": [0, 1, 0, 1], "speed": [1.0, 2.0, 3.0, 6.0]}
    )
    table = curves(series, trials(), "weight", "speed")
    assert list(table["mean"]) == [2.0, 4.0]
    assert list(table["n"]) == [2, 2]
    assert table["high"][1] == pytest.approx(mean_interval(np.array([2.0, 6.0]))[2])


def test_the_interval_of_a_difference_is_welchs() -> None:
    """Against scipy's, with unequal variances and numbers."""
    rng = np.random.default_rng(3)
    one, other = rng.normal(5, 1, 9), rng.normal(3, 4, 23)
    expected = ttest_ind(one, other, equal_var=False).confidence_interval(0.99)
    assert mean_estimate(other, one).interval(0.99) == pytest.approx(
        (expected.low, expected.high)
    )
    assert mean_estimate(other, one).value == pytest.approx(one.mean() - other.mean())


def test_one_sample_has_the_interval_of_a_mean() -> None:
    values = np.array([1.0, np.nan, 2.0, 4.0])
    assert mean_estimate(values).interval() == pytest.approx(mean_interval(values)[1:3])


def test_the_interval_of_a_rank_correlation_covers_the_truth() -> None:
    """Normal pairs with correlation 0.6 have a rank correlation of 6/pi asin(0.3); 2000
    intervals of 40 pairs.

    The method is approximate: 95 % to within one per cent, and 4 standard errors for
    chance.
    """
    rng, covered = np.random.default_rng(4), []
    truth = 6 / np.pi * np.arcsin(0.3)
    for _ in range(2000):
        one = rng.normal(size=40)
        low, high = rank_estimate(one, 0.6 * one + 0.8 * rng.normal(size=40)).interval()
        covered.append(low <= truth <= high)
    assert abs(np.mean(covered) - 0.95) < 0.01 + 4 * np.sqrt(0.95 * 0.05 / 2000)


def test_rank_correlations_are_spearmans_and_a_perfect_one_has_an_interval() -> None:
    rng = np.random.default_rng(5)
    one, other = rng.integers(0, 5, 30).astype(float), rng.normal(size=30)
    other[3] = np.nan
    kept = ~np.isnan(other)
    found = rank_estimate(one, other)
    assert found.value == pytest.approx(spearmanr(one[kept], other[kept]).statistic)
    assert found.n == 29
    low, high = rank_estimate(np.arange(5.0), np.arange(5.0) ** 3).interval()
    assert 0.0 < low < 0.5
    assert high == pytest.approx(1.0)


def test_a_rank_correlation_of_what_does_not_vary_is_undefined() -> None:
    assert np.isnan(rank_estimate(np.arange(5.0), np.ones(5)).value)
