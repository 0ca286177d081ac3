"""Means and quantiles over replicates, with confidence intervals.

Trials that are not done are counted, and their values are left out.
"""

from collections.abc import Mapping, Sequence
from functools import lru_cache, partial
from types import MappingProxyType
from typing import Any, Literal, NamedTuple, get_args

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from sweep.analysis.estimate import CONFIDENCE, mean_estimate
from sweep.analysis.mean_bounds import (
    Declaration,
    Declared,
    Samples,
    equal,
    in_full,
    mean_bounds,
)
from sweep.analysis.resampling import resampled_interval, studentised_interval
from sweep.text import unknown

Floats = NDArray[np.float64]
MeanKind = Literal["t", "bootstrap", "bootstrap_t"]
QuantileKind = Literal["order", "bootstrap"]

NONE_REPEATED: Mapping[str, float] = MappingProxyType({})
"""No repeated confidence intervals."""
NONE_DECLARED: Mapping[str, Declared] = MappingProxyType({})
"""No declared distributions: all values are normal."""


class Interval(NamedTuple):
    """An estimate with a confidence interval.

    Attributes
    ----------
    value : float
        The estimate, in the unit of the values; NaN without a value.
    low, high : float
        Bounds of the confidence interval, in the same unit; NaN if unknown.
    n : int
        Number of values.
    """

    value: float
    low: float
    high: float
    n: int


def half_width(deviation: Any, n: Any, confidence: float = CONFIDENCE) -> Any:
    """Return the half-width of the Student-t confidence interval of a mean.

    Valid for independent values whose mean is about normal.

    Parameters
    ----------
    deviation : float or array
        Sample standard deviation.
    n : int or array
        Number of values.
    confidence : float, default 0.95

    Returns
    -------
    float or array
        Half-width, in the unit of `deviation`; NaN for fewer than two values.

    Examples
    --------
    >>> half_width(0.05, np.array([5, 10, 40])).round(3).tolist()
    [0.062, 0.036, 0.016]
    """
    from scipy.stats import t

    n = np.asarray(n, np.float64)
    return (
        t.ppf(0.5 + confidence / 2, np.where(n > 1, n - 1, np.nan))
        * deviation
        / np.sqrt(n)
    )


def mean_interval(
    values: ArrayLike,
    confidence: float = CONFIDENCE,
    interval: MeanKind | None = None,
    distribution: Declared = "normal",
) -> Interval:
    """Return the mean of independent values with a confidence interval.

    Parameters
    ----------
    values : array_like
        Independent values, (n,). NaN does not count.
    confidence : float, default 0.95
    interval : {"t", "bootstrap", "bootstrap_t"}, optional
        By default the interval of the distribution, see `sweep.analysis.mean_bounds`.

        - "t", Student's: for means that are about normal.
        - "bootstrap", BCa (Efron 1987, J. Am. Stat. Assoc. 82, 171-185): misses about
          equally often on either side if the distribution is skewed. Too narrow for
          fewer than about 50 values.
        - "bootstrap_t" (Efron and Tibshirani 1993, An Introduction to the Bootstrap,
          section 12.5): wide on the side of the long tail. Unbounded for two or three
          values.
    distribution : Declared, default "normal"
        Distribution and range of the values, from `study.distributions`.

    Returns
    -------
    Interval
        With the number of values that are not NaN. No interval reaches beyond the range
        of the values. The bounds are NaN for fewer than two values.

    Raises
    ------
    ValueError
        If the kind of interval is unknown.

    Examples
    --------
    >>> interval = mean_interval([0.61, 0.58, 0.66, 0.63, 0.6])
    >>> round(interval.value, 3), round(interval.low, 3), round(interval.high, 3)
    (0.616, 0.578, 0.654)
    >>> arrived = [0, 0, 1, 0, 1, 0, 0, 0, 0, 1]
    >>> share = mean_interval(arrived, distribution="proportion")
    >>> round(share.value, 2), round(share.low, 2), round(share.high, 2), share.n
    (0.3, 0.08, 0.62, 10)

    Notes
    -----
    Measured coverage of 95 % intervals, for "t", "bootstrap", "bootstrap_t":
    10 exponential values 90, 88 and 93 % ("skewed" has 95 %), 30 exponential values 93,
    92 and 94 %, 30 lognormal values with sigma = 1 88, 89 and 93 %.
    """
    _check_interval(interval)
    declaration = _declaration_for(interval, distribution)
    estimate = mean_estimate(np.asarray(values, np.float64), distribution=declaration)
    n = estimate.samples[0].n
    if not estimate.testable:
        return Interval(estimate.value, np.nan, np.nan, n)
    # Resamples of equal values are equal too.
    if interval in (None, "t") or estimate.constant:
        return Interval(estimate.value, *estimate.interval(confidence), n)
    if interval == "bootstrap":
        bounds = resampled_interval(_known(values), np.mean, confidence, "BCa")
        return Interval(estimate.value, *bounds, n)
    bounds = studentised_interval(_known(values), confidence)
    low, high = estimate.support.cut(estimate.value, *bounds)
    return Interval(estimate.value, float(low), float(high), n)


