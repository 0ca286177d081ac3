"""Sobol indices from blocks of means over replicates, with and without replicate noise.

The mean of n replicates is f + e, with the expectation f and noise e. The product of
two means has the expectation of the product of the f plus the covariance of the e. So
each product in the estimators of Saltelli et al. (2010, Computer Physics Communications
181, 259-270) is reduced by an estimate of this covariance: the sample covariance of the
replicates divided by n.

For independent noise this is the one-way analysis of variance (Searle, Casella and
McCulloch 1992, Variance Components, chapter 3) in the estimators. Numerators of S1 and
S2 keep the expectation, and numerators of ST lose the noise variance of a mean. All
numerators are divided by the variance less this noise variance. The correction stays
valid if points share random numbers, which the plain analysis of variance takes for
independent noise, and if blocks share points. Replicates must be independent, and at
least two.
"""

from itertools import combinations
from typing import NamedTuple

import numpy as np

from sweep.methods.sensitivity.sampled import Analysis, Blocks, Floats, SampledAxis

NAMES = ("raw", "corrected", "noise_share")
ROUNDING = 1e-12
"""Fraction of the size of a metric, below which a variation is a rounding error."""


class Columns(NamedTuple):
    """Indices of the points of a block.

    The points are A, B, A with one parameter of B (`ab`), and the reverse (`ba`), if
    any.
    """

    a: int
    b: int
    ab: range
    ba: range

    @property
    def pairs(self) -> list[tuple[int, int]]:
        """The pairs of parameters that have an index S2."""
        return list(combinations(range(len(self.ba)), 2))


def _columns(settings: int, size: int) -> Columns:
    return Columns(0, size - 1, range(1, settings + 1), range(settings + 1, size - 1))


def index_analysis(sample: SampledAxis) -> Analysis:
    """Return the analysis of raw and corrected S1, ST and S2, and the noise.

    The noise is a fraction of the variance of a mean.
    """
    settings = list(sample.settings.columns)
    blocks = sample.complete
    columns = _columns(len(settings), blocks.shape[1])
    labels = [("S1", setting, "") for setting in settings] + [
        ("ST", setting, "") for setting in settings
    ]
    labels += [("S2", settings[j], settings[k]) for j, k in columns.pairs]
    rows: list[dict[str, object]] = [
        {"index": name, "setting": setting, "other": partner}
        for name, setting, partner in labels
    ]
    values = sample.means[blocks]
    spread = values.std() if len(blocks) else 0.0
    if spread <= ROUNDING * np.abs(values).max(initial=0.0):
        return Analysis(
            rows,
            NAMES,
            lambda drawn: np.full((len(NAMES), len(rows), drawn.shape[1]), np.nan),
        )
    # Centred values make products of them much more precise, and SALib expects values
    # of the size of one.
    means = (values - values.mean()) / spread
    noise = _noise(sample, columns) / spread**2
    return Analysis(rows, NAMES, lambda drawn: _estimates(columns, means, noise, drawn))


def _estimates(columns: Columns, means: Floats, noise: Floats, drawn: Blocks) -> Floats:
    """Return raw, corrected and noise_share, (3, indices, resamples)."""
    from SALib.analyze.sobol import first_order, second_order, total_order

    a = means[drawn, columns.a]
    b = means[drawn, columns.b]
    ab = [means[drawn, column] for column in columns.ab]
    ba = [means[drawn, column] for column in columns.ba]
    raw = np.array(
        [first_order(a, column, b) for column in ab]
        + [total_order(a, column, b) for column in ab]
        + [second_order(a, ab[j], ab[k], ba[j], B=b) for j, k in columns.pairs]
    )
    variance = np.concatenate([a, b]).var(axis=0)
    of_variance, *of_products = _means_of(noise, drawn)
    remaining = np.where(variance > of_variance, variance - of_variance, np.nan)
    share = of_variance / np.where(variance > 0.0, variance, np.nan)
    corrected = (raw * variance - np.array(of_products)) / remaining
    return np.stack([raw, corrected, np.broadcast_to(share, raw.shape)])


def _means_of(noise: Floats, drawn: Blocks) -> Floats:
    """Return means of rows (rows, b) over drawn blocks, (rows, resamples).

    Values that are not finite do not count.
    """
    blocks, resamples = drawn.shape
    places = drawn + blocks * np.arange(resamples)
    times = (
        np.bincount(places.ravel(), minlength=blocks * resamples)
        .reshape(resamples, blocks)
        .T.astype(np.float64)
    )
    finite = np.isfinite(noise)
    number = finite @ times
    means: Floats = (
        np.where(finite, noise, 0.0) @ times / np.where(number > 0.0, number, np.nan)
    )
    return means


def _noise(sample: SampledAxis, columns: Columns) -> Floats:
    """Return the part of the variance and of numerators that is noise.

    The shape is (1 + indices, b): the variance first, then the numerator of each index.
    """
    points = sample.complete.T
    noise = sample.noise
    a = points[columns.a]
    b = points[columns.b]
    ab = points[columns.ab.start : columns.ab.stop]
    ba = points[columns.ba.start : columns.ba.stop]
    first = [noise(b, column) - noise(b, a) for column in ab]
    total = [
        0.5 * (noise(a, a) + noise(column, column)) - noise(a, column) for column in ab
    ]
    second = [
        noise(ba[j], ab[k]) - noise(a, b) - first[j] - first[k]
        for j, k in columns.pairs
    ]
    return np.array([0.5 * (noise(a, a) + noise(b, b)), *first, *total, *second])
