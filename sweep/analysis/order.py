"""Fluctuations of an order parameter, which distinguish a transition to order.

m is the order parameter, such as the polarization (Vicsek et al. 1995, Phys. Rev. Lett.
75, 1226-1229): near 0 in disorder, 1 in perfect order. `samples` are the values of m:
(k,) for k independent trials, or (k, T) for T frames of each trial after the burn-in.
Moments are means over all frames of all trials. The jackknife leaves out whole trials,
because only trials are independent; no autocorrelation time is needed. The jackknife
removes the bias of first order in 1/k. The confidence intervals are Student's intervals
of the pseudo-values (Tukey 1958, Ann. Math. Stat. 29, 614; Miller 1974, Biometrika 61,
1-15).
"""

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from sweep.analysis.estimate import CONFIDENCE
from sweep.analysis.intervals import Interval, mean_interval
from sweep.analysis.resampling import pseudo_values
from sweep.analysis.steady import SeriesTables
from sweep.text import unknown

Floats = NDArray[np.float64]


def susceptibility(
    samples: ArrayLike, n: int, confidence: float = CONFIDENCE
) -> Interval:
    """Estimate the susceptibility n (<m^2> - <m>^2) of a system of n boids.

    The susceptibility peaks at a transition, and the peak grows with the system. For
    independent boids the susceptibility does not depend on n. The estimate has no bias.

    Parameters
    ----------
    samples : array_like
        Values of m, (k,) or (k, T).
    n : int
        Number of boids.
    confidence : float, default 0.95
        In disorder, 95 % intervals cover 83 % for 12 trials of one frame each, 90 % for
        50 trials, 94 % for 200, and 95 % for 12 trials of 100 independent frames.

    Returns
    -------
    Interval
        With the number of trials.

    Raises
    ------
    ValueError
        If `samples` have an invalid shape, or values that are not finite.

    Examples
    --------
    >>> samples = [[0.31, 0.24, 0.18], [0.27, 0.4, 0.22], [0.15, 0.3, 0.36]]
    >>> chi = susceptibility(samples, n=100)
    >>> round(chi.value, 2), chi.n
    (0.62, 3)
    """
    return mean_interval(susceptibility_values(samples, n), confidence)


def binder_cumulant(samples: ArrayLike, confidence: float = CONFIDENCE) -> Interval:
    """Estimate Binder's cumulant U = 1 - <m^4>/(3 <m^2>^2).

    Binder (1981, Z. Phys. B 43, 119-140). U is 2/3 in perfect order. In disorder U is
    1/3 if m is the length of a mean of headings in the plane, and 0 if m has a single
    component. At a continuous transition the curves of different sizes meet in one
    point. If phases coexist, U falls below the value in disorder. An estimate may
    exceed the limits by the statistical error.

    Parameters
    ----------
    samples : array_like
        Values of m, (k,) or (k, T).
    confidence : float, default 0.95
        In disorder, 95 % intervals cover 80 % for 12 trials of one frame each, 87 % for
        50 trials, 91 % for 200, and 94 % for 12 trials of 100 independent frames.

    Returns
    -------
    Interval
        With the number of trials. NaN if m is always 0. The bounds are NaN for a single
        trial.

    Raises
    ------
    ValueError
        If `samples` have an invalid shape, or values that are not finite.

    Examples
    --------
    >>> ordered = [[0.97, 0.98, 0.96], [0.95, 0.97, 0.98], [0.99, 0.96, 0.97]]
    >>> [round(number, 4) for number in binder_cumulant(ordered)]
    [0.6665, 0.6663, 0.6667, 3]
    """
    return mean_interval(binder_values(samples), confidence)


def susceptibility_values(samples: ArrayLike, n: int) -> Floats:
    """Return the pseudo-values whose mean is `susceptibility`.

    Contrasts between independent samples use the pseudo-values as values.

    Parameters
    ----------
    samples : array_like
        Values of m, (k,) or (k, T).
    n : int
        Number of boids.

    Returns
    -------
    array
        Pseudo-value of each trial, (k,).

    Raises
    ------
    ValueError
        If `samples` have an invalid shape, or values that are not finite.

    Examples
    --------
    >>> a = susceptibility_values([0.31, 0.24, 0.18, 0.4], n=100)
    >>> b = susceptibility_values([0.97, 0.95, 0.98, 0.96], n=100)
    >>> round(independent_contrast(a, b).value, 2)
    -0.88
    """
    return n * pseudo_values(
        _moments(samples), lambda first, second, _: second - first * first
    )


def binder_values(samples: ArrayLike) -> Floats:
    """Return the pseudo-values whose mean is `binder_cumulant`.

    Contrasts between independent samples use the pseudo-values as values.

    Parameters
    ----------
    samples : array_like
        Values of m, (k,) or (k, T).

    Returns
    -------
    array
        Pseudo-value of each trial, (k,).

    Raises
    ------
    ValueError
        If `samples` have an invalid shape, or values that are not finite.

    Examples
    --------
    >>> a = binder_values([0.31, 0.24, 0.18, 0.4])
    >>> b = binder_values([0.97, 0.95, 0.98, 0.96])
    >>> round(independent_contrast(a, b).value, 2)
    0.14
    """
    return pseudo_values(_moments(samples), _binder)


