"""Confidence bounds of a mean, for each distribution of values over trials.

A metric declares a distribution and a range of values (`kernels.metrics.Metric`). All
reported means have bounds from this module. BOUNDS has a function per distribution,
which takes the moments of k samples at once. A mean is within the range of the values,
so intervals are cut off at the ends of the range (`Support.cut`). The cut does not
change the coverage.

Coverage in per cent of 95 % intervals, for 3, 10, 40 and 200 values. The complete
table, and the coverage of Student's intervals, are in
`docs/decisions/intervals-of-few-values.md`:

    normal                                      95   95   95   95

    skewed: lognormal with sigma 0.5            96   95   96   96
            lognormal with sigma 1              93   93   94   95
            exponential                         96   96   96   96
            normal                              97   96   96   95

    count:  Poisson, mean 0.3                   99   93   97   95
            Poisson, mean 3                     99   98   96   95

            clustered, mean 5, variance 88      90   94   95   96
            clustered, mean 1, variance 3       80   93   95   95

    0 to 1: 0 or 1 with chance 0.01             97  100   99   98
            0 or 1 with chance 0.3              97   96   94   95

            beta 0.9, a tenth of that variance  95   96   95   95
            beta 0.9, half of that variance     69   90   97   96

Intervals cover less than 93 % if a sample cannot show the whole distribution:

- the long tail of ten lognormal values (92.6 %);
- the variance of 3 to 10 clustered counts;
- the variance of 3 to 10 proportions near an end, which are often all equal;
- 40 values of noise in two regimes, a common and a rare regime (87 %).

Intervals cover more than 97 % for 3 values of most distributions, for counts that vary
less than Poisson's, and if few means are possible, as for rare and few events. Two to
five values are too few to show a longer tail: the coverage is 86 % for four lognormal
values with sigma 1.5 (FEW).

If all values but at most one are equal, a sample does not show how much values vary.
Events have an interval with a positive width nevertheless. Normal and skewed values
have an interval from the range of the metric, or NaN if the range lacks an end. If more
than half of the values are equal, the values are treated as skewed. So the intervals of
lognormal values with 80 to 97 % zeros cover 96 to 100 %, if there is an interval.
Student's intervals cover 8 to 94 %.
"""

import math
from collections.abc import Callable, Mapping
from functools import partial
from types import MappingProxyType
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Bounds = tuple[Floats, Floats]
Distribution = Literal["normal", "skewed", "count", "proportion", "percentage"]

ROUNDING = 1e-9
"""Relative difference up to which numbers differ by rounding alone."""


class Support(NamedTuple):
    """The smallest and the largest possible value.

    Attributes
    ----------
    low, high : float
        Ends of the range, in the unit of the values; infinite without an end.
    """

    low: float = -math.inf
    high: float = math.inf

    @property
    def words(self) -> str:
        """The range as a string, such as `0 to 1`; "any" without an end.

        >>> Support(0.0, 1.0).words, Support(low=1.0).words, Support(high=2.0).words
        ('0 to 1', 'from 1', 'up to 2')
        """
        if math.isinf(self.low) and math.isinf(self.high):
            return "any"
        if math.isinf(self.high):
            return f"from {self.low:g}"
        if math.isinf(self.low):
            return f"up to {self.high:g}"
        return f"{self.low:g} to {self.high:g}"

    @property
    def of_differences(self) -> "Support":
        """The support of X - Y for X and Y in this support."""
        return Support(self.low - self.high, self.high - self.low)

    def within(self, other: "Support") -> "Support":
        """Return the intersection of two supports."""
        return Support(max(self.low, other.low), min(self.high, other.high))

    def holds(
        self, least: Floats | float, largest: Floats | float
    ) -> NDArray[np.bool_]:
        """Return whether samples are in the support, except for rounding.

        A sample outside the support means that the declaration of the metric is wrong.

        Parameters
        ----------
        least, largest : float or array
            Extremes of the samples, (k,) each.

        Returns
        -------
        array of bool
            (k,).
        """
        slack = ROUNDING * np.fmax(np.abs(least), np.abs(largest))
        return np.asarray((least >= self.low - slack) & (largest <= self.high + slack))

    def cut(self, value: ArrayLike, low: ArrayLike, high: ArrayLike) -> Bounds:
        """Cut confidence intervals off at the ends of the support.

        An interval always includes the estimate, which may be outside the support by a
        rounding error.

        Parameters
        ----------
        value, low, high : array_like
            Estimates and the bounds of the intervals, (k,) or one number each.

        Returns
        -------
        low, high : array
        """
        return (
            np.maximum(low, np.minimum(self.low, value)),
            np.minimum(high, np.maximum(self.high, value)),
        )


