"""Where obstacles are that move."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kernels.chance import ChanceKey
from kernels.moving import (
    build_motion,
    given_velocities,
    move_obstacles,
    place_along,
    place_obstacles,
    velocities_of,
)
from kernels.settings import BOUNDED, INTEGER, TORUS, WorldSettings
from kernels.shapes import Obstacle, Polygon
from kernels.worlds import (
    build_moving_reach,
    build_world,
    obstacle_distance,
    reach_cell,
)
from tests import naive

TRIANGLE = (10.0, 10.0), (30.0, 10.0), (20.0, 40.0)
OBSTACLES: tuple[Obstacle, ...] = (
    (30.0, 40.0, 5.0, 5.0, 1.0, 2.0, -3.0),
    (60.0, 20.0, 5.0, 8.0, 0.0, 0.0, 0.0),
    (60.0, 50.0, 5.0, 8.0, 0.0),
    Polygon(TRIANGLE, velocity=(7.0, 0.5)),
    Polygon(TRIANGLE, is_arena=True),
)
SETTINGS = WorldSettings(
    *("empty", 100.0, 80.0, BOUNDED, False, 0, 25.0, 100.0, INTEGER),
    *(0.0, 0.0, (), False, 0.0),
)


@given(st.floats(0, 100), st.floats(-2000, 2000), st.booleans())
def test_a_middle_is_where_one_is_who_walks_and_turns_round(
    start: float, way: float, wraps: bool
) -> None:
    """Twenty turns of a length of 100 round by 1e-12 of it each."""
    found = place_along(start, way, 100.0, wraps)
    wanted = naive.walked(start, way, 100.0, wraps)
    off = abs(found - wanted)
    assert (min(off, 100 - off) if wraps else off) < 1e-9


def test_a_triangle_wave_is_what_it_is() -> None:
    places = [place_along(90.0, 4.0 * step, 100.0, False) for step in range(30)]
    assert places[:6] == [90, 94, 98, 98, 94, 90]
    assert min(places) == 2
    assert places[25] == 10


def test_what_begins_outside_turns_round_there_and_does_not_jump() -> None:
    places = [place_along(-5.0, way, 100.0, False) for way in (0, 1, 105, 209, 210)]
    assert places == [-5, -4, 100, -4, -5]


@pytest.mark.parametrize("borders", [BOUNDED, TORUS])
def test_obstacles_go_with_their_velocities_and_keep_their_shapes(borders: int) -> None:
    world = build_world(SETTINGS._replace(borders=borders), OBSTACLES)
    given = given_velocities(OBSTACLES, 1.5)
    assert given is not None
    velocities = velocities_of(given, 1.5, ChanceKey(3, 4))
    assert velocities[:, [0, 1, 3, 4]].T.tolist() == [[2, -3], [0, 0], [7, 0.5], [0, 0]]
    assert math.hypot(*velocities[:, 2]) == pytest.approx(1.5, abs=1e-15)
    motion = build_motion(world, velocities, 0.5)
    for step in (0, 1, 7, 1000, 3):
        place_obstacles(motion, step)
        for m in range(len(OBSTACLES)):
            for places, start, speed, length in (
                (motion.world.obstacle_x, world.obstacle_x, velocities[0], 100.0),
                (motion.world.obstacle_y, world.obstacle_y, velocities[1], 80.0),
            ):
                way, wraps = speed[m] * (step * 0.5), borders == TORUS
                wanted = naive.walked(start[m], way, length, wraps)
                off = abs(places[m] - wanted)
                assert (min(off, length - off) if wraps else off) < 1e-9
        dx = motion.world.obstacle_x[3] - world.obstacle_x[3]
        dy = motion.world.obstacle_y[3] - world.obstacle_y[3]
        there = obstacle_distance(motion.world, 3, 50.0 + dx, 30.0 + dy)
        assert there == pytest.approx(obstacle_distance(world, 3, 50.0, 30.0), abs=1e-9)


def test_a_world_that_obstacles_move_in_is_nobody_elses() -> None:
    world = build_world(SETTINGS, OBSTACLES)
    before = [part.copy() for part in world if isinstance(part, np.ndarray)]
    corners = world.corners
    assert corners is not None
    vertices = corners.x.copy()
    motion = build_motion(world, np.ones((2, 5)), 1.0)
    place_obstacles(motion, 9)
    now = [part for part in world if isinstance(part, np.ndarray)]
    assert all((one == two).all() for one, two in zip(before, now, strict=True))
    assert (corners.x == vertices).all()
    assert (motion.world.obstacle_x != world.obstacle_x).any()


@pytest.mark.parametrize("borders", [BOUNDED, TORUS])
@pytest.mark.parametrize("margin", [0.0, 6.0, 60.0, math.inf])
@pytest.mark.parametrize("n", [1, 5, 60])
def test_obstacles_are_found_where_they_have_moved_to(
    borders: int, margin: float, n: int
) -> None:
    """The reach lists at any place, ascending, all that can act there, and hardly any
    others; what is outside of the world lists all. There is room for whatever comes.
    """
    rng = np.random.default_rng(n)
    x, y = rng.uniform(0, 100, n), rng.uniform(0, 80, n)
    size = rng.uniform(0, 4, (2, n)) + (rng.random(n) < 0.1) * 20.0
    boxes = np.column_stack([x, y, *size, np.zeros(n)])
    world = build_world(SETTINGS._replace(borders=borders), boxes)
    motion = build_motion(world, rng.normal(0, 5, (2, n)), 0.5, margin)
    world, reach = motion.world, build_moving_reach(motion.world, margin)
    far = np.hypot(1.0 / reach.columns_per_length, 1.0 / reach.rows_per_length)
    most = np.maximum(world.half_width, world.half_height) + margin
    looked: list[int] = []
    for step in (0, 1, 2, 30, 500, 7):
        move_obstacles(motion, reach, step)
        assert reach.first[-1] <= reach.obstacle.size
        for place in rng.uniform(-20, 120, (50, 2)):
            cell = reach_cell(reach, *place)
            listed = reach.obstacle[reach.first[cell] : reach.first[cell + 1]].tolist()
            away = np.abs([world.obstacle_x - place[0], world.obstacle_y - place[1]])
            assert set(np.flatnonzero((away < most).all(axis=0))) <= set(listed)
            assert listed == sorted(set(listed))
            if cell == reach.columns * reach.rows:
                assert listed == list(range(n))
            else:
                looked.append(len(listed))
                assert (away[:, listed] <= most[listed] + far).all()
    if n == 60 and margin <= 6.0:
        assert np.mean(looked) < n / 3


def test_nothing_moves_where_no_obstacle_has_a_velocity() -> None:
    assert given_velocities(OBSTACLES[1:3], 0.0) is None
    assert given_velocities(OBSTACLES[4:], 1.0) is None
    assert given_velocities((), 1.0) is None
    assert given_velocities(np.zeros((2, 5)), 1.0) is not None


def test_directions_are_uniform_and_do_not_depend_on_how_many_there_are() -> None:
    """Means of 4000 cosines and sines, of variance 1/2: beyond 4 standard errors with a
    probability of 1.3e-4 for the two together.
    """
    key = ChanceKey(1, 2)
    many = velocities_of(np.full((2, 4000), np.nan), 1.0, key)
    few = velocities_of(np.full((2, 7), np.nan), 1.0, key)
    assert (many[:, :7] == few).all()
    assert (np.abs(many.mean(axis=1)) < 4 * math.sqrt(0.5 / 4000)).all()
