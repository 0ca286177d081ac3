"""From tables to estimates with intervals. Trials that are not done take no part; how many there are is counted."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

CONFIDENCE = 0.95


def mean_interval(values: NDArray[np.float64], confidence: float = CONFIDENCE) -> tuple[float, float, float, int]:
    """Mean, its two-sided Student-t interval and the number of values that are not NaN.

    Valid for independent values whose mean is about normal. The bounds are NaN for fewer than two values.
    """
    from scipy.stats import t

    values = values[~np.isnan(values)]
    n = len(values)
    if n == 0:
        return np.nan, np.nan, np.nan, 0
    mean = float(values.mean())
    if n == 1:
        return mean, np.nan, np.nan, 1
    half = float(t.ppf(0.5 + confidence / 2, n - 1)) * float(values.std(ddof=1)) / np.sqrt(n)
    return mean, mean - half, mean + half, n


def by_point(
    trials: pd.DataFrame, varied: Sequence[str], metrics: Sequence[str], confidence: float = CONFIDENCE
) -> pd.DataFrame:
    """Each metric's mean and interval over the replicates of each point, in the order of `trials`.

    Columns: the `varied` settings, then for each metric its mean under its own name, `<metric>_low`,
    `<metric>_high` and `<metric>_n`, and `not_done`, the number of trials without a result.
    """
    rows: list[dict[str, Any]] = []
    for _, group in trials.groupby("point", sort=False):
        row: dict[str, Any] = {name: group[name].iloc[0] for name in varied}
        for name in metrics:
            mean, low, high, n = mean_interval(group[name].to_numpy(np.float64), confidence)
            row |= {name: mean, f"{name}_low": low, f"{name}_high": high, f"{name}_n": n}
        rows.append(row | {"not_done": int((group["status"] != "done").sum())})
    return pd.DataFrame(rows)


def curves(
    series: pd.DataFrame, trials: pd.DataFrame, by: str, metric: str, confidence: float = CONFIDENCE
) -> pd.DataFrame:
    """Mean of `metric` over trials, with its pointwise interval, at every frame and for every value of `by`.

    Columns: `by`, frame, mean, low, high, n. The interval is for each frame alone, not for the whole curve.
    """
    from scipy.stats import t

    done = trials.loc[trials["status"] == "done", ["trial_id", by]]
    joined = series[["trial_id", "frame", metric]].merge(done, on="trial_id")
    groups = joined.groupby([by, "frame"], sort=True)[metric].agg(["mean", "std", "count"]).reset_index()
    freedom = (groups["count"] - 1).clip(lower=1)
    half = t.ppf(0.5 + confidence / 2, freedom) * groups["std"] / np.sqrt(groups["count"])
    groups["low"], groups["high"] = groups["mean"] - half, groups["mean"] + half
    return groups.rename(columns={"count": "n"})[[by, "frame", "mean", "low", "high", "n"]]
