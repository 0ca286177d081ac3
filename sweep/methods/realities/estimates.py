"""Estimates over pseudo-realities, each with a confidence interval.

The trials of a controller form a table: a row per pseudo-reality, and a column per
replicate. Rows are independent draws. Columns are independent too, but trials of one
column may share random numbers. So the mean of the table has the variance of the row
means over the number of rows, plus the variance of the column means over the number of
columns. The noise within the table counts twice, which makes intervals a little wide.

A table without spread has no such variance. Trials on the diagonal share neither row
nor column, so as many values as the shorter side has are independent.
"""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from sweep.analysis import Interval, equal, mean_interval

Floats = NDArray[np.float64]

TENTH = 0.1
"""Fraction of the draws in the worst tenth."""


def known_means(table: Floats, axis: int) -> Floats:
    """Return means of finite values along an axis; NaN without finite values."""
    finite = np.isfinite(table)
    count = finite.sum(axis=axis)
    total = np.where(finite, table, 0.0).sum(axis=axis)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def varies(values: Floats) -> bool:
    """Return whether the finite values differ by more than a rounding error."""
    finite = values[np.isfinite(values)]
    return len(finite) > 0 and not equal(finite.min(), finite.max())


def fewer_known(rows: Floats, columns: Floats) -> Floats:
    """Return the side of a table with fewer finite values."""
    return min((columns, rows), key=lambda side: int(np.isfinite(side).sum()))


def crossed_interval(
    value: float, rows: Floats, columns: Floats, confidence: float
) -> Interval:
    """Return a value with an interval from the spread of rows and of columns.

    Parameters
    ----------
    value : float
        The estimate.
    rows, columns : array
        Independent values, (N,) and (R,). The variance of the estimate is the sum of
        the variances of the two means. NaN does not count.
    confidence : float

    Returns
    -------
    Interval
        Student's, with Welch's degrees of freedom. `n` is the number of rows. Bounds
        are NaN for fewer than two rows or columns, and without any spread.

    Examples
    --------
    >>> interval = crossed_interval(
    ...     0.6, np.array([0.5, 0.6, 0.7]), np.array([0.58, 0.62]), 0.95
    ... )
    >>> round(interval.low, 2), round(interval.high, 2)
    (0.38, 0.82)
    """
    from scipy.stats import t

    parts = [part[np.isfinite(part)] for part in (rows, columns)]
    n = len(parts[0])
    if min(map(len, parts)) < 2:
        return Interval(value, math.nan, math.nan, n)
    squares = [
        float(part.var(ddof=1)) / len(part) if varies(part) else 0.0 for part in parts
    ]
    if sum(squares) == 0.0:
        return Interval(value, math.nan, math.nan, n)
    spread = sum(
        square**2 / (len(part) - 1) for square, part in zip(squares, parts, strict=True)
    )
    quantile = t.ppf(0.5 + confidence / 2, sum(squares) ** 2 / spread)
    half = float(quantile) * math.sqrt(sum(squares))
    return Interval(value, value - half, value + half, n)


def difference_interval(first: Interval, second: Interval) -> Interval:
    """Return the difference of two independent estimates, second - first.

    The distances of the bounds are added as squares (Zou and Donner 2008, Stat. Med.
    27, 1693-1702). So an asymmetric interval keeps its longer side.
    """
    value = second.value - first.value
    below = math.hypot(second.value - second.low, first.high - first.value)
    above = math.hypot(second.high - second.value, first.value - first.low)
    return Interval(value, value - below, value + above, second.n)


def crossed_estimate(
    estimate: Callable[[Floats, float], Interval], table: Floats, confidence: float
) -> Interval:
    """Return an estimate from row means, with the spread of rows and of columns.

    The variance of the columns is the jackknife's, from the estimates without each
    column. The distances of bounds are added as squares (see `difference_interval`).

    Parameters
    ----------
    estimate : callable
        Takes the means of rows without NaN, (N,), and a confidence. Returns an interval
        from the spread of the rows alone.
    table : array
        (N, R). NaN does not count.
    confidence : float

    Returns
    -------
    Interval
        Bounds are NaN for fewer than two columns.

    Examples
    --------
    >>> table = np.linspace(0.0, 1.0, 20)[:, None] + [-0.1, 0.0, 0.1]
    >>> interval = crossed_estimate(worst_mean, table, 0.95)
    >>> round(interval.value, 3), round(interval.low, 2), round(interval.high, 2)
    (0.026, -0.39, 0.44)
    """
    from scipy.stats import t

    measured = table[:, np.isfinite(table).any(axis=0)]
    r = measured.shape[1]
    rows = known_means(measured, 1)
    value, low, high, n = estimate(rows[np.isfinite(rows)], confidence)
    if r < 2:
        return Interval(value, math.nan, math.nan, n)
    without = list[float]()
    for column in range(r):
        rows = known_means(np.delete(measured, column, axis=1), 1)
        without.append(estimate(rows[np.isfinite(rows)], confidence).value)
    error = (r - 1) * float(np.std(without, ddof=1)) / math.sqrt(r)
    half = float(t.ppf(0.5 + confidence / 2, r - 1)) * error
    below = math.hypot(value - low, half)
    above = math.hypot(high - value, half)
    return Interval(value, value - below, value + above, n)


def lost_fraction(advantages: Floats, confidence: float) -> Interval:
    """Return the fraction of negative values, with the interval of a proportion."""
    lost = np.where(advantages < 0.0, 1.0, 0.0)
    return mean_interval(lost, confidence, distribution="proportion")


def worst_mean(
    values: Floats, confidence: float, *, low_is_worst: bool = True
) -> Interval:
    """Return the mean of the worst tenth of the values, with a confidence interval.

    The mean is the conditional value at risk, CVaR (Rockafellar and Uryasev 2002, J.
    Bank. Finance 26, 1443-1471). A value at the edge of the tenth counts in part.

    Parameters
    ----------
    values : array
        Independent values, (N,).
    confidence : float
    low_is_worst : bool, default True

    Returns
    -------
    Interval
        The interval is Student's, from the influence of each value on the mean. The
        degrees of freedom are those of the values in the tenth, at least 1. Bounds are
        NaN for fewer than ten values.

    Examples
    --------
    >>> worst = worst_mean(np.arange(100.0), 0.95)
    >>> worst.value, round(worst.low, 2), round(worst.high, 2)
    (4.5, 0.8, 8.2)
    """
    from scipy.stats import t

    ordered = np.sort(values if low_is_worst else -values)
    n = len(ordered)
    if n == 0:
        return Interval(math.nan, math.nan, math.nan, 0)
    size = TENTH * n
    weights = np.clip(size - np.arange(n), 0.0, 1.0)
    mean = float(weights @ ordered / weights.sum())
    half = math.nan
    if n >= 1 / TENTH:
        edge = ordered[math.ceil(size) - 1]
        influence = edge - np.maximum(edge - ordered, 0.0) / TENTH
        freedom = max(size - 1.0, 1.0)
        error = float(influence.std(ddof=1)) / math.sqrt(n)
        half = float(t.ppf(0.5 + confidence / 2, freedom)) * error
    centre = mean if low_is_worst else -mean
    return Interval(centre, centre - half, centre + half, n)
