"""The bootstrap and the jackknife: what an estimate would have been with other
replicates, or without one of those that there are.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

RESAMPLES = 4999
RESAMPLING_SEED = 20
"""The same values have the same interval in every run."""
MOST_NUMBERS = 5_000_000
"""At once in memory: 40 MB."""


def resampled_interval(
    values: Floats, statistic: Callable[..., Any], confidence: float, method: str
) -> tuple[float, float]:
    """scipy's "BCa" or "percentile" interval of a statistic of `values` (n,); no width
    where all are equal.
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
    """The bootstrap-t interval of the mean of `values` (n,); no width where all are
    equal.
    """
    if np.all(values == values[0]):
        return float(values[0]), float(values[0])
    mean, error = values.mean(), values.std(ddof=1) / np.sqrt(len(values))
    tails = [0.5 + confidence / 2, 0.5 - confidence / 2]
    statistics = student_statistics((values - mean)[:, None])[:, 0]
    high, low = np.quantile(statistics, tails, method="nearest")
    return float(mean - high * error), float(mean - low * error)


def student_statistics(centred: Floats) -> Floats:
    """Student's statistic of each of k means in each resample of the rows of `centred`
    (n, k), whose means are zero.

    Shape (`RESAMPLES`, k). Infinite where a resample has an error of zero, and zero
    where its mean is so too.
    """
    n = len(centred)
    rng, statistics = np.random.default_rng(RESAMPLING_SEED), []
    batch = max(1, MOST_NUMBERS // n)
    for first in range(0, RESAMPLES, batch):
        # How often each row is drawn: sums over a resample are then products of
        # matrices.
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
    """Student's statistic. Without an error it is infinite, or zero for a mean of 0."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(mean == 0.0, 0.0, mean / error)


def pseudo_values(values: Floats, statistic: Callable[..., Floats]) -> Floats:
    """k f(all) - (k - 1) f(all but one) for each of the k rows of `values` (k, m).

    f is a smooth function of the m column means; `statistic` takes m arrays (n,) of
    them, and returns f as (n,). The mean of the pseudo-values estimates f without the
    bias of first order in 1/k, and Student's interval of them is that of the jackknife
    (Tukey 1958, Ann. Math. Stat. 29, 614; Miller 1974, Biometrika 61, 1-15). For a
    single row f of it.
    """
    k = len(values)
    if k < 2:
        return statistic(*values.T)
    whole = values.mean(axis=0)
    others = whole + (whole - values) / (k - 1)
    return k * statistic(*whole[:, None]) - (k - 1) * statistic(*others.T)
