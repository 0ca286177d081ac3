"""The measures of the claims of strombom2014."""

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from experiments.strombom2014.figures import DRIVEN, period, spectra

STEPS = 500


def trial(name: str, done: float, every: int) -> pd.DataFrame:
    """A dog that is beside its line by a wave of one period until the task is done, and
    by one of three times this period in the beginning.
    """
    frame = np.arange(STEPS + 1)
    early = frame < done - DRIVEN if math.isfinite(done) else frame < 0
    waves = np.sin(math.tau * frame / np.where(early, 3 * every, every))
    return pd.DataFrame(
        {
            "trial_id": name,
            "frame": frame,
            "dog_offset": 5 + waves,
            "herding_time": np.where(frame < done, math.nan, done),
        }
    )


def test_the_period_is_that_of_the_last_steps_of_a_task_that_is_done() -> None:
    """Trials whose task is not done, or done too soon, have none."""
    series = pd.concat(
        [
            trial("a", 400, 20),
            trial("b", 470, 8),
            trial("c", math.inf, 8),
            trial("d", DRIVEN - 1, 8),
        ]
    )
    studies: Any = {"path": SimpleNamespace(series=series)}
    assert period(studies) == pytest.approx([20, 8])


def test_a_spectrum_has_shares_of_the_variance_without_the_mean() -> None:
    rows = np.random.default_rng(1).normal(100.0, 1.0, (3, 64))
    frequencies, found = spectra(rows)
    assert frequencies[[0, -1]] == pytest.approx([1 / 64, 0.5])
    assert found.shape == (3, 32)
    assert found.sum(axis=1) == pytest.approx([1, 1, 1])
