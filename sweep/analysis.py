"""From tables to estimates with intervals. Trials that are not done take no part; how many there are is counted."""

from collections.abc import Sequence
from typing import Any

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
