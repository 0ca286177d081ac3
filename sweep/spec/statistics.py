"""The statistics that a search can take of the values of a metric.

To add one, write a function and enter it in STATISTICS.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class StatisticKind:
    """One number for many values: how it is computed, and what is known of it.

    `formula(values, share, maximize)` gives it along the last axis of `values`
    (..., n), n above zero and none of them NaN; its result has the shape (...).
    `maximize` says which values are the worse ones: the smaller, else the larger.

    `text` says what it is. `takes_share` says that specs give it a share, above 0 and
    below 1, as in `{quantile: 0.1}`; others get NaN for it. `words` is its name in
    reports, where that is not its name in specs.

    The rest decides which intervals and tests it has. `averages`: it is the mean over
    blocks of the means of blocks, so that Student's hold. `extreme`: it is one of the
    values, and more of them can only make it worse, so that no interval says how bad it
    can get. All others are resampled: `bootstrap` is the kind of their interval, and
    `tail` says which part of the values they rest on, by their share.
    """

    formula: Callable[[Floats, float, bool], Floats]
    text: str
    takes_share: bool = False
    words: str = ""
    averages: bool = False
    extreme: bool = False
    bootstrap: Literal["BCa", "percentile"] = "BCa"
    tail: Callable[[float], float] | None = None


def mean(values: Floats, _share: float, _maximize: bool) -> Floats:
    """The mean."""
    return np.asarray(values.mean(axis=-1))


def worst(values: Floats, _share: float, maximize: bool) -> Floats:
    """The smallest value where more is better, else the largest."""
    return np.asarray(values.min(axis=-1) if maximize else values.max(axis=-1))


def quantile(values: Floats, share: float, _maximize: bool) -> Floats:
    """The quantile with the probability `share`, whichever direction is better.

    It is interpolated linearly, as numpy does it.
    """
    return np.asarray(np.quantile(values, share, axis=-1))


def cvar(values: Floats, share: float, maximize: bool) -> Floats:
    """The mean of the part `share` of the values, from the worst on.

    The last of the worst values is weighed by the fraction of it that belongs to the
    share (Rockafellar and Uryasev 2000, Journal of Risk 2, 21-41).
    """
    ordered = np.sort(values, axis=-1) if maximize else -np.sort(-values, axis=-1)
    whole = share * ordered.shape[-1]
    weights = np.clip(whole - np.arange(ordered.shape[-1]), 0.0, 1.0)
    return np.asarray(ordered @ weights / whole)


STATISTICS: dict[str, StatisticKind] = {
    "mean": StatisticKind(mean, "the mean of all values", averages=True),
    "worst": StatisticKind(worst, "the worst of all values", extreme=True),
    "quantile": StatisticKind(
        quantile,
        "the value below which this part of all values lies",
        takes_share=True,
        bootstrap="percentile",
        tail=lambda share: min(share, 1.0 - share),
    ),
    "cvar": StatisticKind(
        cvar,
        "conditional value at risk: the mean of this part of all values, the worst",
        takes_share=True,
        words="CVaR",
        tail=lambda share: share,
    ),
}
"""By their names in specs."""
USUAL = "mean"
"""What a constraint takes where it does not say it, and what goes without saying."""
