"""Obstacles of any shape: what lies within them, how far they are, what is behind them,
and how they push.
"""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kernels.coverage import build_coverage
from kernels.model import OccupancySettings
from kernels.models.vasarhelyi2018 import _out_of
from kernels.occupancy import build_occupancy
from kernels.polygons import meets_polygon
from kernels.rules.obstacles import (
    repulsion_inverse,
    repulsion_linear,
    repulsion_unit,
)
from kernels.settings import INTEGER, StartSettings, WorldSettings
from kernels.shapes import Obstacle, Polygon, checked
from kernels.starts import start_numpy
from kernels.state import World
from kernels.worlds import (
    build_reach,
    build_world,
    inside_any,
    inside_obstacle,
    obstacle_distance,
)
from sweep.spec.polygons import flaw_of
from tests import builders, naive

SQUARE = (50.0, 70.0), (150.0, 70.0), (150.0, 130.0), (50.0, 130.0)
RECTANGLE: Obstacle = (100.0, 100.0, 50.0, 30.0, 0.0)
HOOK = (
    (20.0, 20.0),
    (80.0, 20.0),
    (80.0, 80.0),
    (60.0, 80.0),
    (60.0, 40.0),
    (20.0, 40.0),
)
SETTINGS = WorldSettings(
    *("empty", 200.0, 160.0, 0, False, 0, 25.0, 100.0, INTEGER),
    *(0.0, 0.0, (), False, 0.0),
)
START = StartSettings(0, 0, 1.0, 0.0, 0.0, 0.0, 0.0, True, 0.0, 0)
inside_world = st.floats(-20.0, 220.0), st.floats(-20.0, 180.0)


def a_world(*obstacles: Obstacle) -> World:
    return build_world(SETTINGS, obstacles)


@st.composite
def polygons(draw: Any) -> tuple[tuple[float, float], ...]:
    """Stars about a middle, whose sides do not cross, in either direction."""
    n = draw(st.integers(3, 9))
    radii = draw(st.lists(st.floats(5.0, 70.0), min_size=n, max_size=n))
    turns = [2 * math.pi * (k + 0.1) / n for k in range(n)]
    found = [
        (100.0 + r * math.cos(a), 80.0 + r * math.sin(a))
        for r, a in zip(radii, turns, strict=True)
    ]
    return tuple(found[:: draw(st.sampled_from([1, -1]))])


def test_a_polygon_of_the_corners_of_a_rectangle_is_the_rectangle() -> None:
    """Exactly, also on the border: all numbers are small and whole."""
    backwards = SQUARE[::-1]
    world = a_world(RECTANGLE, Polygon(SQUARE), Polygon(backwards))
    for x in range(40, 161):
        for y in range(60, 141):
            one, *others = (
                (
                    obstacle_distance(world, m, float(x), float(y)),
                    inside_obstacle(world, m, float(x), float(y)),
                )
                for m in range(3)
            )
            assert others == [one, one]


@given(*inside_world)
def test_an_arena_is_solid_where_its_polygon_is_not(x: float, y: float) -> None:
    world = a_world(Polygon(HOOK), Polygon(HOOK, True))
    distance, other = (obstacle_distance(world, m, x, y) for m in range(2))
    assert distance == -other
    assert inside_obstacle(world, 0, x, y) == (distance < 0)
    assert inside_obstacle(world, 1, x, y) == (distance > 0)


@given(polygons(), *inside_world)
def test_distance_and_inside_are_those_of_a_slow_twin(
    vertices: tuple[tuple[float, float], ...], x: float, y: float
) -> None:
    """Coordinates are up to 220, so that sums of products round by 1e-11 of a length;
    nearer to the border than that the sign may differ.
    """
    world = a_world(Polygon(vertices))
    found = obstacle_distance(world, 0, x, y)
    wanted = naive.polygon_distance(vertices, x, y)
    assert abs(found) == pytest.approx(abs(wanted), rel=0, abs=1e-9)
    if abs(wanted) > 1e-9:
        assert (found < 0) == (wanted < 0) == inside_obstacle(world, 0, x, y)


