"""The order in which trials run, if it is not the longest first: from coarse to fine.

Each value of an axis has a fineness. The first and the last value have 0 and 1, that in
the middle 2, those between 3 and 4, and so on: the sequence of van der Corput, with the
ends before it. A sample has its own order, as each beginning of a Sobol or Halton
sequence is spread evenly. The fineness of a point is the greatest of its values. So the
points up to a fineness are a whole grid, which each further fineness makes denser.

Source: J. G. van der Corput, Verteilungsfunktionen, Proc. Akad. Wet. Amsterdam 38
(1935), 813-821.
"""

import numpy as np
from numpy.typing import NDArray

from sweep.spec.axes import Axis

Fineness = NDArray[np.int32]


def fineness_of(axis: Axis) -> Fineness:
    """The fineness of each row of an axis, shape (len(axis),)."""
    count = len(axis)
    if axis.sampler is not None:
        return np.arange(count, dtype=np.int32)
    fineness = np.empty(count, np.int32)
    fineness[ends_then_middles(count)] = np.arange(count)
    return fineness


def ends_then_middles(count: int) -> NDArray[np.int64]:
    """The places 0 to `count` - 1: the first, the last, the middle, the quarters ...

    >>> ends_then_middles(5).tolist()
    [0, 4, 2, 1, 3]
    """
    places = np.concatenate([[0, count - 1], _inner(count)])
    _, first = np.unique(places, return_index=True)
    found: NDArray[np.int64] = places[np.sort(first)]
    return found


def _inner(count: int) -> NDArray[np.int64]:
    """All places, some of them several times, by the sequence of van der Corput."""
    bits = count.bit_length()
    numbers, reversed_ = np.arange(2**bits), np.zeros(2**bits, np.int64)
    for bit in range(bits):
        reversed_ |= (numbers >> bit & 1) << (bits - 1 - bit)
    places: NDArray[np.int64] = reversed_ * (count - 1) // 2**bits
    return places


def coarse_first(
    fineness: NDArray[np.int32], replicate: NDArray[np.int64]
) -> NDArray[np.int64]:
    """The places of trials in the order in which they run: the first replicate of all
    points, from coarse to fine, then the next one.

    fineness   (trials,) of the point of each
    replicate  (trials,)
    """
    order: NDArray[np.int64] = np.lexsort((fineness, replicate))
    return order
