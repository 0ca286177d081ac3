"""The bootstrap and the jackknife.

The bootstrap resamples replicates. The jackknife leaves out each replicate in turn.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

RESAMPLES = 4999
RESAMPLING_SEED = 20
"""Fixed seed: identical values have identical confidence intervals in every run."""
MOST_NUMBERS = 5_000_000
"""Most resampled numbers in memory at once: 40 MB."""


def resampled_interval(
    values: Floats, statistic: Callable[..., Any], confidence: float, method: str
) -> tuple[float, float]:
    """Return a bootstrap confidence interval of a statistic.

    Parameters
    ----------
    values : array
        (n,).
    statistic : callable
        Function of values, vectorised as scipy's `bootstrap` needs it.
    confidence : float
    method : {"BCa", "percentile"}
        Kind of confidence interval, as in scipy's `bootstrap`.

    Returns
    -------
    low, high : float
        Equal bounds if all values are equal.
    """
    from scipy.stats import bootstrap

    if np.all(values == values[0]):
        return float(values[0]), float(values[0])
    resample: Any = bootstrap
    low, high = resample(
        (values,),
        statistic,
        n_resamples=RESAMPLES,
        batch=max(1, MOST_NUMBERS // len(values)),
        vectorized=True,
        confidence_level=confidence,
        method=method,
        random_state=np.random.default_rng(RESAMPLING_SEED),
    ).confidence_interval
    return float(low), float(high)


def studentised_interval(values: Floats, confidence: float) -> tuple[float, float]:
    """Return the bootstrap-t confidence interval of the mean of values (n,).

    The bounds are equal if all values are equal.
    """
    if np.all(values == values[0]):
        return float(values[0]), float(values[0])
    mean = values.mean()
    error = values.std(ddof=1) / np.sqrt(len(values))
    tails = [0.5 + confidence / 2, 0.5 - confidence / 2]
    statistics = student_statistics((values - mean)[:, None])[:, 0]
    high, low = np.quantile(statistics, tails, method="nearest")
    return float(mean - high * error), float(mean - low * error)


def student_statistics(centred: Floats) -> Floats:
    """Return Student's statistic of k means in resamples of rows, (RESAMPLES, k).

    `centred` are (n, k), with column means of zero. The statistic of a resample with a
    mean of 0 is 0; otherwise the statistic is infinite for a standard error of 0.
    """
    n = len(centred)
    rng = np.random.default_rng(RESAMPLING_SEED)
    statistics = []
    batch = max(1, MOST_NUMBERS // n)
    for first in range(0, RESAMPLES, batch):
        # Counts of the drawn rows turn sums over a resample into matrix products.
        rows = np.arange(min(batch, RESAMPLES - first))[:, None]
        drawn = rng.integers(0, n, (len(rows), n)) + n * rows
        weights = np.bincount(drawn.ravel(), minlength=n * len(rows)).reshape(-1, n) / n
        means = weights @ centred
        errors = np.sqrt(
            np.maximum(weights @ (centred * centred) - means * means, 0.0) / (n - 1)
        )
        statistics.append(ratio(means, errors))
    return np.concatenate(statistics)


def ratio(mean: Floats, error: Floats) -> Floats:
    """Return Student's statistic, mean / standard error.

    Zero for a mean of 0; otherwise infinite for an error of 0.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(mean == 0.0, 0.0, mean / error)


def pseudo_values(values: Floats, statistic: Callable[..., Floats]) -> Floats:
    """Return the pseudo-values of the jackknife, k f(all) - (k - 1) f(all but one).

    f is a smooth function of the m column means. The mean of the pseudo-values
    estimates f without the bias of first order in 1/k. Student's interval of the
    pseudo-values is the jackknife's confidence interval (Tukey 1958, Ann. Math. Stat.
    29, 614; Miller 1974, Biometrika 61, 1-15).

    Parameters
    ----------
    values : array
        Values of k independent rows, (k, m).
    statistic : callable
        Takes m arrays (n,) of column means and returns f as (n,).

    Returns
    -------
    array
        Pseudo-value of each row, (k,). For a single row, the result is f of the row.

    Examples
    --------
    >>> x = np.array([1.0, 2.0, 4.0, 5.0])
    >>> columns = np.column_stack([x, x * x])
    >>> variances = pseudo_values(columns, lambda mean, square: square - mean * mean)
    >>> variances.round(2).tolist()
    [5.33, 1.33, 1.33, 5.33]
    >>> round(float(variances.mean()), 3), round(float(x.var(ddof=1)), 3)
    (3.333, 3.333)
    """
    k = len(values)
    if k < 2:
        return statistic(*values.T)
    means = values.mean(axis=0)
    means_without = means + (means - values) / (k - 1)
    return k * statistic(*means[:, None]) - (k - 1) * statistic(*means_without.T)
