"""Order of a transition: coexistence of two phases, or a gradual change.

At a transition of first order, a system has two phases at one value of the control
parameter. The order parameter has two peaks, and Binder's cumulant falls below zero
(Binder and Landau 1984, Phys. Rev. B 30, 1477-1485). At a continuous transition the
cumulants of all sizes cross in one point, and the susceptibility grows with the size.
"""

from collections.abc import Sequence
from itertools import combinations
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sweep.analysis.estimate import CONFIDENCE
from sweep.analysis.simultaneous import simultaneous_confidence
from sweep.analysis.size_curves import (
    SizeCurve,
    binder_crossings,
    susceptibility_peak,
)

Floats = NDArray[np.float64]
Sign = Literal["negative", "positive", "not decided"]
Order = Literal["first order", "continuous", "not decided"]

BANDS = 12
"""Number of bands of equal width into which the range of the order is divided."""
TRIPLES = np.array([*combinations(range(BANDS), 3)])
"""All choices of a low peak, a valley and a high peak among the bands, (M, 3)."""
FEWEST_TRIALS = 6
"""Fewest trials per point for which two peaks are tested."""


class BinderMinimum(NamedTuple):
    """The smallest Binder cumulant of a system of `n` boids, at `x`, and the `sign`.

    `low` and `high` bound the confidence interval of `value`. The intervals at all
    values of the control parameter are simultaneous. The sign is negative if any
    interval is below zero, and positive if all intervals are above zero.
    """

    n: int
    x: float
    value: float
    low: float
    high: float
    sign: Sign


def binder_minimum(curve: SizeCurve, confidence: float = CONFIDENCE) -> BinderMinimum:
    """Return the smallest of Binder's cumulants of one size."""
    lows, highs = curve.binder.bounds(simultaneous_confidence(len(curve.x), confidence))
    least = int(np.argmin(curve.binder.value))
    sign: Sign = "not decided"
    if (highs < 0.0).any():
        sign = "negative"
    elif (lows > 0.0).all():
        sign = "positive"
    return BinderMinimum(
        n=curve.n,
        x=float(curve.x[least]),
        value=float(curve.binder.value[least]),
        low=float(lows[least]),
        high=float(highs[least]),
        sign=sign,
    )


class TwoPeaks(NamedTuple):
    """Test of two peaks in the order parameter of a system of `n` boids.

    `p` is the p-value of the hypothesis of one peak at every value of the control
    parameter. If the test finds two peaks, the peaks are near the orders `low` and
    `high`, at the control parameter `x`, with a valley near `valley`. Otherwise `x`,
    `low`, `valley` and `high` are NaN. `tested` is False for fewer than FEWEST_TRIALS
    trials per point.
    """

    n: int
    p: float
    tested: bool
    x: float = np.nan
    low: float = np.nan
    valley: float = np.nan
    high: float = np.nan

    def significant(self, confidence: float = CONFIDENCE) -> bool:
        """Return whether the test finds two peaks at this confidence."""
        return self.tested and self.p < 1.0 - confidence


class _Valley(NamedTuple):
    """A value of the control parameter, by index, and three bands of the order there.

    The bands contain the low peak, the valley and the high peak.
    """

    point: int
    bands: NDArray[np.int64]


def two_peaks(curve: SizeCurve, confidence: float = CONFIDENCE) -> TwoPeaks:
    """Test whether the order parameter of one size has two peaks.

    Whole trials are the units. The range of the order is divided into twelve bands of
    equal width. Half of the trials choose the value of the control parameter and the
    three bands with the largest statistic of `_statistics`. The second half tests
    whether the middle band has fewer frames than each outer band. The tests are two
    one-sided Student tests on split data (Cox 1975, Biometrika 62, 441-444). The two
    tests must both reject (Berger 1982, Technometrics 24, 295-300). The halves then
    exchange roles, and the result is twice the smaller p-value.
    """
    if min(len(samples) for samples in curve.samples) < FEWEST_TRIALS:
        return TwoPeaks(curve.n, np.nan, False)
    edges = _edges(curve)
    fractions = [_fractions(samples, edges) for samples in curve.samples]
    halves = [[trials[first::2] for trials in fractions] for first in (0, 1)]
    choices = [_choice(half) for half in halves]
    # Each choice is tested with the half of the trials that did not choose.
    p = [_test(halves[1 - number], valley) for number, valley in enumerate(choices)]
    best = int(np.argmin(p))
    both = min(1.0, 2.0 * p[best])
    peaks = TwoPeaks(curve.n, both, True)
    if not peaks.significant(confidence):
        return peaks
    centres = 0.5 * (edges[:-1] + edges[1:])
    low, valley, high = centres[choices[best].bands].tolist()
    x = float(curve.x[choices[best].point])
    return peaks._replace(x=x, low=low, valley=valley, high=high)


