"""The trials of a run's candidates by block and scenario, and intervals over blocks.

The trials of a block share their seed, so blocks are what is independent, and what is
resampled.
"""

from functools import partial
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sweep.analysis import CONFIDENCE, Interval, mean_interval
from sweep.analysis.resampling import resampled_interval
from sweep.spec.objectives import Floats, Objective


class Blocks(NamedTuple):
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


def blocks_of(rows: pd.DataFrame, columns: list[str]) -> Blocks:
    """The blocks of `rows` of a search's table, all of one run and one phase."""
    candidates, places = np.unique(
        rows["candidate"].to_numpy(np.int64), return_inverse=True
    )
    block, scenario = (
        rows["block"].to_numpy(np.int64),
        rows["scenario"].to_numpy(np.int64),
    )
    shape = (
        len(candidates),
        int(block.max(initial=-1)) + 1,
        int(scenario.max(initial=-1)) + 1,
    )
    status = rows["status"].to_numpy()
    stored, done = np.zeros(shape, np.bool_), np.zeros(shape, np.bool_)
    stored[places, block, scenario] = status != "missing"
    done[places, block, scenario] = status == "done"
    values = {column: np.full(shape, np.nan) for column in columns}
    for column, array in values.items():
        array[places, block, scenario] = rows[column].to_numpy(np.float64)
        done &= np.isfinite(array)
    for array in values.values():
        array[~done] = np.nan
    return Blocks(candidates, stored, done, values)


def block_interval(
    objective: Objective, values: Floats, confidence: float = CONFIDENCE
) -> Interval:
    """The objective's statistic of `values` (blocks, scenarios), its interval over
    blocks, and their number.

    A mean has Student's interval of the block means, a CVaR the BCa bootstrap's over
    blocks, a quantile the percentile one. The latter two are too narrow where few
    blocks are in the tail: measured for 95 % and normal values, a CVaR of 0.2 is
    covered by 78 % with 20 blocks and by 90 % with 40, a quantile of 0.1 by 88 and 92
    %. The worst of some values has no interval, NaN: how bad it can get is not known
    from them, and a resample cannot be worse than they are (Bickel and Freedman 1981,
    Ann. Stat. 9, 1196-1217, section 6). NaN also where there are fewer than two blocks,
    or a result is missing.
    """
    return difference_interval(objective, values, None, confidence)


def difference_interval(
    objective: Objective,
    first: Floats,
    second: Floats | None,
    confidence: float = CONFIDENCE,
) -> Interval:
    """The statistic of `first` minus that of `second`, (blocks, scenarios) each, paired
    by block; as `block_interval`.

    Without `second` it is that of `first` alone.
    """
    value = objective.value(first) - (
        0.0 if second is None else objective.value(second)
    )
    n = len(first)
    if n < 2 or np.isnan(value) or objective.statistic.kind == "worst":
        return Interval(value, np.nan, np.nan, n)
    if objective.statistic.kind == "mean":
        means = (first if second is None else first - second).mean(axis=1)
        return Interval(value, *mean_interval(means, confidence)[1:])
    sides = np.stack([first] if second is None else [first, second])
    if np.all(sides == sides[:, :1]):
        return Interval(value, value, value, n)
    method = "percentile" if objective.statistic.kind == "quantile" else "BCa"
    statistic = partial(_resampled, sides=sides, objective=objective)
    return Interval(
        value,
        *resampled_interval(
            np.arange(n, dtype=np.float64), statistic, confidence, method
        ),
        n,
    )


def _resampled(
    drawn: Floats, sides: Floats, objective: Objective, axis: int = -1
) -> Floats:
    """The statistic of the first side, minus that of the second, with the blocks
    `drawn` (..., n) of their numbers.
    """
    rows = np.moveaxis(drawn, axis, -1).astype(np.intp)
    each = [
        objective.statistic.along(
            side[rows].reshape(*rows.shape[:-1], -1), maximize=objective.maximize
        )
        for side in sides
    ]
    return each[0] if len(each) == 1 else each[0] - each[1]
