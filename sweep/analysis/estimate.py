"""Means, differences and rank correlations with confidence intervals."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, NamedTuple, Protocol

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from sweep.analysis.mean_bounds import (
    ANYWHERE,
    EVENTS,
    Bounds,
    Declared,
    Distribution,
    Samples,
    Support,
    equal,
    in_full,
    mean_bounds,
)

Floats = NDArray[np.float64]

CONFIDENCE = 0.95
"""Default confidence level of an interval."""


class Sample(NamedTuple):
    """The moments of a single sample; `Samples` has the moments of k samples.

    Attributes
    ----------
    mean : float
        Mean, in the unit of the values.
    variance : float
        With divisor n - 1, in the squared unit; NaN for fewer than two values.
    n : int
        Number of values.
    skewness : float, default 0
        Adjusted, G1, without a unit; 0 for fewer than three values.
    least, largest : float
        Extreme values of the sample; infinite if not known.
    alike : int, default 0
        Number of values that equal the median.
    low, high : float
        Range of possible values; infinite without an end.
    """

    mean: float
    variance: float
    n: int
    skewness: float = 0.0
    least: float = -math.inf
    largest: float = math.inf
    alike: int = 0
    low: float = -math.inf
    high: float = math.inf


class Estimate(Protocol):
    """A quantity with intervals, such as a mean or a correlation."""

    @property
    def value(self) -> float:
        """The estimate."""

    @property
    def testable(self) -> bool:
        """True if there is an interval."""

    def interval(
        self, confidence: float = CONFIDENCE, published: int | None = None
    ) -> tuple[float, float]:
        """Return the bounds of the interval.

        Parameters
        ----------
        confidence : float, default 0.95
        published : int, optional
            Number of trials behind the published number, if its error counts.
        """

    def grown(self, times: float) -> "Estimate":
        """Return the estimate from `times` as many trials with an equal spread."""


@dataclass(frozen=True)
class MeanEstimate:
    """The mean of a sample, or the mean of a first sample minus the mean of a second.

    The distribution of the values determines confidence intervals and tests, see
    `sweep.analysis.mean_bounds`. Normal values have Student's and Welch's intervals.
    Student's and Welch's intervals fail for few values of a skewed distribution, and
    for a skewed sample compared with a narrow sample. For differences of values that
    are not normal the interval is Zou and Donner's (2008, Stat. Med. 27, 1693-1702;
    Newcombe's for two proportions). This interval adds up the squared distances of each
    mean from the bounds of that mean. The p-value is the level at which the interval
    just excludes the tested value.

    Attributes
    ----------
    samples : tuple of Sample
        One sample, or two.
    distribution : Distribution, default "normal"
        Distribution of the values.
    correlation : float or None
        Correlation of the two samples; None if the samples are independent. Correlated
        samples have the wider of this interval and Student's interval of the
        differences, because few pairs of one sign have little information.
    support : Support
        Range of the mean, or of the difference. Intervals are cut off at the ends of
        the range, and the p-value of a true value outside is zero.
    """

    samples: tuple[Sample, ...]
    distribution: Distribution = "normal"
    correlation: float | None = None
    support: Support = ANYWHERE

    @property
    def value(self) -> float:
        """The mean, or the first mean minus the second."""
        first, *subtracted = (sample.mean for sample in self.samples)
        return first - sum(subtracted)

    @property
    def constant(self) -> bool:
        """True if all values of a sample but at most one are equal.

        A constant sample does not show how much values vary.
        """
        return any(bool(_as_arrays(sample).constant) for sample in self.samples)

    @property
    def testable(self) -> bool:
        """True if there is a confidence interval.

        Every sample needs two values. A constant sample also needs a bounded range or
        values that are events.
        """
        bounded = all(bool(_as_arrays(sample).bounded) for sample in self.samples)
        return min(sample.n for sample in self.samples) > 1 and (
            bounded or self.distribution in EVENTS or not self.constant
        )

    def interval(
        self, confidence: float = CONFIDENCE, published: int | None = None
    ) -> tuple[float, float]:
        """Return the bounds of the confidence interval of the value.

        Parameters
        ----------
        confidence : float, default 0.95
        published : int, optional
            Number of trials of a published mean. The interval is then for the
            difference from the published mean, under the assumption that published and
            present trials have equal variance. The interval includes the errors of the
            two means, so it may extend beyond the support.

        Returns
        -------
        low, high : float
        """
        uncut = self._uncut(confidence, published)
        if published is not None:
            return uncut
        low, high = self.support.cut(self.value, *uncut)
        return float(low), float(high)

    def _uncut(self, confidence: float, published: int | None) -> tuple[float, float]:
        if not self._normal:
            low, high = self._bounds(np.array((1.0 - confidence) / 2.0), published)
            return float(low), float(high)
        error, freedom = self.error(published)
        half = student_quantile(0.5 + confidence / 2, freedom) * error
        return self.value - half, self.value + half

    def grown(self, times: float) -> "MeanEstimate":
        """Return the estimate from `times` as many values of the same moments."""
        samples = tuple(
            sample._replace(
                n=round(sample.n * times), alike=round(sample.alike * times)
            )
            for sample in self.samples
        )
        return replace(self, samples=samples)

    @property
    def _normal(self) -> bool:
        """True if the values are declared normal and are not mostly equal."""
        alike = [_as_arrays(sample).mostly_alike for sample in self.samples]
        return self.distribution == "normal" and not np.any(alike)

    def error(self, published: int | None = None) -> tuple[float, float]:
        """Return the standard error and its degrees of freedom.

        Two samples have Welch's degrees of freedom (1947, Biometrika 34, 28-35). The
        degrees of freedom are infinite if the values within each sample are equal,
        because the error is then zero. `published` is the number of trials of a
        published mean, see `interval`.
        """
        extra = 1.0 / published if published else 0.0
        parts = [sample.variance * (1.0 / sample.n + extra) for sample in self.samples]
        if sum(parts) == 0.0:
            return 0.0, math.inf
        spread = sum(
            part * part / (sample.n - 1)
            for part, sample in zip(parts, self.samples, strict=True)
        )
        return math.sqrt(sum(parts)), sum(parts) ** 2 / spread

    def tail(self, bound: float, *, above: bool) -> float:
        """Return the one-sided p-value of the hypothesis of a true value of `bound`.

        Parameters
        ----------
        bound : float
            True value under the hypothesis.
        above : bool
            True to test for a larger value than `bound`, False for a smaller value.

        Returns
        -------
        float
            Student's for normal values; at least LEAST_P for all other distributions.
            Zero if the hypothesis is outside the support: with `above`, if `bound` is
            below the support, else if `bound` is above the support.
        """
        from scipy.stats import t

        if bound < self.support.low if above else bound > self.support.high:
            return 0.0
        if not self._normal:
            side, sign = (0, 1.0) if above else (1, -1.0)
            tail = _crossing(lambda tails: sign * (self._bounds(tails)[side] - bound))
            if tail < 0.5:
                return tail
            return 1.0 - _crossing(
                lambda tails: sign * (bound - self._bounds(tails)[1 - side])
            )
        error, freedom = self.error()
        distance = self.value - bound if above else bound - self.value
        return (
            float(t.sf(distance / error, freedom))
            if error > 0.0
            else float(distance <= 0.0)
        )

    def p_value(self) -> float:
        """Return the two-sided p-value for a true value of zero.

        The test is Student's for normal values and Welch's for two normal samples. For
        all other distributions the confidence interval determines the p-value. NaN if
        not testable.
        """
        if not self.testable:
            return np.nan
        return min(1.0, 2.0 * self.tail(0.0, above=self.value > 0.0))

    def _bounds(self, tail: Floats, published: int | None = None) -> Bounds:
        """Return the bounds in the shape of `tail`, the probability to miss each."""
        samples = [_as_arrays(sample) for sample in self.samples]
        if len(samples) == 1 and published is None:
            below, above = _arms(samples[0], self.distribution, tail)
            return self.value - below, self.value + above
        squares = list(squared_arms(samples, self.distribution, tail, self.correlation))
        if published is not None:
            for index, sample in enumerate(samples):
                down, up = _arms(sample, self.distribution, tail)
                # A published mean that is too high makes the difference too low.
                swapped = (up, down) if index == 0 else (down, up)
                for side, arm in enumerate(swapped):
                    squares[side] += _squared(arm) * sample.n / published
        roots = [np.sqrt(np.maximum(square, 0.0)) for square in squares]
        return self.value - roots[0], self.value + roots[1]


def _as_arrays(sample: Sample) -> Samples:
    return Samples(*(np.array(moment) for moment in sample))


ENDLESS = 1e150
"""Length from which an arm counts as infinite.

