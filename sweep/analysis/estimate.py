"""Estimates whose interval can be asked for at any confidence: means, differences and
rank correlations.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, NamedTuple

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


class Sample(NamedTuple):
    """What `Samples` knows of one sample; the skewness is 0 for fewer than three
    values.
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

    `support` is what the mean, or the difference, lies in: intervals end there, and the
    chance of a true value outside is zero.
    """

    samples: tuple[Sample, ...]
    distribution: Distribution = "normal"
    correlation: float | None = None
    support: Support = ANYWHERE

    @property
    def value(self) -> float:
        first, *others = (sample.mean for sample in self.samples)
        return first - sum(others)

    @property
    def constant(self) -> bool:
        """Whether the values of a sample are equal, but for one at most, and so do not
        show how much they vary.
        """
        return any(bool(_as_arrays(sample).constant) for sample in self.samples)

    @property
    def testable(self) -> bool:
        """Whether there is an interval: every sample has two values, and a constant one
        has a range or is of events.
        """
        known = all(bool(_as_arrays(sample).bounded) for sample in self.samples)
        return min(sample.n for sample in self.samples) > 1 and (
            known or self.distribution in EVENTS or not self.constant
        )

    def interval(
        self, confidence: float = CONFIDENCE, published: int | None = None
    ) -> tuple[float, float]:
        """The bounds of the interval that the distribution of the values has.

        With `published`, it is the interval of the difference from means of so many
        published trials, which are taken to vary as ours do. It may reach beyond the
        support, as it has the error of both.
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
        """What `times` as many values would give if mean and spread stayed."""
        samples = tuple(
            one._replace(n=round(one.n * times), alike=round(one.alike * times))
            for one in self.samples
        )
        return replace(self, samples=samples)

    @property
    def _normal(self) -> bool:
        """Whether the values are about normal, as declared: not mostly equal."""
        alike = [_as_arrays(one).mostly_alike for one in self.samples]
        return self.distribution == "normal" and not np.any(alike)

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
        were `bound`: Student's for normal values, for others at least LEAST_P; zero
        where neither `bound` nor what lies beyond can be.
        """
        from scipy.stats import t

        if bound < self.support.low if above else bound > self.support.high:
            return 0.0
        if not self._normal:
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

    def _bounds(self, tail: Floats, published: int | None = None) -> Bounds:
        """The two bounds that are missed with the chance `tail` each, same shape."""
        samples = [_as_arrays(sample) for sample in self.samples]
        if len(samples) == 1 and published is None:
            below, above = _arms(samples[0], self.distribution, tail)
            return self.value - below, self.value + above
        squares = list(squared_arms(samples, self.distribution, tail, self.correlation))
        if published is not None:
            for place, one in enumerate(samples):
                down, up = _arms(one, self.distribution, tail)
                # A published mean that lies too high makes ours seem too low.
                swapped = (up, down) if place == 0 else (down, up)
                for side, arm in enumerate(swapped):
                    squares[side] += _squared(arm) * one.n / published
        roots = [np.sqrt(np.maximum(one, 0.0)) for one in squares]
        return self.value - roots[0], self.value + roots[1]


def _as_arrays(sample: Sample) -> Samples:
    return Samples(*(np.array(one) for one in sample))


ENDLESS = 1e150
"""An arm that is longer holds no bound. Two skewed values say so little that theirs
grows like the exponential of Student's quantile, and its square would be no number.
"""


def squared_arms(
    samples: Sequence[Samples],
    distribution: Distribution,
    tail: Floats,
    correlation: ArrayLike | None = None,
) -> tuple[Floats, Floats]:
    """The squares of what the lower and the upper bound are away from a mean, or from
    a first mean minus a second one: those of `MeanEstimate`, of k at once.

    `samples` are one or two, (k,) each, `tail` the chance with which a bound is missed,
    and `correlation` is that between both samples, None where they are independent.
    """
    (below, above), *others = (_arms(one, distribution, tail) for one in samples)
    common = 0.0 if correlation is None else np.asarray(correlation, np.float64)
    squares = _squared(below), _squared(above)
    for down, up in others:
        squares = _squared(below, up, common), _squared(above, down, common)
    if correlation is None:
        return squares
    least = _students_half(samples, common, tail) ** 2
    return np.maximum(squares[0], least), np.maximum(squares[1], least)


def _squared(
    arm: Floats, other: Floats | float = 0.0, common: Floats | float = 0.0
) -> Floats:
    """The square of what two arms, whose means have the correlation `common`, are
    together; infinite where one of them is ENDLESS.
    """
    endless = np.maximum(arm, other) > ENDLESS
    one, two = (np.where(endless, 0.0, each) for each in (arm, other))
    together = one**2 + two**2 - 2.0 * common * one * two
    return np.where(endless, np.inf, together)


def _arms(
    samples: Samples, distribution: Distribution, tail: Floats
) -> tuple[Floats, Floats]:
    """What either bound of the mean is away from it."""
    low, high = mean_bounds(distribution, samples, tail)
    return samples.mean - low, high - samples.mean


def _students_half(
    samples: Sequence[Samples], correlation: Floats | float, tail: Floats
) -> Floats:
    """Half the width of Student's interval of the differences of both samples."""
    first, second = samples
    common = np.sqrt(first.variance) * np.sqrt(second.variance)
    variance = first.variance + second.variance - 2.0 * correlation * common
    none = np.zeros_like(variance)
    change = first._replace(mean=none, variance=np.maximum(variance, 0.0), alike=none)
    return mean_bounds("normal", change, tail)[1]


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
    *values: NDArray[np.float64], distribution: Declared = "normal"
) -> MeanEstimate:
    """The estimate from one array of independent values, or from two, a and b, for
    their difference, b minus a; NaN does not count.
    """
    known = [array[~np.isnan(array)] for array in reversed(values)]
    of, support = _declared(distribution, known)
    return MeanEstimate(
        tuple(_sample(one, support) for one in known),
        of,
        support=support if len(known) == 1 else support.of_differences,
    )


