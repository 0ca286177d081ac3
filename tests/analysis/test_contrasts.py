"""Contrasts of small tables by hand, and of normal values whose truth is known."""

from collections.abc import Mapping
from typing import Any, ClassVar, get_args

import numpy as np
import pandas as pd
import pytest
from scipy.integrate import quad
from scipy.stats import chi2, norm, t, ttest_rel

from sweep.analysis import (
    Contrast,
    Distribution,
    Together,
    adjusted,
    cliffs_delta,
    contrast,
    contrasts,
    equivalence,
    hedges_g,
    holm,
    independent_contrast,
    jointly,
    max_t,
    mean_estimate,
    paired_contrast,
    paired_estimate,
    simultaneous_confidence,
    superiority,
)

COMMON, APART = (
    "start=common world=common noise=independent",
    "start=independent world=common noise=independent",
)
WEIGHTS = (0.5, 1.0, 2.0)


class Tables:
    """What a contrast needs of a stored study: three weights, two sizes and twelve
    replicates, rows in any order.
    """

    distributions: ClassVar[Mapping[str, Distribution]] = {}

    def __init__(self, streams: str = COMMON) -> None:
        rng = np.random.default_rng(1)
        rows = [
            (weight, n, replicate)
            for weight in WEIGHTS
            for n in (10, 20)
            for replicate in range(12)
        ]
        table = pd.DataFrame(rows, columns=["weight", "n", "replicate"])
        table["trial_id"] = [f"t{number}" for number in range(len(table))]
        table["point"] = table["weight"].astype(str) + "/" + table["n"].astype(str)
        table["seed"], table["streams"], table["status"] = 5, streams, "done"
        shared = rng.normal(size=12)
        table["speed"] = (
            shared[table["replicate"]]
            + table["weight"]
            + 0.1 * rng.normal(size=len(table))
        )
        self.trials = table.sample(frac=1.0, random_state=2)
        self.varied = ["weight", "n"]

    def values(self, weight: float, n: int) -> np.ndarray:
        """The speeds of a point by replicate."""
        rows = self.trials[(self.trials["weight"] == weight) & (self.trials["n"] == n)]
        return rows.sort_values("replicate")["speed"].to_numpy()


LOW, HIGH = {"weight": 0.5, "n": 10}, {"weight": 2.0, "n": 10}


def test_every_difference_is_b_minus_a() -> None:
    """As of `sweep compare A B`. Sides of a contrast are named, so that no call of
    before, when it was a minus b, changes its sign unseen.
    """
    a, b = np.array([1.0, 2.0, 4.0]), np.array([5.0, 7.0, 9.0])
    columns = pd.Series(a), pd.Series(b)
    table = pd.DataFrame(
        {
            "trial_id": [*"pqrstu"],
            "point": [*"aaabbb"],
            "w": [0, 0, 0, 1, 1, 1],
            "seed": 1,
            "replicate": [0, 1, 2] * 2,
            "status": "done",
            "streams": "start=common",
            "x": [*a, *b],
        }
    )
    change = contrast(table, "x", a={"w": 0}, b={"w": 1})
    assert (change.a.tolist(), change.b.tolist()) == (a.tolist(), b.tolist())
    found = (
        change.value,
        contrasts(table, "x", "w", 0)["difference"][0],
        mean_estimate(a, b).value,
        paired_estimate(a, b).value,
        paired_estimate(a, b, "count").value,
        paired_contrast(*columns).value,
        independent_contrast(a, b).value,
    )
    assert found == pytest.approx([14.0 / 3.0] * len(found))
    assert (superiority(a, b).value, cliffs_delta(a, b).value) == (1.0, 1.0)
    assert hedges_g(a, b).value > 0.0
    assert hedges_g(a, b, paired=True).value > 0.0
    with pytest.raises(TypeError):
        contrast(table, "x", {"w": 0}, {"w": 1})  # type: ignore[misc]


