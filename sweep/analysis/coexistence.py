"""Whether a transition jumps: two phases that coexist, or one that changes gradually.

At a transition of first order, systems hold both phases at one value of the control
parameter: the order has two peaks, and Binder's cumulant falls below zero (Binder and
Landau 1984, Phys. Rev. B 30, 1477-1485). At a continuous one the cumulants of all sizes
cross in one point, and the susceptibility grows with the size.
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
TRIPLES = np.array([*combinations(range(BANDS), 3)])
FEWEST_TRIALS = 6


class BinderMinimum(NamedTuple):
    """The smallest cumulant of `n` boids, at `x`, with its interval, and its `sign`.

    The intervals of all values of the control parameter hold together: it is negative
    where that of the smallest lies below zero, and positive where all lie above.
    """

    n: int
    x: float
    value: float
    low: float
    high: float
    sign: Sign


def binder_minimum(curve: SizeCurve, confidence: float = CONFIDENCE) -> BinderMinimum:
    """The smallest of Binder's cumulants of one size."""
    lows, highs = curve.binder.bounds(simultaneous_confidence(len(curve.x), confidence))
    least = int(np.argmin(curve.binder.value))
    sign: Sign = "not decided"
    if (highs < 0.0).any():
        sign = "negative"
    elif (lows > 0.0).all():
        sign = "positive"
    value = float(curve.binder.value[least])
    bounds = float(lows[least]), float(highs[least])
    return BinderMinimum(curve.n, float(curve.x[least]), value, *bounds, sign)


class TwoPeaks(NamedTuple):
    """Whether the order of `n` boids has two peaks at some value of the control
    parameter, and p, the chance of such data if it has one at all of them.

    Where they are told, `x` is that value, and the peaks lie about the orders `low` and
    `high`, with a valley about `valley`; else NaN. `tested` is false for fewer than six
    trials a point.
    """

    n: int
    p: float
    tested: bool
    x: float = np.nan
    low: float = np.nan
    valley: float = np.nan
    high: float = np.nan

    def told(self, confidence: float = CONFIDENCE) -> bool:
        """Whether there surely are two peaks."""
        return self.tested and self.p < 1.0 - confidence


class _Valley(NamedTuple):
    """A value of the control parameter, and three bands of the order at it."""

    point: int
    bands: NDArray[np.int64]


def two_peaks(curve: SizeCurve, confidence: float = CONFIDENCE) -> TwoPeaks:
    """A test of two peaks that takes whole trials as its units.

    The range of the order is parted into twelve bands of one width. One half of the
    trials chooses where to look: the value of the control parameter and the three bands
    of which the middle one is the most surely held for less time than either other. The
    other half says by two one-sided Student tests whether it is (Cox 1975, Biometrika
    62, 441-444, of data that are split; both tests must reject: Berger 1982,
    Technometrics 24, 295-300). Both halves do both; p is twice the smaller one.
    """
    if min(len(one) for one in curve.samples) < FEWEST_TRIALS:
        return TwoPeaks(curve.n, np.nan, False)
    edges = _edges(curve)
    shares = [_shares(samples, edges) for samples in curve.samples]
    halves = [[one[first::2] for one in shares] for first in (0, 1)]
    chosen = [_choice(half) for half in halves]
    p = [_test(halves[1 - number], one) for number, one in enumerate(chosen)]
    best = int(np.argmin(p))
    both = min(1.0, 2.0 * p[best])
    found = TwoPeaks(curve.n, both, True)
    if not found.told(confidence):
        return found
    centres = 0.5 * (edges[:-1] + edges[1:])
    low, valley, high = centres[chosen[best].bands].tolist()
    x = float(curve.x[chosen[best].point])
    return found._replace(x=x, low=low, valley=valley, high=high)


