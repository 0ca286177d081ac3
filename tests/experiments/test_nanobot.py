"""The pseudocode of nanobot against steps worked out by hand."""

from collections.abc import Sequence

import numpy as np
import pytest

from experiments.nanobot.pseudocode import one_pass


def after_a_pass(
    place: Sequence[Sequence[float]], velocity: Sequence[Sequence[float]]
) -> np.ndarray:
    """Velocities (2, N) after a pass; places move by them."""
    where, moving = np.array(place), np.array(velocity)
    before = where.copy()
    one_pass(where, moving)
    np.testing.assert_allclose(where, before + moving, rtol=1e-14)
    return moving


def test_a_boid_near_two_edges_turns_back_from_both() -> None:
    moving = after_a_pass([[50.0], [400.0]], [[-4.0], [1.0]])
    np.testing.assert_allclose(moving[:, 0], [-3.8, 0.8], rtol=1e-14)


def test_boids_inside_the_protected_range_repel_and_take_part_in_nothing_else() -> None:
    """4 px apart, so 0.2 px a step. The second sees the first where it has gone to: 4.2
    px to the left and 4 px below.
    """
    moving = after_a_pass([[300.0, 304.0], [240.0, 240.0]], [[0.0, 0.0], [4.0, 4.0]])
    assert moving[:, 0] == pytest.approx([-0.2, 4.0], rel=1e-13)
    assert moving[:, 1] == pytest.approx([0.05 * 4.2, 4.0 - 0.2], rel=1e-13)


def test_boids_farther_off_cohere_then_align_with_the_changed_velocity() -> None:
    moving = after_a_pass([[300.0, 320.0], [240.0, 240.0]], [[0.0, 4.0], [4.0, 0.0]])
    pulled = 20.0 * 0.0005
    first = [pulled + (4.0 - pulled) * 0.05, 4.0 - 4.0 * 0.05]
    assert moving[:, 0] == pytest.approx(first, rel=1e-13)


def test_speeds_are_limited_at_both_ends() -> None:
    moving = after_a_pass([[300.0, 100.0], [240.0, 140.0]], [[8.0, 0.0], [0.0, 1.0]])
    assert np.hypot(*moving) == pytest.approx([6.0, 3.0], rel=1e-14)
