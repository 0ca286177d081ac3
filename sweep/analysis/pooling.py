"""Means over several points, replicate by replicate.

Every point has equal weight. Trials of a replicate may share random numbers at all
points, so these trials are not independent. Different replicates are independent.
"""

from collections.abc import Sequence

import pandas as pd

from sweep.analysis.pairing import REPLICATE, replicates


def pooled(
    trials: pd.DataFrame, by: Sequence[str], metrics: Sequence[str]
) -> pd.DataFrame:
    """Pool the points that agree in some parameters, replicate by replicate.

    Parameters
    ----------
    trials : DataFrame
        Rows are trials.
    by : sequence of str
        Parameters that define the groups; if empty, all points form a single group.
    metrics : sequence of str
        Columns of `trials`.

    Returns
    -------
    DataFrame
        A row per group and replicate, in the order of `trials`; a valid input of
        `by_point`. Columns: `point` (number of the group), `points` (number of points
        in the group), the parameters `by`, `trial_id` (of the first trial), `status`,
        and each metric (mean over the points). The status is "done" if every point of
        the group has the replicate and all trials of the replicate are done, else "not
        done". A mean is NaN if any point has no value, because the remaining points are
        a different group.

    Examples
    --------
    >>> study = sweep.load("my/first")
    >>> table = pooled(study.trials, by=["n"], metrics=["speed"]).round(2)
    >>> table[["n", "points", "replicate", "status", "speed"]].head(3)
        n  points  replicate status  speed
    0  30       3          0   done   1.44
    1  30       3          1   done   1.85
    2  30       3          2   done   1.99
    """
    groups = trials.groupby(list(by), sort=False, dropna=False) if by else None
    number = groups.ngroup() if groups else pd.Series(0, index=trials.index)
    keys = replicates(trials).to_frame(index=False).set_index(trials.index)
    table = trials.drop(columns=[*REPLICATE, "point"]).assign(
        point=number, points=trials.groupby(number)["point"].transform("nunique")
    )
    table = table.join(keys)
    table["done"] = table["status"] == "done"
    table[list(metrics)] = table[list(metrics)].where(table["done"])
    replicated = table.groupby(["point", *REPLICATE], sort=False)
    first = replicated[[*dict.fromkeys([*by, "points", "trial_id"])]].first()
    done = replicated["done"].sum() == first["points"]
    means = replicated[list(metrics)].mean()
    complete = replicated[list(metrics)].count().eq(first["points"], axis=0)
    status = done.map({True: "done", False: "not done"}).rename("status")
    rows = pd.concat([first, status, means.where(complete)], axis=1)
    return rows.reset_index()