@given(*inside_world)
def test_a_regular_polygon_is_near_its_disc(x: float, y: float) -> None:
    """Its border lies within the disc, by no more than r (1 - cos(pi / n))."""
    n, r = 96, 40.0
    turns = [2 * math.pi * k / n for k in range(n)]
    ring = tuple((100 + r * math.cos(a), 80 + r * math.sin(a)) for a in turns)
    world = a_world((100.0, 80.0, r, r, 1.0), Polygon(ring))
    disc, polygon = (obstacle_distance(world, m, x, y) for m in range(2))
    assert -1e-9 <= polygon - disc <= r * (1 - math.cos(math.pi / n)) + 1e-9


@given(polygons(), *inside_world, st.floats(-100, 100), st.floats(-100, 100))
def test_a_way_meets_what_its_points_are_in(
    vertices: tuple[tuple[float, float], ...], x: float, y: float, dx: float, dy: float
) -> None:
    """Of 201 points on the way the deepest is in the polygon, deeper than the way to
    the next point; or all are farther from it than that.
    """
    world = a_world(Polygon(vertices), Polygon(vertices, True))
    assert world.corners is not None
    shares = np.linspace(0.0, 1.0, 201).tolist()
    slack = math.hypot(dx, dy) / 200 + 1e-9
    for m in range(2):
        least = min(
            obstacle_distance(world, m, x + share * dx, y + share * dy)
            for share in shares
        )
        if abs(least) > slack:
            assert meets_polygon(world.corners, m, x, y, dx, dy) == (least < 0)


@pytest.mark.parametrize(
    ("way", "meets"),
    [
        ((0, 100, 200, 0), True),
        ((0, 70, 200, 0), False),  # along a side
        ((40, 80, 20, -20), False),  # touches a corner
        ((50, 70, 100, 60), True),  # from corner to corner
        ((60, 80, 2, 0), True),  # within
        ((60, 80, 0, 0), True),  # no way at all, within
        ((20, 80, 0, 0), False),
        ((0, 0, 10, 10), False),
    ],
)
def test_a_way_along_a_side_or_to_a_corner_does_not_lead_through(
    way: tuple[int, int, int, int], meets: bool
) -> None:
    corners = a_world(Polygon(SQUARE)).corners
    assert corners is not None
    assert meets_polygon(corners, 0, *map(float, way)) == meets


@given(polygons(), *inside_world, st.sampled_from([15.0, 60.0, math.inf]))
def test_a_polygon_pushes_from_its_nearest_point(
    vertices: tuple[tuple[float, float], ...], x: float, y: float, margin: float
) -> None:
    """As a disc of radius 0 there. Within, the push is mirrored, so that it leads out,
    at any depth: who goes to the nearest point by 1e-6 is nearer to it by that.
    """
    distance = naive.polygon_distance(vertices, x, y)
    if abs(distance) < 1e-3 or abs(distance - margin) < 1e-6:
        return
    world, length = a_world(Polygon(vertices)), abs(distance)
    reach = build_reach(world, margin)
    for push, size in (
        (repulsion_unit(world, reach, margin, x, y), 1.0),
        (repulsion_inverse(world, reach, margin, 0.5, x, y), 1 / (length + 0.5)),
        (repulsion_linear(world, reach, margin, x, y), length),
    ):
        acts = distance < margin
        assert math.hypot(*push) == pytest.approx(acts * size, rel=0, abs=1e-8)
        if acts:
            step = math.copysign(1e-6, -distance) * np.array(push) / size
            nearer = naive.polygon_distance(vertices, x + step[0], y + step[1])
            assert abs(nearer) == pytest.approx(length - 1e-6, rel=0, abs=1e-9)


@given(*inside_world)
def test_shill_agents_stand_at_the_nearest_point(x: float, y: float) -> None:
    """As at the same rectangle, but within it near its diagonals, where two sides are
    equally near.
    """
    world = a_world(RECTANGLE, Polygon(SQUARE))
    one, other = (_out_of(world, m, x, y) for m in range(2))
    across, along = abs(x - 100) - 50, abs(y - 100) - 30
    if abs(one[2]) > 1e-6 and not (one[2] < 0 and abs(across - along) < 1e-6):
        assert other == pytest.approx(one, rel=0, abs=1e-8)