def order_parameters(
    study: SeriesTables, metric: str, burn_in: int = 0, confidence: float = CONFIDENCE
) -> pd.DataFrame:
    """Return the moments of an order parameter at each point of a study.

    Parameters
    ----------
    study : study
        A stored study.
    metric : str
        Recorded series that is the order parameter.
    burn_in : int, default 0
        Step of the first frame that counts; `steady_states` estimates it.
    confidence : float, default 0.95
        Confidence of each interval alone.

    Returns
    -------
    DataFrame
        A row per point. Columns: the varied parameters; order (the mean),
        susceptibility and binder, each with _low and _high; trials (number of trials);
        frames (number of frames per trial); and left_out (number of trials that are not
        done or lack a value).

    Raises
    ------
    ValueError
        If the study has not recorded `metric`, or has no frame from `burn_in` on.

    Examples
    --------
    >>> study = sweep.load("my/first")
    >>> table = order_parameters(study, "polarization", burn_in=50).round(2)
    >>> table[["separation_weight", "order", "susceptibility", "binder", "frames"]]
       separation_weight  order  susceptibility  binder  frames
    0                0.5   0.49            1.30    0.47      51
    1                1.0   0.37            1.06    0.39      51
    2                2.0   0.50            1.03    0.54      51
    """
    trials = study.trials
    rows = []
    for point, samples in order_samples(study, metric, burn_in).items():
        at = trials[trials["point"] == point]
        intervals = {
            "order": mean_interval(samples.mean(axis=1), confidence),
            "susceptibility": susceptibility(samples, int(at["n"].iloc[0]), confidence),
            "binder": binder_cumulant(samples, confidence),
        }
        row = {name: at[name].iloc[0] for name in study.varied}
        for name, interval in intervals.items():
            row |= {
                name: interval.value,
                f"{name}_low": interval.low,
                f"{name}_high": interval.high,
            }
        count, frames = samples.shape
        rows.append(
            row | {"trials": count, "frames": frames, "left_out": len(at) - count}
        )
    return pd.DataFrame(rows)


def order_samples(
    study: SeriesTables, metric: str, burn_in: int = 0
) -> dict[str, Floats]:
    """Return the samples of an order parameter at each point of a study.

    Parameters
    ----------
    study : study
        A stored study.
    metric : str
        Recorded series that is the order parameter.
    burn_in : int, default 0
        Step of the first frame that counts.

    Returns
    -------
    dict
        Samples (k, T) of the k trials that are done and lack no value, by the hash of
        the point in `study.trials`. Points are in the order of the study.

    Raises
    ------
    ValueError
        If the study has not recorded `metric`, or has no frame from `burn_in` on.

    Examples
    --------
    >>> study = sweep.load("my/first")
    >>> samples = order_samples(study, "polarization", burn_in=50)
    >>> [of_point.shape for of_point in samples.values()]
    [(10, 51), (10, 51), (10, 51)]
    """
    if metric not in study.series or metric in ("trial_id", "frame"):
        raise ValueError(
            unknown("recorded series", metric, list(study.series.columns[2:]))
        )
    series = study.series[study.series["frame"] >= burn_in]
    if series.empty:
        raise ValueError(
            f"burn_in: {burn_in}; allowed: at most the last recorded frame,"
            f" {study.series['frame'].max()}"
        )
    done = study.trials[study.trials["status"] == "done"].set_index("trial_id")["point"]
    wide = series[series["trial_id"].isin(done.index)].pivot(
        index="trial_id", columns="frame", values=metric
    )
    samples = {}
    for point, trials in study.trials.groupby("point", sort=False):
        recorded = wide.reindex(trials["trial_id"]).dropna(how="all")
        of_point = recorded.isna().sum() < max(1, len(recorded))
        samples[str(point)] = recorded.loc[:, of_point].dropna().to_numpy(np.float64)
    return samples


def _moments(samples: ArrayLike) -> Floats:
    """Return <m>, <m^2> and <m^4> of each trial, shape (k, 3)."""
    values = np.asarray(samples, np.float64)
    if values.ndim not in (1, 2) or 0 in values.shape[1:]:
        raise ValueError(
            f"samples of shape {values.shape}; allowed: (k,) or (k, T) of k trials"
        )
    if not np.isfinite(values).all():
        raise ValueError(
            "samples have missing or infinite values; leave those trials out"
        )
    frames = values if values.ndim == 2 else values[:, None]
    squares = frames * frames
    return np.stack(
        [power.mean(axis=1) for power in (frames, squares, squares * squares)], axis=1
    )


def _binder(_first: Floats, second: Floats, fourth: Floats) -> Floats:
    square = 3.0 * second * second
    ratio: Floats = np.divide(
        fourth, square, out=np.full(square.shape, np.nan), where=square > 0.0
    )
    return 1.0 - ratio
