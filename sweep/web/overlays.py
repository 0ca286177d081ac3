"""Which part of the floor boids have visited, in as many cells as a page can draw."""

import math

import numpy as np
from numpy.typing import NDArray

MOST_CELLS = 100_000
"""The most cells of a drawn coverage. Of more pixels, a cell has several."""


def visited_shares(visits: NDArray[np.int32]) -> NDArray[np.float64]:
    """Which share of each cell was visited, of its pixels outside of obstacles; NaN
    where it has none. `visits` are those by pixel, negative in obstacles.

    A cell is a pixel, or a block of as many in a row as in a column in a larger world.
    """
    apart = max(1, math.ceil(math.sqrt(visits.size / MOST_CELLS)))
    free, seen = (
        _summed(_summed(one, apart).T, apart).T for one in (visits >= 0, visits > 0)
    )
    shares = np.full(free.shape, np.nan)
    np.divide(seen, free, out=shares, where=free > 0)
    return shares


def _summed(
    table: NDArray[np.bool_] | NDArray[np.int32], apart: int
) -> NDArray[np.int32]:
    """The sums of every `apart` rows. np.add.reduceat takes much longer."""
    total = table[::apart].astype(np.int32)
    for row in range(1, apart):
        others = table[row::apart]
        total[: len(others)] += others
    return total