def test_trials_are_paired_by_replicate_whatever_the_order_of_rows() -> None:
    study = Tables()
    found = contrast(study, "speed", a=LOW, b=HIGH)
    one, other = study.values(2.0, 10), study.values(0.5, 10)
    expected = ttest_rel(one, other)
    assert found.paired
    assert found.value == pytest.approx((one - other).mean())
    assert found.interval() == pytest.approx(tuple(expected.confidence_interval()))
    assert found.p_value() == pytest.approx(expected.pvalue)
    assert found.correlation == pytest.approx(np.corrcoef(one, other)[0, 1])
    assert found.variance_reduction == pytest.approx(
        (one.var() + other.var()) / (one - other).var()
    )
    table = contrast(study.trials, "speed", a=LOW, b=HIGH)
    assert table.interval() == found.interval()


def test_trials_that_start_apart_are_not_paired() -> None:
    study = Tables(APART)
    found = contrast(study, "speed", a=LOW, b=HIGH)
    expected = mean_estimate(study.values(0.5, 10), study.values(2.0, 10))
    assert not found.paired
    assert found.interval() == pytest.approx(expected.interval())
    assert np.isnan([found.correlation, found.variance_reduction]).all()


def test_a_trial_without_a_result_takes_its_partner_along_and_is_counted() -> None:
    study = Tables()
    lost = study.trials.query("weight == 2.0 and n == 10 and replicate == 7").index
    study.trials.loc[lost, "status"] = "diverged"
    found = contrast(study, "speed", a=LOW, b=HIGH)
    differences = study.values(2.0, 10) - study.values(0.5, 10)
    assert found.value == pytest.approx(np.delete(differences, 7).mean())
    assert (len(found.a), found.left_out, found.paired) == (11, 1, True)


def test_several_points_need_a_unit() -> None:
    study = Tables()
    with pytest.raises(
        ValueError, match='2 points are left on one side; "unit" must name'
    ):
        contrast(study, "speed", a={"weight": 0.5}, b={"weight": 2.0})
    differences = np.array(
        [study.values(2.0, n) - study.values(0.5, n) for n in (10, 20)]
    )
    for unit, values in (
        ("trial", differences.ravel()),
        ("replicate", differences.mean(axis=0)),
    ):
        sides: dict[str, Any] = {"a": {"weight": 0.5}, "b": {"weight": 2.0}}
        found = contrast(study, "speed", **sides, unit=unit)
        assert found.interval() == pytest.approx(mean_estimate(values).interval())
    with pytest.raises(ValueError, match="parameters that are not named"):
        contrast(
            study.trials, "speed", a={"weight": 0.5}, b={"weight": 2.0}, unit="trial"
        )


