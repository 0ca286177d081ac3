"""Who is in step, by what counts as one."""

import numpy as np
import pytest

from experiments.patel2023.flights import in_step

FRAMES = np.arange(21.0)
NEAR = np.tile(~np.eye(2, dtype=bool), (21, 1, 1))


def share(second: np.ndarray, tolerance: float, window: float) -> float:
    """Of the frames in which a rover is in step with a second one, beside which it
    flies at 10 a frame along x.
    """
    x = np.column_stack([10.0 * FRAMES, 10.0 * FRAMES])
    y = np.column_stack([0.0 * FRAMES, second])
    return float(in_step(x, y, NEAR, tolerance, window)[:, 0].mean())


@pytest.mark.parametrize(("slope", "in_time"), [(0.0, 11), (1.9, 11), (2.1, 0)])
def test_velocities_agree_to_the_tolerance(slope: float, in_time: int) -> None:
    """The first second of ten frames is over in frame 10. The tolerance is a part of
    the larger speed, which is 10.2 with a slope of 2.1.
    """
    assert share(5.0 + slope * FRAMES, 0.2, 1.0) == in_time / 21


def test_a_change_for_a_frame_is_averaged_away() -> None:
    jolts = np.where(FRAMES % 2 == 0, 0.0, 3.0)
    assert share(jolts, 0.2, 0.1) == 0.0
    assert share(jolts, 0.2, 1.0) == 11 / 21


def test_a_rover_alone_is_in_no_step() -> None:
    x, y = 10.0 * FRAMES[:, None], np.zeros((21, 1))
    assert not in_step(x, y, np.zeros((21, 1, 1), bool), 0.2, 1.0).any()
