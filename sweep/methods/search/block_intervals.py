"""Estimates of objectives from blocks of trials, with confidence intervals.

The trials of a block share a seed. So whole blocks are independent of each other, and
whole blocks are resampled.
"""

from functools import partial

import numpy as np

from sweep.analysis import (
    CONFIDENCE,
    Interval,
    mean_estimate,
    paired_estimate,
    resampled_interval,
)
from sweep.methods.search.objectives import Floats, Objective


def block_interval(
    objective: Objective, values: Floats, confidence: float = CONFIDENCE
) -> Interval:
    """Return the statistic of an objective with its confidence interval over blocks.

    The interval of a mean follows from the block means, by the distribution of the
    metric, see `sweep.analysis.MeanEstimate`. A CVaR has a BCa bootstrap interval over
    blocks, a quantile a percentile interval. Bootstrap intervals are too narrow if few
    blocks are in the tail. For normal values, intervals of 95 % were measured to cover
    a CVaR of 0.2 in 78 % with 20 blocks and in 90 % with 40. The intervals cover a
    quantile of 0.1 in 88 and 92 %. The worst of some values has no interval, NaN. The
    values do not bound the true worst value. A resample cannot be worse than the values
    (Bickel and Freedman 1981, Ann. Stat. 9, 1196-1217, section 6).

    Parameters
    ----------
    objective : Objective
        Statistic, column and distribution.
    values : array of float
        Values of the column, shape (blocks, scenarios).
    confidence : float, default CONFIDENCE
        Confidence level.

    Returns
    -------
    Interval
        Value, low, high and the number of blocks. Low and high are NaN with fewer than
        two blocks, with equal blocks, and if a result is missing.
    """
    return difference_interval(objective, values, None, confidence)


def difference_interval(
    objective: Objective,
    first: Floats,
    second: Floats | None,
    confidence: float = CONFIDENCE,
) -> Interval:
    """Return the difference of a statistic between paired blocks; see `block_interval`.

    Parameters
    ----------
    objective : Objective
        Statistic, column and distribution.
    first : array of float
        Values, shape (blocks, scenarios).
    second : array of float, optional
        Values to subtract, of equal blocks. Without `second`, the statistic is of
        `first` alone.
    confidence : float, default CONFIDENCE
        Confidence level.

    Returns
    -------
    Interval
        Statistic of `first` minus statistic of `second`.
    """
    value = objective.value(first) - (
        0.0 if second is None else objective.value(second)
    )
    n = len(first)
    kind = objective.statistic.about
    if n < 2 or np.isnan(value) or kind.extreme:
        return Interval(value, np.nan, np.nan, n)
    if kind.averages:
        means = first.mean(axis=1)
        distribution = objective.distribution
        estimate = (
            mean_estimate(means, distribution=distribution)
            if second is None
            else paired_estimate(second.mean(axis=1), means, distribution)
        )
        return Interval(value, *estimate.interval(confidence), n)
    sides = np.stack([first] if second is None else [first, second])
    if np.all(sides == sides[:, :1]):
        return Interval(value, np.nan, np.nan, n)
    statistic = partial(_resampled, sides=sides, objective=objective)
    return Interval(
        value,
        *resampled_interval(
            np.arange(n, dtype=np.float64), statistic, confidence, kind.bootstrap
        ),
        n,
    )


def _resampled(
    drawn: Floats, sides: Floats, objective: Objective, axis: int = -1
) -> Floats:
    """Return the statistic of the first side minus the second side, per resample.

    `drawn` has the numbers of the blocks of each resample, shape (..., n).
    """
    rows = np.moveaxis(drawn, axis, -1).astype(np.intp)
    each = [
        objective.statistic.along(
            side[rows].reshape(*rows.shape[:-1], -1), maximize=objective.maximize
        )
        for side in sides
    ]
    return each[0] if len(each) == 1 else each[0] - each[1]
