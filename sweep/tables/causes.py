"""Why trials of a study are not done: each cause once."""

from typing import NamedTuple

import pandas as pd

from sweep.workers.failures import in_a_line


class Cause(NamedTuple):
    """Why trials are not done: how many have this status and this line as their error,
    and the id of the first.
    """

    status: str
    trials: int
    cause: str
    first: str


def causes_of(trials: pd.DataFrame) -> list[Cause]:
    """Each cause once, the one of the first of these trials first."""
    troubled = trials[trials["status"] != "done"]
    causes = troubled["error"].fillna("").astype(str).map(in_a_line)
    groups = troubled.groupby([troubled["status"], causes], sort=False)["trial_id"]
    return [
        Cause(str(status), len(ids), str(cause), str(ids.iloc[0]))
        for (status, cause), ids in groups
    ]
