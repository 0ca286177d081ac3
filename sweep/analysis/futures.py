"""Predictive distributions of future samples, from a pilot.

PREDICTIONS has an entry for each distribution of values: the moments of a future
sample, with quantiles. The mean and the variance of a pilot of m values have errors,
and so have the mean and the variance of a future sample of n values. Each quantile
includes the errors of pilot and future sample: it is a quantile of a predictive
distribution (Geisser 1993, Predictive Inference, chapter 2).

- normal: the mean by Student's distribution, the variance by the F distribution. The
  degrees of freedom are n - 1 and m - 1. Skewed values that are not all positive have
  fewer degrees of freedom, by the kurtosis of a gamma distribution of equal skewness.
- skewed and positive: lognormal, so that not only the few values in a long tail have
  information about the tail. The variance is the mean of a lognormal and a gamma
  variance, weighted by the likelihoods. The future sample has fewer degrees of freedom,
  by the kurtosis of lognormal values.
- count: the mean by the gamma distribution that Jeffreys' prior gives. The variance /
  mean is by the F distribution, with fewer degrees of freedom where the negative
  binomial distribution is more skewed than Poisson's.
- proportion and percentage: the mean by the beta distribution in the same way. The
  variance / largest possible variance is by the F distribution. The skewness of the
  beta distribution reduces the degrees of freedom, unless all values are 0 or the
  largest possible value.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from types import MappingProxyType
from typing import NamedTuple, Self

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sweep.analysis.intervals import group_samples
from sweep.analysis.mean_bounds import SUPPORTS, Distribution, Samples

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]
Times = Floats | float
"""Factors on degrees of freedom."""

SINGLE_DRAWS = 1.0 - 1e-9
"""Fraction of the largest variance from which proportions count as single draws.

