"""Estimates whose interval can be asked for at any confidence: means, differences and
rank correlations.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sweep.analysis.mean_bounds import (
    EVENTS,
    Distribution,
    Samples,
    equal,
    mean_bounds,
)

Floats = NDArray[np.float64]

CONFIDENCE = 0.95


class Sample(NamedTuple):
    """Mean, variance (of n - 1) and number of independent values, their skewness
    (adjusted, G1; 0 for fewer than three), the least and the largest.
    """

    mean: float
    variance: float
    n: int
    skewness: float = 0.0
    least: float = -math.inf
    largest: float = math.inf


@dataclass(frozen=True)
class MeanEstimate:
    """The mean of one sample, or that of a first sample minus that of a second one.

    The intervals and tests are those of the `distribution` of the values: see
    `sweep.analysis.mean_bounds`. Those of "normal" values are Student's and Welch's,
    which fail for few values of a skewed distribution, and for a skewed sample against
    a narrow one. The difference of others has the interval of Zou and Donner (2008,
    Stat. Med. 27, 1693-1702; of two proportions it is Newcombe's): the squares of what
    either bound of either mean is away from it are added up. Its p is the chance at
    which such an interval no longer has the true value.

    `correlation` is that between both samples, None where they are independent. Of
    correlated ones it is the wider of this and Student's of the differences: pairs that
    are few and all alike in sign say little.
    """

    samples: tuple[Sample, ...]
    distribution: Distribution = "normal"
    correlation: float | None = None

    @property
    def value(self) -> float:
        first, *others = (sample.mean for sample in self.samples)
        return first - sum(others)

    @property
    def testable(self) -> bool:
        """Whether every sample has two values, as a spread needs."""
        return min(sample.n for sample in self.samples) > 1

    def interval(
        self, confidence: float = CONFIDENCE, published: int | None = None
    ) -> tuple[float, float]:
        """The bounds of the interval that the distribution of the values has.

        With `published`, it is the interval of the difference from means of so many
        published trials, which are taken to vary as ours do.
        """
        if self.distribution != "normal":
            low, high = self._bounds(np.array((1.0 - confidence) / 2.0), published)
            return float(low), float(high)
        error, freedom = self.error(published)
        half = student_quantile(0.5 + confidence / 2, freedom) * error
        return self.value - half, self.value + half

    def grown(self, times: float) -> "MeanEstimate":
        """What `times` as many values would give if mean and spread stayed."""
        samples = tuple(one._replace(n=round(one.n * times)) for one in self.samples)
        return replace(self, samples=samples)

    def error(self, published: int | None = None) -> tuple[float, float]:
        """The standard error and its degrees of freedom, Welch's (1947, Biometrika 34,
        28-35) for two samples.

        Infinite degrees where no value differs from another, for then the error is
        zero.
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
        """The one-sided p of so large (`above`) or so small a value if the true one
        were `bound`: Student's for normal values, for others at least LEAST_P.
        """
        from scipy.stats import t

        if self.distribution != "normal":
            side, sign = (0, 1.0) if above else (1, -1.0)
            found = _crossing(lambda tails: sign * (self._bounds(tails)[side] - bound))
            if found < 0.5:
                return found
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
        """The two-sided p that the true value is zero: Student's, Welch's for two
        samples, and for other distributions by their interval; NaN where not testable.
        """
        if not self.testable:
            return np.nan
        return min(1.0, 2.0 * self.tail(0.0, above=self.value > 0.0))

    def _bounds(self, tail: Floats, published: int | None = None) -> tuple[Floats, ...]:
        """The two bounds that are missed with the chance `tail` each, same shape."""
        arms = []
        for sample in self.samples:
            moments = Samples(*(np.array(one) for one in sample))
            low, high = mean_bounds(self.distribution, moments, tail)
            arms.append((sample.mean - low, high - sample.mean))
        below, above = arms[0]
        if len(arms) == 1 and published is None:
            return self.value - below, self.value + above
        correlation = self.correlation or 0.0
        squares = [below**2, above**2]
        for down, up in arms[1:]:
            squares[0] += up**2 - 2.0 * correlation * below * up
            squares[1] += down**2 - 2.0 * correlation * above * down
        if self.correlation is not None:
            least = self._students_half(tail) ** 2
            squares = [np.maximum(one, least) for one in squares]
        if published is not None:
            for place, (sample, (down, up)) in enumerate(
                zip(self.samples, arms, strict=True)
            ):
                # A published mean that lies too high makes ours seem too low.
                swapped = (up, down) if place == 0 else (down, up)
                for side, arm in enumerate(swapped):
                    squares[side] += arm**2 * sample.n / published
        roots = [np.sqrt(np.maximum(one, 0.0)) for one in squares]
        return self.value - roots[0], self.value + roots[1]

    def _students_half(self, tail: Floats) -> Floats:
        """Half the width of Student's interval of the differences of both samples."""
        first, second = self.samples
        spreads = math.sqrt(first.variance), math.sqrt(second.variance)
        variance = first.variance + second.variance
        variance -= 2.0 * (self.correlation or 0.0) * spreads[0] * spreads[1]
        change = Sample(0.0, max(variance, 0.0), first.n)
        moments = Samples(*(np.array(one) for one in change))
        return mean_bounds("normal", moments, tail)[1]


