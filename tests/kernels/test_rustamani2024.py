"""rustamani2024: every term by hand, the order in which they are added, steering round
cells, and the maze.
"""

import math
from typing import Any

import numpy as np
import pytest

from kernels.arbitration import add_in_turn, limit_components
from kernels.catalogue import BUILT_IN
from kernels.events import DEAD_ENDS
from kernels.model import OccupancySettings
from kernels.models import MODELS
from kernels.occupancy import Occupancy, build_occupancy
from kernels.rules.avoidance import steer_to_avoid
from sweep.trial.simulation import Simulation, run
from sweep.trial.world import world_of
from tests import builders, naive

MODEL = "rustamani2024"
UNLIMITED = {"max_acceleration": 1e6, "acceleration_pool": 1e6}
PRESETS = ("as_written", "as_run")


def placed(preset: str, flock: Any, **changes: Any) -> Simulation:
    """A simulation in the empty arena of boids given by rows of x, y, vx, vy."""
    x, y, vx, vy = np.array(flock, float).T
    return builders.place(
        Simulation(builders.job(MODEL, preset, n=len(x), **changes)), x, y, vx, vy
    )


def accelerations(preset: str, flock: Any, **changes: Any) -> np.ndarray:
    """(v after a short step - v) / dt for every boid, shape (N, 2); weights that are
    not given are 0, limits far.
    """
    simulation = placed(
        preset, flock, **builders.weightless(MODEL) | UNLIMITED | {"dt": 1e-3} | changes
    )
    assert simulation.advance(1)
    return (
        builders.state(simulation.flock)[2:].T - np.array(flock, float)[:, 2:]
    ) / 1e-3


COMMON_TO_ALL = {
    **{
        "n": 10,
        "dt": 0.1,
        "width": 10,
        "height": 10,
        "max_speed": 0.8,
        "max_acceleration": 10,
        "priority": "safety_first",
    },
    **{
        "navigation_gain": 0.8,
        "stop_distance": 0.05,
        "look_ahead": 0.8,
        "path_step": 0.16,
        "angle_step": 0.5,
    },
    **{"grid_cell": 0.05, "inflation": 0.2, "range_inclusive": False},
}
OF_EACH_PRESET = {
    "obstacle_weight": (1, 6.6, 6.3),
    "separation_weight": (1, 1.8, 1.5),
    "arrival_weight": (1, 1.5, 1.5),
    "seek_weight": (1, 0.4, 0.5),
    "alignment_weight": (1, 1.4, 1.4),
    "cohesion_weight": (1, 0.5, 0.5),
    "separation_range": (math.inf, 0.35, 0.35),
    "alignment_gain": (1, 3, 3),
    "arrival_gain": (1, 0.3, 0.3),
    "arrival_limited": (True, False, False),
    "slow_distance": (0.05, 1, 1),
    "leader_share": (1, 0.5, 0.3),
    "perception_range": (2.4, 1.2, 1.2),
    "flock_range": (2.4, 1.2, 1.2),
    "fov": (360, 360, 360 / 1.4),
    "acceleration_pool": (10, 6.65, 6.5),
    "component_limits": (False, True, True),
}


def test_presets_have_the_values_of_the_text_and_of_the_program_then_and_last() -> None:
    """And differ in nothing else."""
    presets = [MODELS[MODEL].presets[name] for name in (*PRESETS, "as_reported")]
    for preset in presets:
        assert {name: preset[name] for name in COMMON_TO_ALL} == COMMON_TO_ALL
    assert {
        name: tuple(preset[name] for preset in presets) for name in OF_EACH_PRESET
    } == OF_EACH_PRESET
    assert {name for name in presets[0] if len({one[name] for one in presets}) > 1} == (
        set(OF_EACH_PRESET)
    )
    assert (MODELS[MODEL].length, MODELS[MODEL].time) == ("m", "s")


