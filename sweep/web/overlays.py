"""The visited fraction of the floor, in as many cells as a page can draw."""

import math

import numpy as np
from numpy.typing import NDArray

MOST_CELLS = 100_000
"""Largest number of cells of a drawn coverage.

In a larger world a cell has several pixels.
"""


def visited_shares(visits: NDArray[np.int32]) -> NDArray[np.float64]:
    """Return the visited fraction of each cell, of its pixels outside obstacles.

    `visits` are the visits by pixel, negative in obstacles. The fraction is NaN where a
    cell has no pixel outside obstacles. A cell is a pixel, or a square block of pixels
    in a larger world.
    """
    apart = max(1, math.ceil(math.sqrt(visits.size / MOST_CELLS)))
    free, visited = (
        _summed(_summed(mask, apart).T, apart).T for mask in (visits >= 0, visits > 0)
    )
    shares = np.full(free.shape, np.nan)
    np.divide(visited, free, out=shares, where=free > 0)
    return shares


def _summed(
    table: NDArray[np.bool_] | NDArray[np.int32], apart: int
) -> NDArray[np.int32]:
    """Return the sums of every `apart` rows. np.add.reduceat takes much longer."""
    total = table[::apart].astype(np.int32)
    for row in range(1, apart):
        rows = table[row::apart]
        total[: len(rows)] += rows
    return total