ANYWHERE = Support()
SUPPORTS: Mapping[Distribution, Support] = MappingProxyType(
    {
        "count": Support(low=0.0),
        "proportion": Support(0.0, 1.0),
        "percentage": Support(0.0, 100.0),
    }
)
"""Support of a distribution, for any metric; other distributions are ANYWHERE."""


class Declaration(NamedTuple):
    """The declared distribution and support of the values over trials.

    Attributes
    ----------
    distribution : {"normal", "skewed", "count", "proportion", "percentage"}
        Distribution of the values; "normal" by default.
    support : Support
        Range of the values; without ends by default.
    """

    distribution: Distribution = "normal"
    support: Support = ANYWHERE

    @classmethod
    def of(cls, distribution: Distribution, low: float, high: float) -> "Declaration":
        """Declare values of a distribution in a range.

        Parameters
        ----------
        distribution : Distribution
        low, high : float
            Range, which is cut off at the ends of the support of the distribution.

        Returns
        -------
        Declaration

        Examples
        --------
        >>> Declaration.of("skewed", 0.0, math.inf).support
        Support(low=0.0, high=inf)
        """
        always = SUPPORTS.get(distribution, ANYWHERE)
        return cls(distribution, always.within(Support(low, high)))

    @property
    def of_differences(self) -> "Declaration":
        """The declaration of the differences of two declared values."""
        return self._replace(support=self.support.of_differences)


Declared = Distribution | Declaration
"""A declaration, or the name of a distribution alone, without a range."""


def in_full(declared: Declared) -> Declaration:
    """Return a declaration with distribution and support."""
    if isinstance(declared, Declaration):
        return declared
    return Declaration.of(declared, *ANYWHERE)


FEW = 5
"""Number of values up to which a sample does not show the length of a skewed tail."""
ONE_APART = 1
"""Number of values that may differ from the rest in a sample that counts as constant.

A constant sample does not show how much values vary.
"""
HALVINGS = 40
EQUAL = 1e-12
"""Relative difference up to which values are equal, except for rounding."""


NONE: Floats = np.zeros(())
ENDLESS: Floats = np.full((), np.inf)


class Samples(NamedTuple):
    """Moments of k samples of independent values, (k,) or one number each.

    Attributes
    ----------
    mean : array
    variance : array
        With divisor n - 1.
    n : array
        Number of values.
    skewness : array
        Adjusted, G1.
    least, largest : array
        Extreme values of the sample.
    alike : array
        Number of values that equal the median.
    low, high : array
        Range of possible values.
    """

    mean: Floats
    variance: Floats
    n: Floats
    skewness: Floats
    least: Floats
    largest: Floats
    alike: Floats = NONE
    low: Floats = -ENDLESS
    high: Floats = ENDLESS

    @property
    def mostly_alike(self) -> NDArray[np.bool_]:
        """True if more than half of the values are equal, and so not about normal."""
        return np.asarray(2.0 * self.alike > self.n)

    @property
    def constant(self) -> NDArray[np.bool_]:
        """True if at least two values are equal, and at most ONE_APART is not."""
        return np.asarray((self.alike > 1.0) & (self.n - self.alike <= ONE_APART))

    @property
    def bounded(self) -> NDArray[np.bool_]:
        """True if the range of possible values has both ends."""
        return np.isfinite(self.low) & np.isfinite(self.high)