def _edges(curve: SizeCurve) -> Floats:
    """The edges of the bands, from the least to the largest order of this size."""
    least = min(float(one.min()) for one in curve.samples)
    most = max(float(one.max()) for one in curve.samples)
    return np.linspace(least, max(most, np.nextafter(least, np.inf)), BANDS + 1)


def _shares(samples: Floats, edges: Floats) -> Floats:
    """The share of frames of each trial in each band, (k, BANDS)."""
    bands = np.clip(np.searchsorted(edges, samples, "right") - 1, 0, BANDS - 1)
    return np.stack([(bands == band).mean(axis=1) for band in range(BANDS)], axis=1)


def _statistics(shares: Floats, triples: NDArray[np.int64]) -> Floats:
    """The smaller Student statistic of both differences between a peak and the valley,
    for each of the triples of bands (M, 3).
    """
    least = np.full(len(triples), np.inf)
    middle = shares[:, triples[:, 1]]
    for peak in (0, 2):
        apart = shares[:, triples[:, peak]] - middle
        mean = apart.mean(axis=0)
        error = apart.std(axis=0, ddof=1) / np.sqrt(len(shares))
        ratio = np.divide(mean, error, out=np.zeros_like(mean), where=error > 0.0)
        least = np.minimum(least, ratio)
    return least


def _choice(points: Sequence[Floats]) -> _Valley:
    """The point and the bands with the largest statistic."""
    found = [_statistics(one, TRIPLES) for one in points]
    point = int(np.argmax([one.max() for one in found]))
    return _Valley(point, TRIPLES[int(np.argmax(found[point]))])


def _test(points: Sequence[Floats], chosen: _Valley) -> float:
    """The larger p of both one-sided tests, for what others have chosen."""
    from scipy.stats import t

    shares = points[chosen.point]
    statistic = _statistics(shares, chosen.bands[None])[0]
    return float(t.sf(statistic, len(shares) - 1))


class TransitionOrder(NamedTuple):
    """Of which order a transition is as far as these sizes tell, and why in words."""

    order: Order
    why: str


def transition_order(
    curves: Sequence[SizeCurve], confidence: float = CONFIDENCE
) -> TransitionOrder:
    """The order of the transition of systems of several sizes, smallest first.

    first order   in the largest system the order has two peaks, or the smallest
                  cumulant is negative
    continuous    neither in any size, all cumulants surely positive; curves of
                  cumulants cross; and the peak of the susceptibility of the largest
                  system is surely higher than that of the smallest
    not decided   otherwise

    Where one of several tests is enough, they are a family (Bonferroni): the two of
    first order, and the crossings of all pairs of neighbouring sizes. Tests all of
    which must agree need no correction (Berger 1982, Technometrics 24, 295-300).
    """
    each = simultaneous_confidence(2, confidence)
    peaks = [two_peaks(one, each) for one in curves]
    minima = [binder_minimum(one, each) for one in curves]
    if peaks[-1].told(each):
        return TransitionOrder("first order", "the order of the largest has two peaks")
    if minima[-1].sign == "negative":
        return TransitionOrder("first order", "Binder's cumulant falls below zero")
    lacking = []
    if any(one.told(each) for one in peaks):
        lacking.append("the order of a smaller size has two peaks")
    if not all(one.tested for one in peaks):
        lacking.append(f"fewer than {FEWEST_TRIALS} trials a point")
    if any(one.sign != "positive" for one in minima):
        lacking.append("not all cumulants are surely positive")
    pairs = simultaneous_confidence(len(curves) - 1, confidence)
    if not binder_crossings(curves, pairs):
        lacking.append("no cumulants cross, all pairs of sizes together")
    smallest, largest = (
        susceptibility_peak(one, confidence) for one in (curves[0], curves[-1])
    )
    if not largest.height_low > smallest.height_high:
        lacking.append("the susceptibility does not surely grow with the size")
    if lacking:
        return TransitionOrder("not decided", "; ".join(lacking))
    return TransitionOrder(
        "continuous", "cumulants cross and stay positive, and the susceptibility grows"
    )
