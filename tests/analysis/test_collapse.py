"""Collapses of curves whose exponents are known."""

import numpy as np
import pytest
from scipy.stats import binom, t

from sweep.analysis.size_collapse import OPEN, _resampled, collapse, quality
from sweep.analysis.size_curves import SizeCurve
from tests.analysis.mean_field import collapsing, spins
from tests.analysis.measured_scaling import (
    COLLAPSING,
    EXPONENTS,
    NOISES,
    collapsed,
    holding,
)


def test_curves_that_collapse_differ_by_their_errors_alone() -> None:
    """S at the true exponents is a mean of about 30 squares of errors."""
    found = []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        curves = [collapsing(n, NOISES, 40, rng, noise=0.1) for n in COLLAPSING]
        found.append(quality(curves, np.array(EXPONENTS)))
        wrong = quality(curves, np.array([3.0, 0.6, 0.2]))
        assert wrong > 2.0 * found[-1]
    # Mean of 20 S, each of about 30 squares that share their neighbours: its standard
    # error is below 0.1, and what 40 trials do not know of errors adds 5 %.
    assert 0.7 < np.mean(found) < 1.4


@pytest.mark.slow
def test_intervals_hold_the_exponents() -> None:
    """Measured over 40 studies: 92 to 97 %. A right interval is beyond the bounds in
    less than one of 1000 tests of each exponent.
    """
    studies = 7
    found = collapsed(studies, 12, 0.05, resamples=12)
    assert all(one.quality < 3.0 and one.compared > 0.5 for one in found)
    low, _ = binom.interval(0.999, studies, 0.92)
    assert min(holding(found)) >= low


def test_resampled_means_vary_as_means_do() -> None:
    """One trial less is drawn than there are, so that the variance has no bias. Of 4000
    resamples the variance has a relative error of 2 %; 5 of them are allowed.
    """
    rng = np.random.default_rng(2)
    samples = rng.normal(size=(4, 1))
    curve = SizeCurve(9, 3.0, np.zeros(1), (samples,))
    found = [_resampled([curve], rng)[0] for _ in range(4000)]
    assert np.var(found) == pytest.approx(samples.var(ddof=1) / 4, rel=0.1)


def test_half_widths_are_students() -> None:
    """With one degree of freedom less than there are trials. Two confidences have the
    same resamples.
    """
    rng = np.random.default_rng(3)
    curves = [collapsing(n, NOISES, 12, rng, noise=0.05) for n in COLLAPSING]
    wide, narrow = (collapse(curves, each, resamples=3) for each in (0.95, 0.5))
    for one, other in zip(wide[:3], narrow[:3], strict=True):
        assert one[0] - one[1] == pytest.approx(one[2] - one[0])
        ratio = (one[2] - one[0]) / (other[2] - other[0])
        assert ratio == pytest.approx(t.ppf(0.975, 11) / t.ppf(0.75, 11))


def test_the_mean_field_model_has_its_exponents() -> None:
    """beta / (nu d) = 1/4 and 1 / (nu d) = 1/2 in powers of n, at T = 1. Corrections to
    scaling at these sizes are a few per cent.
    """
    rng = np.random.default_rng(1)
    warm = np.linspace(0.95, 1.05, 11)
    curves = [spins(n, warm, 12, 200, rng) for n in (256, 1024, 4096)]
    found = collapse(curves, resamples=10)
    assert found.place[0] == pytest.approx(1.0, abs=0.01)
    assert found.inverse_nu[0] == pytest.approx(0.5, abs=0.08)
    assert found.beta_nu[0] == pytest.approx(0.25, abs=0.04)


def test_what_cannot_be_collapsed_says_why() -> None:
    rng = np.random.default_rng(1)
    curves = [collapsing(n, NOISES, 6, rng) for n in COLLAPSING]
    assert collapse(curves[:2]).why == "fewer than 3 sizes"
    short = [collapsing(n, NOISES[:5], 6, rng) for n in COLLAPSING]
    assert "fewer than 6 values" in collapse(short).why
    enough = [collapsing(n, NOISES[:6], 6, rng) for n in COLLAPSING]
    assert "fewer than" not in collapse(enough, resamples=2).why
    level = [
        collapsing(n, NOISES, 6, rng, inverse_nu=0.0, beta_nu=0.0) for n in COLLAPSING
    ]
    assert collapse(level, resamples=10).why == OPEN
    equal = [collapsing(n, NOISES, 6, rng, noise=0.0) for n in COLLAPSING]
    assert collapse(equal).why == "all trials of a point have equal order"