def _declaration_for(interval: MeanKind | None, declared: Declared) -> Declaration:
    """Return the declaration for an interval: normal if a kind of interval is named."""
    declaration = in_full(declared)
    return declaration._replace(distribution="normal") if interval else declaration


def quantile_interval(
    values: ArrayLike,
    probability: float,
    confidence: float = CONFIDENCE,
    interval: QuantileKind = "order",
) -> Interval:
    """Return a quantile of independent values with a confidence interval.

    Parameters
    ----------
    values : array_like
        Independent values, (n,). NaN does not count.
    probability : float
        Between 0 and 1; 0.5 for the median.
    confidence : float, default 0.95
    interval : {"order", "bootstrap"}, default "order"
        "order" is the interval between order statistics (Thompson 1936, Ann. Math.
        Stat. 7, 122-128). For any distribution, each bound is missed with a probability
        of at most (1 - `confidence`) / 2, and less often if values are equal.
        "bootstrap" is the percentile interval, approximate and for more than about 20
        values. BCa would need a jackknife, which is not consistent for quantiles (Efron
        and Tibshirani 1993, section 11.6).

    Returns
    -------
    Interval
        With the number of values that are not NaN. The bounds of "order" are NaN for
        too few values: at 95 % the median needs 6, and the quantile at 0.1 needs 36.

    Raises
    ------
    ValueError
        If the kind of interval is unknown, or `probability` is not between 0 and 1.

    Examples
    --------
    >>> quantile_interval([1.2, 1.5, 1.1, 1.9, 1.4, 1.6, 1.3, 1.7, 2.2], 0.5)
    Interval(value=1.5, low=1.2, high=1.9, n=9)
    """
    _check("interval", interval, get_args(QuantileKind))
    if not 0.0 < probability < 1.0:
        raise ValueError(
            f"probability: {probability}; allowed: above 0 and below 1"
            " (0.5 is the median)"
        )
    numbers = _known(values)
    if len(numbers) < 2:
        return Interval(
            float(numbers[0]) if len(numbers) else np.nan, np.nan, np.nan, len(numbers)
        )
    value = float(np.quantile(numbers, probability))
    if interval == "order":
        low, high = _order_bounds(len(numbers), probability, confidence)
        ordered = [np.nan, *np.sort(numbers), np.nan]
        return Interval(value, float(ordered[low]), float(ordered[high]), len(numbers))
    statistic = partial(np.quantile, q=probability)
    return Interval(
        value,
        *resampled_interval(numbers, statistic, confidence, "percentile"),
        len(numbers),
    )


