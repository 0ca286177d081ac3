"""Estimates whose interval can be asked for at any confidence: means, differences and
rank correlations.
"""

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

CONFIDENCE = 0.95


class Sample(NamedTuple):
    """Mean, sample variance and number of independent values."""

    mean: float
    variance: float
    n: int


@dataclass(frozen=True)
class MeanEstimate:
    """The mean of one sample, or that of a first sample minus that of an independent
    second one.

    Its intervals and tests are Student's and Welch's: for independent values whose mean
    is about normal. They fail for few values of a skewed distribution, where
    "bootstrap_t" of `mean_interval` does better.
    """

    samples: tuple[Sample, ...]

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
        """The bounds of Student's interval, of Welch's for two samples.

        With `published`, it is the interval of the difference from means of so many
        published trials, whose variance is taken to be ours.
        """
        error, freedom = self.error(published)
        half = student_quantile(0.5 + confidence / 2, freedom) * error
        return self.value - half, self.value + half

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
        """Student's one-sided p, of so large (`above`) or so small a value if the true
        one were `bound`.
        """
        from scipy.stats import t

        error, freedom = self.error()
        distance = self.value - bound if above else bound - self.value
        return (
            float(t.sf(distance / error, freedom))
            if error > 0.0
            else float(distance <= 0.0)
        )

    def p_value(self) -> float:
        """Student's two-sided p, Welch's for two samples, that the true value is zero;
        NaN where not testable.
        """
        if not self.testable:
            return np.nan
        return min(1.0, 2.0 * self.tail(0.0, above=self.value > 0.0))


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


Estimate = MeanEstimate | RankEstimate


def mean_estimate(*values: NDArray[np.float64]) -> MeanEstimate:
    """The estimate from one array of independent values, or from two for their
    difference; NaN does not count.
    """
    return MeanEstimate(tuple(_sample(array[~np.isnan(array)]) for array in values))


def _sample(values: NDArray[np.float64]) -> Sample:
    if len(values) < 2:
        return Sample(float(values[0]) if len(values) else np.nan, np.nan, len(values))
    # The mean of equal values may be off by a rounding error, which would pass for a
    # variance.
    if np.all(values == values[0]):
        return Sample(float(values[0]), 0.0, len(values))
    with np.errstate(invalid="ignore"):
        return Sample(float(values.mean()), float(values.var(ddof=1)), len(values))


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
