"""Measures of what aziel_chen2025 says of its search for gains, and of what it found,
each a function that published.yaml calls.
"""

from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sweep.tables.stored_study import StoredStudy

Studies = dict[str, StoredStudy]
Values = NDArray[np.float64]
Coverage = pd.Series

SIZES = (50, 100)
GAINS = {
    "cohesion_weight": "k_coh",
    "alignment_weight": "k_ali",
    "separation_weight": "k_col",
}
BLOCKS = 10
PERIPHERY = 50
"""Pixels from the border."""


def done(study: StoredStudy, **settings: Any) -> pd.DataFrame:
    """The trials with these settings that are done."""
    trials = study.where(**settings).trials
    return trials[trials["status"] == "done"]


def _by_gain(studies: Studies, **settings: Any) -> Coverage:
    """Coverage of the traversable pixels by gain vector, a mean over seeds."""
    return done(studies["gains"], **settings).groupby(list(GAINS))["coverage"].mean()


def losses(coverage: Coverage) -> Values:
    """Coverage lost for each 0.01 of alignment weight, one value for each pair of
    points half the sample apart. `coverage` is by gain vector.
    """
    alignment = coverage.index.get_level_values("alignment_weight").to_numpy()
    order = np.argsort(alignment, kind="stable")
    half = len(order) // 2
    first, second = order[:half], order[half : 2 * half]
    values = coverage.to_numpy()
    return np.asarray(
        0.01
        * (values[first] - values[second])
        / (alignment[second] - alignment[first]),
        np.float64,
    )


def beyond_and_before(coverage: Coverage) -> tuple[Values, Values]:
    """Coverage lost for each 0.01 of alignment weight beyond 0.03, and before."""
    beyond = coverage.index.get_level_values("alignment_weight") > 0.03
    return losses(coverage[beyond]), losses(coverage[~beyond])


def loss_beyond_and_before(studies: Studies, **settings: Any) -> tuple[Values, Values]:
    return beyond_and_before(_by_gain(studies, **settings))


def loss_of_50_less_that_of_100(studies: Studies, **settings: Any) -> Values:
    """Coverage lost for each 0.01 of alignment weight in one map: 50 boids less 100."""
    few, many = (losses(_by_gain(studies, n=n, **settings)) for n in SIZES)
    return few - many


def near_maximal(studies: Studies, **settings: Any) -> Values:
    """By gain vector, whether it reaches nine tenths of the best coverage."""
    coverage = _by_gain(studies, **settings).to_numpy()
    return np.asarray(coverage > 0.9 * coverage.max(), np.float64)


def _spread_over_seeds(studies: Studies, **settings: Any) -> Values:
    by_point = done(studies["gains"], **settings).groupby(list(GAINS))["coverage"]
    return by_point.std().to_numpy(np.float64)


def seed_spread(studies: Studies, **settings: Any) -> Values:
    """Standard deviation of coverage over the seeds by gain vector: a map less the
    empty one.
    """
    return _spread_over_seeds(studies, **settings) - _spread_over_seeds(
        studies, **settings | {"map": "empty"}
    )


def seed_spread_of_50_less_that_of_100(studies: Studies, **settings: Any) -> Values:
    """Standard deviation of coverage over the seeds by gain vector: 50 boids less
    100.
    """
    few, many = (_spread_over_seeds(studies, n=n, **settings) for n in SIZES)
    return few - many


def _deviations(studies: Studies, **settings: Any) -> Values:
    """The squared deviation of each gain vector's coverage from the mean of all."""
    coverage = _by_gain(studies, **settings).to_numpy(np.float64)
    return (coverage - coverage.mean()) ** 2


def gain_spread(studies: Studies, **settings: Any) -> Values:
    """The variance of coverage over gain vectors, by vector: a map less the empty
    one.
    """
    return _deviations(studies, **settings) - _deviations(
        studies, **settings | {"map": "empty"}
    )


def _middle_and_ends(
    studies: Studies, gain: str, **settings: Any
) -> tuple[Values, Values]:
    """Coverage where a gain lies in the middle third of its values, and where it lies
    in the outer ones; less that of the points with the nearest alignment weights.
    """
    coverage = _by_gain(studies, **settings).sort_index(level="alignment_weight")
    level = coverage.rolling(21, center=True, min_periods=1).mean()
    values = coverage.index.get_level_values(gain)
    third = pd.Series(values).rank(pct=True).between(1 / 3, 2 / 3).to_numpy()
    left = (coverage - level).to_numpy(np.float64)
    return left[third], left[~third]


def moderate_cohesion(studies: Studies, **settings: Any) -> tuple[Values, Values]:
    return _middle_and_ends(studies, "cohesion_weight", **settings)


def moderate_separation(studies: Studies, **settings: Any) -> tuple[Values, Values]:
    return _middle_and_ends(studies, "separation_weight", **settings)


def _outweighed(studies: Studies, gain: str, **settings: Any) -> Values:
    """By how much the rank correlation of alignment and coverage exceeds that of
    another gain, both without signs, in BLOCKS parts of the points.
    """
    points = _by_gain(studies, **settings).reset_index()
    values = []
    for part in np.array_split(np.arange(len(points)), BLOCKS):
        ranks = points.iloc[part].rank()
        correlations = ranks[["alignment_weight", gain]].corrwith(ranks["coverage"])
        values.append(abs(correlations.iloc[0]) - abs(correlations.iloc[1]))
    return np.array(values)


def cohesion_outweighed(studies: Studies, **settings: Any) -> Values:
    return _outweighed(studies, "cohesion_weight", **settings)


def separation_outweighed(studies: Studies, **settings: Any) -> Values:
    return _outweighed(studies, "separation_weight", **settings)


def better_than_published(studies: Studies, **settings: Any) -> Values:
    """By gain vector, whether it covers more than the published best one."""
    best = done(studies["equal_steps"], **settings)["coverage"].mean()
    return np.asarray(_by_gain(studies, **settings) > best, np.float64)


def doubling(study: StoredStudy, column: str, **settings: Any) -> Values:
    """The change from 50 to 100 boids, one value a replicate."""
    trials = done(study, **settings)
    by_size = trials.pivot(index="replicate", columns="n", values=column)
    return np.asarray(by_size[100] - by_size[50], np.float64)


def doubling_among_obstacles(studies: Studies) -> Values:
    """What doubling the swarm adds to coverage after 3600 steps in the dense cafeteria
    and the corridor, on average, less what it adds in the empty map.
    """
    study, column = studies["equal_steps"], "coverage"
    dense, corridor, empty = (
        doubling(study, column, map=name)
        for name in ("dense_cafeteria", "narrow_corridor", "empty")
    )
    return 0.5 * (dense + corridor) - empty


def periphery(studies: Studies) -> Values:
    """Visits of a pixel nearer than PERIPHERY to the border over those of a pixel
    farther off, in the dense cafeteria, one value a heatmap.
    """
    study = studies["wall_clock"]
    visits = study.heatmaps.set_index("trial_id")["visits"]
    values = []
    for trial in done(study, map="dense_cafeteria_heatmap")["trial_id"]:
        counts = np.where(visits[trial] >= 0, visits[trial], np.nan).astype(np.float64)
        inner = counts[PERIPHERY:-PERIPHERY, PERIPHERY:-PERIPHERY]
        rest = np.isfinite(counts).sum() - np.isfinite(inner).sum()
        outer = (np.nansum(counts) - np.nansum(inner)) / rest
        values.append(outer / np.nanmean(inner))
    return np.array(values)
