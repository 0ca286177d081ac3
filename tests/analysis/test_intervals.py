"""Intervals of means and quantiles: how often they hold the truth, and whether tables
give the same ones.
"""

from collections.abc import Callable

import numpy as np
import pandas as pd
import pytest
from scipy.stats import binom, quantile_test

from sweep.analysis import (
    by_point,
    curves,
    mean_interval,
    quantile_interval,
    quantiles_by_point,
)
from tests.cases import slow_but

Draw = Callable[[np.random.Generator, int], np.ndarray]

NORMAL: tuple[Draw, float] = (lambda rng, n: rng.normal(size=n), 0.0)
EXPONENTIAL: tuple[Draw, float] = (lambda rng, n: rng.exponential(size=n), 1.0)
LOGNORMAL: tuple[Draw, float] = (lambda rng, n: rng.lognormal(size=n), np.exp(0.5))


@pytest.fixture
def fewer_resamples(monkeypatch: pytest.MonkeyPatch) -> None:
    """Enough for what is measured here, and five times as fast."""
    monkeypatch.setattr("sweep.analysis.resampling.RESAMPLES", 999)


def coverage(
    distribution: tuple[Draw, float], n: int, interval: str, repeats: int
) -> float:
    """The share of 95 % intervals of n values that hold the true mean."""
    draw, truth = distribution
    rng = np.random.default_rng(6)
    found = [mean_interval(draw(rng, n), interval=interval) for _ in range(repeats)]  # type: ignore[arg-type]
    return float(np.mean([one.low <= truth <= one.high for one in found]))


def assert_share(share: float, expected: float, repeats: int) -> None:
    """Two-sided, at 4 standard errors: one false alarm in 16,000."""
    assert abs(share - expected) < 4 * np.sqrt(expected * (1 - expected) / repeats)


@pytest.mark.parametrize(
    ("distribution", "expected"),
    slow_but(
        [(EXPONENTIAL, 0.9276)],
        [(NORMAL, 0.95), (EXPONENTIAL, 0.9276), (LOGNORMAL, 0.8820)],
    ),
    ids=["normal", "exp", "log"],
)
def test_students_interval_covers_normal_values_as_it_says_and_skewed_ones_less(
    distribution: tuple[Draw, float], expected: float
) -> None:
    """30 values. Those of the skewed are from 400,000 intervals computed with numpy
    alone.
    """
    assert_share(coverage(distribution, 30, "t", 2000), expected, 2000)


@pytest.mark.usefixtures("fewer_resamples")
@pytest.mark.parametrize(
    ("distribution", "expected"),
    slow_but(
        [(EXPONENTIAL, 0.943)],
        [(NORMAL, 0.95), (EXPONENTIAL, 0.943), (LOGNORMAL, 0.925)],
    ),
    ids=["normal", "exp", "log"],
)
def test_the_studentised_bootstrap_covers_skewed_values_better(
    distribution: tuple[Draw, float], expected: float
) -> None:
    """30 values; the expected shares are the measured ones of a longer run, to one per
    cent.
    """
    share = coverage(distribution, 30, "bootstrap_t", 800)
    assert abs(share - expected) < 0.01 + 4 * np.sqrt(expected * (1 - expected) / 800)


@pytest.mark.usefixtures("fewer_resamples")
def test_bca_misses_skewed_values_on_both_sides_where_student_misses_on_one() -> None:
    """200 sets of 100 lognormal values: of Student's misses about one in twenty is
    below, of BCa's nearer to half.
    """
    rng, truth = np.random.default_rng(7), np.exp(0.5)
    sets = rng.lognormal(size=(200, 100))
    students, bca = (
        [mean_interval(values, 0.8, kind) for values in sets]
        for kind in ("t", "bootstrap")
    )  # type: ignore[arg-type]
    below = [sum(truth < one.low for one in found) for found in (students, bca)]
    above = [sum(truth > one.high for one in found) for found in (students, bca)]
    assert below[1] > below[0]
    assert above[1] < above[0]


@pytest.mark.parametrize("interval", ["t", "bootstrap", "bootstrap_t"])
def test_one_value_has_no_interval_and_the_same_values_have_the_same(
    interval: str,
) -> None:
    kind: dict[str, str] = {"interval": interval}
    assert np.isnan(mean_interval([4.0, np.nan], **kind)[1:3]).all()  # type: ignore[arg-type]
    values = np.random.default_rng(8).normal(size=12)
    assert mean_interval(values, **kind) == mean_interval(values, **kind)  # type: ignore[arg-type]


def test_an_unknown_interval_says_what_exists() -> None:
    with pytest.raises(
        ValueError, match='unknown interval "bootstap"; did you mean "bootstrap"'
    ):
        mean_interval([1.0, 2.0], interval="bootstap")  # type: ignore[arg-type]


def test_the_median_lies_between_order_statistics() -> None:
    """P(X(2) <= median <= X(9)) of 10 values is 1 - 2 (1 + 10)/1024 = 0.9785; X(1) to
    X(6) of 6 is 1 - 2/64.
    """
    assert quantile_interval(np.arange(1.0, 11.0), 0.5) == (5.5, 2.0, 9.0, 10)
    assert quantile_interval(np.arange(1.0, 7.0), 0.5)[1:3] == (1.0, 6.0)
    assert np.isnan(quantile_interval(np.arange(1.0, 6.0), 0.5)[1:3]).all()


