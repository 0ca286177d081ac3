"""patel2023: each rule by hand, their order, and the speed that a doubled velocity
leaves.
"""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from kernels.models import MODELS
from sweep.trial.simulation import Simulation
from tests import builders

ALONE = {"alignment_weight": 0, "cohesion_weight": 0}


TABLE_I = {
    **{
        "separation_range": 50,
        "alignment_range": 80,
        "cohesion_range": 80,
        "obstacle_range": 60,
    },
    **{
        "separation_weight": 0.15,
        "alignment_weight": 0.1,
        "cohesion_weight": 0.005,
        "obstacle_weight": 0.25,
    },
    **{"border_margin": 175, "border_turn": 10, "max_speed": 10, "min_speed": 7},
}
SCENARIO = {
    **{
        "n": 10,
        "n_obstacles": 5,
        "obstacle_radius": 0,
        "width": 1200,
        "height": 1200,
        "borders": "open",
    },
    **{
        "start_margin": 100,
        "obstacle_margin": 100,
        "start_velocities": "components",
        "start_speed": 10,
    },
    **{"update": "sequential", "dt": 1, "flock_range": 80},
}


def test_presets_have_the_values_of_table_1_and_differ_in_borders_alone() -> None:
    """Ten rovers and five rocks in the arena of 1000 px in a window of 1200; a flock is
    who perceives each other.
    """
    adds = {"as_written": "in_margin", "as_run": "always", "as_intended": "never"}
    known = MODELS["patel2023"].presets
    assert {
        name: known["as_run"][name] for name in TABLE_I | SCENARIO
    } == TABLE_I | SCENARIO
    for preset, where in adds.items():
        assert known[preset] == known["as_run"] | {"border_adds_velocity": where}


def stepped(
    flock: list[tuple[float, float, float, float]],
    preset: str = "as_intended",
    rocks: Any = (),
    **changes: Any,
) -> np.ndarray:
    """The rows x, y, vx, vy of each boid after one step from such rows, among rocks at
    the given places.
    """
    a_job = builders.job(
        "patel2023", preset, n=len(flock), steps=1, map="empty", **changes
    )
    points = tuple((float(x), float(y), 0.0, 0.0, 1.0) for x, y in rocks)
    simulation = builders.place(
        Simulation(replace(a_job, obstacles=points)), *np.array(flock).T
    )
    return builders.state(builders.to_end(simulation).flock).T


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ((30, 40), (6, 8)),
        ((3, 4), (4.2, 5.6)),
        ((0, 8), (0, 8)),
        ((0, 0), (0, 0)),
        ((0, -7), (0, -7)),
    ],
)
def test_the_speed_is_limited_before_the_move(
    before: tuple[float, float], after: tuple[float, float]
) -> None:
    x, y, *velocity = stepped([(600, 600, *before)])[0]
    assert (x, y) == pytest.approx((600 + after[0], 600 + after[1]), rel=1e-15)
    assert velocity == pytest.approx(after, rel=1e-15)


@pytest.mark.parametrize(
    ("preset", "velocity"),
    [
        ("as_intended", (-3.9, -9.2)),
        ("as_written", (-3.9, -9.2)),
        ("as_run", (-7.8, -8.4)),
    ],
)
def test_each_rule_acts_on_what_the_one_before_it_has_left(
    preset: str, velocity: tuple[float, float]
) -> None:
    """Separation gives (-4.5, 0), alignment (0.45, 0.8), cohesion (0.15, 0), the rock
    (0, -10).

    As run, the border rule doubles what there is before the rock acts.
    """
    flock = [(600, 600, 0, 0), (630, 600, 0, 8)]
    assert stepped(flock, preset, rocks=[(600, 640)])[0, 2:] == pytest.approx(
        velocity, rel=1e-14
    )


def test_neighbours_are_those_of_the_new_position() -> None:
    near, far = (
        stepped([(600, 600, vx, 0), (600 + d, 600, 0, 0)], **ALONE)[0, 2]
        for vx, d in ((8, 55), (-8, 45))
    )
    assert near == pytest.approx(8 - 0.15 * 47, rel=1e-14)
    assert far == -8


@pytest.mark.parametrize(
    ("update", "first"), [("sequential", 8), ("synchronous", 8 - 0.15 * 48)]
)
def test_in_a_synchronous_update_all_move_before_any_looks(
    update: str, first: float
) -> None:
    """The first boid is 56 px from where the second was, 48 px from where it comes to;
    the second sees 48 px.
    """
    moved = stepped([(600, 600, 8, 0), (664, 600, -8, 0)], update=update, **ALONE)
    assert moved[:, 0].tolist() == [608, 656]
    assert moved[:, 2] == pytest.approx([first, -8 + 0.15 * 48], rel=1e-14)