@given(polygons(), *inside_world)
def test_the_reach_of_contact_finds_whoever_is_within(
    vertices: tuple[tuple[float, float], ...], x: float, y: float
) -> None:
    for arena in (False, True):
        world = a_world(Polygon(vertices, arena))
        contact = build_reach(world, 0.0)
        assert inside_any(world, contact, x, y) == inside_obstacle(world, 0, x, y)


def test_pixels_and_cells_are_those_of_the_rectangle() -> None:
    grids, pixels = [], []
    for obstacle in (RECTANGLE, Polygon(SQUARE)):
        world = a_world(obstacle)
        grids.append(build_occupancy(world, OccupancySettings(4.0, 9.0)).taken)
        contact = build_reach(world, 0.0)
        pixels.append(build_coverage(world, contact, builders.OBSERVATION).visits)
    assert grids[0].any()
    assert (grids[0] == grids[1]).all()
    assert (pixels[0] == pixels[1]).all()


def test_all_of_an_arena_is_taken_but_its_inside() -> None:
    """Cells whose centre is nearer than 5 to what is solid."""
    world = a_world(Polygon(SQUARE, True))
    taken = build_occupancy(world, OccupancySettings(4.0, 5.0)).taken
    x, y = np.meshgrid(np.arange(2, 200, 4), np.arange(2, 160, 4))
    free = (x >= 55) & (x <= 145) & (y >= 75) & (y <= 125)
    assert (taken == ~free).all()


def test_boids_start_in_an_arena_and_outside_of_polygons() -> None:
    inner = (90.0, 90.0), (110.0, 90.0), (100.0, 110.0)
    world = a_world(Polygon(SQUARE, True), Polygon(inner))
    contact, rng = build_reach(world, 0.0), np.random.default_rng(1)
    flock = start_numpy(200, START, world, contact, rng, 0)
    assert ((flock.x > 50) & (flock.x < 150) & (flock.y > 70) & (flock.y < 130)).all()
    places = zip(flock.x.tolist(), flock.y.tolist(), strict=True)
    assert not any(naive.winding(inner, *place) for place in places)


FLAWS = [
    (((0, 0), (1, 0), (1, 0)), "a side of length 0: side 2, from (1, 0) to (1, 0)"),
    (((0, 0), (1, 1), (2, 2)), "the area 0: all vertices are on one line"),
    (
        ((0, 0), (2, 2), (2, 0), (0, 2)),
        "sides that cross: side 1, from (0, 0) to (2, 2), and side 3, from (2, 0) to"
        " (0, 2)",
    ),
    (
        ((0, 0), (4, 0), (2, 0), (2, 2)),
        "sides that cross: side 1, from (0, 0) to (4, 0), and side 2, from (4, 0) to"
        " (2, 0)",
    ),
    (
        ((0, 0), (4, 0), (4, 4), (2, 0), (0, 4)),
        "sides that cross: side 1, from (0, 0) to (4, 0), and side 3, from (4, 4) to"
        " (2, 0)",
    ),
    (SQUARE, ""),
    (HOOK, ""),
    (HOOK[::-1], ""),
]


@pytest.mark.parametrize(("vertices", "flaw"), FLAWS)
def test_what_is_wrong_with_a_polygon_is_said(vertices: Any, flaw: str) -> None:
    assert flaw_of(tuple((float(x), float(y)) for x, y in vertices)) == flaw


@given(polygons())
def test_stars_have_no_flaw(vertices: tuple[tuple[float, float], ...]) -> None:
    assert flaw_of(vertices) == ""


@pytest.mark.parametrize(
    ("drawn", "words"),
    [
        (np.zeros((2, 4)), "of shape (2, 4): it must be (M, 5) or (M, 7)"),
        ([Polygon(((0.0, 0.0), (1.0, 1.0)))], "a polygon that is none"),
        (
            [Polygon(((0.0, 0.0), (1.0, 1.0), (1.0, math.nan)))],
            "a polygon that is none",
        ),
        ([Polygon(SQUARE), (1.0, 2.0)], "of shape (1, 2)"),
    ],
)
def test_what_a_map_may_not_draw_is_refused(drawn: Any, words: str) -> None:
    with pytest.raises(ValueError, match="map mine draws") as error:
        checked(drawn, "mine")
    assert words in str(error.value)
