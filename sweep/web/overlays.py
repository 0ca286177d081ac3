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
    apart = math.ceil(math.sqrt(visits.size / MOST_CELLS))
    if apart <= 1:
        return visits
    return _most(_most(visits, apart).T, apart).T


def _most(table: NDArray[np.int32], apart: int) -> NDArray[np.int32]:
    """The largest of every `apart` rows. np.maximum.reduceat takes fifteen times as
    long.
    """
    most = table[::apart].copy()
    for row in range(1, apart):
        others = table[row::apart]
        np.maximum(most[: len(others)], others, out=most[: len(others)])
    return most
