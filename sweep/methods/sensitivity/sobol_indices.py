"""Sobol indices from blocks of means over replicates, as they are and without replicate
noise.

The mean of n replicates is f + e: f is what we ask for, e is noise. The product of two
means has the expectation of the product of their f plus the covariance of their e. So
every product in the estimators of Saltelli et al. (2010, Computer Physics
Communications 181, 259-270) loses what the replicates tell of its own part, their
sample covariance divided by n. For independent noise this is the one-way analysis of
variance (Searle, Casella and McCulloch 1992, Variance Components, chapter 3) put into
the estimators: numerators of S1 and S2 keep their expectation, those of ST lose the
noise variance of a mean, and all are divided by the variance less that. It stays right
where points share random numbers, which the plain analysis of variance takes for
independent noise, and where blocks share points. Replicates must be independent of each
other, and there must be two.
"""

from itertools import combinations
from typing import NamedTuple

import numpy as np

from sweep.methods.sensitivity.sampled import Analysis, Blocks, Floats, SampledAxis

NAMES = ("raw", "corrected", "noise_share")
ROUNDING = 1e-12
"""A metric that varies by less than this part of its size does not vary."""


class Columns(NamedTuple):
    """Which point of a block is which: A, B, A with one setting of B (`ab`), and the
    reverse (`ba`), if there are any.
    """

    a: int
    b: int
    ab: range
    ba: range

    @property
    def pairs(self) -> list[tuple[int, int]]:
        """The pairs of settings of which the block tells something."""
        return list(combinations(range(len(self.ba)), 2))


def _columns(settings: int, size: int) -> Columns:
    return Columns(0, size - 1, range(1, settings + 1), range(settings + 1, size - 1))


def index_analysis(sample: SampledAxis) -> Analysis:
    """The raw and corrected S1, ST and S2, and noise's share of a mean's variance."""
    settings, whole = list(sample.settings.columns), sample.whole
    columns = _columns(len(settings), whole.shape[1])
    labels = [("S1", setting, "") for setting in settings] + [
        ("ST", setting, "") for setting in settings
    ]
    labels += [("S2", settings[one], settings[other]) for one, other in columns.pairs]
    rows: list[dict[str, object]] = [
        {"index": name, "setting": one, "other": other} for name, one, other in labels
    ]
    values = sample.means[whole]
    spread = values.std() if len(whole) else 0.0
    if spread <= ROUNDING * np.abs(values).max(initial=0.0):
        return Analysis(
            rows,
            NAMES,
            lambda drawn: np.full((len(NAMES), len(rows), drawn.shape[1]), np.nan),
        )
    # Centred values make products of them much more precise, and SALib expects values
    # of the size of one.
    means, noise = (
        (values - values.mean()) / spread,
        _noise(sample, columns) / spread**2,
    )
    return Analysis(rows, NAMES, lambda drawn: _estimates(columns, means, noise, drawn))


def _estimates(columns: Columns, means: Floats, noise: Floats, drawn: Blocks) -> Floats:
    from SALib.analyze.sobol import first_order, second_order, total_order

    a, b = means[drawn, columns.a], means[drawn, columns.b]
    ab, ba = (
        [means[drawn, column] for column in columns.ab],
        [means[drawn, column] for column in columns.ba],
    )
    raw = np.array(
        [first_order(a, column, b) for column in ab]
        + [total_order(a, column, b) for column in ab]
        + [second_order(a, ab[j], ab[k], ba[j], b) for j, k in columns.pairs]
    )
    variance = np.concatenate([a, b]).var(axis=0)
    of_variance, *of_products = _means_of(noise, drawn)
    remaining = np.where(variance > of_variance, variance - of_variance, np.nan)
    share = of_variance / np.where(variance > 0.0, variance, np.nan)
    corrected = (raw * variance - np.array(of_products)) / remaining
    return np.stack([raw, corrected, np.broadcast_to(share, raw.shape)])


def _means_of(noise: Floats, drawn: Blocks) -> Floats:
    """Means of rows (rows, b) over the known drawn blocks, (rows, resamples)."""
    blocks, resamples = drawn.shape
    places = drawn + blocks * np.arange(resamples)
    times = (
        np.bincount(places.ravel(), minlength=blocks * resamples)
        .reshape(resamples, blocks)
        .T.astype(np.float64)
    )
    known = np.isfinite(noise)
    number = known @ times
    means: Floats = (
        np.where(known, noise, 0.0) @ times / np.where(number > 0.0, number, np.nan)
    )
    return means


def _noise(sample: SampledAxis, columns: Columns) -> Floats:
    """What noise adds to the variance and each index's numerator, (1 + indices, b)."""
    points, noise = sample.whole.T, sample.noise
    a, b = points[columns.a], points[columns.b]
    ab, ba = (
        points[columns.ab.start : columns.ab.stop],
        points[columns.ba.start : columns.ba.stop],
    )
    first = [noise(b, column) - noise(b, a) for column in ab]
    total = [
        0.5 * (noise(a, a) + noise(column, column)) - noise(a, column) for column in ab
    ]
    second = [
        noise(ba[j], ab[k]) - noise(a, b) - first[j] - first[k]
        for j, k in columns.pairs
    ]
    return np.array([0.5 * (noise(a, a) + noise(b, b)), *first, *total, *second])