The arm of two skewed values grows like the exponential of Student's quantile, and the
square would overflow.
"""


def squared_arms(
    samples: Sequence[Samples],
    distribution: Distribution,
    tail: Floats,
    correlation: ArrayLike | None = None,
) -> tuple[Floats, Floats]:
    """Return the squared distances of the two bounds from the value of `MeanEstimate`.

    Parameters
    ----------
    samples : sequence of Samples
        One sample or two, for k estimates at once, (k,) each. The value is the first
        mean minus the second.
    distribution : Distribution
    tail : array
        Probability with which each bound is missed.
    correlation : array_like, optional
        Correlation of the two samples; None if the samples are independent.

    Returns
    -------
    below, above : array
        Squares for the lower and the upper bound, (k,) each.
    """
    (below, above), *subtracted = (
        _arms(sample, distribution, tail) for sample in samples
    )
    common = 0.0 if correlation is None else np.asarray(correlation, np.float64)
    squares = _squared(below), _squared(above)
    for down, up in subtracted:
        squares = _squared(below, up, common), _squared(above, down, common)
    if correlation is None:
        return squares
    least = _students_half(samples, common, tail) ** 2
    return np.maximum(squares[0], least), np.maximum(squares[1], least)


def _squared(
    arm: Floats, other: Floats | float = 0.0, common: Floats | float = 0.0
) -> Floats:
    """Return the square of the combined length of two arms.

    `common` is the correlation of the means. The result is infinite if an arm is beyond
    ENDLESS.
    """
    endless = np.maximum(arm, other) > ENDLESS
    first, second = (np.where(endless, 0.0, length) for length in (arm, other))
    together = first**2 + second**2 - 2.0 * common * first * second
    return np.where(endless, np.inf, together)


def _arms(
    samples: Samples, distribution: Distribution, tail: Floats
) -> tuple[Floats, Floats]:
    """Return the distances of the lower and the upper bound from the mean."""
    low, high = mean_bounds(distribution, samples, tail)
    return samples.mean - low, high - samples.mean


def _students_half(
    samples: Sequence[Samples], correlation: Floats | float, tail: Floats
) -> Floats:
    """Return the half-width of Student's interval of the differences in pairs."""
    first, second = samples
    common = np.sqrt(first.variance) * np.sqrt(second.variance)
    variance = first.variance + second.variance - 2.0 * correlation * common
    none = np.zeros_like(variance)
    change = first._replace(mean=none, variance=np.maximum(variance, 0.0), alike=none)
    return mean_bounds("normal", change, tail)[1]


