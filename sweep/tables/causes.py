"""The causes of trials that are not done, each cause once."""

import re
from typing import NamedTuple

import pandas as pd

from sweep.workers import in_a_line

AT_STEP = re.compile(r" after step \d+$")
"""End of an error that can differ between trials with the same cause."""


class Cause(NamedTuple):
    """A status, the number of trials with an error, and the id of the first trial.

    `cause` is the error as one line, without the step at which the trial ended.
    """

    status: str
    trials: int
    cause: str
    first: str


def causes_of(trials: pd.DataFrame) -> list[Cause]:
    """Return each cause once, in the order of its first trial."""
    troubled = trials[trials["status"] != "done"]
    causes = troubled["error"].fillna("").astype(str).map(in_a_line)
    causes = causes.str.replace(AT_STEP, "", regex=True)
    groups = troubled.groupby([troubled["status"], causes], sort=False)["trial_id"]
    return [
        Cause(str(status), len(ids), str(cause), str(ids.iloc[0]))
        for (status, cause), ids in groups
    ]
