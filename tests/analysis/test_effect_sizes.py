"""Effect sizes against those of known distributions."""

import numpy as np
import pytest
from scipy.stats import norm

from sweep.analysis import cliffs_delta, hedges_g, superiority


@pytest.mark.parametrize(
    ("effect", "correlation"),
    [(0.0, 0.0), (0.5, 0.0), (2.0, 0.0), (0.5, 0.9), (2.0, 0.9)],
)
def test_g_is_unbiased_and_its_interval_covers_the_effect(
    effect: float, correlation: float
) -> None:
    """1500 pairs of 20 normal values; the interval is approximate to 1.5 per cent, and
    4 standard errors for chance.
    """
    rng, found = np.random.default_rng(1), []
    for _ in range(1500):
        shared, alone = rng.normal(size=(2, 20))
        other = correlation * shared + np.sqrt(1 - correlation**2) * alone
        found.append(hedges_g(other, shared + effect, paired=correlation > 0))
    values = np.array([one.value for one in found])
    assert abs(values.mean() - effect) < 4 * values.std() / np.sqrt(1500)
    covered = np.mean([one.low <= effect <= one.high for one in found])
    assert abs(covered - 0.95) < 0.015 + 4 * np.sqrt(0.95 * 0.05 / 1500)


def test_g_by_hand() -> None:
    """Means 2 and 5, both variances 1, four degrees of freedom: 3 gamma(2)/(sqrt(2)
    gamma(1.5)) = 3 x 0.797885.
    """
    assert hedges_g([1.0, 2.0, 3.0], [4.0, 5.0, 6.0]).value == pytest.approx(
        3 * 0.7978846
    )


def test_pairs_with_the_same_random_numbers_narrow_the_interval_of_an_effect() -> None:
    rng = np.random.default_rng(2)
    one = rng.normal(size=40)
    other = one + 0.1 * rng.normal(size=40) - 1.0
    paired, alone = hedges_g(one, other, paired=True), hedges_g(one, other)
    assert paired.value == pytest.approx(alone.value, rel=0.02)
    assert paired.high - paired.low < 0.7 * (alone.high - alone.low)


@pytest.mark.parametrize(
    ("shift", "n", "m"), [(0.0, 20, 20), (1.0, 15, 40), (3.0, 10, 10)]
)
def test_superiority_covers_that_of_normal_values(shift: float, n: int, m: int) -> None:
    """P(X > Y) is Phi(shift/sqrt(2)). 800 intervals; at the edge too wide, by up to 4
    per cent.
    """
    rng, truth = np.random.default_rng(3), norm.cdf(shift / np.sqrt(2))
    found = [
        superiority(rng.normal(0, 1, m), rng.normal(shift, 1, n)) for _ in range(800)
    ]
    covered = np.mean([one.low <= truth <= one.high for one in found])
    chance = 4 * np.sqrt(0.95 * 0.05 / 800)
    assert 0.95 - chance < covered < 0.99 + chance
    assert np.mean([one.value for one in found]) == pytest.approx(truth, abs=0.02)


def test_superiority_by_hand_with_equal_values() -> None:
    """Of 2 x 2 pairs one is larger, one is equal and two are smaller."""
    assert superiority([2.0, 3.0], [1.0, 3.0]).value == pytest.approx(1.5 / 4)
    assert cliffs_delta([2.0, 3.0], [1.0, 3.0]).value == pytest.approx(-0.25)


def test_where_all_are_larger_the_interval_has_a_width_and_sides_may_swap() -> None:
    found, swapped = (
        cliffs_delta(np.arange(6.0), np.arange(5.0) + 10),
        cliffs_delta(np.arange(5.0) + 10, np.arange(6.0)),
    )
    assert (found.value, found.high) == (1.0, 1.0)
    assert 0.0 < found.low < 0.7
    assert (swapped.value, swapped.low, swapped.high) == pytest.approx(
        (-1.0, -1.0, -found.low)
    )


def test_what_has_no_effect_size_is_nan() -> None:
    assert np.isnan(hedges_g([1.0, 2.0], [1.0, 2.0, 3.0])).all()
    assert np.isnan(hedges_g(np.ones(5), np.ones(5))).all()
    assert np.isnan(superiority([np.nan], [1.0])).all()
    with pytest.raises(ValueError, match="2 and 3 values cannot be paired"):
        hedges_g([1.0, 2.0], [1.0, 2.0, 3.0], paired=True)
