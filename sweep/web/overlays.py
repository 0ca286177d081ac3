"""Where boids have been, in as few cells as a page draws."""

import math

import numpy as np
from numpy.typing import NDArray

MOST_CELLS = 100_000
"""Of a coverage that is drawn; a larger one is coarsened."""


def coarsened(visits: NDArray[np.int32]) -> NDArray[np.int32]:
    """Visits by pixel, negative in obstacles, as the most of each block of pixels.

    Blocks are single pixels where there are no more than MOST_CELLS of them.
    """
    side = math.ceil(math.sqrt(visits.size / MOST_CELLS))
    if side <= 1:
        return visits
    return _most(_most(visits, side).T, side).T


def _most(table: NDArray[np.int32], side: int) -> NDArray[np.int32]:
    """The most of each `side` rows, one after the other; np.maximum.reduceat takes
    fifteen times as long.
    """
    most = table[::side].copy()
    for row in range(1, side):
        others = table[row::side]
        np.maximum(most[: len(others)], others, out=most[: len(others)])
    return most