def equal(least: ArrayLike, largest: ArrayLike) -> NDArray[np.bool_]:
    """Return whether numbers, (k,) or one each, are equal except for rounding.

    Rounding errors in sums of equal values would otherwise count as a variance.
    """
    return np.asarray(np.isclose(least, largest, rtol=EQUAL, atol=0.0))


def mean_bounds(
    distribution: Distribution, samples: Samples, tail: ArrayLike
) -> Bounds:
    """Return the confidence bounds of the mean of each of k samples.

    Parameters
    ----------
    distribution : Distribution
        Distribution of the values over trials.
    samples : Samples
    tail : array_like
        Probability with which each bound is missed, above 0 and at most 0.5; a number,
        or (k,).

    Returns
    -------
    low, high : array
        (k,) each. NaN for samples of fewer than two values, and for constant samples of
        values that have no bounded range and are not events.
    """
    arrays = Samples(*(np.asarray(moment, np.float64) for moment in samples))
    several = arrays._replace(n=np.where(arrays.n > 1, arrays.n, np.nan))
    with np.errstate(all="ignore"):
        return BOUNDS[distribution](several, np.asarray(tail, np.float64))


def _normal(samples: Samples, tail: Floats) -> Bounds:
    """Return Student's bounds, for means that are about normal.

    If more than half of the values are equal, the values are not about normal, for any
    declaration, and are treated as skewed.
    """
    bounds = _where(
        samples.mostly_alike, _widest(samples, tail), _student(samples, tail)
    )
    return _where(samples.constant, _within_range(samples, tail), bounds)


def _skewed(samples: Samples, tail: Floats) -> Bounds:
    """Return the widest of three bounds; for constant samples, the range decides."""
    bounds = _widest(samples, tail)
    return _where(samples.constant, _within_range(samples, tail), bounds)


def _within_range(samples: Samples, tail: Floats) -> Bounds:
    """Return the bounds of the mean of a constant sample from the range of its values.

    The fraction of values that differ from the most frequent value is at most the exact
    upper bound (Clopper and Pearson 1934, Biometrika 26, 404-413). All different values
    may be at one end of the range. NaN if the range lacks an end.
    """
    from scipy.special import betaincinv

    apart = samples.n - samples.alike
    fraction = betaincinv(apart + 1.0, samples.alike, 1.0 - tail)
    nearer = samples.mean - samples.least < samples.largest - samples.mean
    commonest = np.where(nearer, samples.least, samples.largest)
    fraction = np.where(samples.bounded, fraction, np.nan)
    # A value may be outside the range by a rounding error.
    below = np.maximum(commonest - samples.low, 0.0)
    above = np.maximum(samples.high - commonest, 0.0)
    return commonest - fraction * below, commonest + fraction * above


def _student(samples: Samples, tail: Floats) -> Bounds:
    half = _quantile(samples, tail) * _error(samples)
    return samples.mean - half, samples.mean + half


def _widest(samples: Samples, tail: Floats) -> Bounds:
    """Return the widest of three pairs of bounds.

    - Student's: for differences of skewed values, which are about symmetric; the
      skewness of a sample is mostly noise.
    - Student's without the skewness: needs some ten values to estimate the skewness.
    - Student's of the logarithm of the mean, by the delta method, if no value is below
      zero: valid for fewer values.
    """
    everywhere = np.ones(np.shape(samples.mean), np.bool_)
    low, high = _wider(
        _student(samples, tail), _without_skewness(samples, tail), everywhere
    )
    ratio = np.exp(_quantile(samples, tail) * _error(samples) / samples.mean)
    positive = (samples.least >= 0.0) & (samples.mean > 0.0)
    return (
        np.where(positive, np.fmin(low, samples.mean / ratio), low),
        np.where(positive, np.fmax(high, samples.mean * ratio), high),
    )


