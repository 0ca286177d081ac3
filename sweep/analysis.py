"""From tables to estimates with intervals. Trials that are not done take no part; how many there are is counted."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

CONFIDENCE = 0.95


def half_width(deviation: Any, n: Any, confidence: float = CONFIDENCE) -> Any:
    """Half the width of the Student-t interval of a mean of `n` values with sample standard deviation `deviation`.

    Both may be arrays. Valid for independent values whose mean is about normal; NaN for fewer than two values.
    """
    from scipy.stats import t

    n = np.asarray(n, np.float64)
    return t.ppf(0.5 + confidence / 2, np.where(n > 1, n - 1, np.nan)) * deviation / np.sqrt(n)


def mean_interval(values: NDArray[np.float64], confidence: float = CONFIDENCE) -> tuple[float, float, float, int]:
    """Mean, the bounds of its interval, and the number of values that are not NaN."""
    values = values[~np.isnan(values)]
    n = len(values)
    if n == 0:
        return np.nan, np.nan, np.nan, 0
    mean = float(values.mean())
    half = float(half_width(values.std(ddof=1), n, confidence)) if n > 1 else np.nan
    return mean, mean - half, mean + half, n


def by_point(
    trials: pd.DataFrame, varied: Sequence[str], metrics: Sequence[str], confidence: float = CONFIDENCE
) -> pd.DataFrame:
    """Each metric's mean and interval over the replicates of each point, in the order of `trials`.

    Columns: the `varied` settings, then for each metric its mean under its own name, `<metric>_low`,
    `<metric>_high` and `<metric>_n`, and `not_done`, the number of trials without a result.
    """
    groups = trials.groupby("point", sort=False)
    columns: dict[str, Any] = {name: groups[name].first() for name in varied}
    for name in metrics:
        mean, n = groups[name].mean(), groups[name].count()
        half = half_width(groups[name].std(), n, confidence)
        columns |= {name: mean, f"{name}_low": mean - half, f"{name}_high": mean + half, f"{name}_n": n}
    columns["not_done"] = (trials["status"] != "done").groupby(trials["point"], sort=False).sum()
    return pd.DataFrame(columns).reset_index(drop=True)


def curves(
    series: pd.DataFrame, trials: pd.DataFrame, by: str, metric: str, confidence: float = CONFIDENCE
) -> pd.DataFrame:
    """Mean of `metric` over trials, with its pointwise interval, at every frame and for every value of `by`.

    Columns: `by`, frame, mean, low, high, n. The interval is for each frame alone, not for the whole curve.
    """
    done = trials.loc[trials["status"] == "done", ["trial_id", by]]
    joined = series[["trial_id", "frame", metric]].merge(done, on="trial_id")
    table = joined.groupby([by, "frame"], sort=True)[metric].agg(["mean", "std", "count"]).reset_index()
    half = half_width(table["std"], table["count"], confidence)
    table["low"], table["high"] = table["mean"] - half, table["mean"] + half
    return table.rename(columns={"count": "n"})[[by, "frame", "mean", "low", "high", "n"]]


class Sample(NamedTuple):
    """Mean, sample variance and number of independent values."""

    mean: float
    variance: float
    n: int


@dataclass(frozen=True)
class MeanEstimate:
    """The mean of one sample, or that of a first sample minus that of an independent second one."""

    samples: tuple[Sample, ...]

    @property
    def value(self) -> float:
        first, *others = (sample.mean for sample in self.samples)
        return first - sum(others)

    @property
    def testable(self) -> bool:
        """Whether every sample has two values, without which nothing is known of their spread."""
        return min(sample.n for sample in self.samples) > 1

    def interval(self, confidence: float = CONFIDENCE, published: int | None = None) -> tuple[float, float]:
        """The bounds of Student's interval, of Welch's for two samples.

        With `published`, it is the interval of the difference from means of so many published trials, whose
        variance is taken to be ours.
        """
        extra = 1.0 / published if published else 0.0
        parts = [sample.variance * (1.0 / sample.n + extra) for sample in self.samples]
        if sum(parts) == 0.0:
            return self.value, self.value
        spread = sum(part * part / (sample.n - 1) for part, sample in zip(parts, self.samples, strict=True))
        half = _student(0.5 + confidence / 2, sum(parts) ** 2 / spread) * math.sqrt(sum(parts))
        return self.value - half, self.value + half


@dataclass(frozen=True)
class RankEstimate:
    """Spearman's rank correlation of `n` pairs; NaN where one side does not vary."""

    value: float
    n: int

    @property
    def testable(self) -> bool:
        """Whether there are the four pairs that an interval needs, and the correlation is defined."""
        return self.n > 3 and not math.isnan(self.value)

    def interval(self, confidence: float = CONFIDENCE, published: int | None = None) -> tuple[float, float]:
        """The bounds by Fisher's z with the variance of Bonett and Wright (2000, Psychometrika 65, 23-28).

        A perfect order has no finite z; it stands half a step of the statistic below one. Raises ValueError
        for `published`, the number of published trials, which says nothing about a correlation over points.
        """
        if published is not None:
            raise ValueError("a rank correlation has no number of published trials")
        largest = 1.0 - 6.0 / (self.n**3 - self.n)
        correlation = min(max(self.value, -largest), largest)
        deviation = math.sqrt((1.0 + correlation * correlation / 2.0) / (self.n - 3))
        half = _student(0.5 + confidence / 2, math.inf) * deviation
        low, high = math.tanh(math.atanh(correlation) - half), math.tanh(math.atanh(correlation) + half)
        return min(low, self.value), max(high, self.value)


Estimate = MeanEstimate | RankEstimate


def mean_estimate(*values: NDArray[np.float64]) -> MeanEstimate:
    """The estimate from one array of independent values, or from two for their difference; NaN does not count."""
    return MeanEstimate(tuple(_sample(array[~np.isnan(array)]) for array in values))


def _sample(values: NDArray[np.float64]) -> Sample:
    if len(values) < 2:
        return Sample(float(values[0]) if len(values) else np.nan, np.nan, len(values))
    # The mean of equal values may be off by a rounding error, which would pass for a variance.
    if np.all(values == values[0]):
        return Sample(float(values[0]), 0.0, len(values))
    with np.errstate(invalid="ignore"):
        return Sample(float(values.mean()), float(values.var(ddof=1)), len(values))


def rank_estimate(one: NDArray[np.float64], other: NDArray[np.float64]) -> RankEstimate:
    """The rank correlation of two arrays, pairs with a NaN left out."""
    complete = ~(np.isnan(one) | np.isnan(other))
    ranks = [pd.Series(values[complete]).rank().to_numpy(np.float64) for values in (one, other)]
    if any(len(rank) < 2 or np.ptp(rank) == 0 for rank in ranks):
        return RankEstimate(np.nan, int(complete.sum()))
    return RankEstimate(float(np.clip(np.corrcoef(ranks[0], ranks[1])[0, 1], -1.0, 1.0)), int(complete.sum()))


@lru_cache(maxsize=4096)
def _student(probability: float, freedom: float) -> float:
    from scipy.stats import t

    return float(t.ppf(probability, freedom))