LEAST_P = 1e-15
"""Smallest p-value that is returned for values that are not normal."""
TAILS = 64
"""Probabilities per round of the search for a p-value."""


def _crossing(excess: Callable[[Floats], Floats]) -> float:
    """Return the probability at which a growing function turns positive.

    The probability is between LEAST_P and 0.5, and 0.5 if `excess` does not turn
    positive.
    """
    low = LEAST_P
    high = 0.5
    for _ in range(3):
        tails = np.geomspace(low, high, TAILS)
        with np.errstate(invalid="ignore"):
            beyond = np.flatnonzero(excess(tails) > 0.0)
        if not len(beyond):
            return high
        if beyond[0] == 0:
            return low
        low = float(tails[beyond[0] - 1])
        high = float(tails[beyond[0]])
    return math.sqrt(low * high)


@dataclass(frozen=True)
class RankEstimate:
    """Spearman's rank correlation of pairs.

    Attributes
    ----------
    value : float
        Correlation from -1 to 1; NaN if a side does not vary.
    n : int
        Number of pairs.
    """

    value: float
    n: int

    @property
    def testable(self) -> bool:
        """True if the correlation is defined and has four pairs, for an interval."""
        return self.n > 3 and not math.isnan(self.value)

    def interval(
        self, confidence: float = CONFIDENCE, published: int | None = None
    ) -> tuple[float, float]:
        """Return the bounds of the confidence interval.

        The interval is Fisher's z with the variance of Bonett and Wright (2000,
        Psychometrika 65, 23-28). A perfect correlation has no finite z, so the
        correlation is limited to half a step of the statistic below 1.

        Parameters
        ----------
        confidence : float, default 0.95
        published : None
            Only for the signature of `MeanEstimate.interval`.

        Returns
        -------
        low, high : float

        Raises
        ------
        ValueError
            If `published` is a number: a number of published trials has no meaning for
            a correlation over points.
        """
        if published is not None:
            raise ValueError("a rank correlation has no number of published trials")
        largest = 1.0 - 6.0 / (self.n**3 - self.n)
        correlation = min(max(self.value, -largest), largest)
        deviation = math.sqrt((1.0 + correlation * correlation / 2.0) / (self.n - 3))
        half = student_quantile(0.5 + confidence / 2, math.inf) * deviation
        low = math.tanh(math.atanh(correlation) - half)
        high = math.tanh(math.atanh(correlation) + half)
        return min(low, self.value), max(high, self.value)

    def grown(self, times: float) -> "RankEstimate":
        """Return the estimate from `times` as many pairs of the same correlation."""
        return RankEstimate(self.value, round(self.n * times))


