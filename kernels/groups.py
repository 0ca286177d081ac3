"""Groups: the connected components of places nearer to each other than a reach."""

import numpy as np
from numpy.typing import NDArray

from kernels.jit import jit
from kernels.state import Floats

Labels = NDArray[np.int64]


@jit
def label_groups(
    x: Floats, y: Floats, order: NDArray[np.integer], reach: float, label: Labels
) -> None:
    """Write into `label` (N,) for every place the index of one of its group, the same
    for all members. `order` (N,) are the places sorted by x.
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
    """The representative of `i`'s component; halves the path to it."""
    while parent[i] != i:
        parent[i] = parent[parent[i]]
        i = parent[i]
    return i
