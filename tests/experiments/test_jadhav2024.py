"""jadhav2024: against its slow twin, and what is known of it without computing."""

from collections.abc import Iterator
from itertools import product
from typing import Any

import numpy as np
import pytest

from kernels.near import build_near
from sweep.design.jobs import stream
from sweep.testing import assert_keeps
from sweep.testing.subject import subject
from sweep.trial.simulation import Simulation
from tests import ROOT, builders, naive
from tests.naive.jadhav2024 import jadhav2024

MODEL = subject(ROOT / "experiments" / "sheep" / "jadhav2024.py").model
"""As specs name it, so that what is compiled here serves tests of studies too."""
ADVANCE: Any = MODEL.advance
choose = ADVANCE.py_func.__globals__["_choose"]
ANYWHERE = {"start_radius": 0, "start_draws": "portable"}
"""The start of trials whose boids are placed, or whose world is small."""

QUIET = {
    "noise": 0,
    "dog_noise": 0,
    "attraction_strength": 0,
    "alignment_strength": 0,
    "alignment_sum": "headings",
}
FAR = (590.0, 590.0)
Places = list[tuple[float, float]]


@pytest.fixture(autouse=True, scope="module")
def _is_known() -> Iterator[None]:
    with builders.entered(MODEL):
        yield


@pytest.mark.parametrize(
    ("preset", "update", "borders"),
    list(product(MODEL.presets, builders.UPDATES, builders.BORDERS)),
)
def test_the_model_does_what_its_slow_twin_does(
    preset: str, update: str, borders: dict[str, Any]
) -> None:
    """For 20 steps in which sheep flee, rest and are driven, with the same generator;
    see tests.kernels.test_models for the tolerance.
    """
    given = ANYWHERE | {"n": 14, "steps": 20, "width": 15, "height": 14, "seed": 27}
    given |= {"goal_x": 3, "goal_y": 4, "detection_range": 6} | borders
    a_job = builders.job("jadhav2024", preset, **given, update=update)
    simulation = Simulation(a_job)
    birds = naive.birds(simulation.flock)
    rng = np.random.default_rng(stream(a_job, "noise"))
    rested = 0
    for _ in range(20):
        birds = jadhav2024(a_job.settings, simulation.world, birds, rng)
        simulation.advance(1)
        slow = np.array([[*bird.position, *bird.velocity] for bird in birds]).T
        rested += int((slow[2:] == 0).all(axis=0).sum())
        np.testing.assert_allclose(
            builders.state(simulation.flock), slow, rtol=0, atol=1e-10
        )
    assert rested > 0


def test_the_model_has_the_symmetries_that_it_declares() -> None:
    assert_keeps(MODEL, "symmetries")


def velocities(
    places: Places, headings: list[complex] | None = None, **changes: Any
) -> list[complex]:
    """Of all boids after a step; the dog is the last. They begin at rest, or with the
    given velocities.
    """
    given = {"n": len(places), "steps": 1, "metrics": ()} | QUIET | changes
    simulation = Simulation(builders.job("jadhav2024", **ANYWHERE | given))
    begin = np.array(headings or [0j] * len(places))
    builders.place(simulation, *np.transpose(places), begin.real, begin.imag)
    simulation.advance(1)
    flock = simulation.flock
    return (flock.vx + 1j * flock.vy).tolist()


def unit(way: complex) -> complex:
    return way / abs(way)


def test_a_sheep_far_from_the_dog_rests_unless_another_is_near() -> None:
    resting = velocities([(100, 100), (100, 102), FAR], [1, 1, 1])
    assert resting[:2] == [0, 0]
    apart = velocities([(100, 100), (100, 101.9), FAR], [1, 1, 1])
    assert apart[:2] == pytest.approx([unit(0.5 - 2j), unit(0.5 + 2j)], rel=1e-12)


def test_a_sheep_flees_up_to_the_range_of_detection_and_at_it() -> None:
    near, at, far = (
        velocities([(100 + distance, 100), (100, 100)])[0]
        for distance in (11.9, 12.0, 12.1)
    )
    assert (near, at, far) == (1.0, 1.0, 0.0)


