"""Rank correlations with their intervals, against ranking each resample anew."""

import time
from statistics import median

import numpy as np
from numpy.random import default_rng

from sweep.methods.sensitivity.resampled_ranks import rank_analysis
from sweep.methods.sensitivity.sampled import samples
from tests.bench.scale import FULL, Scale
from tests.naive.rank_correlations import resampled
from tests.sampled import axis, study_of

ROUNDS = 3
POINTS, RESAMPLES = 2000, 1000


def ranks(scale: Scale = FULL) -> None:
    """A metric at 2000 random points of three settings: as each of the eight samples of
    the gain study.
    """
    points, resamples = scale.of(POINTS), scale.of(RESAMPLES)
    study = study_of(axis("random", points), replicates=3)
    (sample,) = samples(study, "speed", "joint")
    drawn = default_rng(0).integers(points, size=(points, resamples))
    settings, found = sample.settings.to_numpy(), []
    for _ in range(scale.of(ROUNDS)):
        began = time.process_time()
        mine = rank_analysis(sample).estimate(drawn)
        between = time.process_time()
        theirs = resampled(settings, sample.means, drawn.T)
        found.append((between - began, time.process_time() - between))
        np.testing.assert_allclose(mine, theirs, rtol=0, atol=1e-10)
    one, other = (median(pair[k] for pair in found) / resamples * 1e6 for k in (0, 1))
    print(
        f"ranks: {one:.0f} us a resample of {points} points, {other:.0f} us if it is"
        f" ranked anew: {median(b / a for a, b in found):.1f} times as fast"
    )