def by_point(
    trials: pd.DataFrame,
    varied: Sequence[str],
    metrics: Sequence[str],
    confidence: float = CONFIDENCE,
    interval: MeanKind | None = None,
    repeated: Mapping[str, float] = NONE_REPEATED,
    distributions: Mapping[str, Declared] = NONE_DECLARED,
) -> pd.DataFrame:
    """Return the mean of each metric over the replicates of each point.

    Parameters
    ----------
    trials : DataFrame
        Rows are trials.
    varied : sequence of str
        Parameters that become columns.
    metrics : sequence of str
        Columns of `trials`.
    confidence : float, default 0.95
        Confidence of each interval alone. `simultaneous_confidence` returns the value
        for simultaneous intervals.
    interval : {"t", "bootstrap", "bootstrap_t"}, optional
        By default the interval of the distribution of the metric.
    repeated : mapping, optional
        Higher confidence by metric, from `study.repeated`. A metric that decided the
        number of trials of a point needs a repeated confidence interval.
    distributions : mapping, optional
        Distribution by metric, from `study.distributions`; "normal" by default.

    Returns
    -------
    DataFrame
        A row per point, in the order of `trials`. Columns: the `varied` parameters; for
        each metric `<metric>` (the mean), `<metric>_low`, `<metric>_high`, `<metric>_n`
        and `<metric>_undefined`; and `not_done`, the number of trials without a result.
        `<metric>_undefined` is the fraction of the done trials that have no value of
        the metric and do not count.

    Raises
    ------
    ValueError
        If the kind of interval is unknown.

    Examples
    --------
    >>> study = sweep.load("my/first")
    >>> means = by_point(study.trials, study.varied, ["speed"]).round(2)
    >>> means[["separation_weight", "speed", "speed_low", "speed_high", "speed_n"]]
       separation_weight  speed  speed_low  speed_high  speed_n
    0                0.5   1.86       1.44        2.28       10
    1                1.0   0.38       0.24        0.51       10
    2                2.0   2.61       2.25        2.97       10
    """
    _check_interval(interval)
    # Grouping by number is several times faster than grouping by string.
    number = pd.Series(pd.factorize(trials["point"])[0], trials.index)
    groups = trials.groupby(number, sort=False)
    columns: dict[str, Any] = {name: groups[name].first() for name in varied}
    for name in metrics:
        nominal = repeated.get(name)
        table = _group_means(
            groups[name],
            confidence if nominal is None else nominal,
            interval if nominal is None else None,
            distributions.get(name, "normal"),
        )
        columns |= {
            name: table["mean"],
            **{f"{name}_{end}": table[end] for end in ("low", "high", "n")},
            f"{name}_undefined": _undefined(trials, name, number),
        }
    columns["not_done"] = _not_done(trials, number)
    return pd.DataFrame(columns).reset_index(drop=True)


def undefined_shares(trials: pd.DataFrame, metric: str) -> "pd.Series[float]":
    """Return the fraction of done trials without a value of a metric, by point.

    For example, the elongation of a flock has no value in a trial without a flock. The
    mean is then over the remaining trials, conditional on a value.

    Parameters
    ----------
    trials : DataFrame
        Rows are trials.
    metric : str
        Column of `trials`.

    Returns
    -------
    Series
        Fraction from 0 to 1 by the id of the point; 0 for a point without a done trial.

    Examples
    --------
    >>> trials = pd.DataFrame({"point": ["a", "a", "b", "b"], "status": "done"})
    >>> trials["elongation"] = [1.4, np.nan, 1.6, 1.2]
    >>> undefined_shares(trials, "elongation").to_dict()
    {'a': 0.5, 'b': 0.0}
    """
    return _undefined(trials, metric, trials["point"])