Single draws are all 0 or the largest possible value.
"""


@dataclass(frozen=True, eq=False)
class Pilots:
    """The moments of k pilots of one metric.

    `log_variance` (k,) is the variance of the logarithms of lognormal values with equal
    variation. The variance is NaN if any value is not above zero.
    """

    samples: Samples
    log_variance: Floats

    @property
    def known(self) -> Sequence[Floats]:
        """All numbers of the pilots, (k,) each."""
        return [*self.samples, self.log_variance]

    def at(self, rows: NDArray[np.intp]) -> Self:
        """Return the pilots at some indices."""
        samples = Samples(*(moment[rows] for moment in self.samples))
        return replace(self, samples=samples, log_variance=self.log_variance[rows])


def pilots_of(values: Sequence[Floats], distribution: Distribution) -> Pilots:
    """Return the moments of k arrays of values, (m,) each.

    Values that are not finite do not count.
    """
    column = pd.Series(np.concatenate([*values, np.empty(0)]), dtype=np.float64)
    column = column.where(np.isfinite(column))
    numbers = np.repeat(np.arange(len(values)), [len(pilot) for pilot in values])
    codes = pd.Series(pd.Categorical(numbers, categories=range(len(values))))
    samples = group_samples(column.groupby(codes, observed=False), distribution)
    logs = column.where(column > 0.0).map(np.log).groupby(codes, observed=False)
    mean = np.asarray(logs.mean(), np.float64)
    variance = np.asarray(logs.var(), np.float64)
    with np.errstate(all="ignore"):
        equivalent = _log_variance(samples, mean, variance)
    return Pilots(samples, np.where(samples.least > 0.0, equivalent, np.nan))


def _log_variance(samples: Samples, log_mean: Floats, log_variance: Floats) -> Floats:
    """Return the variance of the logarithms of equivalent lognormal values.

    The squared coefficient of variation is a mean over the most likely lognormal and
    the most likely gamma distribution, weighted by the likelihoods. The shape of the
    gamma distribution is an approximation (Minka 2002, Estimating a Gamma
    distribution).
    """
    from scipy.special import expit, gammaln

    below = np.log(samples.mean) - log_mean
    shape = (3.0 - below + np.sqrt((below - 3.0) ** 2 + 24.0 * below)) / (12.0 * below)
    fewer = (samples.n - 1.0) / samples.n
    gain = shape * (np.log(shape) - 1.0 - below) - gammaln(shape)
    gain += 0.5 * np.log(2.0 * np.pi * math.e * fewer * log_variance)
    weight = expit(samples.n * gain)
    squared = weight / (fewer * shape) + (1.0 - weight) * np.expm1(log_variance)
    return np.where(below > CLOSE, np.log1p(squared), log_variance)


CLOSE = 1e-6
"""Difference of the log of the mean and the mean log, below which values are normal."""


class Prediction(NamedTuple):
    """The predictive distribution of samples of n values, for k pilots at once.

    Attributes
    ----------
    spread : callable
        `spread(pilots, n, chance, times)`: quantile of a measure of the variance at the
        probability `chance`, with `times` as many degrees of freedom. The measure
        depends on the distribution.
    mean : callable
        `mean(pilots, n, spread, chance)`: quantile of the mean, given the spread.
    moments : callable
        `moments(pilots, n, mean, spread)`: moments of samples with this mean and
        spread.
    widest : float, default 0
        Mean with the widest confidence interval.
    least, most : float
        Range of the mean.
    """

    spread: Callable[[Pilots, Floats, float, Times], Floats]
    mean: Callable[[Pilots, Floats, Floats, float], Floats]
    moments: Callable[[Pilots, Floats, Floats, Floats], Samples]
    widest: float = 0.0
    least: float = -np.inf
    most: float = np.inf


def _f_quantile(n: Floats, m: Floats, chance: float, times: Times) -> Floats:
    """Return a quantile of the ratio of two variances, of n values and of m values.

    Each variance has (size - 1) `times` degrees of freedom, at least ROUGHLY.
    """
    from scipy.special import fdtri

    degrees = (np.maximum((size - 1.0) * times, ROUGHLY) for size in (n, m))
    return np.asarray(fdtri(*degrees, chance))


ROUGHLY = 0.5
"""Fewest degrees of freedom that count."""


def _fewer(squared_skewness: Floats) -> Floats:
    """Return the fraction of the degrees of freedom of a variance that remains.

    The fraction follows from the kurtosis of a gamma distribution of this skewness.
    """
    return np.asarray(1.0 / (1.0 + 0.75 * squared_skewness))


def _t_quantile(m: Floats, chance: float) -> Floats:
    from scipy.special import stdtrit

    return np.asarray(stdtrit(m - 1.0, chance))


def _both(pilots: Pilots, n: Floats) -> Floats:
    """Return the sample size with the combined error of the pilot and of n values."""
    return 1.0 / (1.0 / pilots.samples.n + 1.0 / n)


def _possible(skewness: Floats, n: Floats) -> Floats:
    """Return a skewness cut off at the root of n, the largest for n values."""
    root = np.sqrt(n)
    return np.clip(skewness, -root, root)


def _normal_spread(pilots: Pilots, n: Floats, chance: float, times: Times) -> Floats:
    samples = pilots.samples
    left = _fewer(samples.skewness**2) * times
    return samples.variance * _f_quantile(n, samples.n, chance, left)


def _normal_mean(pilots: Pilots, n: Floats, spread: Floats, chance: float) -> Floats:
    samples = pilots.samples
    error = np.sqrt(samples.variance / _both(pilots, n))
    return samples.mean + _t_quantile(samples.n, chance) * error + 0.0 * spread


def _normal_moments(pilots: Pilots, n: Floats, mean: Floats, spread: Floats) -> Samples:
    """Return moments of normal values; mostly equal if the pilot is mostly equal."""
    samples = pilots.samples
    infinite = np.full_like(mean, np.inf)
    return Samples(
        mean=mean,
        variance=spread,
        n=n,
        skewness=_possible(samples.skewness, n),
        least=np.where(samples.mostly_alike, samples.least, -infinite),
        largest=infinite,
        alike=np.minimum(samples.alike / samples.n * n, n - NOT_ALIKE),
    )


NOT_ALIKE = 1.5
"""Fewest future values that differ from the majority.

