"""nanobot: each rule of the pseudocode by hand, and its limits of speed."""

from typing import Any

import numpy as np
import pytest

from kernels.models import MODELS
from sweep.trial.simulation import Simulation
from tests import builders

Row = tuple[float, float, float, float]


def stepped(flock: list[Row], **changes: Any) -> np.ndarray:
    """The rows x, y, vx, vy of each boid after one step from such rows."""
    simulation = Simulation(builders.job("nanobot", n=len(flock), steps=1, **changes))
    return builders.state(
        builders.to_end(builders.place(simulation, *np.array(flock).T)).flock
    ).T


def test_there_is_no_program_so_what_was_run_is_what_was_written() -> None:
    presets = MODELS["nanobot"].presets
    assert presets["as_run"] == presets["as_written"]


def test_the_preset_has_the_usual_values_of_the_pseudocode() -> None:
    """A flock is who sees each other; each boid is moved before the next one looks."""
    usual = {
        **{
            "border_turn": 0.2,
            "perception_range": 40,
            "separation_range": 8,
            "cohesion_weight": 0.0005,
        },
        **{
            "separation_weight": 0.05,
            "alignment_weight": 0.05,
            "min_speed": 3,
            "max_speed": 6,
        },
        **{
            "border_margin": 100,
            "width": 640,
            "height": 480,
            "borders": "open",
            "map": "empty",
        },
        **{
            "protected_count_once": True,
            "update": "sequential",
            "flock_range": 40,
            "dt": 1,
        },
    }
    known = MODELS["nanobot"].presets["as_written"]
    assert {name: known[name] for name in usual} == usual


@pytest.mark.parametrize(
    ("once", "velocity"), [(True, (3.5595, 0.15)), (False, (3.5559375, 0.175))]
)
def test_a_boid_in_the_protected_range_counts_for_separation_only(
    once: bool, velocity: tuple[float, float]
) -> None:
    """Neighbours at 5 and 20 px. Cohesion makes 4.01 of 4, alignment 3.8095 of that,
    separation takes 0.25.

    Counted twice, the nearer one makes 4.00625 and 3.8059375 of it.
    """
    flock = [
        (320.0, 240.0, 4.0, 0.0),
        (325.0, 240.0, 0.0, 4.0),
        (340.0, 240.0, 0.0, 3.0),
    ]
    boid = stepped(flock, protected_count_once=once)[0]
    assert boid[2:] == pytest.approx(velocity, rel=1e-14)
    assert boid[:2] == pytest.approx((320 + velocity[0], 240 + velocity[1]), rel=1e-14)


@pytest.mark.parametrize(
    ("distance", "vx"),
    [
        (8.0 - 1e-9, 4 - 0.05 * 8),
        (8.0, 4 + 0.0005 * 8),
        (40.0 - 1e-9, 4 + 0.0005 * 40),
        (40.0, 4.0),
    ],
)
def test_ranges_exclude_their_ends(distance: float, vx: float) -> None:
    boid = stepped([(320, 240, 4, 0), (320 + distance, 240, 4, 0)], alignment_weight=0)[
        0
    ]
    assert boid[2] == pytest.approx(vx, abs=1e-9)


def test_a_protected_range_beyond_the_visual_one_still_repels() -> None:
    flock = [(320.0, 240.0, 4.0, 0.0), (350.0, 240.0, 4.0, 0.0)]
    boid = stepped(flock, perception_range=20, separation_range=35, min_speed=0)[0]
    assert boid[2:] == pytest.approx((4 - 0.05 * 30, 0), rel=1e-14)


@pytest.mark.parametrize("way", [1, -1])
def test_a_boid_turns_back_in_a_margin_but_not_at_its_end(way: int) -> None:
    """By its position before the move, and on both axes."""
    for off, turn in ((99.0, 0.2), (100.0, 0.0), (-30.0, 0.2)):
        x, y = (off, off) if way == 1 else (640 - off, 480 - off)
        assert stepped([(x, 240, 0, 4)])[0, 2:] == pytest.approx(
            (turn * way, 4), rel=1e-14
        )
        assert stepped([(320, y, 4, 0)])[0, 2:] == pytest.approx(
            (4, turn * way), rel=1e-14
        )


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ((6, 8), (3.6, 4.8)),
        ((0.3, 0.4), (1.8, 2.4)),
        ((0, 5), (0, 5)),
        ((0, 0), (0, 0)),
    ],
)
def test_the_speed_is_limited_before_the_move_and_a_boid_at_rest_is_left_alone(
    before: Any, after: Any
) -> None:
    x, y, *velocity = stepped([(320, 240, *before)])[0]
    assert (x, y) == pytest.approx((320 + after[0], 240 + after[1]), rel=1e-15)
    assert velocity == pytest.approx(after, rel=1e-14)


def test_rules_count_by_the_time_of_a_step() -> None:
    """Half a step: half the turn, and then half the way."""
    assert stepped([(50, 240, 4, 0)], dt=0.5)[0] == pytest.approx(
        [50 + 0.5 * 4.1, 240, 4.1, 0], rel=1e-14
    )


@pytest.mark.parametrize("update", builders.UPDATES)
def test_the_speed_stays_within_its_limits(update: str) -> None:
    """In every step of a trial, to the rounding of a scaled vector; and both limits are
    met.
    """
    simulation = builders.to_end(
        Simulation(
            builders.job("nanobot", update=update, steps=300, metrics=("speed",))
        )
    )
    speed = np.hypot(*builders.trajectory(simulation)[:, 2:4].transpose(1, 0, 2))
    assert speed.min() == pytest.approx(3.0, rel=1e-14)
    assert speed.max() == pytest.approx(6.0, rel=1e-14)
