"""Pareto fronts of several objectives: members, hypervolume and knee."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


MARGIN = 0.1
"""Distance of the reference point for thinning, beyond the worst values.

The unit is the range of each objective. Without a margin the ends of a front would add
no volume.
"""
ROUNDING = 1e-9
"""Distance, in ranges of the front, below which a distance counts as zero."""


def nondominated(values: Floats, maximize: Sequence[bool]) -> NDArray[np.bool_]:
    """Return which rows of `values` (k, m) are not dominated, shape (k,).

    Equal rows are all on the front. Rows with NaN are never on the front.
    """
    from moocore import is_nondominated

    complete = ~np.isnan(values).any(axis=1)
    front = np.zeros(len(values), np.bool_)
    if complete.any():
        front[complete] = is_nondominated(
            values[complete], maximise=list(maximize), keep_weakly=True
        )
    return front


def hypervolume(values: Floats, reference: Floats, maximize: Sequence[bool]) -> float:
    """Return the volume between the rows of `values` and a reference point.

    The volume is dominated by rows and better than the reference in all objectives. The
    unit is the product of the units of the objectives.

    Parameters
    ----------
    values : array of float
        Values of k points in m objectives, shape (k, m). Rows with NaN, and rows that
        are not better than the reference in every objective, add nothing.
    reference : array of float
        The reference point, shape (m,).
    maximize : sequence of bool
        Direction of each objective.

    Returns
    -------
    float
        The volume; zero for no rows.
    """
    from moocore import hypervolume as volume

    complete = values[~np.isnan(values).any(axis=1)]
    return (
        float(volume(complete, ref=reference, maximise=list(maximize)))
        if len(complete)
        else 0.0
    )


def thinned(
    values: Floats, maximize: Sequence[bool], worst: Floats, most: int
) -> list[int]:
    """Return the rows of a front that remain after thinning, in the given order.

    The row that adds least to the hypervolume is removed, until at most `most` rows are
    left (Emmerich, Beume and Naujoks 2005, EMO, 62-76). Among equal contributions the
    last row is removed.

    Parameters
    ----------
    values : array of float
        Values of the k rows of a front, shape (k, m).
    maximize : sequence of bool
        Direction of each objective.
    worst : array of float
        Worst values, shape (m,). The reference point is beyond the worst values, by a
        tenth of the range of each objective.
    most : int
        Largest number of rows that remain.
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
    """Return the row of a front that is farthest below the hyperplane of the extremes.

    Objectives are scaled to the range of the front. The extreme point of an axis is the
    point with the smallest value of the worst remaining objective (Das 1999, Structural
    Optimization 18, 107-115). For three or more objectives, many points may be best in
    a single objective; the extreme points are then as in Deb and Jain (2014, IEEE
    Trans. Evol. Comput. 18, 577-601).

    Returns None if no point is below the hyperplane, for example on a front that is
    straight or bulges in the opposite direction. Returns None also if the m extreme
    points are not different or do not span a hyperplane. `values` has the shape (k, m).
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
    """Return the fraction of draws in which each point is on the front, shape (k,).

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
