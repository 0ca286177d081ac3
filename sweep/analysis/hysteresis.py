"""The loop between two directions in which a setting was changed step by step.

The links of a chain depend on each other, since each begins where the one before has
ended. Chains are independent. So what is averaged is one number a chain.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sweep.analysis.intervals import Interval, mean_interval
from sweep.analysis.notation import ROUNDING_ERROR

Floats = NDArray[np.float64]


class Loop(NamedTuple):
    """A loop over k values of a setting, from `chains` whole chains.

    `area` is that between both directions, with its interval: the integral of down less
    up over the setting, by the trapezoidal rule. `difference` (k,), with `low` and
    `high`, are the means of down less up at each value, whose intervals hold all
    together; `apart` (k,) says where they exclude zero, and no rounding error is the
    reason. `width` is the distance from
    the least to the greatest of these values, 0 where there is none.
    """

    area: Interval
    chains: int
    difference: Floats
    low: Floats
    high: Floats
    apart: NDArray[np.bool_]
    width: float


def loop(
    values: ArrayLike, up: ArrayLike, down: ArrayLike, confidence: float = 0.95
) -> Loop:
    """The loop of a metric.

        values      (k,), ascending: the values of the setting
        up, down    (c, k): the metric of each chain at each value, on either way
        confidence  of the area, and of all differences together (Bonferroni)

    Chains with a value that is not finite take no part. Intervals are Student's over
    chains; NaN for fewer than two of them.
    """
    along = np.asarray(values, np.float64)
    lower, upper = np.asarray(up, np.float64), np.asarray(down, np.float64)
    apart_by = upper - lower
    apart_by = apart_by[np.isfinite(apart_by).all(axis=1)]
    each = 1.0 - (1.0 - confidence) / max(len(along), 1)
    means = [mean_interval(column, each, "t") for column in apart_by.T]
    difference, low, high = (
        np.array([getattr(mean, name) for mean in means])
        for name in ("value", "low", "high")
    )
    sizes = abs(np.concatenate([lower, upper]))
    size = np.max(sizes[np.isfinite(sizes)], initial=0.0)
    apart = ((low > 0.0) | (high < 0.0)) & (abs(difference) > ROUNDING_ERROR * size)
    where = along[apart]
    return Loop(
        mean_interval(np.trapezoid(apart_by, along, axis=1), confidence, "t"),
        len(apart_by),
        difference,
        low,
        high,
        apart,
        float(where.max() - where.min()) if len(where) else 0.0,
    )