def test_a_heading_is_the_sum_of_unit_vectors() -> None:
    """By hand: the chosen sheep count by their directions, however far they are, and
    one at rest by its last heading.
    """
    places = [(110.0, 100.0), (110.0, 103.0), (140.0, 100.0), (100.0, 100.0)]
    changes = {"attraction_strength": 1.5, "alignment_strength": 1.3}
    changes |= {"alignment_chosen": 4}
    begin = [1j, -1 + 0j, 1j, 1 + 0j]
    found = velocities(places, begin, **changes)[0]
    wanted = 0.5j + 1.5 * unit(1 + 1j) + 1.3 * unit(-1 + 1j) + 1
    assert found == pytest.approx(unit(wanted), rel=1e-12)


@pytest.mark.parametrize(("heading", "sign"), [(1 + 0j, 1), (1j, 1), (-1 + 0.5j, -1)])
def test_the_program_sums_the_components_of_a_heading(
    heading: complex, sign: int
) -> None:
    """Of one sheep, so that the other is pushed along a diagonal of the world."""
    places = [(110.0, 100.0), (110.0, 103.0), (100.0, 100.0)]
    changes = {"alignment_strength": 1.3, "alignment_sum": "components"}
    found = velocities(places, [1j, heading, 1 + 0j], **changes)[0]
    assert found == pytest.approx(unit(0.5j + 1.3 * sign * (1 + 1j) + 1), rel=1e-12)


def test_a_sheep_at_rest_keeps_its_heading() -> None:
    """Two sheep rest for a step; then the dog comes, and one aligns with the other."""
    given = QUIET | {"n": 3, "steps": 2, "metrics": (), "alignment_strength": 1.3}
    simulation = Simulation(builders.job("jadhav2024", **ANYWHERE | given))
    begin = np.array([1, 1j, 1])
    places = [(110.0, 100.0), (125.0, 100.0), FAR]
    builders.place(simulation, *np.transpose(places), begin.real, begin.imag)
    flock = simulation.flock
    simulation.advance(1)
    assert not flock.vx[:2].any()
    flock.x[2] = flock.y[2] = 100.0
    simulation.advance(1)
    assert complex(flock.vx[0], flock.vy[0]) == pytest.approx(
        unit(0.5 + 1.3j + 1), rel=1e-12
    )


@pytest.mark.parametrize(("distance", "speed"), [(1.99, 0.05), (2.01, 1.5)])
def test_a_dog_near_a_sheep_is_slow_and_keeps_its_heading(
    distance: float, speed: float
) -> None:
    dog = velocities([(100 + distance, 100), (100, 100)], [0j, 1j])[1]
    assert abs(dog) == pytest.approx(speed)
    assert (dog == 0.05j) == (speed == 0.05)


@pytest.mark.parametrize(("farthest", "collects"), [(5.03, False), (5.05, True)])
def test_a_dog_collects_from_the_distance_f_of_n(
    farthest: float, collects: bool
) -> None:
    """f(4) = 2 * 4^(2/3) = 5.0397; the goal is to the east."""
    west = 200.0
    places = [(west, 100 + farthest), *[(west, 100 - farthest / 3)] * 3]
    goal = {"goal_x": 500.0, "goal_y": 100.0, "width": 600, "height": 600}
    dog = velocities([*places, (150.0, 100.0)], **goal)[-1]
    target = 50 + 1j * (farthest + 2) if collects else 50 - 2 * np.sqrt(4)
    assert dog == pytest.approx(1.5 * unit(complex(target)), rel=1e-12)


def test_the_chosen_sheep_are_a_random_part_of_the_nearest() -> None:
    """Each of 10 is among the 4 chosen in 4 of 10 draws, and first in 1 of 10.

    Counts of 10 that exclude each other have 10/9 of the variance of independent ones.
    A chi square with 9 degrees of freedom is below 1.73 or above 23.6 by chance in 1 of
    100 seeds.
    """
    rng = np.random.default_rng(3)
    draws = 6000
    counts = np.zeros(10)
    first = np.zeros(10)
    for _ in range(draws):
        near = build_near(10)
        near.boid[:10] = np.arange(10)
        assert choose(near, 10, 4, rng) == 4
        assert sorted(near.boid[:10]) == list(range(10))
        counts[near.boid[:4]] += 1
        first[near.boid[0]] += 1
    for seen, share in ((counts, 0.4), (first, 0.1)):
        variance = draws * share * (1 - share)
        square = ((seen - draws * share) ** 2).sum() / variance * 9 / 10
        assert 1.73 < square < 23.6
