"""How large a difference is beside the spread of single trials, free of units."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sweep.analysis.estimate import CONFIDENCE, student_quantile

Floats = NDArray[np.float64]


class EffectSize(NamedTuple):
    """An effect size and the bounds of its interval."""

    value: float
    low: float
    high: float


UNKNOWN = EffectSize(np.nan, np.nan, np.nan)


def hedges_g(
    a: ArrayLike,
    b: ArrayLike,
    confidence: float = CONFIDENCE,
    *,
    paired: bool = False,
) -> EffectSize:
    """The mean of b minus that of a in units of the standard deviation of one trial,
    corrected for its bias.

    The unit is the root of the mean of both variances, so that spreads may differ, and
    the same for pairs, whose common random numbers narrow the interval but change no
    effect. The correction is Hedges' (1981, J. Educ. Stat. 6, 107-128) with the degrees
    of freedom of that variance, the interval that of Bonett (2008, Psychol. Methods 13,
    99-109). `a` (n,) and `b` (m,) hold independent values, pairs in the same order; one
    that is NaN does not count, nor does its partner. Valid for values that are about
    normal and more than about ten. NaN for fewer than three values on a side, and where
    neither varies.
    """
    one, other = _sides(a, b, paired)
    if min(len(one), len(other)) < 3 or (np.ptp(one) == 0.0 and np.ptp(other) == 0.0):
        return UNKNOWN
    freedoms, variances = (
        np.array([len(one), len(other)]) - 1.0,
        np.array([one.var(ddof=1), other.var(ddof=1)]),
    )
    covariance = float(np.cov(one, other)[0, 1]) if paired else 0.0
    unit = float(variances.mean())
    spread = float((variances**2 / freedoms).sum()) / 2.0 + covariance**2 / freedoms[0]
    freedom = 2.0 * unit**2 / spread
    g = float(other.mean() - one.mean()) / math.sqrt(unit) * _correction(freedom)
    error_of_difference = (
        float((variances / freedoms).sum()) - 2.0 * covariance / freedoms[0]
    )
    error = math.sqrt(g * g / (2.0 * freedom) + max(error_of_difference, 0.0) / unit)
    half = student_quantile(0.5 + confidence / 2, math.inf) * error
    return EffectSize(g, g - half, g + half)


def superiority(
    a: ArrayLike, b: ArrayLike, confidence: float = CONFIDENCE
) -> EffectSize:
    """The chance that a value of b is larger than one of a, equal ones counting half:
    0.5 is no effect.

    It asks nothing of the distributions. `a` (m,) and `b` (n,) hold independent values,
    NaN does not count; the interval is Newcombe's method 5 (2006, Stat. Med. 25,
    559-573), which stays within 0 and 1 and has a width where all of one side are
    larger. For pairs with common random numbers, and for values many of which are
    equal, it is too wide rather than too narrow. NaN where a side is empty.
    """
    from scipy.stats import rankdata

    other, one = _sides(a, b, False)
    if min(len(one), len(other)) == 0:
        return UNKNOWN
    n, m = len(one), len(other)
    ranks = np.asarray(rankdata(np.concatenate([one, other])), np.float64)
    value = (float(ranks[:n].sum()) - n * (n + 1) / 2.0) / (n * m)
    high = _score_bound(value, n, m, confidence)
    low = 1.0 - _score_bound(1.0 - value, n, m, confidence)
    return EffectSize(value, low, high)


def cliffs_delta(
    a: ArrayLike, b: ArrayLike, confidence: float = CONFIDENCE
) -> EffectSize:
    """The share of pairs in which the value of b is larger than that of a less that in
    which it is smaller, from -1 to 1.

    Cliff (1993, Psychol. Bull. 114, 494-509): twice `superiority` less one, with its
    interval and its limits.
    """
    return EffectSize(*(2.0 * number - 1.0 for number in superiority(a, b, confidence)))


def _score_bound(value: float, n: int, m: int, confidence: float) -> float:
    """The largest chance from which `value` is not further than its error allows if
    that chance were true.
    """
    from scipy.optimize import brentq

    if value == 1.0:
        return 1.0
    quantile = student_quantile(0.5 + confidence / 2, math.inf)
    both = (n + m) / 2.0 - 1.0

    def excess(true: float) -> float:
        spread = 1.0 + both * ((1.0 - true) / (2.0 - true) + true / (1.0 + true))
        return (
            true - value - quantile * math.sqrt(true * (1.0 - true) * spread / (n * m))
        )

    return float(brentq(excess, max(value, 1e-12), 1.0))


def _correction(freedom: float) -> float:
    """The factor that makes a standardised difference unbiased for normal values,
    Hedges' exact one.
    """
    half = freedom / 2.0
    return math.exp(math.lgamma(half) - math.lgamma(half - 0.5)) / math.sqrt(half)


def _sides(a: ArrayLike, b: ArrayLike, paired: bool) -> tuple[Floats, Floats]:
    """Both without NaN, pairs without those that lack a side. Raises ValueError for
    pairs of two lengths.
    """
    one, other = np.asarray(a, np.float64), np.asarray(b, np.float64)
    if not paired:
        return one[~np.isnan(one)], other[~np.isnan(other)]
    if one.shape != other.shape:
        raise ValueError(f"{len(one)} and {len(other)} values are no pairs")
    complete = ~(np.isnan(one) | np.isnan(other))
    return one[complete], other[complete]
