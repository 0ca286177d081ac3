"""Effect sizes: differences relative to the spread of single trials, without units."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sweep.analysis.estimate import CONFIDENCE, student_quantile

Floats = NDArray[np.float64]


class EffectSize(NamedTuple):
    """An effect size and the bounds of the confidence interval.

    Attributes
    ----------
    value : float
        The effect size, without a unit: standard deviations for `hedges_g`, a number
        from -1 to 1 for `cliffs_delta`, a probability for `superiority`.
    low, high : float
        Bounds of the confidence interval, on the scale of `value`.
    """

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
    """Return Hedges' g: the difference of means, b - a, in standard deviations.

    The unit is the square root of the mean of the two variances, so the variances may
    differ. Pairs have an equal unit: common random numbers narrow the interval, and
    change the effect only by the bias correction. The bias correction is Hedges' (1981,
    J. Educ. Stat. 6, 107-128), with the degrees of freedom of the mean variance. The
    confidence interval is Bonett's (2008, Psychol. Methods 13, 99-109). The interval is
    valid for more than about ten values that are about normal.

    Parameters
    ----------
    a, b : array_like
        Independent values, (n,) and (m,). NaN does not count; in pairs, neither does
        the partner of a NaN.
    confidence : float, default 0.95
    paired : bool, default False
        True if values at equal indices are pairs.

    Returns
    -------
    EffectSize
        NaN for fewer than three values on a side, and if neither side varies.

    Raises
    ------
    ValueError
        If the lengths of paired values differ.

    Examples
    --------
    >>> a = [0.61, 0.58, 0.66, 0.63, 0.6, 0.64, 0.59, 0.62, 0.65, 0.57]
    >>> b = [0.65, 0.61, 0.7, 0.68, 0.62, 0.69, 0.63, 0.64, 0.67, 0.61]
    >>> [round(number, 2) for number in hedges_g(a, b)]
    [1.05, 0.07, 2.04]
    >>> [round(number, 2) for number in hedges_g(a, b, paired=True)]
    [1.01, 0.5, 1.52]
    """
    first, second = _sides(a, b, paired)
    if min(len(first), len(second)) < 3:
        return UNKNOWN
    if np.ptp(first) == 0.0 and np.ptp(second) == 0.0:
        return UNKNOWN
    freedoms = np.array([len(first), len(second)]) - 1.0
    variances = np.array([first.var(ddof=1), second.var(ddof=1)])
    covariance = float(np.cov(first, second)[0, 1]) if paired else 0.0
    unit = float(variances.mean())
    spread = float((variances**2 / freedoms).sum()) / 2.0 + covariance**2 / freedoms[0]
    freedom = 2.0 * unit**2 / spread
    g = float(second.mean() - first.mean()) / math.sqrt(unit) * _correction(freedom)
    error_of_difference = (
        float((variances / freedoms).sum()) - 2.0 * covariance / freedoms[0]
    )
    error = math.sqrt(g * g / (2.0 * freedom) + max(error_of_difference, 0.0) / unit)
    half = student_quantile(0.5 + confidence / 2, math.inf) * error
    return EffectSize(g, g - half, g + half)


def superiority(
    a: ArrayLike, b: ArrayLike, confidence: float = CONFIDENCE
) -> EffectSize:
    """Return the probability that a value of b is larger than a value of a.

    Ties count half, so 0.5 means no effect. The distributions are arbitrary. The
    confidence interval is Newcombe's method 5 (2006, Stat. Med. 25, 559-573). The
    interval stays within 0 and 1, and has a positive width even if all values of one
    side are larger. For pairs with common random numbers, and for many ties, the
    interval is too wide rather than too narrow.

    Parameters
    ----------
    a, b : array_like
        Independent values, (m,) and (n,). NaN does not count.
    confidence : float, default 0.95

    Returns
    -------
    EffectSize
        NaN if a side is empty.

    Examples
    --------
    >>> a = [0.61, 0.58, 0.66, 0.63, 0.6]
    >>> b = [0.65, 0.7, 0.62, 0.68, 0.61]
    >>> [round(number, 2) for number in superiority(a, b)]
    [0.78, 0.41, 0.94]
    """
    from scipy.stats import rankdata

    first, second = _sides(a, b, paired=False)
    n = len(second)
    m = len(first)
    if min(n, m) == 0:
        return UNKNOWN
    ranks = np.asarray(rankdata(np.concatenate([second, first])), np.float64)
    value = (float(ranks[:n].sum()) - n * (n + 1) / 2.0) / (n * m)
    high = _score_bound(value, n, m, confidence)
    low = 1.0 - _score_bound(1.0 - value, n, m, confidence)
    return EffectSize(value, low, high)


def cliffs_delta(
    a: ArrayLike, b: ArrayLike, confidence: float = CONFIDENCE
) -> EffectSize:
    """Return Cliff's delta: P(b > a) - P(b < a), from -1 to 1.

    Cliff (1993, Psychol. Bull. 114, 494-509). The value and the confidence interval are
    2 `superiority` - 1, with equal limitations.

    Parameters
    ----------
    a, b : array_like
        Independent values, (m,) and (n,). NaN does not count.
    confidence : float, default 0.95

    Returns
    -------
    EffectSize
        NaN if a side is empty.

    Examples
    --------
    >>> a = [0.61, 0.58, 0.66, 0.63, 0.6]
    >>> b = [0.65, 0.7, 0.62, 0.68, 0.61]
    >>> [round(number, 2) for number in cliffs_delta(a, b)]
    [0.56, -0.18, 0.88]
    """
    return EffectSize(*(2.0 * number - 1.0 for number in superiority(a, b, confidence)))


def _score_bound(value: float, n: int, m: int, confidence: float) -> float:
    """Return the largest probability that `value` does not reject.

    The standard error is computed at the tested probability. `n` and `m` are the
    numbers of values on either side.
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
    """Return Hedges' exact factor, which makes g unbiased for normal values."""
    half = freedom / 2.0
    return math.exp(math.lgamma(half) - math.lgamma(half - 0.5)) / math.sqrt(half)


def _sides(a: ArrayLike, b: ArrayLike, paired: bool) -> tuple[Floats, Floats]:
    """Return the two sides without NaN, or without incomplete pairs.

    Raises ValueError for pairs of unequal lengths.
    """
    first = np.asarray(a, np.float64)
    second = np.asarray(b, np.float64)
    if not paired:
        return first[~np.isnan(first)], second[~np.isnan(second)]
    if first.shape != second.shape:
        raise ValueError(
            f"{len(first)} and {len(second)} values cannot be paired;"
            " pairs need equal lengths"
        )
    complete = ~(np.isnan(first) | np.isnan(second))
    return first[complete], second[complete]