A sample with fewer different values does not show how much values vary.
"""
NORMAL = Prediction(_normal_spread, _normal_mean, _normal_moments)


def _log_spread(pilots: Pilots, n: Floats, chance: float, times: Times) -> Floats:
    """Return a quantile of the variance s of the logarithm.

    The squared coefficient of variation of the values is exp(s) - 1. By the delta
    method the variance varies like a variance with fewer degrees of freedom.
    """
    spread = pilots.log_variance
    power = np.exp(spread)
    kurtosis = power**4 + 2.0 * power**3 + 3.0 * power**2 - 3.0
    slope = np.where(spread > 0.0, spread * power / np.expm1(spread), 1.0)
    fewer = 2.0 * slope**2 / (kurtosis - 1.0)
    factor = _f_quantile(1.0 + (n - 1.0) * fewer, pilots.samples.n, chance, times)
    return np.asarray(spread * factor)


def _log_mean(pilots: Pilots, n: Floats, spread: Floats, chance: float) -> Floats:
    """Return a quantile of the mean of lognormal values, by the delta method.

    A larger variance also means a larger mean.
    """
    samples = pilots.samples
    usual = pilots.log_variance
    error = np.sqrt(np.expm1(usual) / _both(pilots, n))
    off = _t_quantile(samples.n, chance) * error + (spread - usual) / 2.0
    return np.asarray(samples.mean * np.exp(off))


def _log_moments(_: Pilots, n: Floats, mean: Floats, spread: Floats) -> Samples:
    """Return moments of lognormal values; samples are less skewed than the values."""
    variation = np.sqrt(np.expm1(spread))
    skewness = (variation**2 + 3.0) * variation
    none = np.zeros_like(mean)
    return Samples(
        mean=mean,
        variance=(mean * variation) ** 2,
        n=n,
        skewness=1.0 / np.sqrt(1.0 / skewness**2 + 4.0 / n),
        least=none,
        largest=none + np.inf,
    )


SKEWED = Prediction(_log_spread, _log_mean, _log_moments, widest=np.inf, least=0.0)


def _count_dispersion(pilots: Pilots) -> Floats:
    """Return variance / mean; 1 if there was no event."""
    samples = pilots.samples
    return np.where(samples.mean > 0.0, samples.variance / samples.mean, 1.0)


def _count_spread(pilots: Pilots, n: Floats, chance: float, times: Times) -> Floats:
    samples = pilots.samples
    spread = _count_dispersion(pilots)
    more = np.maximum(1.0, spread)
    beyond = ((2.0 * more - 1.0) ** 2 / more - 1.0) / np.maximum(
        samples.mean, 1.0 / samples.n
    )
    factor = _f_quantile(n, samples.n, chance, _fewer(beyond) * times)
    return np.asarray(spread * factor)


def _count_mean(pilots: Pilots, n: Floats, spread: Floats, chance: float) -> Floats:
    from scipy.special import gammaincinv

    size = _both(pilots, n) / np.maximum(1.0, _count_dispersion(pilots))
    mean = gammaincinv(0.5 + pilots.samples.mean * size, chance) / size
    return np.asarray(mean + 0.0 * spread)


def _count_moments(_: Pilots, n: Floats, mean: Floats, spread: Floats) -> Samples:
    """Return moments of negative binomial values; Poisson's if the spread is 1."""
    none = np.zeros_like(mean)
    return Samples(
        mean=mean,
        variance=mean * spread,
        n=n,
        skewness=_possible((2.0 * spread - 1.0) / np.sqrt(spread * mean), n),
        least=none,
        largest=none + np.inf,
    )


COUNT = Prediction(_count_spread, _count_mean, _count_moments, widest=np.inf, least=0.0)