@pytest.mark.parametrize("preset", PRESETS)
def test_seek_goes_for_the_goal_in_proportion_to_its_distance(preset: str) -> None:
    """0.8 (9 - 5) - v. Below the limit of 3, by length or by component, before the
    weight.
    """
    boid = [[5, 5, 0.1, 0.2]]
    assert accelerations(preset, boid, seek_weight=1)[0] == pytest.approx([3.1, 3.0])
    limited = accelerations(preset, boid, seek_weight=0.5, max_acceleration=3)[0]
    by_length = np.array([3.1, 3.0]) * 1.5 / math.hypot(3.1, 3.0)
    assert limited == pytest.approx([1.5, 1.5] if preset == "as_run" else by_length)


@pytest.mark.parametrize(
    ("preset", "distance", "speed"),
    [
        ("as_written", 5.0, 0.8),
        ("as_written", 0.06, 0.8),
        ("as_run", 5.0, 0.24),
        ("as_run", 0.5, 0.12),
        ("as_run", 0.06, 0.0144),
    ],
)
def test_arrival_wants_a_speed_that_falls_towards_the_goal(
    preset: str, distance: float, speed: float
) -> None:
    boid = [[9 - 0.6 * distance, 9 - 0.8 * distance, 0.1, -0.3]]
    wanted = [0.6 * speed - 0.1, 0.8 * speed + 0.3]
    assert accelerations(preset, boid, arrival_weight=1)[0] == pytest.approx(wanted)


@pytest.mark.parametrize("preset", PRESETS)
def test_arrival_ends_at_the_goal(preset: str) -> None:
    assert accelerations(preset, [[9.0, 8.96, 0.3, 0.0]], arrival_weight=1)[
        0
    ].tolist() == [0.0, 0.0]


def test_only_the_written_arrival_is_limited_before_its_weight() -> None:
    """With a maximal speed of 20 it wants 20, or 6 as run, of which a limit of 5 would
    leave 5.
    """
    changes = {"arrival_weight": 0.1, "max_speed": 20, "max_acceleration": 5}
    for preset, wanted in (("as_written", 0.5), ("as_run", 0.6)):
        assert accelerations(preset, [[5, 9, 0, 0]], **changes)[0] == pytest.approx(
            [wanted, 0.0]
        )


def test_separation_has_length_one_and_weighs_near_neighbours_more() -> None:
    """Sums (-10, -5) of those at 0.1 and 0.2, and (-2.5, 0) of the one at 0.4, too far
    as run.
    """
    flock = [[5, 5, 0, 0], [5.1, 5, 0, 0], [5, 5.2, 0, 0], [5.4, 5, 0, 0]]
    pushes = {"as_written": (-12.5, -5.0), "as_run": (-10.0, -5.0)}
    for preset, push in pushes.items():
        wanted = 1.8 * np.array(push) / math.hypot(*push)
        assert accelerations(preset, flock, separation_weight=1.8)[0] == pytest.approx(
            wanted
        )


@pytest.mark.parametrize(("preset", "gain"), [("as_written", 1), ("as_run", 3)])
def test_alignment_is_three_times_as_strong_as_run_and_cohesion_is_not(
    preset: str, gain: float
) -> None:
    flock = [[5, 5, 0.1, 0], [6, 5, 0.3, 0.2], [5, 6, 0.3, 0.4], [5, 8, 0.8, 0.8]]
    assert accelerations(preset, flock, alignment_weight=2)[0] == pytest.approx(
        [0.4 * gain, 0.6 * gain]
    )
    assert accelerations(preset, flock, cohesion_weight=2)[0] == pytest.approx(
        [1.0, 1.0]
    )


@pytest.mark.parametrize(
    ("preset", "n", "leaders"),
    [("as_written", 5, 5), ("as_run", 10, 5), ("as_run", 5, 3)],
)
def test_only_leaders_know_the_goal(preset: str, n: int, leaders: int) -> None:
    flock = [[1 + 0.5 * i, 5, 0, 0] for i in range(n)]
    moved = accelerations(preset, flock, seek_weight=1, arrival_weight=1).any(axis=1)
    assert moved.tolist() == [True] * leaders + [False] * (n - leaders)


