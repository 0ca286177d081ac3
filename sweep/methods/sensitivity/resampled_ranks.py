"""Rank correlations of each parameter of a sample with a metric, in many resamples.

The points are sorted once. A resample is the number of times that each point is drawn.
The ranks in a resample are sums of these counts, and equal values share the mean of the
ranks. So the ranks equal ranks of a new sort of the drawn points.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sweep.methods.sensitivity.sampled import (
    Analysis,
    Blocks,
    Floats,
    SampledAxis,
    numbers,
)

FEWEST = 4
"""Fewest points of a rank correlation."""

DETERMINED = 1e-9
"""Fraction of variance of a rank below which the other parameters determine a rank."""

ROUNDING = 1e-14
"""Eigenvalues of a correlation matrix below this value are rounding errors of 0."""

Drawn = NDArray[np.int32]
"""Number of times that each of n points is in each resample, (n, resamples)."""

AT_ONCE = 100_000
"""Number of points, times resamples, that are ranked at once.

Twice as many do not fit the cache and take a quarter longer.
"""


def rank_analysis(sample: SampledAxis) -> Analysis:
    """Return the rank correlations of each parameter with the metric.

    The correlations are Spearman's, and the partial correlation given the ranks of the
    other parameters.
    """
    settings = [
        numbers(sample.settings[setting], texts=False) for setting in sample.settings
    ]
    orders = [_Order.of(column) for column in (*settings, sample.means)]
    blocks = sample.complete
    points = len(sample.means)
    step = max(1, AT_ONCE // points)

    def estimate(drawn: Blocks) -> Floats:
        parts = [
            _correlations(
                orders, _counts(blocks[drawn[:, first : first + step].T], points)
            )
            for first in range(0, drawn.shape[1], step)
        ]
        return np.concatenate([np.empty((2, len(settings), 0)), *parts], axis=2)

    return Analysis(
        [{"setting": setting} for setting in sample.settings],
        ("spearman", "partial"),
        estimate,
    )


class _Order(NamedTuple):
    """The order of the values of n points.

    `places` (n,) sorts the values. In this order the values equal to the value of a
    point are at its `first` to before its `last`, (n,) each.
    """

    places: NDArray[np.intp]
    first: NDArray[np.intp]
    last: NDArray[np.intp]

    @classmethod
    def of(cls, values: Floats) -> "_Order":
        """Return the order of values, (n,)."""
        places = np.argsort(values, kind="stable")
        ordered = values[places]
        first, last = (ordered.searchsorted(values, side) for side in ("left", "right"))
        return cls(places, first, last)

    def ranks(self, counts: Drawn) -> Floats:
        """Return twice the ranks in resamples, less the mean rank, (n, resamples).

        `counts` (n, resamples) is the number of times that each point is drawn.
        """
        below = np.zeros((len(counts) + 1, counts.shape[1]), np.int32)
        np.cumsum(counts[self.places], axis=0, out=below[1:])
        twice: Drawn = below[self.first] + below[self.last] - below[-1]
        return twice.astype(np.float64)


def _counts(drawn: Blocks, points: int) -> Drawn:
    """Return the number of times that each point is drawn, (points, resamples).

    `drawn` has the points of the drawn blocks, (resamples, blocks, size).
    """
    resamples = len(drawn)
    cells = drawn.reshape(resamples, -1) + points * np.arange(resamples)[:, None]
    counted = np.bincount(cells.ravel(), minlength=points * resamples)
    return counted.reshape(resamples, points).T.astype(np.int32, order="C")


def _correlations(orders: list[_Order], counts: Drawn) -> Floats:
    """Return Spearman's and the partial correlations, (2, D, resamples).

    The correlations are between the first D columns and the last column; NaN if not
    defined.
    """
    products = _products([order.ranks(counts) for order in orders], counts)
    variances = np.diagonal(products, axis1=1, axis2=2)
    varies = variances > 0.0
    drawn = counts.sum(axis=0)[:, None]
    scale = np.sqrt(np.where(varies, variances, 1.0))
    matrix = np.clip(products / (scale[:, :, None] * scale[:, None, :]), -1.0, 1.0)
    defined = varies[:, :-1] & varies[:, -1:] & (drawn >= FEWEST)
    enough = drawn > varies.sum(axis=1, keepdims=True) + 1
    both = np.stack([matrix[:, :-1, -1], _partial(matrix)])
    return np.where([defined, defined & enough], both, np.nan).transpose(0, 2, 1)


def _products(ranks: list[Floats], counts: Drawn) -> Floats:
    """Return sums of products of columns of ranks, (resamples, D + 1, D + 1).

    The values are sums of integers, and exact for up to some 200,000 points.
    """
    products = np.empty((counts.shape[1], len(ranks), len(ranks)))
    weights = counts.astype(np.float64)
    for i, column in enumerate(ranks):
        weighted = column * weights
        for j in range(i + 1):
            product = np.einsum("nr,nr->r", weighted, ranks[j])
            products[:, i, j] = products[:, j, i] = product
    return products


def _partial(matrix: Floats) -> Floats:
    """Return partial correlations of D parameters with the last column, (resamples, D).

    Each correlation is given the other parameters. `matrix` has the correlations,
    (resamples, D + 1, D + 1). Only the part of the parameters is inverted, since the
    last column may depend linearly on the parameters. A direction in which the
    parameters do not vary gets as little variance as rounding leaves. So linearly
    dependent parameters count as determined, and all other parameters keep their
    values.
    """
    settings = matrix[:, :-1, :-1]
    last = matrix[:, :-1, -1]
    values, vectors = np.linalg.eigh(settings)
    roots = vectors / np.sqrt(np.maximum(values, ROUNDING))[:, None, :]
    explained = (roots.transpose(0, 2, 1) @ last[:, :, None])[:, :, 0]
    slopes = (roots @ explained[:, :, None])[:, :, 0]
    # Variance of a parameter that the other parameters leave, and of the last column.
    # The latter is the sum of the variance that all parameters leave, and the variance
    # that this parameter explains.
    left = 1.0 / (roots * roots).sum(axis=2)
    by_all = np.maximum(1.0 - (explained * explained).sum(axis=1, keepdims=True), 0.0)
    left_of_last = by_all + slopes * slopes * left
    determined = np.minimum(left, left_of_last) >= DETERMINED
    root = np.sqrt(np.where(determined, left_of_last, 1.0))
    partial = np.clip(slopes * np.sqrt(left) / root, -1.0, 1.0)
    return np.where(determined, partial, np.nan)
