"""Rank correlations of resamples, as they are defined: what was drawn is ranked, and
each pair of ranks is cleared of what the other columns say of it.
"""

import numpy as np
from scipy.stats import rankdata

LEAST = 1e-9
"""Of the variance of a rank: what is less is rounding."""
ROUNDING = 1e-12
"""Of the largest eigenvalue of a correlation matrix: what is less is 0."""


def resampled(settings: np.ndarray, means: np.ndarray, drawn: np.ndarray) -> np.ndarray:
    """The correlations (2, D, resamples) of D settings (n, D) with means (n,); `drawn`
    (resamples, m) says which points each resample has.
    """
    table = np.column_stack([settings, means])
    return np.stack([rank_correlations(table[points]) for points in drawn], axis=2)


def rank_correlations(table: np.ndarray) -> np.ndarray:
    """Spearman's and the partial correlations (2, D) of the D first columns of a table
    with the last; NaN where they are not defined.
    """
    columns = table.shape[1] - 1
    found = np.full((2, columns), np.nan)
    varying = np.flatnonzero(np.ptp(table, axis=0) > 0.0)
    if len(table) < 4 or columns not in varying or len(varying) < 2:
        return found
    correlation = np.corrcoef(rankdata(table[:, varying], axis=0), rowvar=False)
    for place, column in enumerate(varying[:-1]):
        found[0, column] = correlation[place, -1]
        if len(table) > len(varying) + 1:
            found[1, column] = partial(correlation, place)
    return found


def partial(correlation: np.ndarray, place: int) -> float:
    """The correlation of one column with the last, given all others."""
    pair = [place, len(correlation) - 1]
    others = [column for column in range(len(correlation)) if column not in pair]
    across = correlation[np.ix_(pair, others)]
    among = np.linalg.pinv(correlation[np.ix_(others, others)], ROUNDING)
    left = correlation[np.ix_(pair, pair)] - across @ among @ across.T
    if min(left[0, 0], left[1, 1]) < LEAST:
        return np.nan
    return float(np.clip(left[0, 1] / np.sqrt(left[0, 0] * left[1, 1]), -1.0, 1.0))