def mean_estimate(
    *values: NDArray[np.float64], distribution: Declared = "normal"
) -> MeanEstimate:
    """Estimate a mean, or the difference of two means.

    Parameters
    ----------
    *values : array
        An array (n,) of independent values, or two arrays a and b for the difference
        b - a. NaN does not count.
    distribution : Declared, default "normal"
        Distribution of the values.

    Returns
    -------
    MeanEstimate
        In the unit of the values; `interval` and `p_value` are methods.

    Examples
    --------
    >>> a = np.array([0.61, 0.58, 0.66, 0.63, 0.6])
    >>> b = np.array([0.65, 0.7, 0.62, 0.68, 0.61])
    >>> estimate = mean_estimate(a, b)
    >>> round(estimate.value, 3), round(estimate.p_value(), 2)
    (0.036, 0.14)
    >>> [round(bound, 3) for bound in estimate.interval(0.9)]
    [-0.005, 0.077]
    """
    samples = [array[~np.isnan(array)] for array in reversed(values)]
    of, support = _declared(distribution, samples)
    return MeanEstimate(
        tuple(_sample(sample, support) for sample in samples),
        of,
        support=support if len(samples) == 1 else support.of_differences,
    )


def paired_estimate(
    a: NDArray[np.float64],
    b: NDArray[np.float64],
    distribution: Declared = "normal",
) -> MeanEstimate:
    """Estimate the mean of the differences within pairs, b - a.

    The differences of events are split into gains and losses. Gains and losses are
    events again, so the confidence interval has a positive width even if no pair
    differs.

    Parameters
    ----------
    a, b : array
        Values without NaN, (n,) each. Values at equal indices are pairs.
    distribution : Declared, default "normal"
        Distribution of the values.

    Returns
    -------
    MeanEstimate
        In the unit of the values; `interval` and `p_value` are methods.

    Examples
    --------
    >>> a = np.array([0.61, 0.58, 0.66, 0.63, 0.6])
    >>> b = np.array([0.65, 0.62, 0.69, 0.68, 0.62])
    >>> estimate = paired_estimate(a, b)
    >>> round(estimate.value, 3), [round(bound, 3) for bound in estimate.interval()]
    (0.036, [0.022, 0.05])
    """
    change = b - a
    of, support = _declared(distribution, (a, b))
    if of not in EVENTS:
        sample = _sample(change, support.of_differences)
        return MeanEstimate((sample,), of, support=support.of_differences)
    gains = np.maximum(change, 0.0)
    losses = np.maximum(-change, 0.0)
    varies = len(change) > 1 and np.ptp(gains) > 0.0 and np.ptp(losses) > 0.0
    correlation = float(np.corrcoef(gains, losses)[0, 1]) if varies else 0.0
    samples = _sample(gains), _sample(losses)
    return MeanEstimate(samples, of, correlation, support.of_differences)