def _without_skewness(samples: Samples, tail: Floats) -> Bounds:
    """Return Hall's bounds (1992, J. R. Stat. Soc. B 54, 221-228).

    A cubic function of Student's t has no skewness. Student's quantiles are transformed
    back by the inverse function.
    """
    root = np.sqrt(samples.n)
    quantile = _quantile(samples, tail)
    slope = samples.skewness / (3.0 * root)

    def back(corrected: Floats) -> Floats:
        moved = corrected - slope / 2.0
        return np.where(
            np.abs(slope) > ROUNDING,
            (np.cbrt(1.0 + 3.0 * slope * moved) - 1.0) / slope,
            moved,
        )

    error = _error(samples)
    return samples.mean - error * back(quantile), samples.mean - error * back(-quantile)


def _count(samples: Samples, tail: Floats) -> Bounds:
    """Return the mid-P bounds of Poisson's distribution for all events together.

    For values that vary more than Poisson's, the effective number of trials is smaller,
    by the variance / mean (quasi-Poisson; McCullagh and Nelder 1989, section 6.2).
    Because the variance is estimated, the number is also divided by the squared ratio
    of Student's quantile to the normal quantile. If the variance itself is above the
    mean, the bounds are the wider of mid-P and Hall's bounds. The bounds are never
    narrower than Poisson's, so equal counts, such as all zero, have a positive width.
    Values below zero are not counts and have the bounds of normal values.
    """
    widened = samples.variance * _widening(samples, tail)
    size = samples.n * np.where(
        widened > samples.mean, samples.mean / widened, np.ones_like(widened)
    )
    events = samples.mean * size
    low = _poisson(events, tail, upper=False)
    high = _poisson(events, tail, upper=True)
    hall = _without_skewness(samples, tail)
    bounds = _wider(
        (low / size, high / size),
        (np.fmax(hall[0], 0.0), hall[1]),
        samples.variance > samples.mean * (1.0 + ROUNDING),
    )
    return _where(samples.least >= 0.0, bounds, _normal(samples, tail))


def _fraction(samples: Samples, tail: Floats, total: float) -> Bounds:
    """Return the mid-P bounds of the binomial distribution, for values from 0 to total.

    Samples of only 0 and `total` are single draws. For values that vary less, the
    effective number of draws is larger (Korn and Graubard 1998, Survey Methodology 24,
    193-201). The factor is the largest variance for this mean / the variance of the
    sample. Because the variance is estimated, the number is divided by the squared
    ratio of Student's quantile to the normal quantile. The bounds are then the wider of
    mid-P and Hall's bounds. Equal values do not show how much values vary, so each
    value counts as a single draw. Values outside the range have the bounds of normal
    values.
    """
    mean = samples.mean / total
    largest = mean * (1.0 - mean)
    variance = samples.variance / total**2
    widened = variance * _widening(samples, tail)
    narrower = (widened > 0.0) & (widened < largest)
    size = samples.n * np.where(narrower, largest / widened, np.ones_like(widened))
    low = _binomial(mean * size, size, tail)
    high = 1.0 - _binomial((1.0 - mean) * size, size, tail)
    of_n = variance * (samples.n - 1.0) / samples.n
    between = (variance > 0.0) & (of_n < largest * (1.0 - ROUNDING))
    hall = _without_skewness(samples, tail)
    bounds = _wider(
        (total * low, total * high),
        (np.fmax(hall[0], 0.0), np.fmin(hall[1], total)),
        between,
    )
    inside = (samples.least >= 0.0) & (samples.largest <= total)
    return _where(inside, bounds, _normal(samples, tail))


BOUNDS: Mapping[Distribution, Callable[[Samples, Floats], Bounds]] = MappingProxyType(
    {
        "normal": _normal,
        "skewed": _skewed,
        "count": _count,
        "proportion": partial(_fraction, total=1.0),
        "percentage": partial(_fraction, total=100.0),
    }
)
EVENTS: tuple[Distribution, ...] = ("count", "proportion", "percentage")
"""Distributions with a variance given by the mean; equal values have a width."""


