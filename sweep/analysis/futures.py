"""What a pilot lets one expect of samples to come: their moments, and how far these may
be off. One entry in PREDICTIONS for each distribution of values.

A pilot of m values knows its mean and its spread only about, and a sample of n values
to come differs from the truth as well. Each quantile here is one over both: of a
predictive distribution (Geisser 1993, Predictive Inference, chapter 2).

- normal: the mean by Student's, the variance by the F distribution with n - 1 and m - 1
  degrees of freedom. For skewed values that are not all positive there are fewer of
  them, by the kurtosis of a gamma distribution of their skewness.
- skewed and positive: lognormal, so that a long tail is known from more than the few
  values in it. How much they vary is the mean of what lognormal and gamma values would,
  weighted by the likelihoods of both. The degrees of freedom of the sample to come are
  fewer by the kurtosis of lognormal values.
- count: the mean by the gamma distribution that Jeffreys' prior gives; the variance
  over the mean by the F distribution, with fewer degrees of freedom where the negative
  binomial distribution is more skewed than Poisson's.
- share: the mean by the beta distribution alike; the variance over the largest that is
  possible by the F distribution, with fewer degrees of freedom by the skewness of the
  beta distribution, unless values are 0 and the whole alone.
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

SINGLE_DRAWS = 1.0 - 1e-9
"""Shares that have this part of the largest variance are 0 and the whole alone."""


@dataclass(frozen=True, eq=False)
class Pilots:
    """What is known of k pilots of one metric: `samples`, and the variance of the
    logarithms of lognormal values that vary as much, (k,), NaN where a value is not
    above zero.
    """

    samples: Samples
    log_variance: Floats

    @property
    def known(self) -> Sequence[Floats]:
        """All of it, (k,) each."""
        return [*self.samples, self.log_variance]

    def at(self, rows: NDArray[np.intp]) -> Self:
        """Some of them."""
        samples = Samples(*(one[rows] for one in self.samples))
        return replace(self, samples=samples, log_variance=self.log_variance[rows])


def pilots_of(values: Sequence[Floats], distribution: Distribution) -> Pilots:
    """k arrays of values (m,), of which those that are not finite do not count."""
    column = pd.Series(np.concatenate([*values, np.empty(0)]), dtype=np.float64)
    column = column.where(np.isfinite(column))
    places = np.repeat(np.arange(len(values)), [len(one) for one in values])
    codes = pd.Series(pd.Categorical(places, categories=range(len(values))))
    samples = group_samples(column.groupby(codes, observed=False), distribution)
    logs = column.where(column > 0.0).map(np.log).groupby(codes, observed=False)
    mean, variance = (np.asarray(one, np.float64) for one in (logs.mean(), logs.var()))
    with np.errstate(all="ignore"):
        found = _log_variance(samples, mean, variance)
    return Pilots(samples, np.where(samples.least > 0.0, found, np.nan))


def _log_variance(samples: Samples, log_mean: Floats, log_variance: Floats) -> Floats:
    """The variance of the logarithms of lognormal values whose squared coefficient of
    variation is the mean of those of the lognormal and the gamma distribution that are
    most likely, weighted by their likelihoods.

    The shape of the gamma distribution is about that (Minka 2002, Estimating a Gamma
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
"""Logarithms that vary less are those of normal values, whatever they are."""


class Prediction(NamedTuple):
    """How samples of n values to come are distributed, k of them at once.

    `spread` is the quantile of what tells how much they vary, at a chance, with so many
    times as many degrees of freedom; `mean` that of their mean, where they have a
    spread; and `moments` are those of samples with a mean and a spread. Which mean
    makes the widest interval is `widest`; a mean lies from `least` to `most`.
    """

    spread: Callable[[Pilots, Floats, float, Times], Floats]
    mean: Callable[[Pilots, Floats, Floats, float], Floats]
    moments: Callable[[Pilots, Floats, Floats, Floats], Samples]
    widest: float = 0.0
    least: float = -np.inf
    most: float = np.inf


def _f_quantile(n: Floats, m: Floats, chance: float, times: Times) -> Floats:
    """By how much the variance of n values is above that of m; both have so many times
    as many degrees of freedom.
    """
    from scipy.special import fdtri

    degrees = (np.maximum((one - 1.0) * times, ROUGHLY) for one in (n, m))
    return np.asarray(fdtri(*degrees, chance))


ROUGHLY = 0.5
"""Fewer degrees of freedom say nothing more."""


def _fewer(squared_skewness: Floats) -> Floats:
    """Which part of the degrees of freedom of a variance is left, by the kurtosis that
    gamma distributions of this skewness have.
    """
    return np.asarray(1.0 / (1.0 + 0.75 * squared_skewness))


def _t_quantile(m: Floats, chance: float) -> Floats:
    from scipy.special import stdtrit

    return np.asarray(stdtrit(m - 1.0, chance))


def _both(pilots: Pilots, n: Floats) -> Floats:
    """So many values know a mean as well as the pilot knows that of n others."""
    return 1.0 / (1.0 / pilots.samples.n + 1.0 / n)


def _possible(skewness: Floats, n: Floats) -> Floats:
    """The skewness of n values is at most the root of n."""
    root = np.sqrt(n)
    return np.clip(skewness, -root, root)


def _normal_spread(pilots: Pilots, n: Floats, chance: float, times: Times) -> Floats:
    known = pilots.samples
    left = _fewer(known.skewness**2) * times
    return known.variance * _f_quantile(n, known.n, chance, left)


def _normal_mean(pilots: Pilots, n: Floats, spread: Floats, chance: float) -> Floats:
    known = pilots.samples
    error = np.sqrt(known.variance / _both(pilots, n))
    return known.mean + _t_quantile(known.n, chance) * error + 0.0 * spread


def _normal_moments(pilots: Pilots, n: Floats, mean: Floats, spread: Floats) -> Samples:
    """Of a pilot whose values are mostly equal, so are those to come."""
    known, infinite = pilots.samples, np.full_like(mean, np.inf)
    skewness = _possible(known.skewness, n)
    least = np.where(known.mostly_alike, known.least, -infinite)
    alike = np.minimum(known.alike / known.n * n, n - NOT_ALIKE)
    return Samples(mean, spread, n, skewness, least, infinite, alike)


NOT_ALIKE = 1.5
"""So many values to come differ from the others: with fewer nothing would be known."""
NORMAL = Prediction(_normal_spread, _normal_mean, _normal_moments)


def _log_spread(pilots: Pilots, n: Floats, chance: float, times: Times) -> Floats:
    """The variance of the logarithm. By the delta method that of the values varies as
    one with fewer degrees of freedom: its squared variation is exp(s) - 1.
    """
    spread = pilots.log_variance
    power = np.exp(spread)
    kurtosis = power**4 + 2.0 * power**3 + 3.0 * power**2 - 3.0
    slope = np.where(spread > 0.0, spread * power / np.expm1(spread), 1.0)
    fewer = 2.0 * slope**2 / (kurtosis - 1.0)
    factor = _f_quantile(1.0 + (n - 1.0) * fewer, pilots.samples.n, chance, times)
    return np.asarray(spread * factor)


def _log_mean(pilots: Pilots, n: Floats, spread: Floats, chance: float) -> Floats:
    """By the delta method; values that vary more have a larger mean, too."""
    known, usual = pilots.samples, pilots.log_variance
    error = np.sqrt(np.expm1(usual) / _both(pilots, n))
    off = _t_quantile(known.n, chance) * error + (spread - usual) / 2.0
    return np.asarray(known.mean * np.exp(off))


def _log_moments(_: Pilots, n: Floats, mean: Floats, spread: Floats) -> Samples:
    """Those of lognormal values; samples are less skewed than these."""
    variation = np.sqrt(np.expm1(spread))
    skewness = (variation**2 + 3.0) * variation
    seen = 1.0 / np.sqrt(1.0 / skewness**2 + 4.0 / n)
    none = np.zeros_like(mean)
    return Samples(mean, (mean * variation) ** 2, n, seen, none, none + np.inf)


SKEWED = Prediction(_log_spread, _log_mean, _log_moments, np.inf, 0.0)


def _count_dispersion(pilots: Pilots) -> Floats:
    """The variance over the mean; 1 where no event was seen."""
    known = pilots.samples
    return np.where(known.mean > 0.0, known.variance / known.mean, 1.0)


def _count_spread(pilots: Pilots, n: Floats, chance: float, times: Times) -> Floats:
    known, spread = pilots.samples, _count_dispersion(pilots)
    more = np.maximum(1.0, spread)
    beyond = ((2.0 * more - 1.0) ** 2 / more - 1.0) / np.maximum(
        known.mean, 1.0 / known.n
    )
    factor = _f_quantile(n, known.n, chance, _fewer(beyond) * times)
    return np.asarray(spread * factor)


def _count_mean(pilots: Pilots, n: Floats, spread: Floats, chance: float) -> Floats:
    from scipy.special import gammaincinv

    size = _both(pilots, n) / np.maximum(1.0, _count_dispersion(pilots))
    found = gammaincinv(0.5 + pilots.samples.mean * size, chance) / size
    return np.asarray(found + 0.0 * spread)


def _count_moments(_: Pilots, n: Floats, mean: Floats, spread: Floats) -> Samples:
    """Those of the negative binomial distribution; where the spread is 1, Poisson's."""
    skewness = _possible((2.0 * spread - 1.0) / np.sqrt(spread * mean), n)
    none = np.zeros_like(mean)
    return Samples(mean, mean * spread, n, skewness, none, none + np.inf)


COUNT = Prediction(_count_spread, _count_mean, _count_moments, np.inf, 0.0)


def _share_spread(
    pilots: Pilots, n: Floats, chance: float, times: Times, whole: float
) -> Floats:
    known = pilots.samples
    mean = known.mean / whole
    largest = mean * (1.0 - mean)
    part = known.variance / whole**2 * (known.n - 1.0) / known.n / largest
    single = ~((known.variance > 0.0) & (part < SINGLE_DRAWS))
    left = _fewer(_share_skewness(mean, part) ** 2) * times
    factor = _f_quantile(n, known.n, chance, left)
    return np.where(single, 1.0, np.minimum(1.0, part * factor))


def _share_skewness(mean: Floats, spread: Floats) -> Floats:
    """That of a beta distribution, and of single draws where the spread is 1."""
    largest = mean * (1.0 - mean)
    return np.asarray(
        2.0 * (1.0 - 2.0 * mean) * np.sqrt(spread / largest) / (1.0 + spread)
    )


def _share_mean(
    pilots: Pilots, n: Floats, spread: Floats, chance: float, whole: float
) -> Floats:
    from scipy.special import betaincinv

    size = _both(pilots, n) / spread
    mean = pilots.samples.mean / whole
    one, other = 0.5 + mean * size, 0.5 + (1.0 - mean) * size
    return np.asarray(whole * betaincinv(one, other, chance))


def _share_moments(
    _: Pilots, n: Floats, mean: Floats, spread: Floats, whole: float
) -> Samples:
    share = mean / whole
    skewness = _possible(_share_skewness(share, spread), n)
    variance = whole**2 * spread * share * (1.0 - share) * n / (n - 1.0)
    none = np.zeros_like(mean)
    return Samples(mean, variance, n, skewness, none, none + whole)


def _share(whole: float) -> Prediction:
    shares = Prediction(
        partial(_share_spread, whole=whole),
        partial(_share_mean, whole=whole),
        partial(_share_moments, whole=whole),
        whole / 2.0,
        0.0,
        whole,
    )
    return _where(partial(_from_to, 0.0, whole), shares)


def _where(fits: Callable[[Samples], Mask], prediction: Prediction) -> Prediction:
    """A prediction for the pilots that it fits; the others are taken for normal."""

    def spread(pilots: Pilots, n: Floats, chance: float, times: Times) -> Floats:
        found = (one.spread(pilots, n, chance, times) for one in (prediction, NORMAL))
        return np.where(fits(pilots.samples), *found)

    def mean(pilots: Pilots, n: Floats, spread: Floats, chance: float) -> Floats:
        found = (one.mean(pilots, n, spread, chance) for one in (prediction, NORMAL))
        return np.where(fits(pilots.samples), *found)

    def moments(pilots: Pilots, n: Floats, mean: Floats, spread: Floats) -> Samples:
        where = fits(pilots.samples)
        own, normal = (
            one.moments(pilots, n, mean, spread) for one in (prediction, NORMAL)
        )
        return Samples(
            *(np.where(where, *both) for both in zip(own, normal, strict=True))
        )

    return prediction._replace(spread=spread, mean=mean, moments=moments)


def _from_to(least: float, most: float, known: Samples) -> Mask:
    return np.asarray((known.least >= least) & (known.largest <= most))


def _positive(known: Samples) -> Mask:
    return np.asarray(known.least > 0.0)


PREDICTIONS: Mapping[Distribution, Prediction] = MappingProxyType(
    {
        "normal": NORMAL,
        "skewed": _where(_positive, SKEWED),
        "count": _where(partial(_from_to, 0.0, np.inf), COUNT),
        "proportion": _share(SUPPORTS["proportion"].high),
        "percentage": _share(SUPPORTS["percentage"].high),
    }
)