def _declared(
    declared: Declared, samples: Sequence[NDArray[np.float64]]
) -> tuple[Distribution, Support]:
    """Return the distribution and the support of values.

    The support is ANYWHERE if any value is outside the declared support.
    """
    of, support = in_full(declared)
    pooled = np.concatenate(samples)
    held = not len(pooled) or support.holds(pooled.min(), pooled.max())
    return of, support if held else ANYWHERE


def _sample(values: NDArray[np.float64], support: Support = ANYWHERE) -> Sample:
    n = len(values)
    if n < 2:
        return Sample(float(values[0]) if n else np.nan, np.nan, n)
    least = float(values.min())
    largest = float(values.max())
    if equal(least, largest):
        mean = least
        variance = 0.0
        skewness = 0.0
        alike = n
    else:
        with np.errstate(invalid="ignore"):
            mean = float(values.mean())
            variance = float(values.var(ddof=1))
            alike = int(equal(values, np.median(values)).sum())
        skewness = _skewness(values)
    return Sample(
        mean=mean,
        variance=variance,
        n=n,
        skewness=skewness,
        least=least,
        largest=largest,
        alike=alike,
        low=support.low,
        high=support.high,
    )


def _skewness(values: NDArray[np.float64]) -> float:
    if len(values) < 3 or not np.isfinite(values).all():
        return 0.0
    skewness: Any = pd.Series(values).skew()
    return float(skewness)


def rank_estimate(a: NDArray[np.float64], b: NDArray[np.float64]) -> RankEstimate:
    """Estimate the rank correlation of two arrays.

    Parameters
    ----------
    a, b : array
        Values, (n,) each. Values at equal indices are pairs. A pair with NaN does not
        count.

    Returns
    -------
    RankEstimate
        NaN if a side does not vary, or for fewer than two pairs.

    Examples
    --------
    >>> weights = np.array([0.5, 1.0, 1.5, 2.0, 2.5, 3.0])
    >>> speeds = np.array([1.8, 2.1, 2.0, 2.4, np.nan, 2.9])
    >>> correlation = rank_estimate(weights, speeds)
    >>> round(correlation.value, 2), correlation.n
    (0.9, 5)
    >>> [round(bound, 2) for bound in correlation.interval()]
    [-0.17, 1.0]
    """
    complete = ~(np.isnan(a) | np.isnan(b))
    ranks = [
        pd.Series(values[complete]).rank().to_numpy(np.float64) for values in (a, b)
    ]
    if any(len(rank) < 2 or np.ptp(rank) == 0 for rank in ranks):
        return RankEstimate(np.nan, int(complete.sum()))
    return RankEstimate(
        float(np.clip(np.corrcoef(ranks[0], ranks[1])[0, 1], -1.0, 1.0)),
        int(complete.sum()),
    )


@lru_cache(maxsize=4096)
def student_quantile(probability: float, freedom: float) -> float:
    """Return a quantile of Student's distribution.

    `freedom` is the number of degrees of freedom, which may be infinite.
    """
    from scipy.stats import t

    return float(t.ppf(probability, freedom))
