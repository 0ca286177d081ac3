"""Of which order the transitions of made-up systems are said to be."""

import numpy as np
import pytest
from scipy.stats import binom

from sweep.analysis.coexistence import binder_minimum, two_peaks
from sweep.analysis.size_curves import SizeCurve
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
    assert found.told()
    assert found.low < 0.2 < found.valley < 0.6 < found.high < 0.8
    assert found.x == pytest.approx(1.0, abs=0.05)
    assert binder_minimum(large).sign == "negative"


def test_few_trials_are_not_tested() -> None:
    found = two_peaks(jumping(1, k=5)[-1])
    assert not found.tested
    assert not found.told()
    assert said(continuous(1, k=5)) != "continuous"


def test_one_peak_is_told_to_be_two_in_few_studies() -> None:
    """The test errs in at most 5 % of studies of one size, whatever their number of
    values; bounds at one false alarm in 1000.
    """
    wrong = 0
    for seed in range(60):
        rng = np.random.default_rng(seed)
        m = np.hypot(*rng.normal(0.3, 0.1, (2, 9, 8, 60)))
        wrong += two_peaks(SizeCurve(9, 3.0, np.arange(9.0), tuple(m))).told()
    assert wrong <= binom.interval(0.998, 60, 0.05)[1]