def _fraction_spread(
    pilots: Pilots, n: Floats, chance: float, times: Times, total: float
) -> Floats:
    samples = pilots.samples
    mean = samples.mean / total
    largest = mean * (1.0 - mean)
    part = samples.variance / total**2 * (samples.n - 1.0) / samples.n / largest
    single = ~((samples.variance > 0.0) & (part < SINGLE_DRAWS))
    left = _fewer(_fraction_skewness(mean, part) ** 2) * times
    factor = _f_quantile(n, samples.n, chance, left)
    return np.where(single, 1.0, np.minimum(1.0, part * factor))


def _fraction_skewness(mean: Floats, spread: Floats) -> Floats:
    """Return the skewness of a beta distribution; single draws have a spread of 1."""
    largest = mean * (1.0 - mean)
    return np.asarray(
        2.0 * (1.0 - 2.0 * mean) * np.sqrt(spread / largest) / (1.0 + spread)
    )


def _fraction_mean(
    pilots: Pilots, n: Floats, spread: Floats, chance: float, total: float
) -> Floats:
    from scipy.special import betaincinv

    size = _both(pilots, n) / spread
    mean = pilots.samples.mean / total
    a = 0.5 + mean * size
    b = 0.5 + (1.0 - mean) * size
    return np.asarray(total * betaincinv(a, b, chance))


def _fraction_moments(
    _: Pilots, n: Floats, mean: Floats, spread: Floats, total: float
) -> Samples:
    fraction = mean / total
    none = np.zeros_like(mean)
    return Samples(
        mean=mean,
        variance=total**2 * spread * fraction * (1.0 - fraction) * n / (n - 1.0),
        n=n,
        skewness=_possible(_fraction_skewness(fraction, spread), n),
        least=none,
        largest=none + total,
    )


def _fractions(total: float) -> Prediction:
    """Return the prediction for values from 0 to `total`."""
    fractions = Prediction(
        partial(_fraction_spread, total=total),
        partial(_fraction_mean, total=total),
        partial(_fraction_moments, total=total),
        widest=total / 2.0,
        least=0.0,
        most=total,
    )
    return _where(partial(_from_to, 0.0, total), fractions)


def _where(fits: Callable[[Samples], Mask], prediction: Prediction) -> Prediction:
    """Return `prediction` with NORMAL in its place for pilots that do not fit."""

    def spread(pilots: Pilots, n: Floats, chance: float, times: Times) -> Floats:
        fitting = prediction.spread(pilots, n, chance, times)
        normal = NORMAL.spread(pilots, n, chance, times)
        return np.where(fits(pilots.samples), fitting, normal)

    def mean(pilots: Pilots, n: Floats, spread: Floats, chance: float) -> Floats:
        fitting = prediction.mean(pilots, n, spread, chance)
        normal = NORMAL.mean(pilots, n, spread, chance)
        return np.where(fits(pilots.samples), fitting, normal)

    def moments(pilots: Pilots, n: Floats, mean: Floats, spread: Floats) -> Samples:
        where = fits(pilots.samples)
        fitting = prediction.moments(pilots, n, mean, spread)
        normal = NORMAL.moments(pilots, n, mean, spread)
        return Samples(
            *(np.where(where, *both) for both in zip(fitting, normal, strict=True))
        )

    return prediction._replace(spread=spread, mean=mean, moments=moments)


def _from_to(least: float, most: float, samples: Samples) -> Mask:
    return np.asarray((samples.least >= least) & (samples.largest <= most))


def _positive(samples: Samples) -> Mask:
    return np.asarray(samples.least > 0.0)


PREDICTIONS: Mapping[Distribution, Prediction] = MappingProxyType(
    {
        "normal": NORMAL,
        "skewed": _where(_positive, SKEWED),
        "count": _where(partial(_from_to, 0.0, np.inf), COUNT),
        "proportion": _fractions(SUPPORTS["proportion"].high),
        "percentage": _fractions(SUPPORTS["percentage"].high),
    }
)