def _error(samples: Samples) -> Floats:
    return np.asarray(np.sqrt(samples.variance / samples.n))


def _quantile(samples: Samples, tail: Floats) -> Floats:
    """Return Student's quantile that is exceeded with the probability `tail`."""
    from scipy.special import stdtrit

    return -np.asarray(stdtrit(samples.n - 1.0, tail), np.float64)


def _widening(samples: Samples, tail: Floats) -> Floats:
    """Return the squared ratio of Student's quantile to the normal quantile.

    The ratio is 1 for the median, where the quantiles are 0.
    """
    from scipy.special import ndtri

    normal = -np.asarray(ndtri(tail), np.float64)
    ratio = np.where(normal > 0.0, _quantile(samples, tail) / normal, 1.0)
    return np.asarray(ratio * ratio)


def _wider(bounds: Bounds, other: Bounds, where: NDArray[np.bool_]) -> Bounds:
    both = np.fmin(bounds[0], other[0]), np.fmax(bounds[1], other[1])
    return _where(where, both, bounds)


def _where(where: NDArray[np.bool_], bounds: Bounds, other: Bounds) -> Bounds:
    return np.where(where, bounds[0], other[0]), np.where(where, bounds[1], other[1])


def _poisson(events: Floats, tail: Floats, *, upper: bool) -> Floats:
    """Return the mean at which `events` or more events have the probability `tail`.

    With `upper`, return the mean at which `events` or fewer events have this
    probability. The probability of exactly `events` counts half (mid-P; Lancaster 1961,
    J. Am. Stat. Assoc. 56, 223-234).
    """
    from scipy.special import gammainc, gammaincc, gammainccinv, gammaincinv

    some = events > 0.0
    shape = np.where(some, events, 1.0)
    if upper:
        first = np.where(some, gammainccinv(shape, tail), 0.0)
        return _halved(
            lambda mean: (
                gammaincc(events + 1.0, mean)
                + np.where(some, gammaincc(shape, mean), 0.0)
                < 2.0 * tail
            ),
            first,
            gammainccinv(events + 1.0, tail),
        )
    lower = _halved(
        lambda mean: gammainc(events + 1.0, mean) + gammainc(shape, mean) > 2.0 * tail,
        gammaincinv(shape, tail),
        gammaincinv(events + 1.0, tail),
    )
    return np.where(some, lower, np.where(np.isnan(events), np.nan, 0.0))


def _binomial(events: Floats, draws: Floats, tail: Floats) -> Floats:
    """Return the probability of an event per draw that fits `events` and `tail`.

    At this probability, `events` or more of `draws` have the probability `tail`. The
    probability of exactly `events` counts half (mid-P).
    """
    from scipy.special import betainc, betaincinv

    some = events > 0.0
    all_ = events >= draws
    least = np.where(some, events, 1.0)
    most = np.where(all_, 1.0, draws - events)

    def as_many(chance: Floats) -> Floats:
        beyond = np.where(all_, 0.0, betainc(events + 1.0, most, chance))
        return np.asarray(
            betainc(least, np.where(all_, 0.0, draws - events) + 1.0, chance) + beyond
        )

    chance = _halved(
        lambda chance: as_many(chance) > 2.0 * tail,
        betaincinv(least, np.where(all_, 0.0, draws - events) + 1.0, tail),
        np.where(all_, 1.0, betaincinv(events + 1.0, most, tail)),
    )
    return np.where(some, chance, np.where(np.isnan(events), np.nan, 0.0))


def _halved(
    beyond: Callable[[Floats], NDArray[np.bool_]], low: ArrayLike, high: ArrayLike
) -> Floats:
    """Return where `beyond` turns true between two arrays, by bisection."""
    first, last = np.broadcast_arrays(
        np.asarray(low, np.float64), np.asarray(high, np.float64)
    )
    for _ in range(HALVINGS):
        middle = (first + last) / 2.0
        far = beyond(middle)
        first = np.where(far, first, middle)
        last = np.where(far, middle, last)
    return np.asarray((first + last) / 2.0)
