"""Groups: the connected components of positions within a reach."""

import numpy as np
from numpy.typing import NDArray

from kernels.jit import jit
from kernels.state import Floats

Labels = NDArray[np.int64]


@jit
def label_groups(
    x: Floats, y: Floats, order: NDArray[np.integer], reach: float, label: Labels
) -> None:
    """Label every position with its group.

    Parameters
    ----------
    x, y : array of float64, shape (N,)
        Positions.
    order : array of int, shape (N,)
        Indices of the positions sorted by x.
    reach : float
        Distance below which two positions are in one group.
    label : array of int64, shape (N,)
        Receives the index of a member, equal for all members of a group.
    """
    n = x.size
    for i in range(n):
        label[i] = i
    for k in range(n):
        i = order[k]
        for other in range(k + 1, n):
            j = order[other]
            dx, dy = x[j] - x[i], y[j] - y[i]
            if dx >= reach:
                break
            if dx * dx + dy * dy < reach * reach:
                label[_root(label, i)] = _root(label, j)
    for i in range(n):
        label[i] = _root(label, i)


@jit
def _root(parent: Labels, i: int) -> int:
    """Return the representative of `i`'s component, and halve the path to it."""
    while parent[i] != i:
        parent[i] = parent[parent[i]]
        i = parent[i]
    return i
