"""Curves of systems of several sizes against a control parameter: where Binder's
cumulants cross, and where the susceptibility peaks.

An order parameter m is recorded in k independent trials at each value x of a control
parameter. Whole trials are the unit of all errors: what is estimated at x is a mean of
one value for each trial, of the jackknife's pseudo-values where it is no mean itself
(`sweep.analysis.order`).

A place is found by turning a test round (Fieller 1954, J. R. Stat. Soc. B 16, 175-185):
its interval has the places at which a difference, or a slope, is not told from zero.
So it is as wide as the data leave it, and none is given where they leave it open.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sweep.analysis.estimate import CONFIDENCE
from sweep.analysis.order import binder_values, susceptibility_values
from sweep.analysis.simultaneous import simultaneous_confidence

Floats = NDArray[np.float64]

BETWEEN = 200
"""Places between two values of the control parameter at which a test is made."""
NEAR_THE_PEAK = 0.6
"""Points whose susceptibility is at least this share of the largest make the peak."""
MOST_DEGREE, FITS = 4, 0.1
AT_AN_END = "it is largest at an end of the axis"
FLAT = "no peak is told from a level curve"


class Means(NamedTuple):
    """Means at P values of the control parameter, their standard errors, and the
    degrees of freedom of these, (P,) each.
    """

    value: Floats
    error: Floats
    freedom: Floats

    def bounds(self, confidence: float = CONFIDENCE) -> tuple[Floats, Floats]:
        """Student's interval of each, (P,) each."""
        half = _quantile(confidence, self.freedom) * self.error
        return self.value - half, self.value + half

    def sides(self, confidence: float) -> NDArray[np.int64]:
        """-1 below zero, 1 above, 0 where the interval includes it; (P,)."""
        low, high = self.bounds(confidence)
        return np.where(low > 0.0, 1, np.where(high < 0.0, -1, 0))

    def at(self, places: NDArray[np.int64]) -> "Means":
        """Those at some of the values."""
        return Means(*(one[places] for one in self))

    def minus(self, other: "Means") -> "Means":
        """The differences of independent means, with Welch's degrees of freedom."""
        return _combined(self, 1.0, other, -1.0)

    def between(self, x: Floats, places: Floats) -> "Means":
        """Those on the straight lines between the means at `x` (P,), at `places`."""
        after = np.clip(np.searchsorted(x, places), 1, len(x) - 1)
        share = (places - x[after - 1]) / (x[after] - x[after - 1])
        return _combined(self.at(after - 1), 1.0 - share, self.at(after), share)


def _quantile(confidence: float, freedom: ArrayLike) -> Floats:
    """Student's quantile of a two-sided interval, for each of some degrees of freedom,
    which may be infinite.
    """
    from scipy.stats import t

    return np.asarray(t.ppf(0.5 + confidence / 2, freedom), np.float64)


def _combined(one: Means, a: ArrayLike, other: Means, b: ArrayLike) -> Means:
    """a times one and b times the other, which are independent."""
    a, b = np.asarray(a), np.asarray(b)
    first, second = (a * one.error) ** 2, (b * other.error) ** 2
    variance = first + second
    parts = first**2 / one.freedom + second**2 / other.freedom
    freedom = np.divide(
        variance**2, parts, out=np.full(variance.shape, np.inf), where=parts > 0.0
    )
    return Means(a * one.value + b * other.value, np.sqrt(variance), freedom)


@dataclass(frozen=True, eq=False)
class SizeCurve:
    """A system of `n` boids and of this linear `length`: at each of the ascending
    values `x` (P,) of the control parameter the `samples` (k, T) of the order parameter
    of k trials, k at least 2.
    """

    n: int
    length: float
    x: Floats
    samples: tuple[Floats, ...]

    @cached_property
    def order(self) -> Means:
        """The mean of m."""
        return _means([one.mean(axis=1) for one in self.samples])

    @cached_property
    def susceptibility(self) -> Means:
        """n (<m^2> - <m>^2)."""
        return _means([susceptibility_values(one, self.n) for one in self.samples])

    @cached_property
    def binder(self) -> Means:
        """1 - <m^4>/(3 <m^2>^2)."""
        return _means([binder_values(one) for one in self.samples])


def _means(values: Sequence[Floats]) -> Means:
    """The mean of the values (k,) of each point, one value for each trial."""
    counts = np.array([len(one) for one in values], np.float64)
    errors = [one.std(ddof=1) / np.sqrt(len(one)) for one in values]
    return Means(
        np.array([one.mean() for one in values]), np.array(errors), counts - 1.0
    )


