"""Simultaneous confidence intervals, and p-values adjusted for multiple comparisons."""

from collections.abc import Sequence
from typing import Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sweep.analysis.estimate import CONFIDENCE
from sweep.analysis.mean_bounds import ONE_APART, equal
from sweep.analysis.resampling import ratio, student_statistics
from sweep.text import unknown

Floats = NDArray[np.float64]
Correction = Literal["bonferroni", "sidak"]
Adjustment = Literal["holm", "bonferroni", "sidak"]

FEWEST_REPLICATES = 10


class Simultaneous(NamedTuple):
    """Means with simultaneous confidence intervals and adjusted p-values.

    Attributes
    ----------
    value : array
        Means, in the unit of the values, (k,).
    low, high : array
        Bounds of the simultaneous confidence intervals, in the same unit, (k,) each;
        NaN if unknown.
    p : array
        Adjusted p-values of a mean of zero, (k,); NaN if not testable.
    """

    value: Floats
    low: Floats
    high: Floats
    p: Floats


def simultaneous_confidence(
    comparisons: int,
    confidence: float = CONFIDENCE,
    correction: Correction = "bonferroni",
) -> float:
    """Return the confidence of each interval that makes all intervals simultaneous.

    Parameters
    ----------
    comparisons : int
        Number of intervals, at least 1.
    confidence : float, default 0.95
        Simultaneous (family-wise) confidence.
    correction : {"bonferroni", "sidak"}, default "bonferroni"
        "bonferroni" is valid for any dependence. "sidak" (Sidak 1967, J. Am. Stat.
        Assoc. 62, 626-633) is a little narrower: exact for independent intervals, and
        valid for two-sided intervals of normal means with any correlation.

    Returns
    -------
    float
        Confidence of each interval, at least `confidence`.

    Raises
    ------
    ValueError
        If the correction is unknown, or `comparisons` is below 1.

    Examples
    --------
    >>> round(simultaneous_confidence(10), 5)
    0.995
    >>> round(simultaneous_confidence(10, correction="sidak"), 5)
    0.99488
    """
    if correction not in get_args(Correction):
        raise ValueError(unknown("correction", correction, get_args(Correction)))
    if comparisons < 1:
        raise ValueError(f"comparisons: {comparisons}; allowed: 1 or more")
    if correction == "sidak":
        return float(confidence ** (1.0 / comparisons))
    return 1.0 - (1.0 - confidence) / comparisons


def holm(p_values: Sequence[float] | Floats) -> Floats:
    """Return p-values adjusted for k tests by Holm's method.

    If all hypotheses with an adjusted p-value below a level are rejected, the
    probability of any error is at most the level. The method (Holm 1979, Scand. J.
    Stat. 6, 65-70) is valid for any dependence of the tests.

    Parameters
    ----------
    p_values : sequence of float or array
        The p-value of each test, (k,). A NaN stays NaN and does not count as a test.

    Returns
    -------
    array
        Adjusted p-values, (k,), in the order of `p_values`.

    Examples
    --------
    >>> holm([0.01, 0.04, np.nan, 0.03]).round(3).tolist()
    [0.03, 0.06, nan, 0.06]
    """
    p = np.asarray(p_values, np.float64)
    adjusted = np.full(len(p), np.nan)
    order = np.argsort(p, kind="stable")[: np.count_nonzero(~np.isnan(p))]
    factors = np.arange(len(order), 0, -1)
    adjusted[order] = np.minimum(1.0, np.maximum.accumulate(factors * p[order]))
    return adjusted


