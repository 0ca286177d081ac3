"""The stored points of the candidates and references of a search."""

from collections.abc import Iterable
from typing import cast

import pandas as pd

from sweep.methods.search.asked_trials import AskedTrials
from sweep.tables import StoredStudy


class PointsBehind:
    """Ids of the points of candidates, by run and phase."""

    def __init__(self, study: StoredStudy, asked_trials: AskedTrials) -> None:
        plan: pd.DataFrame = study.plan.select(["trial_id", "point"]).to_pandas()
        point = plan.set_index("trial_id")["point"]
        table = asked_trials.table[["run", "phase", "candidate", "trial_id"]]
        named = table.assign(point=table["trial_id"].map(point)).dropna()
        keys = ["run", "phase", "candidate"]
        self._ids = {
            cast(tuple[str, str, int], key): " ".join(dict.fromkeys(ids))
            for key, ids in named.groupby(keys)["point"]
        }

    def ids(self, run: str, phase: str, numbers: Iterable[int]) -> list[str]:
        """Return the ids of the points of each candidate.

        Parameters
        ----------
        run : str
            Name of the run.
        phase : str
            "search" or "held_out".
        numbers : iterable of int
            Numbers of the candidates.

        Returns
        -------
        list of str
            Ids separated by spaces, one string per candidate; "" without points.
        """
        return [self._ids.get((run, phase, number), "") for number in numbers]