class BinderCrossing(NamedTuple):
    """The curves of Binder's cumulant of `n` and of `other_n` boids cross at `x`, which
    lies within `low` and `high`, and have the `value` there. The interval of this has
    what the means of both leave open at any place of the other interval.

    Beyond it the larger system has the larger cumulant if it `rises`.
    """

    n: int
    other_n: int
    x: float
    low: float
    high: float
    value: float
    value_low: float
    value_high: float
    rises: bool


def binder_crossings(
    curves: Sequence[SizeCurve], confidence: float = CONFIDENCE
) -> list[BinderCrossing]:
    """Where the curves of neighbouring sizes cross (Binder 1981, Z. Phys. B 43,
    119-140), in the order of the sizes.

    A crossing lies between values of the control parameter, both sizes having the same,
    at which surely the one, and surely the other curve is higher: the intervals of all
    differences of a pair hold together. Its interval has all places between these two
    at which the difference, on straight lines between the points, is not told from
    zero. So the grid must be as fine as the curves are straight. Curves that only merge
    do not cross.
    """
    pairs = pairwise(sorted(curves, key=lambda one: one.n))
    return [one for pair in pairs for one in _crossings(*pair, confidence)]


def _crossings(
    small: SizeCurve, large: SizeCurve, confidence: float
) -> list[BinderCrossing]:
    x, first, second = np.intersect1d(small.x, large.x, return_indices=True)
    if len(x) < 2:
        return []
    one, other = small.binder.at(first), large.binder.at(second)
    difference = other.minus(one)
    sides = difference.sides(simultaneous_confidence(len(x), confidence))
    known = np.flatnonzero(sides)
    found = []
    for left, right in pairwise(known.tolist()):
        if sides[left] == sides[right]:
            continue
        part = slice(left, right + 1)
        between = difference.at(np.arange(left, right + 1))
        zero = _zero(x[part], between, confidence)
        places = np.linspace(*zero[1:], BETWEEN + 1)
        values = _pooled(one.between(x, places), other.between(x, places))
        lows, highs = values.bounds(confidence)
        middle = float(np.interp(zero[0], places, values.value))
        value = (middle, float(lows.min()), float(highs.max()))
        rises = bool(sides[right] > 0)
        found.append(BinderCrossing(small.n, large.n, *zero, *value, rises))
    return found


def _pooled(one: Means, other: Means) -> Means:
    """The mean of two that are the same, weighted by their variances."""
    first, second = one.error**2, other.error**2
    both = first + second
    share = np.divide(second, both, out=np.full(both.shape, 0.5), where=both > 0.0)
    return _combined(one, share, other, 1.0 - share)


def _zero(
    x: Floats, difference: Means, confidence: float
) -> tuple[float, float, float]:
    """Where a difference whose sign changes between the first and the last of the
    values `x` is zero, and the bounds of the interval of that place.

    Of several zeros it is that of the straight line which fits the differences best.
    """
    places = np.unique(
        np.concatenate([np.linspace(*ends, BETWEEN + 1) for ends in pairwise(x)])
    )
    there = difference.between(x, places)
    low, high = there.bounds(confidence)
    open_ = places[(low <= 0.0) & (high >= 0.0)]
    changes = np.flatnonzero(np.diff(np.sign(difference.value)))
    if len(changes) == 1:
        (before,) = changes.tolist()
        y = difference.value[before : before + 2]
        place = x[before] - y[0] * (x[before + 1] - x[before]) / (y[1] - y[0])
    else:
        errors = np.maximum(difference.error, np.finfo(float).tiny)
        slope, level = np.polyfit(x, difference.value, 1, w=1.0 / errors)
        place = np.clip(-level / slope, x[0], x[-1])
    ends = (open_[0], open_[-1]) if len(open_) else (place, place)
    return float(place), float(min(ends[0], place)), float(max(ends[1], place))


class SusceptibilityPeak(NamedTuple):
    """The susceptibility of `n` boids is largest at `x`, and `height` there, each with
    its interval. All are NaN where there is no peak: `why` says so in words.
    """

    n: int
    x: float
    low: float
    high: float
    height: float
    height_low: float
    height_high: float
    why: str = ""