def test_limits_are_of_the_length_as_written_and_of_the_components_as_run() -> None:
    for preset, reached in (("as_written", 0.8 / math.sqrt(2)), ("as_run", 0.8)):
        simulation = placed(
            preset,
            [[2, 2, 0.7, 0.7]],
            **builders.weightless(MODEL) | {"seek_weight": 100},
        )
        assert simulation.advance(1)
        assert builders.state(simulation.flock)[:, 0] == pytest.approx(
            [2 + 0.1 * reached] * 2 + [reached] * 2
        )


def test_terms_are_added_until_their_sum_is_longer_than_the_pool() -> None:
    assert add_in_turn(3.0, 0.0, 0.0, 4.0, True, 5.0) == (3.0, 4.0, True)
    assert add_in_turn(3.0, 0.0, 0.0, 4.1, True, 5.0) == (3.0, 4.1, False)
    assert add_in_turn(3.0, 4.1, 1.0, 1.0, False, 5.0) == (3.0, 4.1, False)
    assert limit_components(-7.0, 2.0, 3.0) == (-3.0, 2.0)


FACING_A_WALL = [[9.5, 5, 0.4, 0], [9.5, 4.9, 0.4, 0]]
"""The border is 0.5 m ahead; 1 rad to the left, the second turn, is free. The other
pushes along (0, 1).
"""
STEERING = 6.6 * np.array([math.cos(1.0), math.sin(1.0)])


def test_as_run_safety_leaves_nothing_once_separation_has_passed_the_pool() -> None:
    """Steering alone, 6.6, stays below 6.65; with separation the sum is 8.2, so the
    goal counts no more.

    Without a neighbour, arrival brings the sum to 6.59, so that seek is added too, and
    the sum is 7.9.
    """
    weights = {
        name: value
        for name, value in builders.preset_settings(MODEL, "as_run", BUILT_IN).items()
        if "weight" in name
    }
    settings = weights | {"acceleration_pool": 6.65, "max_acceleration": 10}
    assert accelerations("as_run", FACING_A_WALL, **settings)[0] == pytest.approx(
        STEERING + np.array([0, 1.8])
    )
    arrival = 0.24 * np.array([-0.5, 4.0]) / math.hypot(-0.5, 4.0) - [0.4, 0.0]
    alone = accelerations("as_run", FACING_A_WALL[:1], **settings)[0]
    assert alone == pytest.approx(
        STEERING + 1.5 * arrival + 0.4 * np.array([-0.8, 3.2])
    )


def test_the_sum_is_cut_to_the_maximum_after_the_pool() -> None:
    strong = {
        "obstacle_weight": 6.6,
        "separation_weight": 20.0,
        "max_acceleration": 10,
        "acceleration_pool": 6.65,
    }
    assert accelerations("as_run", FACING_A_WALL, **strong)[0] == pytest.approx(
        [STEERING[0], 10.0]
    )


def test_where_flocking_comes_first_it_may_leave_nothing_for_safety() -> None:
    """Cohesion is (0, -0.1), alignment 0, and a pool of 0.05 is passed by the first of
    them.
    """
    weights = {
        "obstacle_weight": 6.3,
        "separation_weight": 1.5,
        "cohesion_weight": 2,
        "alignment_weight": 2,
    }
    first = weights | {"priority": "flocking_first"}
    assert accelerations(
        "as_run", FACING_A_WALL, **first | {"acceleration_pool": 0.05}
    )[0] == pytest.approx([0, -0.2])
    all_of_them = STEERING * 6.3 / 6.6 + [0, -0.2 + 1.5]
    assert accelerations("as_run", FACING_A_WALL, **first)[0] == pytest.approx(
        all_of_them
    )


