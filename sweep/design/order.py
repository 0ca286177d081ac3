"""The order of trials from coarse to fine, an alternative to the longest trial first.

Each value of an axis has a fineness. The first and the last value have 0 and 1, the
middle value 2, the values in between 3 and 4, and so on. The order is the two ends,
then the sequence of van der Corput. The order of a sample does not change, because each
beginning of a Sobol or Halton sequence is spread evenly. The fineness of a point is the
largest fineness of its values. So the points up to a fineness are a complete grid,
which each further fineness makes denser.

Source: J. G. van der Corput, Verteilungsfunktionen, Proc. Akad. Wet. Amsterdam 38
(1935), 813-821.
"""

import numpy as np
from numpy.typing import NDArray

from sweep.spec import Axis

Fineness = NDArray[np.int32]


def fineness_of(axis: Axis) -> Fineness:
    """Return the fineness of each row of an axis, shape (len(axis),)."""
    count = len(axis)
    if axis.sampler is not None:
        return np.arange(count, dtype=np.int32)
    fineness = np.empty(count, np.int32)
    fineness[ends_then_middles(count)] = np.arange(count)
    return fineness


def ends_then_middles(count: int) -> NDArray[np.int64]:
    """Return the indices 0 to `count` - 1: first, last, middle, quarters and so on.

    Examples
    --------
    >>> ends_then_middles(5).tolist()
    [0, 4, 2, 1, 3]
    """
    repeated = np.concatenate([[0, count - 1], _inner(count)])
    _, first = np.unique(repeated, return_index=True)
    indices: NDArray[np.int64] = repeated[np.sort(first)]
    return indices


def _inner(count: int) -> NDArray[np.int64]:
    """Return all indices in the order of van der Corput; some are repeated."""
    bits = count.bit_length()
    numbers = np.arange(2**bits)
    reversed_ = np.zeros(2**bits, np.int64)
    for bit in range(bits):
        reversed_ |= (numbers >> bit & 1) << (bits - 1 - bit)
    places: NDArray[np.int64] = reversed_ * (count - 1) // 2**bits
    return places


def coarse_first(
    fineness: NDArray[np.int32], replicate: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Return the indices of trials in the order in which they run.

    The first replicate of all points runs first, from coarse to fine, then the second
    replicate, and so on.

    Parameters
    ----------
    fineness : array of int, shape (trials,)
        Fineness of the point of each trial.
    replicate : array of int, shape (trials,)

    Returns
    -------
    array of int, shape (trials,)
    """
    order: NDArray[np.int64] = np.lexsort((fineness, replicate))
    return order