def paired_estimate(
    a: NDArray[np.float64],
    b: NDArray[np.float64],
    distribution: Declared = "normal",
) -> MeanEstimate:
    """The mean of the differences, b minus a, of two arrays (n,) without NaN, whose
    values of equal place are a pair.

    The differences of events are taken apart into gains and losses. Both are events
    again, so that pairs without any difference have an interval with a width.
    """
    change, (of, support) = b - a, _declared(distribution, (a, b))
    if of not in EVENTS:
        sample = _sample(change, support.of_differences)
        return MeanEstimate((sample,), of, support=support.of_differences)
    gains, losses = np.maximum(change, 0.0), np.maximum(-change, 0.0)
    varies = len(change) > 1 and np.ptp(gains) > 0.0 and np.ptp(losses) > 0.0
    correlation = float(np.corrcoef(gains, losses)[0, 1]) if varies else 0.0
    samples = _sample(gains), _sample(losses)
    return MeanEstimate(samples, of, correlation, support.of_differences)


def _declared(
    declared: Declared, samples: Sequence[NDArray[np.float64]]
) -> tuple[Distribution, Support]:
    """The distribution of values and what they lie in: anywhere, where some do not lie
    in what is declared.
    """
    of, support = in_full(declared)
    known = np.concatenate(samples)
    held = not len(known) or support.holds(known.min(), known.max())
    return of, support if held else ANYWHERE


def _sample(values: NDArray[np.float64], support: Support = ANYWHERE) -> Sample:
    n = len(values)
    if n < 2:
        return Sample(float(values[0]) if n else np.nan, np.nan, n)
    least, largest = float(values.min()), float(values.max())
    if equal(least, largest):
        return Sample(least, 0.0, n, 0.0, least, largest, n, *support)
    with np.errstate(invalid="ignore"):
        mean, variance = float(values.mean()), float(values.var(ddof=1))
        alike = int(equal(values, np.median(values)).sum())
    skewness = _skewness(values)
    return Sample(mean, variance, n, skewness, least, largest, alike, *support)


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
