"""Predators and prey: against a slow twin, and by the laws of their paper."""

import math
from typing import Any

import numpy as np
import pytest

from sweep.errors import SpecError
from sweep.trial.simulation import Simulation
from tests.examples.flown import flown, job, places

METRIC = "./predator_distance.py"
INNER, OUTER = math.sqrt(0.2), math.sqrt(1.2)
"""The radii of the ring, for a = 1 and b = 0.2."""


def one_step(place: np.ndarray, predators: int, s: dict[str, Any]) -> np.ndarray:
    """Places after a step by Eqs. (1.1) and (1.2), none of them faster than allowed."""
    prey, hunters = np.split(place, [len(place) - predators])
    velocity = []
    for number, one in enumerate(prey):
        way = one - np.delete(prey, number, axis=0)
        square = (way**2).sum(axis=1)[:, None]
        away = one - hunters
        flight = (away / (away**2).sum(axis=1)[:, None]).sum(axis=0)
        force = (way / square - s["attraction_weight"] * way).sum(axis=0) / len(prey)
        velocity.append(force + s["flight_weight"] * flight)
    for one in hunters:
        way = prey - one
        distance = np.hypot(*way.T)[:, None] ** s["chase_power"]
        velocity.append(s["chase_weight"] * (way / distance).mean(axis=0))
    speed = np.hypot(*np.transpose(velocity))[:, None]
    return place + s["dt"] * np.array(velocity) * np.minimum(1, s["max_speed"] / speed)


@pytest.mark.parametrize("predators", [0, 1, 3])
def test_it_does_what_its_slow_twin_does(predators: int) -> None:
    fixed = {"predators": predators, "n": 14, "steps": 20, "chase_power": 2.5}
    a_job = job("predators", "strong", max_speed=1.5, **fixed)
    simulation = Simulation(a_job)
    place = places(simulation)
    for _ in range(20):
        place = one_step(place, predators, a_job.settings)
        simulation.advance(1)
    np.testing.assert_allclose(places(simulation), place, rtol=0, atol=1e-11)


def test_two_prey_come_to_the_distance_at_which_forces_balance() -> None:
    """Their distance d obeys d' = 1/d - a d, so 1/a - d^2 falls as exp(-2 a t). A step
    errs by dt^2, so half the step halves the error.
    """
    errors = []
    for dt in (0.02, 0.01):
        fixed = {"n": 2, "predators": 0, "dt": dt, "attraction_weight": 2}
        simulation = Simulation(job("predators", "confused", steps=100, **fixed))
        first = math.dist(*places(simulation)) ** 2
        simulation.advance(round(0.5 / dt))
        exact = 0.5 + (first - 0.5) * math.exp(-2)
        errors.append(math.dist(*places(simulation)) ** 2 - exact)
    assert abs(errors[0]) < 0.05
    assert errors[0] / errors[1] == pytest.approx(2, abs=0.2)


def ring(n: int = 201, **settings: Any) -> tuple[np.ndarray, np.ndarray]:
    """The places of prey (n - 1, 2) and of their predator (2,) after a long time."""
    simulation = Simulation(job("predators", "confused", every=100, n=n, **settings))
    assert simulation.advance(simulation.steps_left)
    assert simulation.steps_left == 0
    place = places(simulation)
    return place[:-1], place[-1]


@pytest.mark.slow
def test_a_predator_in_the_middle_of_prey_confuses_itself() -> None:
    """They rest in a ring. Where all rest, sum over x . x' is 0, so that their mean
    square distance from their centre is ((N - 1) / 2 N + b) / a, whatever N.
    """
    prey, predator = ring(steps=4000)
    many, centre = len(prey), prey.mean(axis=0)
    distance = np.hypot(*(prey - predator).T)
    square = ((prey - centre) ** 2).sum(axis=1).mean()
    assert square == pytest.approx((many - 1) / (2 * many) + 0.2, rel=1e-5)
    spacing = math.sqrt(math.pi / many)
    assert INNER < distance.min() < INNER + spacing
    assert OUTER - spacing < distance.max() < OUTER
    assert np.hypot(*(predator - centre)) < 0.02


FOLLOWS = 0.2 / OUTER ** (2 - 3)
CHASES = 1 / (1 / INNER - 1 / OUTER)


@pytest.mark.parametrize(
    ("chase", "rests"),
    [
        pytest.param(FOLLOWS - 0.03, False, id="too weak", marks=pytest.mark.slow),
        pytest.param(FOLLOWS + 0.03, True, id="strong enough"),
        pytest.param(CHASES - 0.06, True, id="still confused", marks=pytest.mark.slow),
        pytest.param(CHASES + 0.06, False, id="chasing"),
    ],
)
def test_the_ring_lasts_between_two_strengths_of_the_chase(
    chase: float, rests: bool
) -> None:
    """As the linear theory of many prey says. The two bounds are 0.219 and 0.756."""
    prey, predator = ring(n=101, chase_weight=chase, steps=4000)
    off_centre = np.hypot(*(predator - prey.mean(axis=0)))
    assert (off_centre < 0.02) == rests
    assert rests or off_centre > 0.1


def test_a_weak_predator_is_left_behind() -> None:
    metrics = [METRIC]
    series = flown(job("predators", "weak", metrics)).series["predator_distance"]
    assert series[-1] > 2 * OUTER


def test_the_metric_is_the_mean_distance_to_the_nearest_predator() -> None:
    """In the ring it is 2/3 (R2^3 - R1^3) / (R2^2 - R1^2), for many prey."""
    result = flown(job("predators", "confused", [METRIC], n=201))
    ideal = 2 / 3 * (OUTER**3 - INNER**3) / (OUTER**2 - INNER**2)
    assert result.last["predator_distance"] == pytest.approx(ideal, rel=0.01)
    a_job = job("predators", "confused", [METRIC], predators=4, n=30)
    simulation = Simulation(a_job)
    place = places(simulation)
    apart = np.hypot(*(place[:26, None] - place[None, 26:]).T).T
    first = flown(a_job).series["predator_distance"][0]
    assert first == pytest.approx(apart.min(axis=1).mean(), rel=1e-12)


def test_without_predators_there_is_no_distance() -> None:
    result = flown(job("predators", "confused", [METRIC], predators=0))
    assert np.isnan(result.series["predator_distance"]).all()


def test_there_must_be_prey() -> None:
    with pytest.raises(SpecError, match="there must be at least one prey"):
        flown(job("predators", "confused", n=3, predators=3))
