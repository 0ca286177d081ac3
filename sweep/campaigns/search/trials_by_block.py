"""The trials of a run's candidates as arrays by candidate, block and scenario."""

from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sweep.spec.objectives import Floats


class TrialsByBlock(NamedTuple):
    """The trials of k candidates, each with up to n blocks in s scenarios.

    `candidates` are their numbers (k,) in ascending order. `stored` and `done` (k, n,
    s) say which trials have run and which of them have a result that is finite in all
    columns asked for. `values` (k, n, s) are these columns, NaN where there is none.
    """

    candidates: NDArray[np.int64]
    stored: NDArray[np.bool_]
    done: NDArray[np.bool_]
    values: dict[str, Floats]

    def counts(self) -> NDArray[np.int64]:
        """How many blocks of each candidate have run in every scenario, up to the first
        that has not; (k,).
        """
        return np.asarray(
            np.logical_and.accumulate(self.stored.all(axis=2), axis=1).sum(axis=1),
            np.int64,
        )

    def of(self, place: int, column: str) -> Floats:
        """The values of a column in the blocks that count of the candidate at `place`:
        shape (blocks, scenarios).
        """
        return self.values[column][place, : self.counts()[place]]

    def find(self, candidate: int) -> int:
        """The place of a candidate. Raises KeyError where it has no trials."""
        (places,) = np.nonzero(self.candidates == candidate)
        if not len(places):
            raise KeyError(candidate)
        return int(places[0])


def by_block(rows: pd.DataFrame, columns: list[str]) -> TrialsByBlock:
    """The blocks of `rows` of a search's table, all of one run and one phase."""
    candidates, places = np.unique(
        rows["candidate"].to_numpy(np.int64), return_inverse=True
    )
    block = rows["block"].to_numpy(np.int64)
    scenario = rows["scenario"].to_numpy(np.int64)
    shape = (
        len(candidates),
        int(block.max(initial=-1)) + 1,
        int(scenario.max(initial=-1)) + 1,
    )
    status = rows["status"].to_numpy()
    stored = np.zeros(shape, np.bool_)
    done = np.zeros(shape, np.bool_)
    stored[places, block, scenario] = status != "missing"
    done[places, block, scenario] = status == "done"
    values = {column: np.full(shape, np.nan) for column in columns}
    for column, array in values.items():
        array[places, block, scenario] = rows[column].to_numpy(np.float64)
        done &= np.isfinite(array)
    for array in values.values():
        array[~done] = np.nan
    return TrialsByBlock(candidates, stored, done, values)
