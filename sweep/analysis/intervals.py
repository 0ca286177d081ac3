"""Means and quantiles over replicates, each with its interval. Trials that are not done
are counted, no more.
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
NONE_DECLARED: Mapping[str, Declared] = MappingProxyType({})


class Interval(NamedTuple):
    """An estimate, the bounds of its interval, and the number of values behind it."""

    value: float
    low: float
    high: float
    n: int


def half_width(deviation: Any, n: Any, confidence: float = CONFIDENCE) -> Any:
    """Half the width of the Student-t interval of a mean of `n` values with sample
    standard deviation `deviation`.

    Both may be arrays. Valid for independent values whose mean is about normal; NaN for
    fewer than two values.
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
    """The mean of `values` (n,), its interval, and the number of values that are not
    NaN.

    The values must be independent. Without `interval` it is the one that holds for
    values of this `distribution`, see `sweep.analysis.mean_bounds`. None reaches beyond
    the values that there can be, `study.distributions` knows both. Else it is one of

    - "t", Student's: for means that are about normal;
    - "bootstrap", BCa (Efron 1987, J. Am. Stat. Assoc. 82, 171-185): its two sides miss
      about equally often where the distribution is skewed, but it is too narrow for
      fewer than about 50 values;
    - "bootstrap_t" (Efron and Tibshirani 1993, An Introduction to the Bootstrap,
      section 12.5): wide on the side of the long tail. Unbounded for two or three
      values.

    Measured for 95 % and 10 exponential values: 90, 88 and 93 % in this order, and 95 %
    for "skewed"; 30: 93, 92 and 94 %; for 30 lognormal ones with sigma = 1: 88, 89 and
    93 %. NaN bounds for fewer than two values. Raises ValueError for another kind.
    """
    _check_interval(interval)
    of = _asked(interval, distribution)
    estimate = mean_estimate(np.asarray(values, np.float64), distribution=of)
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


def _asked(interval: MeanKind | None, declared: Declared) -> Declaration:
    """The values as the interval that is asked for takes them, normal ones; by default
    as they are declared.
    """
    values = in_full(declared)
    return values._replace(distribution="normal") if interval else values