def quantiles_by_point(
    trials: pd.DataFrame,
    varied: Sequence[str],
    metrics: Sequence[str],
    probabilities: Sequence[float] = (0.25, 0.5, 0.75),
    confidence: float = CONFIDENCE,
) -> pd.DataFrame:
    """Return quantiles of each metric over the replicates of each point.

    Parameters
    ----------
    trials : DataFrame
        Rows are trials.
    varied : sequence of str
        Parameters that become columns.
    metrics : sequence of str
        Columns of `trials`.
    probabilities : sequence of float, default (0.25, 0.5, 0.75)
    confidence : float, default 0.95
        Confidence of each interval alone. Intervals are between order statistics.

    Returns
    -------
    DataFrame
        A row per point, metric and probability; points are in the order of `trials`.
        Columns: the `varied` parameters, metric, probability, value, low, high, n and
        `not_done`; see `quantile_interval` and `by_point`.

    Raises
    ------
    ValueError
        If a probability is not between 0 and 1.

    Examples
    --------
    >>> study = sweep.load("my/first")
    >>> medians = quantiles_by_point(study.trials, study.varied, ["speed"], [0.5])
    >>> medians[["separation_weight", "metric", "value", "low", "high", "n"]].round(2)
       separation_weight metric  value   low  high   n
    0                0.5  speed   1.93  1.11  2.36  10
    1                1.0  speed   0.33  0.23  0.64  10
    2                2.0  speed   2.61  1.96  3.09  10
    """
    not_done = _not_done(trials, trials["point"])
    rows = []
    for point, group in trials.groupby("point", sort=False):
        settings = [group[name].iloc[0] for name in varied]
        for metric in metrics:
            values = group[metric].to_numpy(np.float64)
            for probability in probabilities:
                quantile = quantile_interval(values, probability, confidence)
                row = (*settings, metric, probability, *quantile, not_done[point])
                rows.append(row)
    return pd.DataFrame(
        rows, columns=[*varied, "metric", "probability", *Interval._fields, "not_done"]
    )


def curves(
    series: pd.DataFrame,
    trials: pd.DataFrame,
    by: str,
    metric: str,
    confidence: float = CONFIDENCE,
    interval: MeanKind | None = None,
    distribution: Declared = "normal",
) -> pd.DataFrame:
    """Return the mean of a metric over trials at every frame, by value of a parameter.

    Parameters
    ----------
    series : DataFrame
        Recorded series; rows are frames of trials.
    trials : DataFrame
        Rows are trials. Trials that are not done do not count.
    by : str
        Column of `trials`.
    metric : str
        Column of `series`.
    confidence : float, default 0.95
        Confidence of each frame alone, not of the whole curve.
    interval : {"t", "bootstrap", "bootstrap_t"}, optional
        By default the interval of the distribution.
    distribution : Declared, default "normal"
        Distribution and range of the values, from `study.distributions`.

    Returns
    -------
    DataFrame
        A row per value of `by` and frame. Columns: `by`; frame; mean, low and high, in
        the unit of the metric; and n, the number of values.

    Raises
    ------
    ValueError
        If the kind of interval is unknown.

    Examples
    --------
    >>> study = sweep.load("my/first")
    >>> means = curves(study.series, study.trials, "separation_weight", "speed")
    >>> means[means["frame"] == 100].round(2)
         separation_weight  frame  mean   low  high   n
    100                0.5    100  1.86  1.44  2.28  10
    201                1.0    100  0.38  0.24  0.51  10
    302                2.0    100  2.61  2.25  2.97  10
    """
    _check_interval(interval)
    done = trials.loc[trials["status"] == "done", ["trial_id", by]]
    joined = series[["trial_id", "frame", metric]].merge(done, on="trial_id")
    groups = joined.groupby([by, "frame"], sort=True)[metric]
    return _group_means(groups, confidence, interval, distribution).reset_index()


def group_bounds(
    groups: Any, confidence: float, distribution: Declared, *, cut: bool = True
) -> tuple[Floats, Floats]:
    """Return the bounds of the mean of each of k groups of a column.

    Parameters
    ----------
    groups : SeriesGroupBy
    confidence : float
    distribution : Declared
    cut : bool, default True
        Cut the intervals off at the ends of the range of the values.

    Returns
    -------
    low, high : array
        (k,) each.
    """
    samples = group_samples(groups, distribution)
    name = in_full(distribution).distribution
    low, high = mean_bounds(name, samples, (1.0 - confidence) / 2.0)
    if not cut:
        return low, high
    mean = samples.mean
    return (
        np.maximum(low, np.minimum(samples.low, mean)),
        np.minimum(high, np.maximum(samples.high, mean)),
    )