def test_order_statistics_are_those_of_scipy() -> None:
    values = np.random.default_rng(12).normal(size=33)
    for probability, confidence in ((0.5, 0.95), (0.2, 0.9), (0.9, 0.99)):
        expected = quantile_test(values, p=probability).confidence_interval(confidence)
        found = quantile_interval(values, probability, confidence)
        assert (found.low, found.high) == pytest.approx(
            (expected.low, expected.high), nan_ok=True
        )


@pytest.mark.parametrize(("n", "low"), [(35, np.nan), (36, 1.0)])
def test_the_tenth_part_needs_36_values(n: int, low: float) -> None:
    """1 - 0.9^35 = 0.97497 and 1 - 0.9^36 = 0.97747."""
    found = quantile_interval(np.arange(1.0, n + 1), 0.1).low
    assert found == low or np.isnan([found, low]).all()


@pytest.mark.parametrize(("n", "probability"), [(20, 0.5), (50, 0.25), (100, 0.95)])
def test_the_interval_of_a_quantile_covers_it_exactly_as_the_binomial_says(
    n: int, probability: float
) -> None:
    """2000 sets of exponential values, whose quantiles are -log(1 - p); 4 standard
    errors.
    """
    rng, truth = np.random.default_rng(9), -np.log(1 - probability)
    order = quantile_interval(np.arange(1.0, n + 1), probability)
    expected = binom.cdf(order.high - 1, n, probability) - binom.cdf(
        order.low - 1, n, probability
    )
    assert expected >= 0.95
    found = [
        quantile_interval(rng.exponential(size=n), probability) for _ in range(2000)
    ]
    assert_share(
        float(np.mean([one.low <= truth <= one.high for one in found])), expected, 2000
    )


@pytest.mark.usefixtures("fewer_resamples")
@pytest.mark.parametrize("repeats", slow_but([200], [200, 500]))
def test_the_bootstrap_interval_of_a_median_covers_about_as_often(repeats: int) -> None:
    """Sets of 40; approximate to two per cent, and 4 standard errors."""
    rng = np.random.default_rng(10)
    found = [
        quantile_interval(rng.exponential(size=40), 0.5, interval="bootstrap")
        for _ in range(repeats)
    ]
    share = np.mean([one.low <= np.log(2) <= one.high for one in found])
    assert abs(share - 0.95) < 0.02 + 4 * np.sqrt(0.95 * 0.05 / repeats)


@pytest.mark.parametrize("probability", [0.0, 1.0, 50.0])
def test_a_probability_lies_between_0_and_1(probability: float) -> None:
    with pytest.raises(ValueError, match="allowed: above 0 and below 1"):
        quantile_interval([1.0, 2.0], probability)


def trials() -> pd.DataFrame:
    """Two points of 30 trials, the second first in the table; one trial diverged."""
    rng = np.random.default_rng(11)
    table = pd.DataFrame(
        {
            "point": ["q"] * 30 + ["p"] * 30,
            "weight": [2.0] * 30 + [1.0] * 30,
            "status": "done",
        }
    )
    table["trial_id"] = [f"t{number}" for number in range(60)]
    table["speed"] = rng.exponential(size=60)
    table.loc[3, ["status", "speed"]] = ["diverged", np.nan]
    return table


def test_a_table_has_the_interval_that_was_named() -> None:
    table = trials()
    found = by_point(table, ["weight"], ["speed"], interval="bootstrap_t").iloc[0]
    expected = mean_interval(table["speed"][:30].to_numpy(), interval="bootstrap_t")
    assert tuple(
        found[["speed", "speed_low", "speed_high", "speed_n"]]
    ) == pytest.approx(expected)
    assert (found["weight"], found["speed_n"], found["not_done"]) == (2.0, 29, 1)


def test_curves_have_the_interval_that_was_named() -> None:
    table = trials()
    series = pd.DataFrame(
        {"trial_id": table["trial_id"], "frame": 0, "speed": table["speed"].fillna(0.0)}
    )
    found = curves(series, table, "weight", "speed", interval="bootstrap").iloc[1]
    expected = mean_interval(table["speed"][:30].to_numpy(), interval="bootstrap")
    assert list(found.index) == ["weight", "frame", "mean", "low", "high", "n"]
    assert tuple(found[["mean", "low", "high", "n"]]) == pytest.approx(expected)


def test_a_table_of_quantiles() -> None:
    table = trials()
    found = quantiles_by_point(table, ["weight"], ["speed"], [0.5, 0.75])
    assert list(found["weight"]) == [2.0, 2.0, 1.0, 1.0]
    assert list(found["not_done"]) == [1, 1, 0, 0]
    row = found.iloc[1]
    assert (row["value"], row["low"], row["high"], row["n"]) == quantile_interval(
        table["speed"][:30], 0.75
    )


@pytest.mark.usefixtures("fewer_resamples")
@pytest.mark.parametrize("repeats", slow_but([300], [300, 800]))
def test_bca_of_skewed_values_covers_the_mean_a_little_less_than_it_says(
    repeats: int,
) -> None:
    """92.5 % of 30 exponential values in a longer run, to one per cent, and 4 standard
    errors.
    """
    share = coverage(EXPONENTIAL, 30, "bootstrap", repeats)
    assert abs(share - 0.925) < 0.01 + 4 * np.sqrt(0.925 * 0.075 / repeats)


def test_bca_lies_on_the_side_of_the_long_tail_of_the_percentile_interval() -> None:
    rng = np.random.default_rng(13)
    values = rng.exponential(size=30)
    low, high = np.quantile(
        values[rng.integers(0, 30, (5000, 30))].mean(axis=1), [0.025, 0.975]
    )
    found = mean_interval(values, interval="bootstrap")
    assert found.low > low + 0.01
    assert found.high > high + 0.02
