"""Statistics of the values of a metric that a search can use.

To add a statistic, write a function and enter it in STATISTICS.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class StatisticKind:
    """A kind of statistic: a single number for many values.

    Attributes
    ----------
    formula : callable
        Returns the statistic along the last axis from `values`, `share` and `maximize`.
        `values` has the shape (..., n), n above zero, without NaN; the result has the
        shape (...). With `maximize` smaller values are worse, otherwise larger values.
    text : str
        Description of the statistic.
    takes_share : bool, default False
        True if specs give a fraction, above 0 and below 1, such as `{quantile: 0.1}`.
        Other statistics get NaN.
    label : str, default ""
        Name in reports, if not the name in specs.
    averages : bool, default False
        True if the statistic is the mean over blocks of means of blocks. Student's
        intervals and tests then hold.
    extreme : bool, default False
        True if the statistic is a member of the values, and more values can only make
        it worse. A confidence interval then cannot bound the worst value.
    bootstrap : {"BCa", "percentile"}, default "BCa"
        Kind of the bootstrap interval of a statistic that neither averages nor is
        extreme.
    tail : callable, optional
        Returns the fraction of the values that the statistic rests on, from `share`.
    """

    formula: Callable[[Floats, float, bool], Floats]
    text: str
    takes_share: bool = False
    label: str = ""
    averages: bool = False
    extreme: bool = False
    bootstrap: Literal["BCa", "percentile"] = "BCa"
    tail: Callable[[float], float] | None = None


def mean(values: Floats, _share: float, _maximize: bool) -> Floats:
    """Return the mean along the last axis.

    Parameters
    ----------
    values : array
        (..., n), n above zero, no NaN.
    _share : float
        Not used.
    _maximize : bool
        Not used.
    """
    return np.asarray(values.mean(axis=-1))


def worst(values: Floats, _share: float, maximize: bool) -> Floats:
    """Return the worst value along the last axis.

    Parameters
    ----------
    values : array
        (..., n), n above zero, no NaN.
    _share : float
        Not used.
    maximize : bool
        Whether larger values are better.
    """
    return np.asarray(values.min(axis=-1) if maximize else values.max(axis=-1))


def quantile(values: Floats, share: float, _maximize: bool) -> Floats:
    """Return the quantile along the last axis, whichever direction is better.

    The quantile is interpolated linearly, numpy's default.

    Parameters
    ----------
    values : array
        (..., n), n above zero, no NaN.
    share : float
        Probability of the quantile.
    _maximize : bool
        Not used.
    """
    return np.asarray(np.quantile(values, share, axis=-1))


def cvar(values: Floats, share: float, maximize: bool) -> Floats:
    """Return the mean of the worst fraction of the values, along the last axis.

    The last of the worst values is weighted by the part that belongs to the fraction
    (Rockafellar and Uryasev 2000, Journal of Risk 2, 21-41).

    Parameters
    ----------
    values : array
        (..., n), n above zero, no NaN.
    share : float
        Fraction of the values.
    maximize : bool
        Whether larger values are better.
    """
    ordered = np.sort(values, axis=-1) if maximize else -np.sort(-values, axis=-1)
    size = share * ordered.shape[-1]
    weights = np.clip(size - np.arange(ordered.shape[-1]), 0.0, 1.0)
    return np.asarray(ordered @ weights / size)


STATISTICS: dict[str, StatisticKind] = {
    "mean": StatisticKind(mean, "the mean of all values", averages=True),
    "worst": StatisticKind(worst, "the worst of all values", extreme=True),
    "quantile": StatisticKind(
        quantile,
        "the value below which this fraction of all values is",
        takes_share=True,
        bootstrap="percentile",
        tail=lambda share: min(share, 1.0 - share),
    ),
    "cvar": StatisticKind(
        cvar,
        "conditional value at risk: the mean of the worst fraction of all values",
        takes_share=True,
        label="CVaR",
        tail=lambda share: share,
    ),
}
"""Statistics by the names in specs."""
USUAL = "mean"
"""Statistic of a constraint that names no statistic; reports leave this name out."""
