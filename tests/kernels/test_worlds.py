"""Maps as published, the grid of their obstacles, and what lies inside one."""

import random

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kernels.coverage import build_coverage
from kernels.settings import CONTINUOUS, INTEGER, WorldSettings
from kernels.worlds import (
    MAPS,
    TABLE_PLACES,
    build_reach,
    build_world,
    inside_any,
    obstacle_distance,
    reach_cell,
)
from tests import builders, naive

SETTINGS = WorldSettings(
    *("empty", 800.0, 600.0, 0, False, 6, 25.0, 100.0, INTEGER),
    *(0.0, 0.0, (), False, 0.0),
)
PUBLISHED = {
    "dense_cafeteria": (77, 429_456),
    "dense_cafeteria_heatmap": (84, 427_624),
    "cafeteria": (18, 466_090),
    "narrow_corridor": (2, 400_798),
    "empty": (0, 480_000),
}
OBSTACLES = [
    [20, 20, 12, 12, 1],
    [45, 30, 16, 4, 0],
    [100, 78, 15, 15, 1],
    [60, 40, 3, 30, 0],
]
WORLD = builders.a_world(100.0, 80.0, obstacles=OBSTACLES)


def world_of(name: str, seed: int = 1) -> builders.World:
    width, height = MAPS[name].size or (800.0, 600.0)
    settings = SETTINGS._replace(map=name, width=width, height=height)
    return build_world(settings, MAPS[name].draw(settings, np.random.default_rng(seed)))


@pytest.mark.parametrize("name", PUBLISHED)
def test_a_published_map_has_its_obstacles_and_traversable_pixels(name: str) -> None:
    world = world_of(name)
    coverage = build_coverage(world, build_reach(world, 0.0), builders.OBSERVATION)
    assert (len(world.obstacle_x), coverage.traversable) == PUBLISHED[name]


@pytest.mark.parametrize("name", ["dense_cafeteria", "dense_cafeteria_heatmap"])
def test_the_first_table_is_shifted_by_the_first_two_draws(name: str) -> None:
    draws = random.Random(100)
    x, y = (place + draws.uniform(-40, 40) for place in TABLE_PLACES[0])
    world = world_of(name)
    assert (world.obstacle_x[0], world.obstacle_y[0]) == (x, y)


@pytest.mark.parametrize("name", MAPS)
def test_a_map_is_the_same_each_time_unless_it_is_random(name: str) -> None:
    first, second, other = (np.stack(world_of(name, seed)[4:9]) for seed in (1, 1, 2))
    assert np.array_equal(first, second)
    assert np.array_equal(first, other) != MAPS[name].random


@pytest.mark.parametrize("name", MAPS)
def test_obstacles_lie_within_their_map(name: str) -> None:
    """By their centres: a corridor's blocks reach across the border."""
    world = world_of(name)
    assert ((world.obstacle_x >= 0) & (world.obstacle_x <= world.width)).all()
    assert ((world.obstacle_y >= 0) & (world.obstacle_y <= world.height)).all()


@pytest.mark.parametrize("positions", [INTEGER, CONTINUOUS])
def test_random_obstacles_are_uniform_keep_their_margin_and_are_whole_if_asked(
    positions: int,
) -> None:
    """Means of 4000 uniform draws: beyond 4 standard errors with a probability of 1e-4
    for both coordinates.
    """
    settings = SETTINGS._replace(
        map="random_obstacles", n_obstacles=4000, obstacle_positions=positions
    )
    many = build_world(
        settings, MAPS["random_obstacles"].draw(settings, np.random.default_rng(7))
    )
    for places, length in ((many.obstacle_x, 800), (many.obstacle_y, 600)):
        assert (places == np.floor(places)).all() == (positions == INTEGER)
        assert (round(places.min()), round(places.max())) == (100, length - 100)
        assert abs(places.mean() - length / 2) < 4 * (length - 200) / np.sqrt(12 * 4000)


@given(
    st.floats(-30, 130), st.floats(-30, 110), st.sampled_from([0.0, 7.0, 40.0, np.inf])
)
def test_the_reach_of_a_place_misses_no_obstacle_that_acts_there(
    x: float, y: float, margin: float
) -> None:
    """An obstacle acts nearer than its size and the margin to its centre; the lists are
    ascending.
    """
    reach = build_reach(WORLD, margin)
    cell = reach_cell(reach, x, y)
    listed = reach.obstacle[reach.first[cell] : reach.first[cell + 1]].tolist()
    size = np.maximum(WORLD.half_width, WORLD.half_height)
    acting = np.flatnonzero(
        np.hypot(x - WORLD.obstacle_x, y - WORLD.obstacle_y) < size + margin
    )
    assert set(acting.tolist()) <= set(listed)
    assert listed == sorted(listed)


@given(st.floats(-30, 130), st.floats(-30, 110), st.integers(0, 3))
def test_the_distance_of_an_obstacle_is_that_of_the_nearest_of_many_points_of_it(
    x: float, y: float, m: int
) -> None:
    """Points of the surface 0.1 apart, so that the nearest may be farther by 0.05;
    negative exactly inside.
    """
    across, along, cx, cy = (
        WORLD.half_width[m],
        WORLD.half_height[m],
        WORLD.obstacle_x[m],
        WORLD.obstacle_y[m],
    )
    if WORLD.is_round[m]:
        angle = np.linspace(0, 2 * np.pi, 2000)
        px, py = cx + across * np.cos(angle), cy + across * np.sin(angle)
    else:
        side = np.linspace(-1, 1, 1201)
        px = cx + across * np.concatenate([side, side, np.ones(1201), -np.ones(1201)])
        py = cy + along * np.concatenate([np.ones(1201), -np.ones(1201), side, side])
    distance = obstacle_distance(WORLD, m, x, y)
    nearest = np.hypot(px - x, py - y).min()
    assert abs(distance) - 1e-9 <= nearest <= abs(distance) + 0.06
    alone = builders.a_world(
        obstacles=[[cx, cy, across, along, float(WORLD.is_round[m])]]
    )
    assert (distance < 0) == naive.inside_any(alone, x, y)


@given(st.floats(-30, 130), st.floats(-30, 110))
def test_inside_an_obstacle_is_what_its_shape_says(x: float, y: float) -> None:
    assert inside_any(WORLD, build_reach(WORLD, 0.0), x, y) == naive.inside_any(
        WORLD, x, y
    )


@pytest.mark.parametrize(
    ("x", "y", "inside"),
    [(32.0, 20.0, False), (31.99, 20.0, True), (45.0, 34.0, False)],
)
def test_a_surface_is_not_inside(x: float, y: float, inside: bool) -> None:
    assert inside_any(WORLD, build_reach(WORLD, 0.0), x, y) == inside
