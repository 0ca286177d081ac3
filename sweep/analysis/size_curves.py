"""Crossings of Binder's cumulants and peaks of the susceptibility, for several sizes.

An order parameter m is recorded in k independent trials at each value x of a control
parameter. Whole trials are the unit of all errors: an estimate at x is a mean over
trials, with one value per trial. If an estimate is not a mean, the values are the
jackknife's pseudo-values (`sweep.analysis.order`).

The confidence interval of a crossing or a peak is an inverted test (Fieller 1954, J. R.
Stat. Soc. B 16, 175-185). The interval contains the values of x at which a difference,
or a slope, is not significantly different from zero. No result is returned if the data
leave the interval unbounded.
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
"""Number of tests between two values of the control parameter."""
NEAR_THE_PEAK = 0.6
"""Fraction of the largest susceptibility from which a point belongs to the peak."""
MOST_DEGREE = 4
"""Largest degree of the polynomial through a peak."""
FITS = 0.1
"""Smallest p-value of a polynomial that fits."""
AT_AN_END = "the largest value is at an end of the axis"
FLAT = "no peak differs significantly from a constant"


class Means(NamedTuple):
    """Means at P values of the control parameter, (P,) each.

    `error` are the standard errors, and `freedom` the degrees of freedom of the errors.
    """

    value: Floats
    error: Floats
    freedom: Floats

    def bounds(self, confidence: float = CONFIDENCE) -> tuple[Floats, Floats]:
        """Return Student's confidence interval of each mean, (P,) each."""
        half = _quantile(confidence, self.freedom) * self.error
        return self.value - half, self.value + half

    def sides(self, confidence: float) -> NDArray[np.int64]:
        """Return the significant sign of each mean, (P,).

        The sign is -1 for an interval below zero, 1 for an interval above zero, and 0
        for an interval that includes zero.
        """
        low, high = self.bounds(confidence)
        return np.where(low > 0.0, 1, np.where(high < 0.0, -1, 0))

    def at(self, places: NDArray[np.int64]) -> "Means":
        """Return the means at some indices."""
        return Means(*(column[places] for column in self))

    def minus(self, other: "Means") -> "Means":
        """Return differences of independent means, with Welch's degrees of freedom."""
        return _combined(self, 1.0, other, -1.0)

    def between(self, x: Floats, places: Floats) -> "Means":
        """Interpolate the means linearly.

        Parameters
        ----------
        x : array
            Values of the control parameter of the means, (P,), ascending.
        places : array
            Values of the control parameter at which to interpolate, (Q,).

        Returns
        -------
        Means
            (Q,) each.
        """
        after = np.clip(np.searchsorted(x, places), 1, len(x) - 1)
        fraction = (places - x[after - 1]) / (x[after] - x[after - 1])
        return _combined(self.at(after - 1), 1.0 - fraction, self.at(after), fraction)


def _quantile(confidence: float, freedom: ArrayLike) -> Floats:
    """Return Student's quantile of a two-sided interval, per degrees of freedom.

    The degrees of freedom may be infinite.
    """
    from scipy.stats import t

    return np.asarray(t.ppf(0.5 + confidence / 2, freedom), np.float64)


def _combined(first: Means, a: ArrayLike, second: Means, b: ArrayLike) -> Means:
    """Return a `first` + b `second` of independent means."""
    a, b = np.asarray(a), np.asarray(b)
    first_variance = (a * first.error) ** 2
    second_variance = (b * second.error) ** 2
    variance = first_variance + second_variance
    parts = first_variance**2 / first.freedom + second_variance**2 / second.freedom
    freedom = np.divide(
        variance**2, parts, out=np.full(variance.shape, np.inf), where=parts > 0.0
    )
    return Means(a * first.value + b * second.value, np.sqrt(variance), freedom)


