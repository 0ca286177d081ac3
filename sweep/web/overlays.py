"""Where boids have been, in as many cells as a page can draw."""

import math

import numpy as np
from numpy.typing import NDArray

MOST_CELLS = 100_000
"""The most cells of a drawn coverage. A larger one is coarsened."""


def coarsened(visits: NDArray[np.int32]) -> NDArray[np.int32]:
    """Visits by pixel, negative in obstacles. In a large world, the largest value of
    each block of pixels.
    """
    side = math.ceil(math.sqrt(visits.size / MOST_CELLS))
    if side <= 1:
        return visits
    return _most(_most(visits, side).T, side).T


def _most(table: NDArray[np.int32], side: int) -> NDArray[np.int32]:
    """The largest of every `side` rows. np.maximum.reduceat takes fifteen times as
    long.
    """
    most = table[::side].copy()
    for row in range(1, side):
        others = table[row::side]
        np.maximum(most[: len(others)], others, out=most[: len(others)])
    return most