def adjusted(
    p_values: Sequence[float] | Floats, adjustment: Adjustment = "holm"
) -> Floats:
    """Return p-values adjusted for multiple comparisons.

    Parameters
    ----------
    p_values : sequence of float or array
        The p-value of each test, (k,). A NaN stays NaN and does not count as a test.
    adjustment : {"holm", "bonferroni", "sidak"}, default "holm"
        `holm` gives p-values that are never larger than Bonferroni's. "bonferroni" and
        "sidak" agree with the intervals at `simultaneous_confidence`.

    Returns
    -------
    array
        Adjusted p-values, (k,), in the order of `p_values`.

    Raises
    ------
    ValueError
        If the adjustment is unknown.

    Examples
    --------
    >>> adjusted([0.01, 0.04, 0.03]).round(3).tolist()
    [0.03, 0.06, 0.06]
    >>> adjusted([0.01, 0.04, 0.03], "bonferroni").round(3).tolist()
    [0.03, 0.12, 0.09]
    """
    if adjustment not in get_args(Adjustment):
        raise ValueError(unknown("adjustment", adjustment, get_args(Adjustment)))
    p = np.asarray(p_values, np.float64)
    tests = int(np.count_nonzero(~np.isnan(p)))
    if adjustment == "holm":
        return holm(p)
    return (
        np.minimum(1.0, tests * p)
        if adjustment == "bonferroni"
        else -np.expm1(tests * np.log1p(-p))
    )


def max_t(differences: ArrayLike, confidence: float = CONFIDENCE) -> Simultaneous:
    """Return simultaneous confidence intervals of k means, by the bootstrap.

    Whole replicates are resampled. The quantile is the quantile of the largest of the
    k Student statistics (Westfall and Young 1993, Resampling-Based Multiple Testing,
    section 2; Romano and Wolf 2005, Econometrica 73, 1237-1282). The method includes
    the correlation of contrasts with a common reference, so the intervals are narrower
    than Bonferroni's.

    The statistic is studentised in each resample. Otherwise few replicates would give
    intervals that are too narrow. The intervals are approximate: for about ten
    replicates they are too wide rather than too narrow.

    Parameters
    ----------
    differences : array_like
        Differences of k contrasts in n independent replicates, (n, k).
    confidence : float, default 0.95
        Simultaneous confidence of all intervals.

    Returns
    -------
    Simultaneous
        The means of the k contrasts. Bounds and p are NaN for a contrast if all
        differences but at most one are equal. The resamples of the contrast are equal
        too, so the contrast is left out.

    Raises
    ------
    ValueError
        If there are fewer than ten replicates, or a value is not finite.

    Examples
    --------
    >>> first = [0.12, 0.05, 0.11, 0.09, 0.14, 0.02, 0.08, 0.1, 0.07, 0.12]
    >>> second = [0.03, -0.04, 0.05, 0.0, 0.06, -0.05, 0.01, 0.02, -0.02, 0.04]
    >>> means = max_t(np.column_stack([first, second]))
    >>> means.value.round(3).tolist(), means.low.round(3).tolist()
    ([0.09, 0.01], [0.061, -0.02])
    >>> means.p.round(4).tolist()
    [0.0004, 0.4734]
    """
    values = np.asarray(differences, np.float64)
    n = len(values)
    if values.ndim != 2 or n < FEWEST_REPLICATES:
        raise ValueError(
            f"max_t: {n} replicates; allowed: {FEWEST_REPLICATES} or more, one per row"
        )
    if not np.isfinite(values).all():
        raise ValueError(
            "max_t: a value is missing or infinite; leave incomplete replicates out"
        )
    alike = equal(values, np.median(values, axis=0)).sum(axis=0)
    varying = np.flatnonzero(n - alike > ONE_APART)
    mean = values.mean(axis=0)
    half, p = np.full((2, len(mean)), np.nan)
    if len(varying):
        error = values[:, varying].std(axis=0, ddof=1) / np.sqrt(n)
        centred = values[:, varying] - mean[varying]
        largest = np.abs(student_statistics(centred)).max(axis=1)
        half[varying] = np.quantile(largest, confidence, method="higher") * error
        reached = largest[:, None] >= np.abs(ratio(mean[varying], error))
        p[varying] = (reached.sum(axis=0) + 1.0) / (len(largest) + 1.0)
    return Simultaneous(mean, mean - half, mean + half, p)