@dataclass(frozen=True, eq=False)
class SizeCurve:
    """Samples of the order parameter m of one system size against a control parameter.

    Attributes
    ----------
    n : int
        Number of boids.
    length : float
        Linear length of the system.
    x : array
        Values of the control parameter, (P,), ascending.
    samples : tuple of array
        P arrays (k, T): T frames of k trials, k at least 2.
    """

    n: int
    length: float
    x: Floats
    samples: tuple[Floats, ...]

    @cached_property
    def order(self) -> Means:
        """The mean of m."""
        return _means([samples.mean(axis=1) for samples in self.samples])

    @cached_property
    def susceptibility(self) -> Means:
        """The susceptibility, n (<m^2> - <m>^2)."""
        return _means(
            [susceptibility_values(samples, self.n) for samples in self.samples]
        )

    @cached_property
    def binder(self) -> Means:
        """Binder's cumulant, 1 - <m^4>/(3 <m^2>^2)."""
        return _means([binder_values(samples) for samples in self.samples])


def _means(values: Sequence[Floats]) -> Means:
    """Return the mean over trials at each point, from values (k,) of k trials."""
    counts = np.array([len(of_point) for of_point in values], np.float64)
    errors = [of_point.std(ddof=1) / np.sqrt(len(of_point)) for of_point in values]
    return Means(
        value=np.array([of_point.mean() for of_point in values]),
        error=np.array(errors),
        freedom=counts - 1.0,
    )