@pytest.mark.parametrize(
    ("rule", "reach"),
    [("separation", 50), ("alignment", 80), ("cohesion", 80), ("obstacle", 60)],
)
def test_a_range_excludes_its_end(rule: str, reach: float) -> None:
    others = {
        f"{name}_weight": 0
        for name in ("separation", "alignment", "cohesion", "obstacle")
        if name != rule
    }
    for distance, acts in ((reach, False), (reach - 1e-9, True)):
        flock = [(600, 600, 0, 0), (600 + distance, 600, 0, 8)]
        rocks = [(600, 600 + distance)] if rule == "obstacle" else []
        assert stepped(flock, rocks=rocks, **others)[0, 2:].any() == acts


def test_a_rock_is_a_point_and_counts_by_its_distance() -> None:
    assert stepped([(600, 600, 0, 0)], rocks=[(640, 570), (600, 590), (900, 600)])[
        0, 2:
    ].tolist() == [-10, 10]


@pytest.mark.parametrize(
    ("preset", "west", "east"),
    [
        ("as_intended", (4, 8), (-4, -8)),
        ("as_written", (-2, 8), (2, -8)),
        ("as_run", (-2, 16), (2, -16)),
    ],
)
def test_a_border_acts_on_the_components_that_are_in_its_margin(
    preset: str, west: Any, east: Any
) -> None:
    """At 174 and 1026 px of 1200, and the same along the other axis; not at 175 and
    1025.
    """
    assert stepped([(180, 600, -6, 8)], preset)[0, 2:].tolist() == list(west)
    assert stepped([(1020, 600, 6, -8)], preset)[0, 2:].tolist() == list(east)
    assert stepped([(600, 180, 8, -6)], preset)[0, 2:].tolist() == list(west)[::-1]
    assert stepped([(600, 1020, -8, 6)], preset)[0, 2:].tolist() == list(east)[::-1]
    doubled = 2 if preset == "as_run" else 1
    assert stepped([(181, 600, -6, 8)], preset)[0, 2:].tolist() == [
        -6 * doubled,
        8 * doubled,
    ]
    assert stepped([(1019, 600, 6, 8)], preset)[0, 2:].tolist() == [
        6 * doubled,
        8 * doubled,
    ]


def test_a_rover_as_written_never_turns_back_from_a_border_met_head_on() -> None:
    """Its component of -10 becomes -20 + 10."""
    assert stepped([(180, 600, -10, 0)], "as_written")[0, 2:].tolist() == [-10, 0]
    assert stepped([(180, 600, -10, 0)], "as_intended")[0, 2:].tolist() == [0, 0]


def test_rules_count_by_the_time_of_a_step() -> None:
    """Half a step: a move of 4 px, and half of each rule, the added velocity of a
    margin too.
    """
    rover = stepped([(176, 600, -8, 0)], "as_written", dt=0.5)[0]
    assert rover.tolist() == [172, 600, -8 + 0.5 * (-8 + 10), 0]


def shares_of_steps(preset: str, speed: float, trials: int) -> float:
    """The share of steps, among all boids, whose move was as long as `speed`."""
    shares = []
    for replicate in range(trials):
        a_job = builders.job(
            "patel2023", preset, metrics=("speed",), replicate=replicate
        )
        path = builders.trajectory(builders.to_end(Simulation(a_job)))[:, :2]
        length = np.hypot(*np.diff(path, axis=0).transpose(1, 0, 2))
        shares.append(np.isclose(length, speed, rtol=0, atol=1e-9).mean())
    return float(np.mean(shares))


def test_a_velocity_that_doubles_leaves_the_lower_limit_without_work() -> None:
    """As run, 98.5 % of moves are 10 px long: 98.49 in 100 trials, whose standard
    deviation was 0.24.

    Two-sided at five standard errors of 20 trials: a false alarm in one of a million
    seeds. As intended, where the velocity is not added, it was 11.9 %, with a standard
    deviation of 3.5 % between trials.
    """
    assert abs(shares_of_steps("as_run", 10.0, 20) - 0.985) < 5 * 0.0024 / np.sqrt(20)
    assert abs(shares_of_steps("as_intended", 10.0, 20) - 0.119) < 5 * 0.035 / np.sqrt(
        20
    )
