"""Measures of what aziel_chen2025 says of its search for gains, each a function that
published.yaml calls.
"""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sweep.tables.stored_study import StoredStudy

Studies = dict[str, StoredStudy]
Values = NDArray[np.float64]

SIZES = (50, 100)
GAINS = {
    "cohesion_weight": "$k_{coh}$",
    "alignment_weight": "$k_{ali}$",
    "separation_weight": "$k_{col}$",
}
WALL_WEIGHT = 10.0


def done(study: StoredStudy, **settings: object) -> pd.DataFrame:
    """The trials with these settings that are done, the corridor only with the usual
    wall gain.
    """
    trials = study.where(wall_weight=WALL_WEIGHT, **settings).trials
    return trials[trials["status"] == "done"]


def _by_gain(study: StoredStudy, settings: Mapping[str, object]) -> "pd.Series[float]":
    """Coverage of the traversable pixels by gain vector, a mean over seeds and whatever
    `settings` leaves open.
    """
    return done(study, **settings).groupby(list(GAINS))["coverage"].mean()


def _losses(coverage: "pd.Series[float]") -> Values:
    """Coverage lost for each 0.01 of alignment weight, one value for each pair of
    points half the sample apart.
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


def loss_to_alignment_beyond_and_before(studies: Studies) -> tuple[Values, Values]:
    """Coverage lost for each 0.01 of alignment weight beyond 0.03, and before, as a
    mean over maps and sizes.
    """
    coverage = _by_gain(studies["gains"], {})
    beyond = coverage.index.get_level_values("alignment_weight") > 0.03
    return _losses(coverage[beyond]), _losses(coverage[~beyond])


def loss_to_alignment_of_50_less_that_of_100(studies: Studies) -> Values:
    """Coverage lost for each 0.01 of alignment weight in the two obstacle-dense maps:
    50 boids less 100.
    """
    losses = {
        (name, n): _losses(_by_gain(studies["gains"], {"map": name, "n": n}))
        for name in ("dense_cafeteria", "narrow_corridor")
        for n in SIZES
    }
    return np.mean(
        [losses[name, 50] - losses[name, 100] for name, n in losses if n == 50], axis=0
    )


def near_maximal_in_the_empty_map(studies: Studies) -> Values:
    """By gain vector, the share of the two sizes that reach nine tenths of the best
    coverage in the empty map.
    """
    coverage = [_by_gain(studies["gains"], {"map": "empty", "n": n}) for n in SIZES]
    return np.mean([one.to_numpy() > 0.9 * one.max() for one in coverage], axis=0)


def _spread_over_seeds(study: StoredStudy, name: str) -> Values:
    by_point = done(study, map=name).groupby([*GAINS, "n"])["coverage"].std()
    return by_point.groupby(list(GAINS)).mean().to_numpy(np.float64)


def seed_spread_dense_cafeteria(studies: Studies) -> Values:
    """Standard deviation of coverage over the seeds by gain vector: the dense cafeteria
    less the empty map.
    """
    return _spread_over_seeds(studies["gains"], "dense_cafeteria") - _spread_over_seeds(
        studies["gains"], "empty"
    )


def seed_spread_narrow_corridor(studies: Studies) -> Values:
    """Standard deviation of coverage over the seeds by gain vector: the narrow corridor
    less the empty map.
    """
    return _spread_over_seeds(studies["gains"], "narrow_corridor") - _spread_over_seeds(
        studies["gains"], "empty"
    )


def _spread_over_gains(study: StoredStudy, name: str) -> Values:
    """The squared deviation of each gain vector's coverage from the mean of all, a mean
    over the two sizes.
    """
    coverage = [_by_gain(study, {"map": name, "n": n}).to_numpy() for n in SIZES]
    return np.mean([(one - one.mean()) ** 2 for one in coverage], axis=0)


def gain_spread_dense_cafeteria(studies: Studies) -> Values:
    """The variance of coverage over gain vectors, by vector: the dense cafeteria less
    the empty map.
    """
    return _spread_over_gains(studies["gains"], "dense_cafeteria") - _spread_over_gains(
        studies["gains"], "empty"
    )


def gain_spread_narrow_corridor(studies: Studies) -> Values:
    """The variance of coverage over gain vectors, by vector: the narrow corridor less
    the empty map.
    """
    return _spread_over_gains(studies["gains"], "narrow_corridor") - _spread_over_gains(
        studies["gains"], "empty"
    )
