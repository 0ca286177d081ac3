"""Recorded series: end of the burn-in, autocorrelation time and drift of the mean.

A series (T,) belongs to one trial. Several series (m, T) come from independent trials
with equal parameters. Times are in recorded frames. All functions concern the mean, and
do not detect a change of the variance alone.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sweep.analysis.estimate import mean_estimate

Floats = NDArray[np.float64]

BATCH = 5
"""Frames per mean of MSER-5."""
WINDOW = 5.0
"""Lag in units of tau at which the sum of the autocorrelation ends."""
LONG_ENOUGH = 50.0
"""Length in units of tau below which tau is too small on average.

Sokal (1997); emcee warns at the same length.
"""
EARLY = 0.1
LATE = 0.5
"""Fractions of the frames whose means `drift` compares."""
ENOUGH_SERIES = 10
"""Fewest series that are tested by their differences, without the autocorrelation."""
FEWEST_FRAMES = 20
LARGEST_SHARE = 0.5
"""Largest tau/T in the correction of a variance."""


class BurnIn(NamedTuple):
    """Number of frames to leave out from the start.

    Attributes
    ----------
    frames : int
        Number of recorded frames; 0 if no end was found.
    end_found : bool
        False if the transient has no end in the series.
    """

    frames: int
    end_found: bool


class Autocorrelation(NamedTuple):
    """Integrated autocorrelation time and effective sample size.

    Attributes
    ----------
    tau : float
        Integrated autocorrelation time, in recorded frames.
    effective : float
        Effective sample size: the number of independent values with an equal error of
        the mean.
    reliable : bool
        True if the series are at least 50 tau long. Otherwise tau is likely to be too
        small, and the sample size too large.
    """

    tau: float
    effective: float
    reliable: bool


class Drift(NamedTuple):
    """Change of the mean between the start and the end of a series.

    Attributes
    ----------
    difference : float
        Mean of the first tenth of the frames minus that of the second half, in the unit
        of the series.
    p : float
        Two-sided p-value of no drift.
    """

    difference: float
    p: float


def burn_in(series: ArrayLike) -> BurnIn:
    """Return the truncation of MSER-5 for a series, or for the mean of several series.

    Means of five frames are left out from the start until the error of the remaining
    mean is smallest. The error is computed as for white noise (White 1997, Simulation
    69, 323-334; Franklin and White 2008, Proc. Winter Simul. Conf., 541-546). A minimum
    in the second half is not the end of the transient: `end_found` is then False, and
    no frame is left out. The method is not valid for series that oscillate with a
    period of the series length or longer.

    Parameters
    ----------
    series : array_like
        A series (T,), or several series (m, T), T at least 20.

    Returns
    -------
    BurnIn
        The number of recorded frames to leave out, a multiple of five.

    Raises
    ------
    ValueError
        If there are fewer than 20 frames, or a value is not finite.

    Examples
    --------
    >>> t = np.arange(400)
    >>> burn_in(0.8 - 0.6 * np.exp(-t / 10) + 0.02 * np.sin(t))
    BurnIn(frames=45, end_found=True)
    >>> burn_in(0.8 - 0.001 * t)
    BurnIn(frames=0, end_found=False)
    """
    values = as_series(series).mean(axis=0)
    if len(values) < FEWEST_FRAMES:
        raise ValueError(
            f"series of {len(values)} frames; allowed: {FEWEST_FRAMES} or more"
        )
    batches = values[: len(values) // BATCH * BATCH].reshape(-1, BATCH).mean(axis=1)
    centred = batches - batches.mean()
    left = np.arange(len(batches), 0, -1)
    sums = np.cumsum(centred[::-1])[::-1]
    squares = np.cumsum((centred * centred)[::-1])[::-1]
    # The last means are left out: so few means may agree by chance.
    error = ((squares - sums * sums / left) / (left * left))[
        : len(batches) - min(BATCH, len(batches) // 2)
    ]
    first = int(np.argmin(error))
    return (
        BurnIn(first * BATCH, True) if first <= len(batches) // 2 else BurnIn(0, False)
    )


def autocorrelation(series: ArrayLike) -> Floats:
    """Return the autocorrelation function at lags 0 to T - 1.

    For several series, the autocovariances about the mean of each series are averaged.
    Fourier transforms compute the autocovariances, with the divisor T at every lag.

    Parameters
    ----------
    series : array_like
        A series (T,), or several series (m, T), T at least 2.

    Returns
    -------
    array
        Correlation at each lag in recorded frames, (T,); 1 at lag 0. NaN if no series
        varies.

    Raises
    ------
    ValueError
        If the shape is invalid, or a value is not finite.

    Examples
    --------
    >>> autocorrelation([1, 3, 1, 3, 1, 3]).round(2).tolist()
    [1.0, -0.83, 0.67, -0.5, 0.33, -0.17]
    """
    values = as_series(series)
    length = values.shape[1]
    centred = values - values.mean(axis=1, keepdims=True)
    spectrum = (
        np.abs(np.fft.rfft(centred, n=1 << (2 * length - 1).bit_length(), axis=1)) ** 2
    )
    covariance = np.fft.irfft(spectrum.mean(axis=0))[:length]
    varies = bool((np.ptp(values, axis=1) > 0.0).any())
    return np.asarray(
        covariance / covariance[0] if varies else np.full(length, np.nan), np.float64
    )


def integrated_time(series: ArrayLike) -> Autocorrelation:
    """Return the integrated autocorrelation time and the effective sample size.

    tau = 1 + 2 sum of the autocorrelation, in frames, and the size is m T/tau. The sum
    ends at the first lag that is at least 5 tau (Sokal 1997, Monte Carlo Methods in
    Statistical Mechanics, section 3). Goodman and Weare (2010) and emcee use the method
    for several series. The series must be stationary: a drift, or a remaining burn-in,
    makes tau large.

    Parameters
    ----------
    series : array_like
        A series (T,), or several series (m, T), T at least 2.

    Returns
    -------
    Autocorrelation
        tau and the size are NaN if no series varies.

    Raises
    ------
    ValueError
        If the shape is invalid, or a value is not finite.

    Examples
    --------
    >>> noise = np.random.default_rng(2).normal(size=10004)
    >>> smoothed = np.convolve(noise, np.ones(5) / 5, mode="valid")
    >>> time = integrated_time(smoothed)
    >>> len(smoothed), round(time.tau, 1), round(time.effective), time.reliable
    (10000, 5.0, 2008, True)
    """
    values = as_series(series)
    times = 2.0 * np.cumsum(autocorrelation(values)) - 1.0
    # For negative correlations tau is below 1, as a difference of larger terms. The
    # sum must include these terms.
    beyond = np.arange(len(times)) >= WINDOW * np.maximum(times, 1.0)
    tau = float(times[np.argmax(beyond)] if beyond.any() else times[-1])
    tau = max(tau, 1.0 / len(times)) if not math.isnan(tau) else tau
    return Autocorrelation(
        tau, values.size / tau, not values.shape[1] < LONG_ENOUGH * tau
    )


def drift(series: ArrayLike) -> Drift:
    """Test the mean of the first tenth of the frames against the second half.

    The test follows Geweke (1992). For ten or more series, a Student test compares the
    differences of the series. For fewer series, the error comes from the variance and
    the autocorrelation time of the second half, under the assumption that the second
    half is steady. The p-value of fewer series is not reliable if the second half is
    shorter than 50 tau.

    Parameters
    ----------
    series : array_like
        A series (T,), or several series (m, T), T at least 2.

    Returns
    -------
    Drift
        The p-value is 1 if no series varies and the means are equal. The p-value is NaN
        for ten or more equal differences.

    Raises
    ------
    ValueError
        If the shape is invalid, or a value is not finite.

    Examples
    --------
    >>> steady = np.random.default_rng(0).normal(0.8, 0.05, (10, 200))
    >>> round(drift(steady).p, 2)
    0.77
    >>> moved = drift(steady + np.linspace(0.0, 0.1, 200))
    >>> round(moved.difference, 2), moved.p < 0.001
    (-0.07, True)
    """
    values = as_series(series)
    length = values.shape[1]
    early = values[:, : max(1, round(EARLY * length))]
    late = values[:, length - round(LATE * length) :]
    differences = early.mean(axis=1) - late.mean(axis=1)
    difference = float(differences.mean())
    if len(values) >= ENOUGH_SERIES:
        return Drift(difference, mean_estimate(differences).p_value())
    time = integrated_time(late)
    if math.isnan(time.tau):
        return Drift(difference, float(difference == 0.0))
    variance = (
        series_variance(late, time.tau)
        * time.tau
        * (1.0 / early.size + 1.0 / late.size)
    )
    return Drift(
        difference,
        _two_sided(difference / math.sqrt(variance), max(1.0, time.effective - 1.0)),
    )


def series_variance(series: ArrayLike, tau: float) -> float:
    """Return the variance of single values about the true mean.

    The variance about the mean of each series is smaller by a fraction tau/T.
    """
    values = as_series(series)
    share = min(tau / values.shape[1], LARGEST_SHARE)
    return float(values.var(axis=1).mean() / (1.0 - share))


def as_series(series: ArrayLike) -> Floats:
    """Return one or several series as an array (m, T).

    Raises ValueError for an invalid shape and for values that are not finite.
    """
    values = np.atleast_2d(np.asarray(series, np.float64))
    if values.ndim != 2 or values.shape[1] < 2:
        raise ValueError(
            f"series of shape {np.shape(series)}; allowed: (T,) or (m, T), T above 1"
        )
    if not np.isfinite(values).all():
        raise ValueError(
            "a series has missing or infinite values; leave that series out"
        )
    return values


def _two_sided(statistic: float, freedom: float) -> float:
    from scipy.stats import t

    tail: float = t.sf(abs(statistic), freedom)
    return 2.0 * float(tail)