def group_samples(groups: Any, distribution: Declared) -> Samples:
    """Return the moments of each of k groups of a column, (k,) each.

    The skewness of normal values is set to 0, unless more than half of the values are
    equal.
    """
    name, support = in_full(distribution)
    least = groups.min()
    largest = groups.max()
    n = groups.count()
    alike = _alike(groups)
    varies = ~equal(least, largest)
    skewed = (name != "normal") | (2 * alike > n)
    # The skewness is computed only if a group needs it.
    skewness = groups.skew() if skewed.any() else 0.0 * least
    holds = support.holds(*(np.asarray(end, np.float64) for end in (least, largest)))
    return Samples(
        *(
            np.asarray(moment, np.float64)
            for moment in (
                groups.mean(),
                (groups.std() ** 2).where(varies, 0.0),
                n,
                skewness.where(varies & skewed & (n > 2), 0.0),
                least,
                largest,
                alike,
                np.where(holds, support.low, -np.inf),
                np.where(holds, support.high, np.inf),
            )
        )
    )


def _alike(groups: Any) -> "pd.Series[float]":
    """Return how many values of each group equal the median, except for rounding."""
    same = pd.Series(equal(groups.obj, groups.transform("median")), groups.obj.index)
    alike: pd.Series[float] = groups.size()
    # A category without a row is also a group, but has no group number.
    alike[alike > 0] = same.groupby(groups.ngroup()).sum().to_numpy()
    return alike


def _group_means(
    groups: Any,
    confidence: float,
    interval: MeanKind | None,
    distribution: Declared,
) -> pd.DataFrame:
    """Return the mean, low, high and n of each group of a column, by group key."""
    if interval not in (None, "t"):
        intervals = [
            mean_interval(group, confidence, interval, distribution)
            for _, group in groups
        ]
        columns = ["mean", "low", "high", "n"]
        return pd.DataFrame(intervals, columns=columns, index=groups.count().index)
    low, high = group_bounds(
        groups, confidence, _declaration_for(interval, distribution)
    )
    return pd.DataFrame(
        {"mean": groups.mean(), "low": low, "high": high, "n": groups.count()}
    )


@lru_cache(maxsize=4096)
def _order_bounds(n: int, probability: float, confidence: float) -> tuple[int, int]:
    """Return the ranks, from 1 to n, of the order statistics that bound a quantile.

    The ranks are 0 and n + 1 for too few values. The ranks equal the ranks of scipy's
    `quantile_test`, which is too slow for every point of a study.
    """
    from scipy.stats import binom

    tail = 0.5 - confidence / 2
    return (
        int(binom.ppf(tail, n, probability)),
        int(binom.isf(tail, n, probability)) + 1,
    )


def _undefined(
    trials: pd.DataFrame, metric: str, point: "pd.Series[Any]"
) -> "pd.Series[float]":
    done = trials["status"] == "done"
    counted = pd.DataFrame({"done": done, "without": done & trials[metric].isna()})
    counts = counted.groupby(point, sort=False).sum()
    return (counts["without"] / counts["done"]).fillna(0.0).rename(metric)


def _not_done(trials: pd.DataFrame, point: "pd.Series[Any]") -> "pd.Series[Any]":
    return (trials["status"] != "done").groupby(point, sort=False).sum()


def _known(values: ArrayLike) -> Floats:
    array = np.asarray(values, np.float64)
    return array[~np.isnan(array)]


def _check_interval(kind: str | None) -> None:
    if kind is not None:
        _check("interval", kind, get_args(MeanKind))


def _check(argument: str, value: str, allowed: Sequence[str]) -> None:
    if value not in allowed:
        raise ValueError(unknown(argument, value, allowed))