@pytest.mark.parametrize(
    ("metric", "first", "second", "message"),
    [
        (
            "sped",
            {"weight": 1.0},
            {"weight": 2.0},
            'unknown column "sped"; did you mean "speed"',
        ),
        (
            "speed",
            {"wieght": 1.0},
            {"weight": 2.0},
            'unknown column "wieght"; did you mean "weight"',
        ),
        ("speed", {"weight": 3.0}, {"weight": 2.0}, "no trial has weight = 3.0"),
        ("speed", {"status": 1}, {"weight": 2.0}, "no trial has status = 1"),
        ("speed", {"weight": 1.0}, {"n": 10}, "share trials"),
        ("speed", {}, {"n": 10}, "no parameters and n = 10 share trials"),
    ],
)
def test_what_is_wrong_with_a_contrast_is_said(
    metric: str, first: Any, second: Any, message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        contrast(Tables(), metric, a=first, b=second)


def test_all_values_against_a_reference() -> None:
    study = Tables()
    table = contrasts(study, "speed", "weight", 0.5, {"n": 20})
    assert sorted(table["weight"]) == [1.0, 2.0]
    row = table[table["weight"] == 2.0].iloc[0]
    one = contrast(
        study, "speed", a={"weight": 0.5, "n": 20}, b={"weight": 2.0, "n": 20}
    )
    assert (row["low"], row["high"]) == pytest.approx(
        one.interval(simultaneous_confidence(2))
    )
    assert (row["difference"], row["n"], row["left_out"]) == (one.value, 12, 0)
    others = [
        contrast(study, "speed", a={"weight": 0.5, "n": 20}, b={"weight": w, "n": 20})
        for w in table["weight"]
    ]
    assert list(table["p"]) == pytest.approx(
        holm([other.estimate.p_value() for other in others])
    )


@pytest.mark.parametrize(
    ("together", "p"),
    [("bonferroni", 2 * 0.03), ("sidak", 1 - 0.97**2), ("holm", 2 * 0.03)],
)
def test_contrasts_looked_at_together(together: Any, p: float) -> None:
    """The first of two tests, of which the one without two values is none: the third is
    no part of the family.
    """
    rng = np.random.default_rng(8)
    sides = [
        paired_contrast(pd.Series(np.zeros(15)), pd.Series(rng.normal(mean, 1.0, 15)))
        for mean in (0.5, 3.0)
    ]
    family = jointly(
        [*sides, paired_contrast(pd.Series([1.0]), pd.Series([0.0]))], together=together
    )
    level = simultaneous_confidence(
        2, correction="sidak" if together == "sidak" else "bonferroni"
    )
    assert (family.low[0], family.high[0]) == sides[0].interval(level)
    alone = [side.estimate.p_value() for side in sides]
    assert list(family.p[:2]) == pytest.approx(list(adjusted(alone, together)))
    assert np.isnan([family.low[2], family.p[2]]).all()
    assert adjusted([0.03, np.nan, 0.9], together)[0] == pytest.approx(p)


def test_all_values_against_a_reference_by_max_t() -> None:
    study = Tables()
    table = contrasts(study, "speed", "weight", 0.5, {"n": 20}, together="max_t")
    expected = max_t(
        np.column_stack(
            [study.values(w, 20) - study.values(0.5, 20) for w in table["weight"]]
        )
    )
    assert list(table["low"]) == pytest.approx(list(expected.low))
    assert list(table["p"]) == pytest.approx(list(expected.p))
    for lost in (
        "weight == 1.0 and n == 20 and replicate == 3",
        "weight == 2.0 and n == 20 and replicate == 8",
    ):
        study.trials.loc[study.trials.query(lost).index, "status"] = "failed"
    left = contrasts(study, "speed", "weight", 0.5, {"n": 20}, together="max_t")
    columns = [
        np.delete(study.values(w, 20) - study.values(0.5, 20), [3, 8])
        for w in left["weight"]
    ]
    assert list(left["high"]) == pytest.approx(
        list(max_t(np.column_stack(columns)).high)
    )
    assert (list(left["n"]), list(left["left_out"])) == ([10, 10], [1, 1])
    with pytest.raises(ValueError, match="common start stream"):
        contrasts(Tables(APART), "speed", "weight", 0.5, {"n": 20}, together="max_t")


def test_what_is_wrong_with_contrasts_is_said() -> None:
    with pytest.raises(
        ValueError, match='unknown together "hollm"; did you mean "holm"'
    ):
        contrasts(Tables(), "speed", "weight", 0.5, {"n": 20}, together="hollm")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="no trial has a value of n other than 20"):
        contrasts(Tables(), "speed", "n", 20, {"n": 20, "weight": 1.0})
    with pytest.raises(ValueError, match="no trial has n = 20, weight = 7"):
        contrasts(Tables(), "speed", "weight", 7.0, {"n": 20})


def bivariate(correlation: float, n: int) -> Contrast:
    """A contrast of n normal pairs with variances 1."""
    one, other = np.random.default_rng(3).normal(size=(2, n))
    second = correlation * one + np.sqrt(1 - correlation**2) * other
    return paired_contrast(pd.Series(one), pd.Series(second))


@pytest.mark.parametrize("correlation", [0.0, 0.8, -0.5])
def test_the_variance_reduction_of_normal_pairs_is_known(correlation: float) -> None:
    """1/(1 - rho); the estimate has a standard error of (1 + rho)/(1 - rho)/sqrt(n),
    here 4 of them are allowed.
    """
    found, n = bivariate(correlation, 40_000), 40_000
    assert abs(found.correlation - correlation) < 4 * (1 - correlation**2) / np.sqrt(n)
    error = (1 + correlation) / (1 - correlation) / np.sqrt(n)
    assert abs(found.variance_reduction - 1 / (1 - correlation)) < 4 * error


def test_equal_differences_have_an_infinite_reduction_and_no_interval() -> None:
    found = paired_contrast(pd.Series([1.0, 2.0, 4.0]), pd.Series([0.0, 1.0, 3.0]))
    assert found.variance_reduction == np.inf
    assert np.isnan([*found.interval(), found.estimate.p_value()]).all()


