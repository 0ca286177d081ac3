"""Rank correlations of each setting of a sample with a metric, in many resamples.

The points are put in order once. A resample is how often each point is drawn: the ranks
in it are sums of these counts, those of equal values the mean of their places, just as
if what was drawn had been ranked anew.
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
"""A rank correlation needs so many points."""

DETERMINED = 1e-9
"""Others determine a rank if they leave less than this part of its variance."""

ROUNDING = 1e-14
"""Eigenvalues of a correlation matrix are not told from 0 below it."""

Drawn = NDArray[np.int32]
"""How often each of n points is in each resample, (n, resamples)."""

AT_ONCE = 100_000
"""So many points, counted once a resample, are ranked at once. Twice as many leave the
cache and take a quarter longer.
"""


def rank_analysis(sample: SampledAxis) -> Analysis:
    """Spearman's correlation of each setting with the metric, and the partial one given
    the ranks of the other settings.
    """
    settings = [
        numbers(sample.settings[setting], texts=False) for setting in sample.settings
    ]
    orders = [_Order.of(column) for column in (*settings, sample.means)]
    whole, points = sample.whole, len(sample.means)
    step = max(1, AT_ONCE // points)

    def estimate(drawn: Blocks) -> Floats:
        parts = [
            _correlations(
                orders, _counts(whole[drawn[:, first : first + step].T], points)
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
    """The order of the values of n points: `places` (n,) sorts them, and those equal to
    that of a point stand from its `first` to before its `last`, (n,) each.
    """

    places: NDArray[np.intp]
    first: NDArray[np.intp]
    last: NDArray[np.intp]

    @classmethod
    def of(cls, values: Floats) -> "_Order":
        places = np.argsort(values, kind="stable")
        ordered = values[places]
        first, last = (ordered.searchsorted(values, side) for side in ("left", "right"))
        return cls(places, first, last)

    def ranks(self, counts: Drawn) -> Floats:
        """Twice the ranks in resamples, less those of their middle, (n, resamples);
        `counts` (n, resamples) says how often each point is drawn.
        """
        below = np.zeros((len(counts) + 1, counts.shape[1]), np.int32)
        np.cumsum(counts[self.places], axis=0, out=below[1:])
        twice: Drawn = below[self.first] + below[self.last] - below[-1]
        return twice.astype(np.float64)


def _counts(drawn: Blocks, points: int) -> Drawn:
    """How often each of so many points is drawn with blocks (resamples, blocks, size)
    of them, (points, resamples).
    """
    resamples = len(drawn)
    cells = drawn.reshape(resamples, -1) + points * np.arange(resamples)[:, None]
    counted = np.bincount(cells.ravel(), minlength=points * resamples)
    return counted.reshape(resamples, points).T.astype(np.int32, order="C")


def _correlations(orders: list[_Order], counts: Drawn) -> Floats:
    """Spearman's and the partial correlations (2, D, resamples) of the D first columns
    with the last; NaN where they are not defined.
    """
    products = _products([order.ranks(counts) for order in orders], counts)
    variances = np.diagonal(products, axis1=1, axis2=2)
    varies, drawn = variances > 0.0, counts.sum(axis=0)[:, None]
    scale = np.sqrt(np.where(varies, variances, 1.0))
    matrix = np.clip(products / (scale[:, :, None] * scale[:, None, :]), -1.0, 1.0)
    defined = varies[:, :-1] & varies[:, -1:] & (drawn >= FEWEST)
    enough = drawn > varies.sum(axis=1, keepdims=True) + 1
    found = np.stack([matrix[:, :-1, -1], _partial(matrix)])
    return np.where([defined, defined & enough], found, np.nan).transpose(0, 2, 1)


def _products(ranks: list[Floats], counts: Drawn) -> Floats:
    """The sums of the products of each two columns of ranks, (resamples, D + 1, D + 1).
    They are sums of whole numbers, and exact for up to some 200,000 points.
    """
    found = np.empty((counts.shape[1], len(ranks), len(ranks)))
    weights = counts.astype(np.float64)
    for one, column in enumerate(ranks):
        weighted = column * weights
        for other in range(one + 1):
            product = np.einsum("nr,nr->r", weighted, ranks[other])
            found[:, one, other] = found[:, other, one] = product
    return found


def _partial(matrix: Floats) -> Floats:
    """The correlation of each of D settings with the last column given the other
    settings, (resamples, D), from correlation matrices (resamples, D + 1, D + 1).

    Settings alone are inverted: the last column may follow from them. A direction in
    which they do not vary is given as little variance as rounding leaves, so that those
    who follow from others are found to be determined, and all others keep their value.
    """
    settings, last = matrix[:, :-1, :-1], matrix[:, :-1, -1]
    values, vectors = np.linalg.eigh(settings)
    roots = vectors / np.sqrt(np.maximum(values, ROUNDING))[:, None, :]
    explained = (roots.transpose(0, 2, 1) @ last[:, :, None])[:, :, 0]
    slopes = (roots @ explained[:, :, None])[:, :, 0]
    # What the other settings leave of the variance of a setting, and of the last
    # column; the latter is what all settings leave, and what this setting explains.
    left = 1.0 / (roots * roots).sum(axis=2)
    by_all = np.maximum(1.0 - (explained * explained).sum(axis=1, keepdims=True), 0.0)
    left_of_last = by_all + slopes * slopes * left
    known = np.minimum(left, left_of_last) >= DETERMINED
    root = np.sqrt(np.where(known, left_of_last, 1.0))
    found = np.clip(slopes * np.sqrt(left) / root, -1.0, 1.0)
    return np.where(known, found, np.nan)
