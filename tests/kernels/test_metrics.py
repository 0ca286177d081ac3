"""Every metric against its slow twin, and against what is known without computing."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kernels.catalogue import BUILT_IN
from kernels.events import N_EVENTS, N_INTEGRALS
from kernels.identity import code_of
from kernels.lanes.calls import _reached
from kernels.metrics import METRICS, Ground, Metric
from kernels.model import PairPotential
from kernels.recording import FIRST_STATE, N_COUNTS, build_frames
from kernels.registry import Registry
from kernels.settings import Observation
from sweep.spec.recorded import declaration_of
from sweep.trial.simulation import run
from tests import builders, naive

OBSTACLES = [[20, -30, 25, 25, 1], [-60, 40, 30, 5, 0]]
GROUND = Ground(
    world=builders.a_world(100.0, 80.0, obstacles=OBSTACLES),
    boids=30,
    traversable=900,
    pixels=1000,
    dt=0.5,
    potential=PairPotential(0.15, 40.0, 0.6, 70.0, False),
    kind=np.zeros(30, np.int64),
)


N_NUMBERS = N_COUNTS + N_INTEGRALS + 1
"""What a frame holds besides bodies: counts, integrals and the step."""


def measured(
    name: str,
    bodies: np.ndarray,
    counts: np.ndarray | None = None,
    ddof: int = 0,
    flock_range: float = 50.0,
    ground: Ground = GROUND,
) -> np.ndarray:
    """A metric of frames with the given bodies (F, 6, N), or with rows of state after
    these six; as kernels do, it leaves the last frame's value alone. `counts` are
    those of `drawn_counts`.
    """
    filled, rows, n = bodies.shape
    frames = build_frames(filled + 1, n, rows - FIRST_STATE)
    frames.bodies[:filled] = bodies
    if counts is not None:
        frames.counts[:filled], frames.integrals[:filled], frames.step[:filled] = (
            counts[:, :N_COUNTS],
            counts[:, N_COUNTS:-1],
            counts[:, -1],
        )
    values = np.full(filled + 1, -7.0)
    seen = builders.OBSERVATION._replace(coverage_cv_ddof=ddof, flock_range=flock_range)
    METRICS[name].measure(frames, filled, ground, seen, values)
    assert values[filled] == -7.0
    return values[:filled]


def one(name: str, **rows: Any) -> float:
    """A metric of a single frame, given by some of its rows."""
    names = ("x", "y", "vx", "vy", "previous_vx", "previous_vy")
    bodies = np.stack(
        np.broadcast_arrays(
            *(np.array(rows.get(key, 0.0), float, ndmin=1) for key in names)
        )
    )
    return float(measured(name, bodies[None])[0])


def drawn_counts(rng: np.random.Generator, filled: int) -> np.ndarray:
    """What frames hold: running counts of visits to pixels, some visited often, and of
    events; integrals; the step, at first 0.
    """
    visits = rng.poisson(
        rng.uniform(0.01, 3.0, (filled, 1)), (filled, GROUND.traversable)
    )
    visits[:, 0] += 1
    sums = [(visits > 0).sum(axis=1), visits.sum(axis=1), (visits**2).sum(axis=1)]
    events = rng.integers(0, 9, (filled, N_EVENTS))
    integrals = rng.uniform(0.0, 9.0, (filled, N_INTEGRALS))
    return np.column_stack([*sums, events, integrals, 10 * np.arange(filled)])


def test_every_metric_has_a_slow_twin() -> None:
    assert set(naive.METRICS) == set(METRICS)


@pytest.mark.parametrize("ddof", [0, 1])
@pytest.mark.parametrize("n", [1, 2, 30])
@pytest.mark.parametrize("name", METRICS)
def test_a_metric_is_what_its_slow_twin_says(name: str, n: int, ddof: int) -> None:
    """Up to the rounding of sums: 1e-12 relative, and the same absolute for a spread
    about zero (a single boid).
    """
    rng = np.random.default_rng(5)
    bodies, counts = rng.normal(0, 40, (12, 6, n)), drawn_counts(rng, 12)
    bodies[::3, 2:4, -1] = 0.0  # A boid at rest has no course.
    states = rng.integers(0, 2, (12, len(METRICS[name].state), 1)) * np.ones(n)
    bodies = np.concatenate([bodies, states], axis=1)
    seen = builders.OBSERVATION._replace(coverage_cv_ddof=ddof)
    for outside in (False, True):
        ground = GROUND._replace(
            potential=GROUND.potential._replace(cohesion_outside=outside),
            kind=np.arange(n) // max(n - int(outside), 1),
        )
        slow = [
            naive.METRICS[name](*frame, ground, seen)
            for frame in zip(bodies, counts, strict=True)
        ]
        fast = measured(name, bodies, counts, ddof, ground=ground)
        np.testing.assert_allclose(
            fast, slow, rtol=1e-12, atol=1e-12 * np.nanmax(np.abs(slow), initial=1.0)
        )
        low, high = declaration_of(METRICS[name]).support
        known = fast[np.isfinite(fast)]
        assert ((known >= low - 1e-12) & (known <= high * (1.0 + 1e-12))).all()


def test_what_values_lie_in_is_in_no_id() -> None:
    """Stored trials stay those of a metric whose range is said later."""
    bare = METRICS["polarization"]._replace(low=-math.inf, high=math.inf)
    own = Registry("a.test", Metric, {"polarization": bare})
    codes = [
        code_of(known, [], ["polarization"], [], [])
        for known in (BUILT_IN, replace(BUILT_IN, metrics=own))
    ]
    assert codes[0] == codes[1]
    assert codes[0].metrics["polarization"]


def test_boids_that_head_the_same_way_are_polarized() -> None:
    speeds = np.array([0.1, 1.0, 7.0])
    assert one("polarization", vx=0.6 * speeds, vy=-0.8 * speeds) == pytest.approx(
        1.0, rel=1e-15
    )
    assert one("polarization", vx=[2.0, -0.5]) == 0.0


def test_a_boid_at_rest_counts_as_no_direction() -> None:
    assert one("polarization", vx=[3.0, 0.0]) == 0.5
    assert one("polarization", vx=[0.0, 0.0]) == 0.0


def test_the_speed_of_a_group_is_that_of_its_centre() -> None:
    assert one("group_speed", vx=[3.0, 3.0], vy=[8.0, 0.0]) == 5.0
    assert one("group_speed", vx=[1.0, -1.0]) == 0.0


def test_velocities_are_correlated_by_pairs() -> None:
    """Of three boids, one of which flies against the others, one pair of three agrees.
    With one at rest only one pair is left that counts.
    """
    assert one("velocity_correlation", vx=[2.0, 0.5, 9.0]) == 1.0
    assert one("velocity_correlation", vx=[2.0, 0.5, -9.0]) == pytest.approx(-1 / 3)
    assert one("velocity_correlation", vx=[2.0, 0.5, 0.0]) == pytest.approx(1 / 3)
    assert one("velocity_correlation", vx=[2.0, 0.0], vy=[0.0, 5.0]) == 0.0
    assert math.isnan(one("velocity_correlation", vx=[2.0]))


def test_flocks_are_correlated_within_and_boids_alone_are_left_out() -> None:
    """A pair that agrees, a flock of three of which one flies backwards, and a boid on
    its own: (2 * 1 + 3 * (-1 / 3)) / 5.
    """
    places = {"x": [0.0, 9.0, 200.0, 209.0, 218.0, 500.0]}
    ways = {"vx": [1.0, 2.0, 0.0, 0.0, 0.0, 7.0], "vy": [0.0, 0.0, 1.0, 1.0, -3.0, 0.0]}
    assert one("flock_correlation", **places, **ways) == pytest.approx(0.2)
    assert one("boids_alone", **places) == one("smallest_flock", **places) == 1
    assert math.isnan(one("flock_correlation", x=[0.0, 500.0], vx=1.0))
    assert one("boids_alone", x=[0.0, 500.0]) == 2
    assert one("smallest_flock", x=[0.0, 9.0, 500.0, 509.0, 518.0]) == 2


def test_pairs_in_contact_are_a_share_of_all_pairs() -> None:
    """Three in a row touch their neighbours: two of six pairs with one apart."""
    row = {"x": [0.0, 4.0, 8.0, 13.0]}
    assert one("pairs_in_contact", **row) == pytest.approx(100 / 3)
    assert one("least_distance", **row) == 4.0
    assert one("least_distance", x=[0.0, 3.0, 1.0], y=[0.0, 0.0, 9.0]) == 3.0
    assert math.isnan(one("least_distance", x=[3.0]))
    assert math.isnan(one("pairs_in_contact", x=[3.0]))


def test_depth_is_outside_of_the_world_or_in_an_obstacle() -> None:
    """In a world of 100 x 80 with a disc of radius 25 at (20, -30) and a wall about
    (-60, 40): one boid inside, one beyond a corner, one in the wall, 5 from its side
    but 30 out of the world.
    """
    assert one("depth_outside", x=[50.0, 103.0], y=[40.0, 84.0]) == 2.5
    assert one("depth_outside", x=[-30.0], y=[40.0]) == 30.0
    disc = builders.a_world(100.0, 80.0, obstacles=[[50, 40, 25, 25, 1]])
    inside = np.zeros((1, 6, 2))
    inside[0, :2] = [[50.0, 80.0], [33.0, 40.0]]
    ground = GROUND._replace(world=disc)
    assert measured("depth_outside", inside, ground=ground).tolist() == [9.0]


def test_the_velocity_diameter_is_the_greatest_difference() -> None:
    """Wherever boids are, and however fast all of them fly."""
    velocities = {"vx": [7.0, 7.0, 4.0], "vy": [-1.0, 1.0, -5.0]}
    assert one("velocity_diameter", **velocities, x=[0.0, 9.0, 5.0]) == math.hypot(3, 6)
    assert one("velocity_diameter", vx=[2.5, 2.5]) == 0.0
    assert one("velocity_diameter", vx=[2.5]) == 0.0


def herd(name: str, task_time: float = 0.0, **rows: Any) -> float:
    """A metric of one frame of sheep, and of their dog after them; the goal is at
    (50, 40).
    """
    n = len(rows["x"])
    bodies = np.zeros((1, FIRST_STATE + 1, n))
    bodies[0, 0], bodies[0, 1], bodies[0, FIRST_STATE] = rows["x"], rows["y"], task_time
    kind = np.arange(n) // (n - 1)
    return float(measured(name, bodies, ground=GROUND._replace(kind=kind))[0])


def test_the_dog_is_no_sheep() -> None:
    """Two sheep on a line to the west of the goal; the dog is farther, and to the south
    of that line: seen from the goal it is anticlockwise of it.
    """
    places = {"x": [10.0, 30.0, 5.0], "y": [40.0, 40.0, 33.0]}
    assert herd("herd_radius", **places) == 10.0
    assert herd("herd_goal_distance", **places) == 30.0
    assert herd("dog_offset", **places) == 7.0
    assert herd("dog_distance", **places) == math.hypot(15.0, 7.0)
    places["y"][2] = 52.0
    assert herd("dog_offset", **places) == -12.0
    assert math.isnan(herd("dog_offset", x=[40.0, 60.0, 0.0], y=[40.0, 40.0, 0.0]))


def test_a_task_is_done_or_not() -> None:
    places = {"x": [10.0, 30.0, 5.0], "y": [40.0, 40.0, 33.0]}
    assert [herd("herded", time, **places) for time in (0.0, 7.0)] == [0.0, 1.0]
    assert herd("herding_time", 7.0, **places) == 7.0
    assert math.isnan(herd("herding_time", 0.0, **places))


def test_a_mill_has_angular_momentum_one_and_a_column_none() -> None:
    """To 1e-15 times a few: sums of five terms of about one."""
    around = np.linspace(0.0, 2 * math.pi, 5, endpoint=False)
    ring = {"x": 3.0 + 7.0 * np.cos(around), "y": 7.0 * np.sin(around) - 2.0}
    mill = {"vx": -0.2 * np.sin(around), "vy": 0.2 * np.cos(around)}
    back = {name: -1.0 * row for name, row in mill.items()}
    for way in (mill, back):
        assert one("angular_momentum", **ring, **way) == pytest.approx(1.0, abs=1e-14)
    assert one("angular_momentum", **ring, vx=1.0) == pytest.approx(0.0, abs=1e-14)
    outwards = {"vx": np.cos(around), "vy": np.sin(around)}
    assert one("angular_momentum", **ring, **outwards) == pytest.approx(0.0, abs=1e-14)


def test_two_mills_in_opposite_ways_cancel_and_boids_at_rest_count_as_none() -> None:
    square = {"x": [1.0, 0.0, -1.0, 0.0], "y": [0.0, 1.0, 0.0, -1.0]}
    assert one("angular_momentum", **square, vy=[1, 0, 1, 0], vx=[0, -1, 0, -1]) == 0.0
    assert one("angular_momentum", **square, vy=[3.0, 0.0, -2.0, 0.0]) == 0.5
    assert one("angular_momentum", x=[-1.0, 0.0, 1.0], vy=[-1.0, 5.0, 1.0]) == (
        pytest.approx(2 / 3, rel=1e-15)
    )


@pytest.mark.parametrize("degrees", [0.0, 10.0, -75.0, 179.0])
@pytest.mark.parametrize("heading", [0.0, 44.0, -91.0])
def test_the_turn_rate_of_a_constant_turner_is_its_turn(
    heading: float, degrees: float
) -> None:
    """To 1e-12 degrees, a few roundings of angles of 180."""
    before, after = math.radians(heading), math.radians(heading + degrees)
    rate = one(
        "turn_rate",
        vx=math.cos(after),
        vy=math.sin(after),
        previous_vx=math.cos(before),
        previous_vy=math.sin(before),
    )
    assert rate == pytest.approx(abs(degrees), abs=1e-12)


def test_a_boid_at_rest_before_or_after_a_step_does_not_turn() -> None:
    assert (
        one(
            "turn_rate",
            vx=[0.0, 0.0],
            vy=[1.0, 0.0],
            previous_vx=[0.0, 0.0],
            previous_vy=[0.0, 1.0],
        )
        == 0.0
    )


def test_turning_across_180_degrees_is_a_large_turn_only_if_unwrapped() -> None:
    across = {
        "vx": -1.0,
        "vy": math.tan(0.1),
        "previous_vx": -1.0,
        "previous_vy": -math.tan(0.1),
    }
    small = math.degrees(0.2)
    assert one("turn_rate", **across) == pytest.approx(small, rel=1e-13)
    assert one("turn_rate_unwrapped", **across) == pytest.approx(360 - small, rel=1e-13)


def test_there_is_no_turn_at_the_start() -> None:
    rates = ("turn_rate", "turn_rate_unwrapped")
    for model in builders.MODELS:
        moving = builders.job(model, series=rates, steps=2, n=20, start_speed=1.0)
        result = run(moving)
        assert [result.series[rate][0] for rate in rates] == [0.0, 0.0]
        assert all(result.series[rate][1] > 0.0 for rate in rates)


def test_a_square_of_boids_has_its_half_diagonal_as_radius() -> None:
    corners = {"x": [0.0, 6.0, 6.0, 0.0], "y": [0.0, 0.0, 8.0, 8.0]}
    assert one("flock_radius", **corners) == 5.0
    assert one("dispersion", **corners) == 0.0
    assert one("nearest_neighbour_distance", **corners) == 6.0


def test_all_that_touch_are_in_contact_and_none_that_are_just_as_far() -> None:
    """Three in a row touch their neighbours, one is exactly contact_distance away."""
    assert builders.OBSERVATION.contact_distance == 5.0
    assert one("in_contact", x=[0.0, 4.0, 8.0, 13.0]) == 75.0
    assert one("in_contact", x=[0.0, 4.0, 8.0, 13.0], y=[9.0, 0.0, 0.0, 0.0]) == 50.0
    assert one("in_contact", x=[3.0], y=[4.0]) == 0.0


def test_one_boid_is_a_flock_without_a_nearest_neighbour() -> None:
    alone = {"x": [3.0], "y": [4.0], "vx": [3.0], "vy": [4.0]}
    known = {
        "speed": 5.0,
        "flock_radius": 0.0,
        "dispersion": 0.0,
        "polarization": 1.0,
        "flock_count": 1,
        "largest_flock": 1,
    }
    assert {name: one(name, **alone) for name in known} == known
    assert math.isnan(one("nearest_neighbour_distance", **alone))


def test_a_column_is_long_along_its_course_and_a_front_across_it() -> None:
    """Three boids in a row; a square is round; one that does not move as a whole has no
    course.
    """
    row, corners = (
        {"x": [0.0, 10.0, 20.0]},
        {"x": [0.0, 10.0, 10.0, 0.0], "y": [0.0, 0.0, 10.0, 10.0]},
    )
    assert one("elongation", **row, vx=2.0) == 1.0
    assert one("elongation", **row, vy=-2.0) == -1.0
    assert one("elongation", **corners, vx=3.0) == 0.0
    assert math.isnan(one("elongation", **row, vx=[1.0, -1.0, 0.0]))
    assert math.isnan(one("elongation", x=[0.0, 10.0], vx=2.0))


def test_elongation_is_of_the_largest_flock() -> None:
    """Deviations of 2 along and 1 across its course make 1/3; a pair far off, and its
    course, do not count.
    """
    box = {"x": [0.0, 4.0, 4.0, 0.0, 500.0, 500.0], "y": [0.0, 0.0, 2.0, 2.0, 0.0, 9.0]}
    assert one(
        "elongation", **box, vx=[1.0] * 4 + [0.0] * 2, vy=[0.0] * 4 + [50.0] * 2
    ) == pytest.approx(1 / 3)


def test_neighbours_ahead_are_those_on_the_side_of_the_course() -> None:
    """Of a column all fly along x: the last sees two ahead, the middle one of two, the
    first none of two.
    """
    assert one("neighbours_ahead", x=[0.0, 10.0, 20.0], vx=1.0) == 50.0
    assert one("neighbours_ahead", x=[0.0, 10.0], vx=[1.0, -1.0]) == 100.0
    assert one("neighbours_ahead", x=[0.0, 10.0], vx=[-1.0, 1.0]) == 0.0
    assert one("neighbours_ahead", x=[0.0, 10.0], vy=1.0) == 0.0, "abreast is not ahead"


def test_a_boid_at_rest_has_nobody_ahead_and_does_not_count() -> None:
    assert one("neighbours_ahead", x=[0.0, 10.0, -10.0], vx=[1.0, 0.0, 0.0]) == 50.0
    assert math.isnan(one("neighbours_ahead", x=[0.0, 10.0]))
    assert math.isnan(one("neighbours_ahead", x=[0.0, 51.0], vx=1.0))


def test_clearance_is_from_the_surface_and_negative_inside() -> None:
    """A disc of radius 25 at (20, -30), and a wall whose upper side is at y = 45;
    without obstacles there is none.
    """
    places = {"x": [20.0, -60.0], "y": [-10.0, 57.0]}
    assert one("clearance", **places) == (-5.0 + 12.0) / 2
    assert one("least_clearance", **places) == -5.0
    nothing = GROUND._replace(world=builders.a_world(100.0, 80.0))
    for name in ("clearance", "least_clearance"):
        assert np.isnan(measured(name, np.zeros((2, 6, 3)), ground=nothing)).all()


def test_the_spread_at_the_goal_is_about_the_centre_of_those_who_are_there() -> None:
    """The goal is at (50, 40) and its radius 50; a boid just at the radius is not
    there.
    """
    places = {"x": [56.0, 50.0, 50.0, 100.0], "y": [40.0, 48.0, 32.0, 40.0]}
    apart = (4.0 + 2 * math.hypot(2.0, 8.0)) / 3
    assert one("goal_spread", **places) == pytest.approx(apart, rel=1e-15)
    assert one("goal_distance", **places) == (6 + 8 + 8 + 50) / 4
    assert math.isnan(one("goal_spread", x=[50.0, 100.0], y=[40.0, 40.0]))


def test_boids_are_lost_that_are_outside_the_largest_flock() -> None:
    places = {"x": [0.0, 49.0, 98.0, 200.0, 249.0, 400.0, 450.0, 900.0]}
    assert one("flock_count", **places) == 5
    assert (one("boids_lost", **places), one("largest_flock_share", **places)) == (
        5,
        37.5,
    )


@pytest.mark.parametrize("n", [2, 3, 10, 60])
def test_graphs_have_the_connectivity_that_is_known(n: int) -> None:
    """Of a path of n boids 2 (1 - cos(pi / n)), of a ring 2 (1 - cos(2 pi / n)), of a
    whole graph n, of two parts 0; to 1e-13 of the largest eigenvalue, at most 2 n.
    """
    near, around = 1e-13 * 2 * n, np.linspace(0, 2 * math.pi, n, endpoint=False)
    path = one("algebraic_connectivity", x=40.0 * np.arange(n))
    assert path == pytest.approx(2 * (1 - math.cos(math.pi / n)), abs=near)
    whole = one("algebraic_connectivity", x=np.linspace(0.0, 49.0, n))
    assert whole == pytest.approx(n, abs=near)
    parts = np.where(np.arange(n) == 0, -1000.0, 40.0 * np.arange(n))
    assert one("algebraic_connectivity", x=parts) == 0.0
    if n > 3:
        radius = 20.0 / math.sin(math.pi / n)
        at = {"x": radius * np.cos(around), "y": radius * np.sin(around)}
        ring = one("algebraic_connectivity", **at)
        assert ring == pytest.approx(2 * (1 - math.cos(2 * math.pi / n)), abs=near)


def test_the_potential_of_a_pair_counts_for_either_boid() -> None:
    """With the rules of GROUND: 0.6 (50^2 - 40^2) / 2 for boids 50 apart, nothing from
    70 on and at 40.

    Nearer than 40 it is (0.15 - 0.6) (40^2 - r^2) / 2, below zero, as cohesion is the
    stronger there. A boid with two neighbours feels half of each.
    """
    assert one("potential", x=[0.0, 50.0]) == pytest.approx(270.0, rel=1e-14)
    assert one("potential", x=[0.0, 30.0]) == pytest.approx(-157.5, rel=1e-14)
    assert [one("potential", x=[0.0, r]) for r in (40.0, 70.0)] == [0.0, 0.0]
    assert one("potential", x=[0.0, 50.0, 100.0]) == pytest.approx(270.0, rel=1e-14)
    assert one("flock_potential", x=[0.0, 45.0, 500.0]) == pytest.approx(
        2 * 0.3 * (45**2 - 40**2), rel=1e-14
    )
    assert math.isnan(one("flock_potential", x=[0.0, 60.0])), (
        "they act on each other, but are no flock"
    )


def test_coverage_cv_before_the_first_visit_is_not_a_number() -> None:
    assert math.isnan(
        measured("coverage_cv", np.zeros((1, 6, 1)), np.zeros((1, N_NUMBERS)))[0]
    )


def test_even_coverage_does_not_vary() -> None:
    visits = 3
    counts = np.zeros((1, N_NUMBERS))
    counts[0, :3] = 900, visits * 900, visits**2 * 900
    assert measured("coverage_cv", np.zeros((1, 6, 1)), counts)[0] == 0.0
    assert measured("coverage", np.zeros((1, 6, 1)), counts)[0] == 100.0
    assert measured("coverage_total", np.zeros((1, 6, 1)), counts)[0] == 90.0


places = st.lists(
    st.tuples(st.integers(0, 300), st.integers(0, 300)), min_size=1, max_size=40
)


@settings(max_examples=100)
@given(places, st.sampled_from([0.0, 1.0, 5.0, 25.0, 60.0, 1000.0]))
def test_flocks_are_the_connected_components(
    boids: list[tuple[int, int]], flock_range: float
) -> None:
    """Whole coordinates, so that distances just at the range occur: 25 is also that of
    7 and 24, or 15 and 20.
    """
    bodies = np.zeros((1, 6, len(boids)))
    bodies[0, :2] = np.transpose(boids)
    sizes = naive.flock_sizes(bodies[0], flock_range)
    assert measured("flock_count", bodies, flock_range=flock_range)[0] == len(sizes)
    assert measured("largest_flock", bodies, flock_range=flock_range)[0] == max(sizes)


@pytest.mark.parametrize(
    ("steps", "every", "kept"),
    [
        (6, 1, [0, 1, 2, 3, 4, 5, 6]),
        (6, 3, [0, 3, 6]),
        (7, 3, [0, 3, 6, 7]),
        (5, 100, [0, 5]),
        (1, 1, [0, 1]),
    ],
)
def test_frames_are_kept_at_0_every_so_many_steps_and_at_the_last(
    steps: int, every: int, kept: list[int]
) -> None:
    result = run(builders.job(steps=steps, every=every, n=9, series=("speed",)))
    assert result.frames.tolist() == kept
    assert len(result.series["speed"]) == len(kept)


@pytest.mark.parametrize("model", builders.MODELS)
def test_a_series_does_not_depend_on_how_often_it_is_taken(model: str) -> None:
    each, third = (
        run(builders.job(model, steps=12, n=15, every=every, series=("speed",)))
        for every in (1, 3)
    )
    assert each.series["speed"][::3].tolist() == third.series["speed"].tolist()
    assert each.last == pytest.approx(third.last, rel=0, abs=0, nan_ok=True)


def test_the_summary_is_the_last_frame_and_the_mean_of_the_last_half() -> None:
    result = run(builders.job(steps=10, n=9, series=("speed",)))
    speed = result.series["speed"]
    assert result.last["speed"] == speed[10]
    assert result.mean["speed"] == speed[6:].mean()


OF_PIXELS = {"COVERED", "VISITS", "SQUARED_VISITS"}
READ_AS = {
    "flock_range": {"flock_range", "FISSIONS", "FUSIONS", "SETTLED"},
    "contact_distance": {"contact_distance", "BOID_COLLISIONS", "PAIR_COLLISIONS"},
    "goal_radius": {"goal_radius", "ARRIVED", "GOALS_REACHED"},
    "coverage_cv_ddof": {"coverage_cv_ddof"},
    "equilibrium_tolerance": {"SETTLED"},
    "equilibrium_steps": {"SETTLED"},
    "pixel": OF_PIXELS,
    "footprint": OF_PIXELS,
    "footprint_radius": OF_PIXELS,
}
"""The names by which kernels read each parameter, or counts that use the parameter."""


@pytest.mark.parametrize("name", METRICS)
def test_a_metric_names_the_parameters_that_it_reads(name: str) -> None:
    functions = _reached(METRICS[name].measure)
    read = {one for function in functions for one in function.__code__.co_names}
    found = {setting for setting, names in READ_AS.items() if names & read}
    assert found == set(METRICS[name].parameters)


def test_each_parameter_of_the_observation_is_read_as_something() -> None:
    assert READ_AS.keys() == set(Observation._fields)