LEAST_P = 1e-15
"""Smaller chances are told as this one, for values that are not normal."""
TAILS = 64


def _crossing(excess: Callable[[Floats], Floats]) -> float:
    """The chance, from LEAST_P to 0.5, at which `excess`, which grows with it, turns
    above zero; 0.5 where it does not.
    """
    low, high = LEAST_P, 0.5
    for _ in range(3):
        tails = np.geomspace(low, high, TAILS)
        with np.errstate(invalid="ignore"):
            beyond = np.flatnonzero(excess(tails) > 0.0)
        if not len(beyond):
            return high
        if beyond[0] == 0:
            return low
        low, high = float(tails[beyond[0] - 1]), float(tails[beyond[0]])
    return math.sqrt(low * high)


@dataclass(frozen=True)
class RankEstimate:
    """Spearman's rank correlation of `n` pairs; NaN where one side does not vary."""

    value: float
    n: int

    @property
    def testable(self) -> bool:
        """Whether the correlation is defined and has four pairs, for an interval."""
        return self.n > 3 and not math.isnan(self.value)

    def interval(
        self, confidence: float = CONFIDENCE, published: int | None = None
    ) -> tuple[float, float]:
        """The bounds by Fisher's z with the variance of Bonett and Wright (2000,
        Psychometrika 65, 23-28).

        A perfect order has no finite z; it stands half a step of the statistic below
        one. Raises ValueError for `published`, the number of published trials, which
        says nothing about a correlation over points.
        """
        if published is not None:
            raise ValueError("a rank correlation has no number of published trials")
        largest = 1.0 - 6.0 / (self.n**3 - self.n)
        correlation = min(max(self.value, -largest), largest)
        deviation = math.sqrt((1.0 + correlation * correlation / 2.0) / (self.n - 3))
        half = student_quantile(0.5 + confidence / 2, math.inf) * deviation
        low, high = (
            math.tanh(math.atanh(correlation) - half),
            math.tanh(math.atanh(correlation) + half),
        )
        return min(low, self.value), max(high, self.value)

    def grown(self, times: float) -> "RankEstimate":
        """What `times` as many pairs would give if the correlation stayed."""
        return RankEstimate(self.value, round(self.n * times))


Estimate = MeanEstimate | RankEstimate


def mean_estimate(
    *values: NDArray[np.float64], distribution: Distribution = "normal"
) -> MeanEstimate:
    """The estimate from one array of independent values, or from two for their
    difference; NaN does not count.
    """
    samples = tuple(_sample(array[~np.isnan(array)]) for array in values)
    return MeanEstimate(samples, distribution)


def paired_estimate(
    first: NDArray[np.float64],
    second: NDArray[np.float64],
    distribution: Distribution = "normal",
) -> MeanEstimate:
    """The mean of the differences of two arrays (n,) without NaN, whose values of equal
    place are a pair.

    The differences of events are taken apart into gains and losses. Both are events
    again, so that pairs without any difference have an interval with a width.
    """
    change = first - second
    if distribution not in EVENTS:
        return MeanEstimate((_sample(change),), distribution)
    gains, losses = np.maximum(change, 0.0), np.maximum(-change, 0.0)
    varies = len(change) > 1 and np.ptp(gains) > 0.0 and np.ptp(losses) > 0.0
    correlation = float(np.corrcoef(gains, losses)[0, 1]) if varies else 0.0
    return MeanEstimate((_sample(gains), _sample(losses)), distribution, correlation)


def _sample(values: NDArray[np.float64]) -> Sample:
    if len(values) < 2:
        return Sample(float(values[0]) if len(values) else np.nan, np.nan, len(values))
    least, largest = float(values.min()), float(values.max())
    if equal(least, largest):
        return Sample(least, 0.0, len(values), 0.0, least, largest)
    with np.errstate(invalid="ignore"):
        mean, variance = float(values.mean()), float(values.var(ddof=1))
    return Sample(mean, variance, len(values), _skewness(values), least, largest)


def _skewness(values: NDArray[np.float64]) -> float:
    if len(values) < 3 or not np.isfinite(values).all():
        return 0.0
    skewness: Any = pd.Series(values).skew()
    return float(skewness)


def rank_estimate(one: NDArray[np.float64], other: NDArray[np.float64]) -> RankEstimate:
    """The rank correlation of two arrays, pairs with a NaN left out."""
    complete = ~(np.isnan(one) | np.isnan(other))
    ranks = [
        pd.Series(values[complete]).rank().to_numpy(np.float64)
        for values in (one, other)
    ]
    if any(len(rank) < 2 or np.ptp(rank) == 0 for rank in ranks):
        return RankEstimate(np.nan, int(complete.sum()))
    return RankEstimate(
        float(np.clip(np.corrcoef(ranks[0], ranks[1])[0, 1], -1.0, 1.0)),
        int(complete.sum()),
    )


@lru_cache(maxsize=4096)
def student_quantile(probability: float, freedom: float) -> float:
    """The quantile of Student's distribution with so many degrees of freedom, which may
    be infinite.
    """
    from scipy.stats import t

    return float(t.ppf(probability, freedom))
