"""Which settings matter at all: elementary effects of Morris's trajectories, and rank
correlations of any sample.
"""

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sweep.tables.sensitivity.sampled import (
    Analysis,
    Blocks,
    Floats,
    SampledAxis,
    known_means,
)

FEWEST = 4
"""A rank correlation needs so many points."""

DETERMINED = 1e-9
"""Others determine a rank if they leave less than this part of its variance."""


def effect_analysis(sample: SampledAxis) -> Analysis:
    """Mean, mean of the absolute values and standard deviation of the elementary
    effects of each setting.

    An effect is a change over the step, which is a part of the unit interval.
    """
    assert sample.levels is not None
    step = sample.levels / (2.0 * (sample.levels - 1))
    effects, noise = _effects(sample, step)

    def estimate(drawn: Blocks) -> Floats:
        chosen = effects[:, drawn]
        deviation = (
            chosen.std(axis=1, ddof=1)
            if len(drawn) > 1
            else np.full_like(chosen[:, 0], np.nan)
        )
        return np.stack([chosen.mean(axis=1), np.abs(chosen).mean(axis=1), deviation])

    rows = [
        {"setting": setting, "noise": float(size)}
        for setting, size in zip(sample.settings, noise, strict=True)
    ]
    return Analysis(rows, ("mu", "mu_star", "sigma"), estimate)


def _effects(sample: SampledAxis, step: float) -> tuple[Floats, Floats]:
    """The effects (settings, b), and by setting their standard deviation from noise."""
    whole = sample.whole
    before, after = whole[:, :-1], whole[:, 1:]
    settings = np.stack(
        [_numbers(sample.settings[setting], texts=True) for setting in sample.settings],
        axis=1,
    )
    direction = np.sign(settings[after] - settings[before])
    effects = (
        np.einsum("bsf,bs->fb", direction, sample.means[after] - sample.means[before])
        / step
    )
    one, other = before.ravel(), after.ravel()
    variance = (
        sample.noise(one, one)
        + sample.noise(other, other)
        - 2.0 * sample.noise(one, other)
    )
    of_field = np.where(
        direction.reshape(-1, settings.shape[1]) != 0.0, variance[:, None], np.nan
    )
    noise: Floats = np.sqrt(np.maximum(known_means(of_field, 0), 0.0)) / step
    return effects, noise


def _numbers(column: "pd.Series[float]", *, texts: bool) -> Floats:
    """A setting as numbers: for `texts` any that tell them apart, else NaN."""
    if pd.api.types.is_numeric_dtype(column):
        return np.asarray(column, np.float64)
    codes: Floats = pd.factorize(column)[0].astype(np.float64)
    return codes if texts else np.full_like(codes, np.nan)


def rank_analysis(sample: SampledAxis) -> Analysis:
    """Spearman's correlation of each setting with the metric, and the partial one given
    the ranks of the other settings.
    """
    settings = np.stack(
        [
            _numbers(sample.settings[setting], texts=False)
            for setting in sample.settings
        ],
        axis=1,
    )
    table = np.column_stack([settings, sample.means])
    whole = sample.whole

    def estimate(drawn: Blocks) -> Floats:
        return np.stack(
            [_rank_correlations(table[whole[column].ravel()]) for column in drawn.T],
            axis=2,
        )

    return Analysis(
        [{"setting": setting} for setting in sample.settings],
        ("spearman", "partial"),
        estimate,
    )


def _rank_correlations(table: Floats) -> Floats:
    """Spearman's and the partial correlations (2, D) of D columns with the last; NaN
    where they are not defined.
    """
    from scipy.stats import rankdata

    settings = table.shape[1] - 1
    found = np.full((2, settings), np.nan)
    varying = np.flatnonzero(np.ptp(table, axis=0) > 0.0)
    if len(table) < FEWEST or settings not in varying or len(varying) < 2:
        return found
    ranks = rankdata(table[:, varying], axis=0)
    correlation = np.asarray(np.corrcoef(ranks, rowvar=False))
    for place, setting in enumerate(varying[:-1]):
        found[:, setting] = correlation[place, -1], _partial(correlation, place)
    if len(table) <= len(varying) + 1:
        found[1] = np.nan
    return found


def _partial(correlation: NDArray[np.float64], place: int) -> float:
    """The correlation of one column with the last, given all others."""
    pair = [place, len(correlation) - 1]
    others = [column for column in range(len(correlation)) if column not in pair]
    across = correlation[np.ix_(pair, others)]
    left = (
        correlation[np.ix_(pair, pair)]
        - across @ np.linalg.pinv(correlation[np.ix_(others, others)]) @ across.T
    )
    if min(left[0, 0], left[1, 1]) < DETERMINED:
        return np.nan
    return float(np.clip(left[0, 1] / np.sqrt(left[0, 0] * left[1, 1]), -1.0, 1.0))
