"""Fronts, hypervolumes and knees that are known exactly."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from sweep.analysis.fronts import (
    hypervolume,
    knee,
    nondominated,
    shares_on_front,
    thinned,
)

BOTH = [True, True]
POINTS = arrays(
    np.float64,
    st.tuples(st.integers(1, 12), st.integers(2, 3)),
    elements=st.integers(0, 5).map(float),
)


def test_a_front_in_every_direction() -> None:
    points = np.array(
        [[1.0, 5.0], [2.0, 2.0], [5.0, 1.0], [4.0, 4.0], [np.nan, 9.0], [4.0, 4.0]]
    )
    assert nondominated(points, BOTH).tolist() == [True, False, True, True, False, True]
    assert nondominated(points, [False, False]).tolist() == [
        True,
        True,
        True,
        False,
        False,
        False,
    ]
    assert nondominated(points, [True, False]).tolist() == [
        False,
        False,
        True,
        False,
        False,
        False,
    ]
    assert nondominated(np.full((2, 2), np.nan), BOTH).tolist() == [False, False]


@given(POINTS)
def test_a_point_is_on_the_front_if_no_other_is_as_good_everywhere_and_better_somewhere(
    points: np.ndarray,
) -> None:
    maximize = [True, False, True][: points.shape[1]]
    better = points * np.where(maximize, 1.0, -1.0)
    expected = [
        not any((one >= other).all() and (one > other).any() for one in better)
        for other in better
    ]
    assert nondominated(points, maximize).tolist() == expected


def test_the_hypervolume_of_stairs() -> None:
    stairs = np.array([[1.0, 3.0], [2.0, 2.0], [3.0, 1.0]])
    assert hypervolume(stairs, np.zeros(2), BOTH) == 6.0
    assert hypervolume(stairs, np.array([4.0, 4.0]), [False, False]) == 6.0
    assert hypervolume(stairs, np.array([0.0, 4.0]), [True, False]) == pytest.approx(
        9.0
    )
    assert (
        hypervolume(
            np.vstack([stairs, [[np.nan, 9.0]], [[-1.0, 9.0]], [[0.0, 5.0]]]),
            np.zeros(2),
            BOTH,
        )
        == 6.0
    )
    assert hypervolume(np.empty((0, 2)), np.zeros(2), BOTH) == 0.0
    assert hypervolume(np.full((1, 2), np.nan), np.zeros(2), BOTH) == 0.0


def test_the_hypervolume_of_boxes_in_three_dimensions() -> None:
    """Three boxes of 1 x 1 x 2, each along another axis: twice three less the corner
    they share twice too often.
    """
    boxes = np.array([[2.0, 1.0, 1.0], [1.0, 2.0, 1.0], [1.0, 1.0, 2.0]])
    assert hypervolume(boxes, np.zeros(3), [True] * 3) == pytest.approx(4.0)
    assert hypervolume(-boxes, np.zeros(3), [False] * 3) == pytest.approx(4.0)
    assert hypervolume(
        boxes * [1, -1, 1], np.zeros(3), [True, False, True]
    ) == pytest.approx(4.0)


def test_the_hypervolume_of_a_quarter_disc_is_nearly_its_area() -> None:
    angle = np.linspace(0.0, np.pi / 2, 4001)
    front = np.column_stack([np.cos(angle), np.sin(angle)])
    assert hypervolume(front, np.zeros(2), BOTH) == pytest.approx(np.pi / 4, abs=1e-3)


def test_the_knee_of_a_hyperbola_has_the_slope_of_the_line_through_its_ends() -> None:
    """x y = 1 from 1/4 to 4: by symmetry at (1, 1); scaling an objective does not move
    it.
    """
    x = np.geomspace(0.25, 4.0, 101)
    front = np.column_stack([x, 1.0 / x])
    assert knee(front, [False, False]) == 50
    assert knee(front * [1.0, 1e4], [False, False]) == 50
    assert knee(-front, BOTH) == 50
    assert knee(front * [-1.0, 1.0], [True, False]) == 50


def test_the_knee_of_a_power_is_where_the_calculus_says() -> None:
    """y = (1 - x)^3 is farthest below the diagonal where 3 (1 - x)^2 = 1."""
    x = np.linspace(0.0, 1.0, 1001)
    found = knee(np.column_stack([x, (1.0 - x) ** 3]), [False, False])
    assert found is not None
    assert x[found] == pytest.approx(1.0 - 3.0**-0.5, abs=1e-3)


def test_the_knee_of_a_symmetric_3d_front_is_the_point_nearest_to_the_ideal() -> None:
    ends = np.eye(3)
    inner = np.array([[0.3, 0.3, 0.3], [0.1, 0.5, 0.39], [0.6, 0.2, 0.19]])
    assert knee(np.vstack([ends, inner]), [False] * 3) == 3
    turned = np.array([[1.0, 0.1, 0.0], [0.0, 1.0, 0.1], [0.1, 0.0, 1.0]])
    assert knee(np.vstack([turned, inner]) * [1.0, 1e3, 1.0], [False] * 3) == 3


def test_there_is_no_knee_without_a_bulge_or_with_too_few_points() -> None:
    x = np.linspace(0.0, 1.0, 11)
    assert knee(np.column_stack([x, 1.0 - x]), [False, False]) is None
    assert knee(np.column_stack([x, np.sqrt(1.0 - x * x)]), [False, False]) is None
    assert knee(np.array([[0.0, 1.0], [1.0, 0.0]]), [False, False]) is None
    assert knee(np.array([[0.0, 1.0]]), [False, False]) is None
    assert knee(np.array([[1.0, 1.0]] * 3), BOTH) is None


def test_thinning_keeps_the_ends_and_takes_the_crowded_away() -> None:
    front = np.array([[0.0, 10.0], [4.9, 5.1], [5.0, 5.0], [5.1, 4.9], [10.0, 0.0]])
    worst = np.array([0.0, 0.0])
    assert thinned(front, BOTH, worst, 5) == [0, 1, 2, 3, 4]
    assert thinned(front, BOTH, worst, 3) in ([0, 1, 4], [0, 2, 4], [0, 3, 4])
    assert len(thinned(front, BOTH, worst, 1)) == 1
    assert thinned(np.array([[2.0, 3.0]] * 3), BOTH, np.array([2.0, 3.0]), 2) == [0, 1]


@given(POINTS, st.integers(1, 5))
def test_thinning_leaves_as_many_as_asked_for(points: np.ndarray, most: int) -> None:
    maximize = [True] * points.shape[1]
    front = points[nondominated(points, maximize)]
    left = thinned(front, maximize, points.min(axis=0), most)
    assert len(left) == min(most, len(front))
    assert left == sorted(set(left))


def test_shares_on_the_front_count_draws() -> None:
    draws = np.array(
        [
            [[1.0, 1.0], [2.0, 2.0]],
            [[1.0, 3.0], [2.0, 2.0]],
            [[3.0, 3.0], [2.0, 2.0]],
            [[0, 9], [9, 0]],
        ]
    )
    assert shares_on_front(draws, BOTH).tolist() == [0.75, 0.75]
