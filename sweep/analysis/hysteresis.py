"""The hysteresis loop between the increasing and the decreasing branch of a parameter.

The links of a chain are dependent, because each link begins with the final flock of the
previous link. Chains are independent. Therefore means are over one number per chain.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sweep.analysis.intervals import Interval, mean_interval
from sweep.analysis.notation import ROUNDING_ERROR

Floats = NDArray[np.float64]


class Loop(NamedTuple):
    """A hysteresis loop over k values of a parameter.

    Attributes
    ----------
    area : Interval
        Integral of down - up over the parameter, by the trapezoidal rule, with a
        confidence interval.
    chains : int
        Number of complete chains.
    difference, low, high : array
        Mean of down - up at each value, and the bounds of the confidence interval, (k,)
        each. The k intervals are simultaneous.
    apart : array of bool
        True where the interval excludes zero by more than a rounding error, (k,).
    width : float
        Distance from the smallest to the largest value at which `apart` is True, in the
        unit of the parameter; 0 if `apart` is False everywhere.
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
    """Return the hysteresis loop of a metric.

    Parameters
    ----------
    values : array_like
        Values of the parameter, (k,), ascending.
    up, down : array_like
        Metric of each chain at each value, (c, k) each, while the parameter increases
        and while it decreases. Chains with a value that is not finite do not count.
    confidence : float, default 0.95
        Confidence of the area, and simultaneous confidence of the k differences
        (Bonferroni).

    Returns
    -------
    Loop
        With Student's intervals over chains; NaN for fewer than two chains.
    """
    along = np.asarray(values, np.float64)
    lower = np.asarray(up, np.float64)
    upper = np.asarray(down, np.float64)
    gaps = upper - lower
    gaps = gaps[np.isfinite(gaps).all(axis=1)]
    each = 1.0 - (1.0 - confidence) / max(len(along), 1)
    means = [mean_interval(column, each, "t") for column in gaps.T]
    difference, low, high = (
        np.array([getattr(mean, name) for mean in means])
        for name in ("value", "low", "high")
    )
    sizes = abs(np.concatenate([lower, upper]))
    size = np.max(sizes[np.isfinite(sizes)], initial=0.0)
    apart = ((low > 0.0) | (high < 0.0)) & (abs(difference) > ROUNDING_ERROR * size)
    where = along[apart]
    return Loop(
        area=mean_interval(np.trapezoid(gaps, along, axis=1), confidence, "t"),
        chains=len(gaps),
        difference=difference,
        low=low,
        high=high,
        apart=apart,
        width=float(where.max() - where.min()) if len(where) else 0.0,
    )
