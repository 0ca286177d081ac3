"""Rank correlations of resamples are those of what was drawn, ranked anew."""

import numpy as np
import pandas as pd
import pytest
from numpy.random import default_rng

from sweep.methods.sensitivity.resampled_ranks import AT_ONCE, rank_analysis
from sweep.methods.sensitivity.sampled import SampledAxis
from tests.naive.rank_correlations import resampled

RNG = default_rng(5)
FREE = RNG.random((40, 4))
COARSE = RNG.integers(0, 3, (40, 4)).astype(float)
EQUAL = np.column_stack([FREE[:, 0], FREE[:, 0] ** 3, FREE[:, 2:]])
CONSTANT = np.column_stack([FREE[:, :2], np.full(40, 7.0), FREE[:, 3]])
NOISE = RNG.random(40)
CASES = {
    "all values differ": (FREE, FREE[:, 0] + NOISE, 1),
    "equal values": (COARSE, np.round(COARSE[:, 0] + 2 * NOISE), 1),
    "blocks that share points": (COARSE, COARSE[:, 1] - NOISE, 6),
    "two settings in one order": (EQUAL, EQUAL[:, 0] + NOISE, 1),
    "the metric follows from a setting": (FREE, np.exp(FREE[:, 1]), 1),
    "the metric follows from two": (EQUAL[:, :2], EQUAL[:, 0], 1),
    "a setting does not vary": (CONSTANT, CONSTANT[:, 0] + NOISE, 1),
    "the metric does not vary": (FREE, np.ones(40), 1),
    "one setting": (FREE[:, :1], FREE[:, 0] + NOISE, 1),
    "few points": (FREE[:6], FREE[:6, 0] + NOISE[:6], 1),
    "few equal points": (COARSE[:7], COARSE[:7, 0] + NOISE[:7], 1),
    "too few points": (FREE[:3], NOISE[:3], 1),
}


def sample_of(settings: np.ndarray, means: np.ndarray, size: int) -> SampledAxis:
    """A sample in blocks of a size, which share points if there are more than one."""
    points = np.arange(len(means))
    rows = points[:, None] if size == 1 else default_rng(1).choice(points, (30, size))
    names = [f"setting {number}" for number in range(settings.shape[1])]
    table = pd.DataFrame(settings, columns=names)
    nothing = np.full((len(means), 1), np.nan)
    return SampledAxis({}, table, means, nothing, rows, None, len(means), 0)


@pytest.mark.parametrize("case", CASES)
def test_each_resample_is_as_if_it_was_ranked_anew(case: str) -> None:
    """To within rounding, also where others determine a rank, in 100 resamples."""
    settings, means, size = CASES[case]
    sample = sample_of(settings, means, size)
    blocks = len(sample.complete)
    drawn = default_rng(2).integers(blocks, size=(blocks, 100))
    found = rank_analysis(sample).estimate(drawn)
    points = sample.complete[drawn.T].reshape(100, -1)
    expected = resampled(settings, means, points)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-10)


def test_resamples_that_are_ranked_in_turns_are_all_there() -> None:
    """With 400 points, 250 resamples at once."""
    rng = default_rng(3)
    settings = rng.random((400, 2))
    means = settings[:, 0] + rng.random(400)
    drawn = rng.integers(400, size=(AT_ONCE // 400 + 3, 400))
    estimate = rank_analysis(sample_of(settings, means, 1)).estimate
    expected = resampled(settings, means, drawn)
    np.testing.assert_allclose(estimate(drawn.T), expected, rtol=0, atol=1e-12)
    assert estimate(drawn.T[:, :0]).shape == (2, 2, 0)


def test_settings_of_texts_take_no_part() -> None:
    settings = pd.DataFrame({"one": FREE[:, 0], "map": ["empty", "cafeteria"] * 20})
    points = np.arange(40)[:, None]
    sample = SampledAxis({}, settings, NOISE, NOISE[:, None], points, None, 40, 0)
    found = rank_analysis(sample).estimate(points)
    alone = resampled(FREE[:, :1], NOISE, points.T)
    np.testing.assert_allclose(found[:, :1], alone, rtol=0, atol=1e-12)
    assert np.isnan(found[:, 1]).all()