@pytest.mark.parametrize("together", get_args(Together))
def test_a_contrast_of_equal_differences_is_no_test(together: Together) -> None:
    """Beside one that is: the adjustment counts that alone."""
    rng = np.random.default_rng(6)
    one, other = rng.normal(size=(2, 12))
    sides = [
        paired_contrast(pd.Series(other), pd.Series(first))
        for first in (one, other + 1.0, np.append(other[:-1], 7.0))
    ]
    found = jointly(sides, together=together)
    for bounds in (found.low, found.high, found.p):
        assert np.isnan(bounds).tolist() == [False, True, True]


def test_one_pair_has_no_interval_and_pairs_must_be_told_apart() -> None:
    assert np.isnan(
        paired_contrast(pd.Series([1.0]), pd.Series([2.0])).interval()
    ).all()
    with pytest.raises(ValueError, match="cannot be paired"):
        paired_contrast(pd.Series([1.0, 2.0], index=[0, 0]), pd.Series([1.0]))


def equivalent_share(truth: float, margin: float, n: int, repeats: int) -> float:
    """How often n normal values with variance 1 are shown to be equivalent to zero."""
    rng = np.random.default_rng(4)
    samples = (mean_estimate(rng.normal(truth, 1.0, n)) for _ in range(repeats))
    return float(
        np.mean([equivalence(sample, -margin, margin).equivalent for sample in samples])
    )


@pytest.mark.slow
def test_equivalence_is_claimed_of_a_value_on_the_margin_one_time_in_twenty() -> None:
    """2000 samples, 4 standard errors; the other margin is 12 errors away."""
    assert abs(equivalent_share(1.5, 1.5, 16, 2000) - 0.05) < 4 * np.sqrt(
        0.05 * 0.95 / 2000
    )


def test_the_power_of_equivalence_is_the_known_one() -> None:
    """For a true value of zero: P(|mean| < margin - t s/sqrt(n)), integrated over s;
    1000 samples, 4 errors.
    """
    n, margin = 12, 0.8
    quantile = t.ppf(0.95, n - 1)

    def given(squares: float) -> float:
        room = margin * np.sqrt(n) - quantile * np.sqrt(squares / (n - 1))
        return (
            float((2 * norm.cdf(room) - 1) * chi2.pdf(squares, n - 1))
            if room > 0
            else 0.0
        )

    power = quad(given, 0, (margin * np.sqrt(n) / quantile) ** 2 * (n - 1))[0]
    assert 0.5 < power < 0.9
    assert abs(equivalent_share(0.0, margin, n, 1000) - power) < 4 * np.sqrt(
        power * (1 - power) / 1000
    )


def test_equivalence_is_where_the_90_percent_interval_lies_within_the_margins() -> None:
    estimate = mean_estimate(np.array([0.1, -0.2, 0.05, 0.15, -0.1]))
    found = equivalence(estimate, -0.3, 0.3)
    assert (found.low, found.high) == pytest.approx(estimate.interval(0.9))
    assert found.equivalent
    assert not equivalence(estimate, -0.3, found.high - 1e-9).equivalent
    assert equivalence(estimate, -0.3, found.high).p == pytest.approx(0.05)
    assert not equivalence(mean_estimate(np.zeros(3)), -1.0, 1.0).equivalent
    assert not equivalence(mean_estimate(np.ones(3)), -1.0, 1.0).equivalent
    assert not equivalence(mean_estimate(np.zeros(1)), -1.0, 1.0).equivalent
    with pytest.raises(ValueError, match="margins: 1 to -1"):
        equivalence(estimate, 1, -1)


def test_pairs_are_those_that_both_columns_have() -> None:
    first = pd.Series([3.0, 1.0, np.nan, 2.0], index=[30, 10, 40, 20])
    second = pd.Series([0.5, 0.25, 4.0, 5.0], index=[20, 30, 40, 50])
    found = paired_contrast(first, second)
    assert (found.a.tolist(), found.b.tolist()) == ([2.0, 3.0], [0.5, 0.25])
    assert found.pairs is not None
    assert found.pairs.tolist() == [20, 30]
    nothing = paired_contrast(first, pd.Series([], dtype=np.float64))
    assert (len(nothing.a), nothing.paired) == (0, True)
