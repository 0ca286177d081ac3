"""Trials of several points taken together: the mean over the points, replicate by
replicate.

Every point weighs the same. Trials of one replicate may share random numbers at all
points, so they are not independent of each other; different replicates always are.
"""

from collections.abc import Sequence

import pandas as pd

from sweep.analysis.pairing import REPLICATE, replicates


def pooled(
    trials: pd.DataFrame, by: Sequence[str], metrics: Sequence[str]
) -> pd.DataFrame:
    """One row a replicate of all points that agree in the settings `by`, in the order
    of `trials`; `by_point` takes it.

    Columns: `point`, which numbers the groups of points; `points`, how many there are
    in the group; the settings `by`; `trial_id`, of the first trial; `status`, "done"
    where every point of the group has such a trial and all of these are done, else
    "not done"; and each of `metrics`, its mean over the points, NaN where one of them
    has no value: that would be the mean of something else.
    """
    groups = trials.groupby(list(by), sort=False, dropna=False) if by else None
    number = groups.ngroup() if groups else pd.Series(0, index=trials.index)
    places = replicates(trials).to_frame(index=False).set_index(trials.index)
    table = trials.drop(columns=[*REPLICATE, "point"]).assign(
        point=number, points=trials.groupby(number)["point"].transform("nunique")
    )
    table = table.join(places)
    table["done"] = table["status"] == "done"
    table[list(metrics)] = table[list(metrics)].where(table["done"])
    found = table.groupby(["point", *REPLICATE], sort=False)
    first = found[[*dict.fromkeys([*by, "points", "trial_id"])]].first()
    done = found["done"].sum() == first["points"]
    means = found[list(metrics)].mean()
    complete = found[list(metrics)].count().eq(first["points"], axis=0)
    status = done.map({True: "done", False: "not done"}).rename("status")
    rows = pd.concat([first, status, means.where(complete)], axis=1)
    return rows.reset_index()
