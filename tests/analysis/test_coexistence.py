"""Of which order the transitions of made-up systems are said to be."""

import numpy as np
import pytest
from scipy.stats import binom

from sweep.analysis.coexistence import (
    TransitionOrder,
    binder_minimum,
    transition_order,
    two_peaks,
)
from sweep.analysis.size_curves import SizeCurve, binder_crossings
from tests.analysis.mean_field import coexisting
from tests.analysis.measured_scaling import continuous, jumping, orders, said

STUDIES = 20


def test_a_continuous_transition_is_never_said_to_jump() -> None:
    """Of 60 studies 48 were said to be continuous, and 12 not decided."""
    alike, _, jumps = orders(continuous, STUDIES)
    assert jumps == 0
    low, high = binom.interval(0.999, STUDIES, 0.8)
    assert low <= alike <= high


def test_a_jump_is_told() -> None:
    """Of 60 studies with 12 trials all were."""
    alike, _, jumps = orders(jumping, STUDIES)
    assert alike == 0
    assert jumps >= STUDIES - 1


def test_peaks_of_the_mixture_are_where_its_phases_are() -> None:
    large = jumping(1)[-1]
    found = two_peaks(large)
    assert found.significant()
    assert found.low < 0.2 < found.valley < 0.6 < found.high < 0.8
    assert found.x == pytest.approx(1.0, abs=0.05)
    assert binder_minimum(large).sign == "negative"


def test_few_trials_are_not_tested() -> None:
    found = two_peaks(jumping(1, k=5)[-1])
    assert not found.tested
    assert not found.significant()
    assert said(continuous(1, k=5)) != "continuous"


def test_one_peak_is_told_to_be_two_in_few_studies() -> None:
    """The test errs in at most 5 % of studies of one size, whatever their number of
    values; bounds at one false alarm in 1000.
    """
    wrong = 0
    for seed in range(60):
        rng = np.random.default_rng(seed)
        m = np.hypot(*rng.normal(0.3, 0.1, (2, 9, 8, 60)))
        wrong += two_peaks(SizeCurve(9, 3.0, np.arange(9.0), tuple(m))).significant()
    assert wrong <= binom.interval(0.998, 60, 0.05)[1]


def few_of_two_phases(seed: int) -> list[SizeCurve]:
    """Two sizes with six trials at five values."""
    rng = np.random.default_rng(seed)
    return [coexisting(n, np.linspace(0.9, 1.1, 5), 6, 60, rng) for n in (64, 144)]


@pytest.mark.parametrize("seed", [1, 14, 22])
def test_two_peaks_alone_must_be_surer_as_there_are_two_tests(seed: int) -> None:
    """Where the other test could have told a jump as well, 95 % are not enough."""
    curves = few_of_two_phases(seed)
    assert 0.025 < two_peaks(curves[-1]).p < 0.05
    assert transition_order(curves).order == "not decided"


@pytest.mark.parametrize("seed", [6, 32])
def test_so_must_a_negative_cumulant(seed: int) -> None:
    curves = few_of_two_phases(seed)
    assert binder_minimum(curves[-1]).sign == "negative"
    assert binder_minimum(curves[-1], 0.975).sign == "not decided"
    assert transition_order(curves).order == "not decided"


@pytest.mark.parametrize("seed", [2, 9])
def test_crossings_of_all_pairs_of_sizes_are_one_family(seed: int) -> None:
    """Of three sizes there are two pairs, and with 95 % each one seems to cross."""
    curves = continuous(seed)
    assert binder_crossings(curves)
    assert transition_order(curves) == TransitionOrder(
        "not decided", "no cumulants cross, simultaneously for all pairs of sizes"
    )


def test_the_smallest_cumulant_is_one_of_all() -> None:
    """At its value alone it seems to be negative in more studies."""
    found = [few_of_two_phases(seed)[0] for seed in range(40)]
    alone = [one.binder.bounds(0.95)[1].min() < 0.0 for one in found]
    together = [binder_minimum(one).sign == "negative" for one in found]
    assert sum(alone) > sum(together)
    for one, is_told in zip(found, together, strict=True):
        highs = one.binder.bounds(1.0 - 0.05 / 5)[1]
        assert is_told == bool((highs < 0.0).any())