def susceptibility_peak(
    curve: SizeCurve, confidence: float = CONFIDENCE
) -> SusceptibilityPeak:
    """The largest value of a polynomial through the logarithms of the susceptibility at
    the points about the largest one.

    These are as many as the polynomial fits, from those that have at least 60 % of the
    largest value. It is of fourth degree, as peaks are not symmetric, or goes through
    all points where these are fewer than five. All count alike, with the mean square of
    their relative errors: those of few trials go with the values themselves. The
    interval of the place has those at which the slope is not told from zero. There is
    no peak where this leaves the place open, or the largest value stands at an end of
    the axis.
    """
    chi = curve.susceptibility
    top = int(np.argmax(chi.value))
    if top in (0, len(curve.x) - 1):
        return _no_peak(curve, AT_AN_END)
    near = _about(chi.value, top)
    points = chi.at(near)
    if (points.error <= 0.0).any() or (points.value <= 0.0).any():
        return _no_peak(curve, FLAT)
    fit = _fitted(curve.x[near] - curve.x[top], points)
    quantile = float(_quantile(confidence, fit.freedom))
    places = np.linspace(fit.x[0], fit.x[-1], BETWEEN * (len(fit.x) - 1) + 1)
    logs, _ = fit.at(places)
    best = int(np.argmax(logs))
    slopes, errors = fit.at(places, derivative=True)
    told = np.flatnonzero(np.abs(slopes) > quantile * errors)
    before, after = told[told < best], told[told > best]
    if not (len(before) and len(after)):
        return _no_peak(curve, FLAT)
    ends = [best, int(before[-1]) + 1, int(after[0]) - 1]
    level, error = (float(one[best]) for one in fit.at(places))
    heights = np.exp(level + quantile * error * np.array([0.0, -1.0, 1.0]))
    place, low, high = (float(curve.x[top] + places[end]) for end in ends)
    height, least, most = heights.tolist()
    return SusceptibilityPeak(curve.n, place, low, high, height, least, most)


def _no_peak(curve: SizeCurve, why: str) -> SusceptibilityPeak:
    return SusceptibilityPeak(
        curve.n, np.nan, np.nan, np.nan, np.nan, np.nan, np.nan, why
    )


def _about(values: Floats, top: int) -> NDArray[np.int64]:
    """The places about `top` that have at least a share of its value, without a gap,
    and its neighbours in any case.
    """
    low = np.flatnonzero(values < NEAR_THE_PEAK * values[top])
    first = int(low[low < top].max(initial=-1)) + 1
    last = int(low[low > top].min(initial=len(values))) - 1
    return np.arange(min(first, top - 1), max(last, top + 1) + 1)


class _Polynomial(NamedTuple):
    """A polynomial that fits logarithms at `x`: its coefficients, the lowest first,
    their covariance, and the degrees of freedom of the errors.
    """

    x: Floats
    coefficients: Floats
    covariance: Floats
    freedom: float

    def at(self, places: Floats, *, derivative: bool = False) -> tuple[Floats, Floats]:
        """Its values, or its slopes, and their standard errors."""
        powers = np.arange(len(self.coefficients))
        rows = places[:, None] ** powers
        if derivative:
            rows = np.where(powers, powers * places[:, None] ** np.abs(powers - 1), 0.0)
        variances = np.einsum("ij,jk,ik->i", rows, self.covariance, rows)
        return rows @ self.coefficients, np.sqrt(np.maximum(variances, 0.0))


def _fitted(x: Floats, points: Means) -> _Polynomial:
    """The polynomial through the logarithms of `points`. While it does not fit, the
    lower one of both ends is left out.
    """
    from scipy.stats import chi2

    degree = min(MOST_DEGREE, len(x) - 1)
    logs = np.log(points.value)
    error = float(np.sqrt(np.mean((points.error / points.value) ** 2)))
    weighted = x[:, None] ** np.arange(degree + 1) / error
    covariance = np.asarray(np.linalg.pinv(weighted.T @ weighted), np.float64)
    coefficients = np.asarray(covariance @ weighted.T @ (logs / error), np.float64)
    squares = float(((logs / error - weighted @ coefficients) ** 2).sum())
    spare = len(x) - degree - 1
    if spare and chi2.sf(squares, spare) < FITS:
        kept = slice(1, None) if logs[0] < logs[-1] else slice(None, -1)
        return _fitted(x[kept], Means(*(one[kept] for one in points)))
    return _Polynomial(x, coefficients, covariance, float(points.freedom.sum()))
