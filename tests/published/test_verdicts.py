"""Verdicts on synthetic data whose truth is known."""

import math
from collections import Counter

import numpy as np
import pytest

from sweep.analysis import Estimate, RankEstimate, mean_estimate
from sweep.published.verdicts import Above, Below, Expectation, Value, Within, judge

RNG_SEED = 11


def estimate(*values: float) -> Estimate:
    return mean_estimate(np.array(values))


def status(found: Estimate, expectation: Expectation, claims: int = 1) -> str:
    return judge(found, expectation, claims).status


def test_a_page_of_true_numbers_has_an_error_as_often_as_it_says() -> None:
    """1000 pages of 10 claims with 8 normal values each; Bonferroni gives 1 - (1 -
    0.005)^10 = 0.0489.

    Two-sided bound at 4 standard errors: one false alarm in 16,000.
    """
    rng, pages, claims = np.random.default_rng(RNG_SEED), 1000, 10
    values = rng.normal(3.0, 2.0, (pages, claims, 8))
    wrong = [
        any(
            status(mean_estimate(row), Value(3.0), claims) == "not reproduced"
            for row in page
        )
        for page in values
    ]
    expected = 1 - (1 - 0.05 / claims) ** claims
    assert abs(np.mean(wrong) - expected) < 4 * math.sqrt(
        expected * (1 - expected) / pages
    )


def test_the_error_of_few_published_trials_counts() -> None:
    """3 published against 20 of ours, one claim: 5 % of 2000 are called wrong; with the
    error left out far more.

    Two-sided bound at 4 standard errors.
    """
    rng, repeats = np.random.default_rng(RNG_SEED), 2000
    counted: Counter[bool] = Counter()
    for _ in range(repeats):
        published, ours = (
            rng.normal(0, 1, 3).mean(),
            mean_estimate(rng.normal(0, 1, 20)),
        )
        for trials in (3, None):
            counted[trials == 3] += (
                status(ours, Value(published, trials=trials)) == "not reproduced"
            )
    assert abs(counted[True] / repeats - 0.05) < 4 * math.sqrt(0.05 * 0.95 / repeats)
    assert counted[False] / repeats > 0.4


@pytest.mark.parametrize("bound", [Above(0.0), Below(0.0), Within(-2.0, 0.0)])
def test_a_false_bound_is_hardly_ever_reproduced(bound: Expectation) -> None:
    """Truth on the bound: the whole 95 % interval lies beyond it in 2.5 % of 2000.
    Bound at 4 standard errors.
    """
    rng = np.random.default_rng(RNG_SEED)
    share = np.mean(
        [
            status(mean_estimate(rng.normal(0, 1, 30)), bound) == "reproduced"
            for _ in range(2000)
        ]
    )
    assert abs(share - 0.025) < 4 * math.sqrt(0.025 * 0.975 / 2000)


def test_a_wrong_number_is_noticed_by_half_at_the_noticeable_difference() -> None:
    """The share of 1000 samples that show it; two-sided bound at 4 standard errors."""
    rng, noticed = np.random.default_rng(RNG_SEED), []
    for values in rng.normal(0, 1, (1000, 12)):
        wrong = judge(mean_estimate(values), Value(0.0), 5).noticeable
        noticed.append(
            status(mean_estimate(values + wrong), Value(0.0), 5) == "not reproduced"
        )
    assert abs(np.mean(noticed) - 0.5) < 4 * math.sqrt(0.25 / 1000)


def test_rounding_and_margin_widen_and_are_told() -> None:
    ours = estimate(1.0, 1.0, 1.0)
    assert status(ours, Value(1.2)) == "not reproduced"
    assert status(ours, Value(1.2, rounding=0.1)) == "not reproduced"
    verdict = judge(ours, Value(1.2, rounding=0.1, margin=0.1, because="a guess"), 1)
    assert (verdict.status, verdict.noticeable) == ("reproduced", pytest.approx(0.2))
    assert (
        verdict.reason
        == "differs by -0.2, which chance, rounding and the margin may explain"
    )


def test_equal_values_have_an_interval_without_width() -> None:
    """And a mean of 0.1 is 0.1, whatever the order of adding."""
    ours = estimate(*[0.1] * 7)
    assert judge(ours, Value(0.1), 3).interval == (0.1, 0.1)
    assert status(ours, Value(0.1)) == "reproduced"
    assert status(ours, Above(0.1)) == "not reproduced"
    assert status(ours, Above(0.09)) == "reproduced"
    assert status(mean_estimate(np.ones(3), np.ones(4)), Value(0.0)) == "reproduced"


@pytest.mark.parametrize("values", [[], [1.0], [1.0, math.nan]])
def test_fewer_than_two_values_are_not_testable(values: list[float]) -> None:
    assert (
        status(mean_estimate(np.array(values, np.float64)), Value(1.0))
        == "not testable as published"
    )


@pytest.mark.parametrize("expectation", [Value(1.0), Above(1.0)])
def test_neither_are_infinite_values(expectation: Expectation) -> None:
    for values in ([1.0, math.inf, 2.0], [math.inf, -math.inf], [math.inf, math.inf]):
        assert (
            status(mean_estimate(np.array(values)), expectation)
            == "not testable as published"
        )


@pytest.mark.parametrize("found", [RankEstimate(0.5, 3), RankEstimate(math.nan, 9)])
def test_neither_is_a_correlation_of_three_or_of_what_does_not_vary(
    found: RankEstimate,
) -> None:
    assert status(found, Above(0.0)) == "not testable as published"


@pytest.mark.parametrize(
    ("expectation", "expected", "reason"),
    [
        (Above(0.0), "reproduced", "lies wholly there"),
        (Above(9.0), "not reproduced", "the opposite was shown"),
        (Above(2.0), "not reproduced", "nothing could be shown"),
        (Below(9.0), "reproduced", "lies wholly there"),
        (Below(0.0), "not reproduced", "the opposite was shown"),
        (Within(0.0, 4.0), "reproduced", "lies wholly there"),
        (Within(1.9, 2.1), "not reproduced", "nothing could be shown"),
        (Within(5.0, 6.0), "not reproduced", "the opposite was shown"),
    ],
)
def test_a_bound_is_reproduced_where_the_whole_interval_is(
    expectation: Expectation, expected: str, reason: str
) -> None:
    verdict = judge(estimate(1.8, 2.0, 2.2, 2.0, 1.9, 2.1), expectation, 4)
    assert verdict.status == expected
    assert reason in verdict.reason


def test_more_claims_make_the_rule_more_lenient_but_not_the_interval_shown() -> None:
    ours = estimate(1.0, 2.0, 3.0)
    one, many = judge(ours, Value(5.0), 1), judge(ours, Value(5.0), 100)
    assert (one.status, many.status) == ("not reproduced", "reproduced")
    assert one.interval == many.interval