@pytest.mark.parametrize("priority", naive.ORDERS)
def test_a_pool_of_nothing_leaves_the_first_term_that_is_there(priority: str) -> None:
    """Of those whose weight is not 0, one less each time."""
    flock, order = [[9.5, 5, 0.4, 0], [9.5, 4.9, 0.3, 0.1]], naive.ORDERS[priority]
    for k, first in enumerate(order):
        weights = {f"{name}_weight": 1.0 for name in order[k:]}
        together = accelerations(
            "as_run", flock, priority=priority, **weights | {"acceleration_pool": 0.0}
        )[0]
        assert together.any()
        assert (
            together.tolist()
            == accelerations("as_run", flock, **{f"{first}_weight": 1.0})[0].tolist()
        )


def test_a_boid_at_rest_looks_where_it_flew_last() -> None:
    """Stopped in flight along y by the wish for no speed; then, of two others, only the
    one along y draws it.
    """
    flock = [[5, 5, 0, 0.4], [5, 6, 0, 0], [6, 5, 0, 0]]
    changes = builders.weightless(MODEL) | {
        "seek_weight": 10,
        "navigation_gain": 0,
        "fov": 90,
        "leader_share": 0.4,
    }
    simulation = placed("as_run", flock, **changes)
    assert simulation.advance(1)
    assert builders.state(simulation.flock)[2:, 0].tolist() == [0.0, 0.0]
    flight = simulation.flight
    flight.params = flight.params._replace(seek_weight=0.0, cohesion_weight=1.0)
    assert simulation.advance(1)
    assert builders.state(simulation.flock)[2:, 0] == pytest.approx([0.0, 0.1])


PATHS = (0.8, 0.16, 0.5)
ARENA = build_occupancy(
    builders.a_world(10.0, 10.0, obstacles=[[5, 5, 0.1, 1.5, 0]]),
    OccupancySettings(0.05, 0.2),
)


@pytest.mark.parametrize(
    ("boid", "heading"),
    [
        ((2.0, 2.0, 0.4, 0.0), None),
        ((4.5, 5.0, 0.0, 0.0), None),
        ((4.0, 5.0, 0.4, 0.0), None),
        ((4.11, 5.0, 0.4, 0.0), 0.5),
        ((4.6, 5.0, 0.4, 0.0), 1.5),
        ((4.6, 5.0, 0.4, -0.2), math.atan2(-0.2, 0.4) - 1.0),
        ((9.4, 5.0, 0.4, 0.0), 0.5),
        ((9.3, 5.0, 0.4, 0.0), None),
        ((9.37, 5.0, 0.4, 0.0), 0.5),
        ((9.8, 9.8, 0.1, 0.1), math.pi / 4 + 2.5),
    ],
)
def test_a_boid_steers_to_the_first_free_heading(
    boid: tuple[float, float, float, float], heading: float | None
) -> None:
    """The wall takes what lies from 4.7 to 5.3, and a path is seen up to 0.64 m. Left,
    growing angles, comes first.
    """
    x, y, is_dead_end = steer_to_avoid(ARENA, *boid, *PATHS)
    assert (x, y) == (
        (0.0, 0.0)
        if heading is None
        else pytest.approx((math.cos(heading), math.sin(heading)))
    )
    assert not is_dead_end


def test_the_search_goes_up_to_half_a_turn_to_either_side() -> None:
    """All cells are taken but those of one path, 3 rad off: the sixth turn of 0.5, and
    none without that path.
    """
    taken = np.ones((200, 200), np.bool_)
    assert steer_to_avoid(Occupancy(taken, 20.0), 5.0, 5.0, 0.4, 0.0, *PATHS) == (
        0.0,
        0.0,
        True,
    )
    for side in (1.0, -1.0):
        free, points = taken.copy(), 0.16 * np.arange(1, 5)
        rows, columns = 5 + points * math.sin(3.0 * side), 5 + points * math.cos(3.0)
        free[(20 * rows).astype(int), (20 * columns).astype(int)] = False
        found = steer_to_avoid(Occupancy(free, 20.0), 5.0, 5.0, 0.4, 0.0, *PATHS)
        assert found == (math.cos(3.0), math.sin(3.0 * side), False)


