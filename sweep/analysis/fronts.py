"""Pareto fronts of several objectives, in any directions: who is on them, their
hypervolume and their knee.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


MARGIN = 0.1
"""For thinning, the reference point lies beyond the worst values, by this part of the
range of each objective. Without it the ends of a front would add nothing.
"""
ROUNDING = 1e-9
"""Smaller distances, in ranges of the front, are taken for zero."""


def nondominated(values: Floats, maximize: Sequence[bool]) -> NDArray[np.bool_]:
    """Which rows of `values` (k, m) no other row dominates; equal rows are all on the
    front, rows with NaN never.
    """
    from moocore import is_nondominated

    known = ~np.isnan(values).any(axis=1)
    front = np.zeros(len(values), np.bool_)
    if known.any():
        front[known] = is_nondominated(
            values[known], maximise=list(maximize), keep_weakly=True
        )
    return front


def hypervolume(values: Floats, reference: Floats, maximize: Sequence[bool]) -> float:
    """The volume that is dominated by rows of `values` (k, m) and better than the point
    `reference` (m,) in all of it.

    Its unit is the product of those of the objectives. Rows with NaN, and those that
    are not better than the reference everywhere, add nothing; zero for no rows.
    """
    from moocore import hypervolume as volume

    known = values[~np.isnan(values).any(axis=1)]
    return (
        float(volume(known, ref=reference, maximise=list(maximize)))
        if len(known)
        else 0.0
    )


def thinned(
    values: Floats, maximize: Sequence[bool], worst: Floats, most: int
) -> list[int]:
    """The rows of a front `values` (k, m) that are left, at most `most`, in their
    order.

    The row that adds least to the hypervolume is taken away, and of equal ones the
    last, until few enough are left (Emmerich, Beume and Naujoks 2005, EMO, 62-76). The
    reference lies beyond the `worst` values (m,) by a tenth of each objective's range.
    """
    from moocore import hv_contributions

    signs = np.where(maximize, -1.0, 1.0)
    smaller = values * signs
    span = worst * signs - smaller.min(axis=0)
    reference = worst * signs + MARGIN * np.where(span > 0.0, span, 1.0)
    left = list(range(len(values)))
    while len(left) > most:
        adds = hv_contributions(smaller[left], ref=reference)
        left.pop(len(left) - 1 - int(np.argmin(adds[::-1])))
    return left


def knee(values: Floats, maximize: Sequence[bool]) -> int | None:
    """The row of a front `values` (k, m) that lies farthest below the hyperplane
    through its extreme points.

    Objectives are scaled to the range of the front, and the extreme point of each axis
    is the one whose other objectives are best, in the worst of them (Das 1999,
    Structural Optimization 18, 107-115; for three objectives and more with the extreme
    points of Deb and Jain 2014, IEEE Trans. Evol. Comput. 18, 577-601, since the best
    in one objective are many there). None where no point lies below, as on a front that
    is straight or bulges the other way, and where the extreme points are not m
    different ones or do not span a hyperplane.
    """
    if len(values) <= values.shape[1]:
        return None
    smaller = values * np.where(maximize, -1.0, 1.0)
    span = np.ptp(smaller, axis=0)
    if not (span > 0.0).all():
        return None
    scaled = (smaller - smaller.min(axis=0)) / span
    objectives = range(values.shape[1])
    extremes = scaled[
        [
            int(np.delete(scaled, axis, axis=1).max(axis=1).argmin())
            for axis in objectives
        ]
    ]
    if np.linalg.matrix_rank(extremes) < len(extremes):
        return None
    # The plane is normal @ x = 1.
    normal = np.linalg.solve(extremes, np.ones(len(extremes)))
    below = (1.0 - scaled @ normal) / np.linalg.norm(normal)
    return int(below.argmax()) if below.max() > ROUNDING else None


def shares_on_front(draws: Floats, maximize: Sequence[bool]) -> Floats:
    """How often each of k points is on the front, as a share of the draws, shape (k,).

    `draws` has the shape (draws, k, m).
    """
    from moocore import is_nondominated_within_sets

    number, k, m = draws.shape
    sets = np.repeat(np.arange(number), k)
    flat = draws.reshape(-1, m)
    front = is_nondominated_within_sets(
        flat, sets, maximise=list(maximize), keep_weakly=True
    )
    return np.asarray(np.asarray(front, np.float64).reshape(number, k).mean(axis=0))