def _edges(curve: SizeCurve) -> Floats:
    """Return the edges of the bands, from the least to the largest order of a size."""
    least = min(float(samples.min()) for samples in curve.samples)
    most = max(float(samples.max()) for samples in curve.samples)
    return np.linspace(least, max(most, np.nextafter(least, np.inf)), BANDS + 1)


def _fractions(samples: Floats, edges: Floats) -> Floats:
    """Return the fraction of frames of each trial in each band, (k, BANDS)."""
    bands = np.clip(np.searchsorted(edges, samples, "right") - 1, 0, BANDS - 1)
    return np.stack([(bands == band).mean(axis=1) for band in range(BANDS)], axis=1)


def _statistics(fractions: Floats, triples: NDArray[np.int64]) -> Floats:
    """Return the smaller Student statistic of the two differences, peak - valley.

    The result has a value for each triple of bands (M, 3), shape (M,).
    """
    least = np.full(len(triples), np.inf)
    middle = fractions[:, triples[:, 1]]
    for peak in (0, 2):
        differences = fractions[:, triples[:, peak]] - middle
        mean = differences.mean(axis=0)
        error = differences.std(axis=0, ddof=1) / np.sqrt(len(fractions))
        ratio = np.divide(mean, error, out=np.zeros_like(mean), where=error > 0.0)
        least = np.minimum(least, ratio)
    return least


def _choice(points: Sequence[Floats]) -> _Valley:
    """Return the point and the bands with the largest statistic."""
    statistics = [_statistics(fractions, TRIPLES) for fractions in points]
    point = int(np.argmax([of_point.max() for of_point in statistics]))
    return _Valley(point, TRIPLES[int(np.argmax(statistics[point]))])


def _test(points: Sequence[Floats], valley: _Valley) -> float:
    """Return the larger p-value of the two one-sided tests of a valley.

    The valley must not come from the trials of `points`.
    """
    from scipy.stats import t

    fractions = points[valley.point]
    statistic = _statistics(fractions, valley.bands[None])[0]
    return float(t.sf(statistic, len(fractions) - 1))


class TransitionOrder(NamedTuple):
    """The order of a transition, estimated from several sizes, and the reason `why`."""

    order: Order
    why: str


def transition_order(
    curves: Sequence[SizeCurve], confidence: float = CONFIDENCE
) -> TransitionOrder:
    """Decide the order of the transition of systems of several sizes.

    Parameters
    ----------
    curves : sequence of SizeCurve
        Smallest size first.
    confidence : float, default 0.95

    Returns
    -------
    TransitionOrder
        "first order": in the largest system the order has two peaks, or the smallest
        cumulant is negative.
        "continuous": no size has two peaks, and all cumulants are significantly
        positive. Curves of cumulants cross, and the peak of the susceptibility of the
        largest system is significantly higher than the peak of the smallest.
        "not decided": otherwise.

    Notes
    -----
    If one significant test of several is enough, the tests are corrected as a family
    (Bonferroni). The families are the two tests of first order, and the crossings of
    all pairs of neighbouring sizes. Tests that must all agree need no correction
    (Berger 1982, Technometrics 24, 295-300).
    """
    each = simultaneous_confidence(2, confidence)
    peaks = [two_peaks(curve, each) for curve in curves]
    minima = [binder_minimum(curve, each) for curve in curves]
    if peaks[-1].significant(each):
        return TransitionOrder(
            "first order", "the order of the largest size has two peaks"
        )
    if minima[-1].sign == "negative":
        return TransitionOrder("first order", "Binder's cumulant falls below zero")
    lacking = []
    if any(test.significant(each) for test in peaks):
        lacking.append("the order of a smaller size has two peaks")
    if not all(test.tested for test in peaks):
        lacking.append(f"fewer than {FEWEST_TRIALS} trials per point")
    if any(minimum.sign != "positive" for minimum in minima):
        lacking.append("not all cumulants are significantly positive")
    pairs = simultaneous_confidence(len(curves) - 1, confidence)
    if not binder_crossings(curves, pairs):
        lacking.append("no cumulants cross, simultaneously for all pairs of sizes")
    smallest, largest = (
        susceptibility_peak(curve, confidence) for curve in (curves[0], curves[-1])
    )
    if not largest.height_low > smallest.height_high:
        lacking.append("the susceptibility does not grow significantly with the size")
    if lacking:
        return TransitionOrder("not decided", "; ".join(lacking))
    return TransitionOrder(
        "continuous", "cumulants cross and stay positive, and the susceptibility grows"
    )