def test_a_path_has_its_points_whatever_the_rounding() -> None:
    """0.6 / 0.2 is a little less than 3; of three steps the second ends at 0.4, of two
    the first at 0.3.
    """
    assert 0.6 / 0.2 < 3
    assert steer_to_avoid(ARENA, 9.65, 5.0, 0.4, 0.0, 0.6, 0.2, 0.5)[0] > 0
    assert steer_to_avoid(ARENA, 9.55, 5.0, 0.4, 0.0, 0.6, 0.2, 0.5)[0] == 0


def test_a_boid_without_a_free_heading_flies_on_and_is_counted() -> None:
    """In the middle of a disc that is longer than its paths: at every step, for the one
    that moves.
    """
    disc = {
        "map": "random_obstacles",
        "n_obstacles": 1,
        "obstacle_margin": 5,
        "obstacle_radius": 3,
        "dt": 1e-3,
    }
    weights = builders.weightless(MODEL) | {"obstacle_weight": 6.6}
    simulation = placed("as_run", [[5, 5, 0.4, 0], [5, 5.5, 0, 0]], **disc, **weights)
    assert simulation.advance(3)
    assert simulation.flight.record.watch.events[DEAD_ENDS] == 3
    assert builders.state(simulation.flock)[2:].tolist() == [[0.4, 0.0], [0.0, 0.0]]


SCENARIO_2 = {"cohesion_weight": 2, "alignment_weight": 2, "seek_weight": 0.5}
SCENARIO_2 |= {
    "obstacle_weight": 6.3,
    "separation_weight": 1.5,
    "priority": "flocking_first",
}


def through_the_maze(metric: str, trials: int, **changes: Any) -> np.ndarray:
    """A metric at the end of trials of 120 s that start in the corner of the maze,
    shape (trials,).
    """
    start = {
        "map": "maze",
        "start_center_x": 1.4,
        "start_center_y": 1.4,
        "start_radius": 0.9,
        "steps": 1200,
    }
    jobs = (
        builders.job(MODEL, replicate=k, metrics=(metric,), **start, **changes)
        for k in range(trials)
    )
    return np.array([run(a_job).last[metric] for a_job in jobs])


@pytest.mark.parametrize("changes", [{}, SCENARIO_2])
def test_boids_find_their_way_through_the_maze(changes: dict[str, Any]) -> None:
    """Of 10 boids all came to the goal, but for one in one of 1000 trials, half of them
    of either scenario.

    So fewer than 8 in one of 8 trials have a probability of at most 3 %, at 95 %
    confidence.
    """
    assert (through_the_maze("share_arrived", 4, **changes) >= 80).all()


def test_flocking_first_pays_with_collisions() -> None:
    """By how often a boid enters a wall: 0.14 times in a trial of scenario 1, 1.34
    times in one of scenario 2.

    Those are means of 500 trials. Of 40 the difference is 1.2 with a standard error of
    0.2; two-sided at 4 of them, the check fails by chance in 1 of 16,000 seeds.
    """
    safe, social = (
        through_the_maze("collisions", 40, **changes) for changes in ({}, SCENARIO_2)
    )
    assert abs((social - safe).mean() - 1.2) < 0.8


@pytest.mark.parametrize(
    ("share", "arrival", "known"),
    [(0.05, 1.5, True), (0.04, 1.5, False), (1.0, 0.0, False)],
)
def test_a_goal_is_shown_if_a_robot_knows_it_and_a_rule_leads_there(
    share: float, arrival: float, known: bool
) -> None:
    """The number of those who know it is rounded: of ten with a share of 0.04 nobody
    does.
    """
    weights = {"arrival_weight": arrival, "seek_weight": 0.0}
    a_job = builders.job(MODEL, n=10, leader_share=share, **weights)
    assert world_of(a_job).goal == ((9.0, 9.0, 1.0) if known else None)
