"""Crossings and peaks of systems whose laws are known.

Intervals of 95 % are counted over studies at fixed seeds; bounds on the counts are
two-sided, and a right interval is beyond them in less than one of 1000 such tests.
"""

import numpy as np
import pytest
from scipy.stats import binom

from sweep.analysis.size_curves import (
    AT_AN_END,
    FLAT,
    SizeCurve,
    binder_crossings,
    susceptibility_peak,
)
from tests.analysis.mean_field import exact_binder, spins
from tests.analysis.measured_scaling import Held, held

TEMPERATURES = np.linspace(0.7, 1.1, 17)
STUDIES = 60
FALSE_ALARM = 0.001


def between(chance: float, studies: int) -> tuple[int, int]:
    """Between which counts of such intervals hold the truth."""
    low, high = binom.interval(1.0 - FALSE_ALARM, studies, chance)
    return int(low), int(high)


def test_the_cumulant_of_the_model_is_the_known_one() -> None:
    """At the critical temperature P(m) ~ exp(-n m^4 / 12), so that U is 1 less a third
    of Gamma(5/4) Gamma(1/4) / Gamma(3/4)^2: 0.27052.
    """
    assert exact_binder(200_000, 1.0) == pytest.approx(0.27052, abs=0.002)


@pytest.fixture(scope="module")
def of_studies() -> Held:
    return held(STUDIES, trials=20, frames=400, points=17)


def test_crossings_are_where_exact_cumulants_are_equal(of_studies: Held) -> None:
    # Measured 94 %, and 98 % for the value, whose interval allows for the place.
    low, high = between(0.95, STUDIES)
    assert of_studies.crossings == STUDIES
    assert low <= of_studies.places <= high
    assert of_studies.values >= low


def test_a_crossing_names_its_sizes_the_smaller_one_first() -> None:
    rng = np.random.default_rng(1)
    curves = [spins(n, TEMPERATURES, 20, 400, rng) for n in (400, 100)]
    (found,) = binder_crossings(curves)
    assert (found.n, found.other_n, found.rises) == (100, 400, False)


def test_curves_that_only_merge_do_not_cross() -> None:
    """Below the critical temperature both cumulants tend to 2/3. The chance that a pair
    crosses somewhere is at most 5 %.
    """
    crossed = 0
    for seed in range(STUDIES):
        rng = np.random.default_rng(seed)
        cold = np.linspace(0.5, 0.9, 9)
        curves = [spins(n, cold, 8, 50, rng) for n in (100, 400)]
        crossed += bool(binder_crossings(curves))
    assert crossed <= between(0.05, STUDIES)[1]


def test_peaks_are_where_the_exact_susceptibility_is_largest(of_studies: Held) -> None:
    # Measured 91 % and 94 %: a polynomial is not the curve itself.
    assert of_studies.peaks == STUDIES
    low, high = between(0.92, STUDIES)
    assert low <= of_studies.peak_places <= high
    assert low <= of_studies.heights <= STUDIES


def test_few_trials_often_have_no_crossing_and_intervals_that_hold_where_they_do() -> (
    None
):
    """Of 150 studies with 8 trials 81 % have none, and 17 % no peak."""
    few = held(STUDIES, trials=8, frames=100, points=9)
    low, high = between(0.19, STUDIES)
    assert low <= few.crossings <= high
    assert few.places <= few.crossings
    assert few.values <= few.crossings
    low, high = between(0.83, STUDIES)
    assert low <= few.peaks <= high
    assert between(0.92, few.peaks)[0] <= few.heights <= few.peaks


def test_a_peak_at_an_end_or_of_a_level_curve_is_none() -> None:
    rng = np.random.default_rng(1)
    end = susceptibility_peak(spins(100, np.linspace(0.5, 0.8, 5), 8, 100, rng))
    assert end.why == AT_AN_END
    assert np.isnan(end.x)
    level = rng.normal(0.5, 0.1, (9, 8, 50))
    flat = [
        susceptibility_peak(SizeCurve(9, 3.0, np.arange(9.0), tuple(one)))
        for one in (level, np.full((9, 8, 50), 0.5))
    ]
    assert {one.why for one in flat} <= {FLAT, AT_AN_END}


def test_sizes_need_values_of_the_control_parameter_in_common() -> None:
    rng = np.random.default_rng(1)
    curves = [
        spins(n, TEMPERATURES + shift, 4, 20, rng) for n, shift in ((64, 0), (100, 0.1))
    ]
    assert binder_crossings([curves[0], spins(144, TEMPERATURES[:1], 4, 9, rng)]) == []
    assert isinstance(binder_crossings(curves), list)