class BinderCrossing(NamedTuple):
    """A crossing of Binder's cumulants of two sizes.

    Attributes
    ----------
    n, other_n : int
        Numbers of boids.
    x, low, high : float
        Control parameter of the crossing, and the bounds of its confidence interval.
    value, value_low, value_high : float
        Cumulant at the crossing. The interval covers the mean of the two curves at any
        x from `low` to `high`.
    rises : bool
        True if the larger system has the larger cumulant beyond the crossing.
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
    """Return the crossings of Binder's cumulants of neighbouring sizes.

    Binder (1981, Z. Phys. B 43, 119-140). A crossing is between two values of the
    control parameter, common to the two sizes. The difference is significant at these
    values, with opposite signs. The confidence intervals of all differences of a pair
    are simultaneous. The interval of the crossing contains all x between the two values
    at which the difference is not significant. Differences between points are
    interpolated linearly, so the grid must be fine enough. Curves that only merge do
    not cross. The list is in the order of the sizes.
    """
    pairs = pairwise(sorted(curves, key=lambda curve: curve.n))
    return [crossing for pair in pairs for crossing in _crossings(*pair, confidence)]


def _crossings(
    small: SizeCurve, large: SizeCurve, confidence: float
) -> list[BinderCrossing]:
    x, first, second = np.intersect1d(small.x, large.x, return_indices=True)
    if len(x) < 2:
        return []
    smaller = small.binder.at(first)
    larger = large.binder.at(second)
    difference = larger.minus(smaller)
    sides = difference.sides(simultaneous_confidence(len(x), confidence))
    nonzero = np.flatnonzero(sides)
    crossings = []
    for left, right in pairwise(nonzero.tolist()):
        if sides[left] == sides[right]:
            continue
        part = slice(left, right + 1)
        between = difference.at(np.arange(left, right + 1))
        zero = _zero(x[part], between, confidence)
        places = np.linspace(*zero[1:], BETWEEN + 1)
        values = _pooled(smaller.between(x, places), larger.between(x, places))
        lows, highs = values.bounds(confidence)
        crossings.append(
            BinderCrossing(
                n=small.n,
                other_n=large.n,
                x=zero[0],
                low=zero[1],
                high=zero[2],
                value=float(np.interp(zero[0], places, values.value)),
                value_low=float(lows.min()),
                value_high=float(highs.max()),
                rises=bool(sides[right] > 0),
            )
        )
    return crossings


def _pooled(first: Means, second: Means) -> Means:
    """Return the mean of two estimates of one value, weighted by inverse variances."""
    first_variance = first.error**2
    second_variance = second.error**2
    both = first_variance + second_variance
    weight = np.divide(
        second_variance, both, out=np.full(both.shape, 0.5), where=both > 0.0
    )
    return _combined(first, weight, second, 1.0 - weight)


def _zero(
    x: Floats, difference: Means, confidence: float
) -> tuple[float, float, float]:
    """Return the zero of a difference, and the bounds of its confidence interval.

    The sign of the difference changes between the first and the last of the values `x`.
    If the sign changes several times, the result is the zero of the straight line that
    fits the differences best.
    """
    places = np.unique(
        np.concatenate([np.linspace(*ends, BETWEEN + 1) for ends in pairwise(x)])
    )
    low, high = difference.between(x, places).bounds(confidence)
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
    """The peak of the susceptibility of a system of `n` boids.

    The susceptibility is largest at the control parameter `x`, with a confidence
    interval from `low` to `high`. The `height` at `x` has a confidence interval from
    `height_low` to `height_high`. All numbers are NaN if there is no peak, and `why` is
    the reason.
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
    """Return the peak of a polynomial through the logarithms of the susceptibility.

    The polynomial is fitted to the points around the largest value that have at least
    60 % of the largest value. While the fit is rejected, points at the ends are left
    out. The polynomial is of fourth degree, because peaks are not symmetric; fewer than
    five points are interpolated. All points have equal weight, by the mean square of
    the relative errors, because errors from few trials correlate with the values. The
    confidence interval of `x` contains the values at which the slope is not
    significant. There is no peak if this interval is unbounded, or if the largest value
    is at an end of the axis.
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
    steep = np.flatnonzero(np.abs(slopes) > quantile * errors)
    before = steep[steep < best]
    after = steep[steep > best]
    if not (len(before) and len(after)):
        return _no_peak(curve, FLAT)
    level, error = (float(column[best]) for column in fit.at(places))
    heights = np.exp(level + quantile * error * np.array([0.0, -1.0, 1.0]))
    height, height_low, height_high = heights.tolist()
    return SusceptibilityPeak(
        n=curve.n,
        x=float(curve.x[top] + places[best]),
        low=float(curve.x[top] + places[int(before[-1]) + 1]),
        high=float(curve.x[top] + places[int(after[0]) - 1]),
        height=height,
        height_low=height_low,
        height_high=height_high,
    )


def _no_peak(curve: SizeCurve, why: str) -> SusceptibilityPeak:
    return SusceptibilityPeak(
        n=curve.n,
        x=np.nan,
        low=np.nan,
        high=np.nan,
        height=np.nan,
        height_low=np.nan,
        height_high=np.nan,
        why=why,
    )


def _about(values: Floats, top: int) -> NDArray[np.int64]:
    """Return the indices around `top` with at least NEAR_THE_PEAK of the top value.

    The indices are consecutive, and always include the neighbours of `top`.
    """
    low = np.flatnonzero(values < NEAR_THE_PEAK * values[top])
    first = int(low[low < top].max(initial=-1)) + 1
    last = int(low[low > top].min(initial=len(values))) - 1
    return np.arange(min(first, top - 1), max(last, top + 1) + 1)


class _Polynomial(NamedTuple):
    """A polynomial that fits logarithms at `x`.

    The coefficients are in ascending order of powers. `freedom` is the number of
    degrees of freedom of the errors.
    """

    x: Floats
    coefficients: Floats
    covariance: Floats
    freedom: float

    def at(self, places: Floats, *, derivative: bool = False) -> tuple[Floats, Floats]:
        """Return the values of the polynomial and their standard errors.

        Parameters
        ----------
        places : array
            Positions at which to evaluate the polynomial, (Q,).
        derivative : bool, default False
            Return slopes and their errors instead.

        Returns
        -------
        values, errors : array
            (Q,) each.
        """
        powers = np.arange(len(self.coefficients))
        rows = places[:, None] ** powers
        if derivative:
            rows = np.where(powers, powers * places[:, None] ** np.abs(powers - 1), 0.0)
        variances = np.einsum("ij,jk,ik->i", rows, self.covariance, rows)
        return rows @ self.coefficients, np.sqrt(np.maximum(variances, 0.0))


def _fitted(x: Floats, points: Means) -> _Polynomial:
    """Return the polynomial through the logarithms of `points`.

    While the fit is rejected, the end with the lower value is left out.
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
        inner = slice(1, None) if logs[0] < logs[-1] else slice(None, -1)
        return _fitted(x[inner], Means(*(column[inner] for column in points)))
    return _Polynomial(x, coefficients, covariance, float(points.freedom.sum()))