def quantile_interval(
    values: ArrayLike,
    probability: float,
    confidence: float = CONFIDENCE,
    interval: QuantileKind = "order",
) -> Interval:
    """The quantile of `values` (n,) at `probability`, the median at 0.5, its interval,
    and the number not NaN.

    The values must be independent. "order" is the interval between order statistics
    (Thompson 1936, Ann. Math. Stat. 7, 122-128): whatever the distribution, it misses
    on either side with at most half of 1 - `confidence`, and where values are equal
    more seldom. Its bounds are NaN where there are too few values for that: the median
    needs 6 for 95 %, the tenth part 36. "bootstrap" is the percentile one, approximate
    and for more than about 20 values; BCa corrects by a jackknife, which is not
    consistent for quantiles (Efron and Tibshirani 1993, section 11.6). Raises
    ValueError for another kind, and for a probability that is not between 0 and 1.
    """
    _check("interval", interval, get_args(QuantileKind))
    if not 0.0 < probability < 1.0:
        raise ValueError(
            f"probability: {probability}; allowed: above 0 and below 1,"
            " and the median is 0.5"
        )
    known = _known(values)
    if len(known) < 2:
        return Interval(
            float(known[0]) if len(known) else np.nan, np.nan, np.nan, len(known)
        )
    value = float(np.quantile(known, probability))
    if interval == "order":
        low, high = _order_bounds(len(known), probability, confidence)
        ordered = [np.nan, *np.sort(known), np.nan]
        return Interval(value, float(ordered[low]), float(ordered[high]), len(known))
    statistic = partial(np.quantile, q=probability)
    return Interval(
        value,
        *resampled_interval(known, statistic, confidence, "percentile"),
        len(known),
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
    """Each metric's mean and interval over the replicates of each point, in the order
    of `trials`.

    Columns: the `varied` settings, then for each metric its mean under its own name,
    `<metric>_low`, `<metric>_high`, `<metric>_n` and `<metric>_undefined`, the share of
    the done trials that have no value of it and take no part, and `not_done`, the
    number of trials without a result. Each interval is for its point alone;
    `simultaneous_confidence` gives the `confidence` at which all hold together.

    Without `interval` it is that of the distribution of the metric, which
    `distributions=study.distributions` has by name; "normal" where it is not named.
    Where a metric decided how many trials a point has, its interval must be the
    repeated one, at a higher confidence: `repeated=study.repeated` has that by the name
    of the metric.
    """
    _check_interval(interval)
    # Numbers of points are grouped several times as fast as their texts.
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
    """The share of the done trials of each point that have no value of a metric, such
    as the elongation of a flock where there is none; by the id of the point.

    A mean is that of the others, under the condition that there is a value.
    """
    return _undefined(trials, metric, trials["point"])


def quantiles_by_point(
    trials: pd.DataFrame,
    varied: Sequence[str],
    metrics: Sequence[str],
    probabilities: Sequence[float] = (0.25, 0.5, 0.75),
    confidence: float = CONFIDENCE,
) -> pd.DataFrame:
    """Each metric's quantiles over the replicates of each point, with intervals between
    order statistics.

    One row a point, metric and probability, points in the order of `trials`. Columns:
    the `varied` settings, metric, probability, value, low, high, n and `not_done`, as
    `quantile_interval` and `by_point` have them.
    """
    not_done, rows = _not_done(trials, trials["point"]), []
    for point, group in trials.groupby("point", sort=False):
        settings = [group[name].iloc[0] for name in varied]
        for metric in metrics:
            values = group[metric].to_numpy(np.float64)
            for probability in probabilities:
                found = quantile_interval(values, probability, confidence)
                rows.append((*settings, metric, probability, *found, not_done[point]))
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
    """Mean of `metric` over trials, with its pointwise interval, at every frame and for
    every value of `by`.

    Columns: `by`, frame, mean, low, high, n. The interval is for each frame alone, not
    for the whole curve. Without `interval` it is that of the `distribution`.
    """
    _check_interval(interval)
    done = trials.loc[trials["status"] == "done", ["trial_id", by]]
    joined = series[["trial_id", "frame", metric]].merge(done, on="trial_id")
    groups = joined.groupby([by, "frame"], sort=True)[metric]
    return _group_means(groups, confidence, interval, distribution).reset_index()


def group_bounds(
    groups: Any, confidence: float, distribution: Declared, *, cut: bool = True
) -> tuple[Floats, Floats]:
    """The bounds of the mean of each of k groups of a column, (k,) each; `cut` off
    where values end.
    """
    samples = group_samples(groups, distribution)
    of = in_full(distribution).distribution
    low, high = mean_bounds(of, samples, (1.0 - confidence) / 2.0)
    if not cut:
        return low, high
    mean = samples.mean
    return (
        np.maximum(low, np.minimum(samples.low, mean)),
        np.minimum(high, np.maximum(samples.high, mean)),
    )


def group_samples(groups: Any, distribution: Declared) -> Samples:
    """What is known of each of k groups of a column, whose values have this
    `distribution`. Normal ones are taken to have no skewness, but those of which most
    are equal.
    """
    of, support = in_full(distribution)
    least, largest, n = groups.min(), groups.max(), groups.count()
    alike = _alike(groups)
    varies, skewed = ~equal(least, largest), (of != "normal") | (2 * alike > n)
    skewness = groups.skew() if skewed.any() else 0.0 * least
    holds = support.holds(*(np.asarray(end, np.float64) for end in (least, largest)))
    return Samples(
        *(
            np.asarray(one, np.float64)
            for one in (
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
    """How many values of each group of a column equal its median, but for rounding."""
    same = pd.Series(equal(groups.obj, groups.transform("median")), groups.obj.index)
    alike: pd.Series[float] = groups.size()
    # A category without a row is a group too, and has no number.
    alike[alike > 0] = same.groupby(groups.ngroup()).sum().to_numpy()
    return alike


def _group_means(
    groups: Any,
    confidence: float,
    interval: MeanKind | None,
    distribution: Declared,
) -> pd.DataFrame:
    """mean, low, high and n of each group of a column, by the keys of the groups."""
    if interval not in (None, "t"):
        found = [
            mean_interval(group, confidence, interval, distribution)
            for _, group in groups
        ]
        return pd.DataFrame(
            found, columns=["mean", "low", "high", "n"], index=groups.count().index
        )
    low, high = group_bounds(groups, confidence, _asked(interval, distribution))
    return pd.DataFrame(
        {"mean": groups.mean(), "low": low, "high": high, "n": groups.count()}
    )


@lru_cache(maxsize=4096)
def _order_bounds(n: int, probability: float, confidence: float) -> tuple[int, int]:
    """Which of n values in ascending order, from 1 to n, bound the quantile; 0 and n +
    1 where none does.

    Those of scipy's `quantile_test`, which takes too long to be asked for every point
    of a study.
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


def _check_interval(given: str | None) -> None:
    if given is not None:
        _check("interval", given, get_args(MeanKind))


def _check(what: str, given: str, allowed: Sequence[str]) -> None:
    if given not in allowed:
        raise ValueError(unknown(what, given, allowed))
