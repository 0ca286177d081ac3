"""The trials of a run's candidates as arrays by candidate, block and scenario."""

from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sweep.methods.search.objectives import Floats


class TrialsByBlock(NamedTuple):
    """The trials of k candidates, each with up to n blocks in s scenarios.

    Attributes
    ----------
    candidates : array of int
        Numbers of the candidates in ascending order, shape (k,).
    stored : array of bool
        Whether each trial has run, shape (k, n, s).
    done : array of bool
        Whether each trial has a finite result in all requested columns, shape (k, n,
        s).
    values : dict of arrays
        Values by column, NaN without a value, shape (k, n, s).
    """

    candidates: NDArray[np.int64]
    stored: NDArray[np.bool_]
    done: NDArray[np.bool_]
    values: dict[str, Floats]

    def counts(self) -> NDArray[np.int64]:
        """Return the number of blocks of each candidate that count, shape (k,).

        A block counts if it and all blocks before have run in every scenario.
        """
        return np.asarray(
            np.logical_and.accumulate(self.stored.all(axis=2), axis=1).sum(axis=1),
            np.int64,
        )

    def of(self, place: int, column: str) -> Floats:
        """Return the values of a column in the blocks of a candidate that count.

        Parameters
        ----------
        place : int
            Index of the candidate: the result of `find`.
        column : str
            Name of the column.

        Returns
        -------
        array of float
            Shape (blocks, scenarios).
        """
        return self.values[column][place, : self.counts()[place]]

    def find(self, candidate: int) -> int:
        """Return the index of a candidate. Raises KeyError without trials."""
        (places,) = np.nonzero(self.candidates == candidate)
        if not len(places):
            raise KeyError(candidate)
        return int(places[0])


def by_block(rows: pd.DataFrame, columns: list[str]) -> TrialsByBlock:
    """Return the trials in `rows`, which are of a single run and phase of a search."""
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
