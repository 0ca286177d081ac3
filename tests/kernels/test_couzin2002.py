"""couzin2002: what is known of it without computing."""

import math
from typing import Any

import numpy as np
import pytest

from sweep.trial.simulation import Simulation
from tests import builders

STEP = math.radians(4)
"""The most that a boid turns in a step of the presets."""
EAST, NORTH, WEST, SOUTH = (0.0, 0.5 * math.pi, math.pi, -0.5 * math.pi)


def turns(
    places: list[tuple[float, float]], headings: list[float], **changes: Any
) -> np.ndarray:
    """By which angle each boid turns in one step without noise, radians."""
    flock = {"n": len(places), "steps": 1, "noise": 0} | changes
    simulation = Simulation(builders.job("couzin2002", metrics=(), **flock))
    x, y = np.transpose(places) + 10.0
    vx, vy = 3 * np.cos(headings), 3 * np.sin(headings)
    builders.place(simulation, x, y, vx, vy).advance(1)
    after = simulation.flock.vx + 1j * simulation.flock.vy
    assert np.abs(after) == pytest.approx(3, rel=1e-14)
    turned: np.ndarray = np.angle(after / (vx + 1j * vy))
    return turned


WIDE = {"max_turn": 1800, "orientation_width": 3}
"""Boids that can turn by half a circle in a step; r_r 1, r_o 4, r_a 14."""


@pytest.mark.parametrize(
    ("distance", "turn"),
    [
        (0.999, -0.5 * math.pi),  # away from the other, who is to the north
        (1.0, math.pi),  # as the other flies: to the west
        (3.999, math.pi),
        (4.0, 0.5 * math.pi),  # to the other
        (13.999, 0.5 * math.pi),
        (14.0, 0.0),
    ],
)
def test_zones_begin_with_their_inner_radius(distance: float, turn: float) -> None:
    found = turns([(0, 0), (0, distance)], [EAST, WEST], **WIDE)
    assert math.cos(found[0] - turn) == pytest.approx(1, abs=1e-12)


def test_repulsion_overrides_the_others_and_has_no_blind_angle() -> None:
    """One is near behind, another to the north, in the zone of attraction."""
    places = [(0, 0), (-0.5, 0), (0, 8)]
    assert turns(places, [EAST, EAST, EAST], **WIDE)[0] == pytest.approx(0, abs=1e-12)
    places[1] = (0, 0.5)
    assert turns(places, [EAST, EAST, EAST], **WIDE)[0] == pytest.approx(-math.pi / 2)


def test_repulsion_is_by_unit_vectors() -> None:
    """Of two others the nearer one counts no more: to the north and to the east."""
    places = [(0, 0), (0, 0.1), (0.9, 0)]
    found = turns(places, [NORTH] * 3, **WIDE)[0]
    assert math.cos(found - 0.75 * math.pi) == pytest.approx(1, abs=1e-12)


@pytest.mark.parametrize(("degrees", "seen"), [(134.9, True), (135.1, False)])
@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize("distance", [2.0, 8.0])
def test_who_is_behind_is_not_followed(
    degrees: float, seen: bool, side: int, distance: float
) -> None:
    angle = side * math.radians(degrees)
    place = distance * math.cos(angle), distance * math.sin(angle)
    found = turns([(0, 0), place], [EAST, side * NORTH], **WIDE)[0]
    assert (found != 0.0) == seen
    assert found * side >= 0


def test_the_fuller_zone_counts_more_with_plain_sums_alone() -> None:
    """Three fly north in the zone of orientation, and one is to the east in that of
    attraction. The sums are (1, 3): 71.6 degrees, or (1, 1): 45.
    """
    places = [(0, 0), (0, 2), (1, 2), (-1, 2), (8, 0)]
    headings = [EAST, NORTH, NORTH, NORTH, NORTH]
    for zone_sums, turn in (
        ("plain_sums", math.atan(3)),
        ("unit_vectors", math.pi / 4),
    ):
        found = turns(places, headings, zone_sums=zone_sums, **WIDE)[0]
        assert found == pytest.approx(turn, rel=1e-12)


def test_zones_that_cancel_leave_the_heading() -> None:
    places = [(0, 0), (0, 8), (0, -8)]
    assert turns(places, [EAST] * 3, **WIDE)[0] == 0.0
    places = [(0, 0), (2, 0), (2, 1.5)]
    assert turns(places, [NORTH, EAST, WEST], **WIDE)[0] == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize("side", [-1, 1])
def test_a_boid_turns_by_no_more_than_it_can(side: int) -> None:
    """4 degrees in 0.1 s, and less where less is desired."""
    ahead = (8 * math.cos(0.05), side * 8 * math.sin(0.05))
    assert turns([(0, 0), ahead], [EAST] * 2)[0] == pytest.approx(side * 0.05)
    found = turns([(0, 0), (0, side * 8)], [EAST] * 2)[0]
    assert found == pytest.approx(side * STEP, rel=1e-12)
    slow = turns([(0, 0), (0, side * 8)], [EAST] * 2, max_turn=10)[0]
    assert slow == pytest.approx(side * STEP / 4, rel=1e-12)


def test_a_boid_moves_with_its_new_heading() -> None:
    simulation = Simulation(builders.job("couzin2002", n=2, steps=1, noise=0))
    builders.place(simulation, [10, 10], [10, 18], [3, 3], [0, 0]).advance(1)
    flock = simulation.flock
    moved = [10 + 0.3 * math.cos(STEP), 10 + 0.3 * math.sin(STEP)]
    assert [flock.x[0], flock.y[0]] == pytest.approx(moved, rel=1e-14)


def lone_turns(**changes: Any) -> np.ndarray:
    """By how much 4000 boids turn, too far apart to see each other."""
    n = 4000
    simulation = Simulation(
        builders.job("couzin2002", n=n, steps=1, metrics=(), **changes)
    )
    place = 100.0 * np.arange(n)
    builders.place(simulation, place, place, np.full(n, 3.0), np.zeros(n)).advance(1)
    angles: np.ndarray = np.arctan2(simulation.flock.vy, simulation.flock.vx)
    return angles


def test_a_lone_boid_misses_its_heading_by_a_gaussian_angle() -> None:
    """Mean, standard deviation and fourth moment at 4.5 standard errors, two-sided:
    one of the three fails by chance for one of 49,000 seeds.
    """
    found = lone_turns(noise=0.4, max_turn=1800) / 0.4
    n = found.size
    assert abs(found.mean()) < 4.5 / math.sqrt(n)
    assert abs((found**2).mean() - 1) < 4.5 * math.sqrt(2 / n)
    assert abs((found**4).mean() - 3) < 4.5 * math.sqrt(96 / n)


def test_noise_is_within_the_turn_that_a_boid_can_make() -> None:
    """At 0.05 radians and 4 degrees a share of 16.3 % would turn further."""
    found = lone_turns()
    assert np.abs(found).max() == pytest.approx(STEP, rel=1e-12)
    cut = np.isclose(np.abs(found), STEP, rtol=1e-9).mean()
    share = math.erfc(STEP / 0.05 / math.sqrt(2))
    assert abs(cut - share) < 4.5 * math.sqrt(share * (1 - share) / found.size)


def test_angles_of_much_noise_are_folded() -> None:
    """With a deviation of 10 radians all directions are alike: the mean cosine is zero
    at 4.5 standard errors, two-sided: by chance for one of 150,000 seeds.
    """
    found = lone_turns(noise=10, max_turn=1800)
    assert abs(np.cos(found).mean()) < 4.5 * math.sqrt(0.5 / found.size)
