"""The values by which a search decides, from the requested trials."""

import math
from collections.abc import Sequence

import numpy as np
import pyarrow as pa

from sweep.methods.search.objectives import Floats

Trial = tuple[float, ...] | None
"""The values of a trial; None if the trial is not done, or a value is not finite."""


class KnownValues:
    """The values of some columns for each trial, in the order of `columns`."""

    def __init__(self, columns: Sequence[str]) -> None:
        self.columns = tuple(columns)
        self.trials: dict[str, Trial] = {}

    def enter(self, ids: Sequence[str], table: pa.Table) -> None:
        """Enter trials and their values.

        Parameters
        ----------
        ids : sequence of str
            Ids of the trials.
        table : Table
            One row per trial, with `status` and the columns.
        """
        for trial, row in zip(ids, table.to_pylist(), strict=True):
            values = [row[name] for name in self.columns]
            complete = row["status"] == "done" and all(map(_finite, values))
            self.trials[trial] = tuple(values) if complete else None

    def of(self, trials: Sequence[Sequence[str]]) -> dict[str, Floats] | None:
        """Return the values of trials by column, each as an array (blocks, scenarios).

        `trials` has the ids by block and scenario. Returns None if a trial has no
        values.
        """
        rows = [[self.trials[trial] for trial in block] for block in trials]
        if any(row is None for block in rows for row in block):
            return None
        values = np.array(rows, np.float64).reshape(len(trials), -1, len(self.columns))
        return {
            column: values[:, :, place] for place, column in enumerate(self.columns)
        }


def _finite(value: float | None) -> bool:
    return value is not None and math.isfinite(value)
