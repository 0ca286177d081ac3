"""The measures of the claims of cucker_smale2007."""

from typing import Any

import numpy as np
import pandas as pd
import pytest

from experiments.cucker_smale2007.figures import (
    drift_near,
    left_far,
    rate,
    rise_far,
    rise_near,
)


class Made:
    """Three trials, the last of which has another beta."""

    trials = pd.DataFrame(
        {"trial_id": ["a", "b", "c"], "exponent": [0.4, 0.4, 0.8], "dt": 0.1}
    )
    series = pd.DataFrame(
        {
            "trial_id": ["a"] * 4 + ["b"] * 4 + ["c"] * 4,
            "frame": [0, 10, 20, 30] * 3,
            "velocity_diameter": [8, 4, 2, 1, 2, 3, 1, 1, 9, 9, 9, 9],
            "group_speed": [1, 1, 1, 1, 2, 2.5, 2, 2, 1, 3, 1, 1],
        }
    )


STUDIES: Any = {"near": Made, "far": Made}


def test_a_rise_is_a_share_of_the_start() -> None:
    for measure in (rise_near, rise_far):
        assert measure(STUDIES, exponent=0.4) == pytest.approx([-1 / 8, 0.5])


def test_a_drift_is_the_greatest_change() -> None:
    assert drift_near(STUDIES, exponent=0.4) == pytest.approx([0.0, 0.25])
    assert drift_near(STUDIES, exponent=0.8) == pytest.approx([2.0])


def test_what_is_left_is_a_share_of_the_start() -> None:
    assert left_far(STUDIES, 0.4) == pytest.approx([1 / 8, 0.5])


def test_the_rate_is_that_of_the_last_frames() -> None:
    """From 4 to 1 in two times one unit."""
    assert rate(STUDIES, 0.4)[0] == pytest.approx(np.log(4) / 2)
