"""How well a swarm stands a failure: what it keeps, and when it has come back.

The words are those of resilience engineering: M. Bruneau et al. (2003), A framework to
quantitatively assess and enhance the seismic resilience of communities, Earthquake
Spectra 19, 733: how much of a performance is left, and how long it takes to recover.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sweep.analysis.intervals import Interval, mean_interval

Floats = NDArray[np.float64]


class Recovery(NamedTuple):
    """Of one pair of trials: the part of the level that is `retained`, and the `time` from
    the failure until the level is reached again, NaN where it is not.
    """

    retained: float
    time: float


class Resilience(NamedTuple):
    """Of several pairs the mean part that is `retained`, the share of them that have
    `recovered`, and the mean `time` of those, each with its interval.
    """

    retained: Interval
    recovered: Interval
    time: Interval


def recovery(
    times: Floats, whole: Floats, failing: Floats, at: float, within: float
) -> Recovery:
    """What a failure at time `at` does to a metric.

    times    (F,), ascending: of the frames of both trials
    whole    (F,): the metric of the trial in which nobody fails
    failing  (F,): that of the other one
    within   which part of the level it may differ by and be reached

    The level is the mean of `whole` over the frames after the failure, and `kept` the
    mean of `failing` over them, divided by it. It is reached again at the first of
    these frames from which on all differ by at most `within` of the level; where that
    is the first one, it was never left. Values are NaN without such a frame, and where
    a value in one is NaN or the level is 0.
    """
    after = times > at
    level = whole[after].mean() if after.any() else np.nan
    if not np.isfinite(level) or level == 0.0 or np.isnan(failing[after]).any():
        return Recovery(np.nan, np.nan)
    kept = float(failing[after].mean() / level)
    outside = np.flatnonzero(np.abs(failing[after] - level) > within * abs(level))
    first = outside[-1] + 1 if len(outside) else 0
    reached = times[after][first:]
    if not first:
        return Recovery(kept, 0.0)
    return Recovery(kept, float(reached[0] - at) if len(reached) else np.nan)


def resilience(pairs: list[Recovery]) -> Resilience:
    """Means over independent pairs, with 95 % intervals: of skewed values, and of a
    proportion. A pair whose values are NaN for another reason than that the level was
    not reached takes no part.
    """
    known = np.array([one for one in pairs if np.isfinite(one.retained)]).reshape(-1, 2)
    back = np.isfinite(known[:, 1])
    return Resilience(
        mean_interval(known[:, 0], distribution="skewed"),
        mean_interval(back.astype(float), distribution="proportion"),
        mean_interval(known[back, 1], distribution="skewed"),
    )
