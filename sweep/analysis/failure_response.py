"""Resilience of a swarm to a failure: retained performance and time to recover.

The terms come from resilience engineering: M. Bruneau et al. (2003), A framework to
quantitatively assess and enhance the seismic resilience of communities, Earthquake
Spectra 19, 733.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sweep.analysis.intervals import Interval, mean_interval

Floats = NDArray[np.float64]


class Recovery(NamedTuple):
    """Recovery of a trial with a failure, relative to the paired trial without failure.

    `retained` is the retained fraction of the level. `time` is the time from the
    failure until the level is reached again, or NaN if the level is not reached.
    """

    retained: float
    time: float


class Resilience(NamedTuple):
    """Means over several pairs of trials, with confidence intervals.

    `retained` is the mean fraction of the level, `recovered` the proportion of pairs
    that reached the level again, and `time` the mean time to recover in the recovered
    pairs.
    """

    retained: Interval
    recovered: Interval
    time: Interval


def recovery(
    times: Floats, intact: Floats, failing: Floats, at: float, within: float
) -> Recovery:
    """Return how a metric recovers from a failure.

    The level is the mean metric without a failure, over the frames after the failure.
    The level is reached again at the first frame from which all values stay within a
    fraction of the level.

    Parameters
    ----------
    times : array
        Times of the frames of the two trials, (F,), ascending.
    intact : array
        Metric of the trial without a failure, (F,).
    failing : array
        Metric of the trial with the failure, (F,).
    at : float
        Time of the failure, in the unit of `times`.
    within : float
        Largest allowed difference from the level, as a fraction of the level.

    Returns
    -------
    Recovery
        `retained` is the mean of `failing` after the failure, divided by the level.
        `retained` is NaN without a frame after the failure, if a value of `failing`
        after the failure is NaN, and if the level is 0 or not finite. `time` is 0 if
        the level was never left.
    """
    after = times > at
    level = intact[after].mean() if after.any() else np.nan
    if not np.isfinite(level) or level == 0.0 or np.isnan(failing[after]).any():
        return Recovery(np.nan, np.nan)
    retained = float(failing[after].mean() / level)
    outside = np.flatnonzero(np.abs(failing[after] - level) > within * abs(level))
    first = outside[-1] + 1 if len(outside) else 0
    reached = times[after][first:]
    if not first:
        return Recovery(retained, 0.0)
    return Recovery(retained, float(reached[0] - at) if len(reached) else np.nan)


def resilience(pairs: list[Recovery]) -> Resilience:
    """Return means over independent pairs, with 95 % confidence intervals.

    The intervals are for skewed values, and for a proportion in `recovered`. Pairs with
    NaN in `retained` do not count.
    """
    finite = np.array([pair for pair in pairs if np.isfinite(pair.retained)]).reshape(
        -1, 2
    )
    back = np.isfinite(finite[:, 1])
    return Resilience(
        retained=mean_interval(finite[:, 0], distribution="skewed"),
        recovered=mean_interval(back.astype(float), distribution="proportion"),
        time=mean_interval(finite[back, 1], distribution="skewed"),
    )
