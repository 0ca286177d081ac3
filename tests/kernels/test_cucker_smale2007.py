"""cucker_smale2007: what is known of it without computing."""

import math
from typing import Any

import numpy as np
import pytest

from sweep.trial.simulation import Simulation
from tests import builders
from tests.cases import slow_but

ANGLES = 2 * math.pi * np.arange(50) / 50
START = np.array(
    [
        10 + 5 * (1 + 0.5 * np.sin(3 * ANGLES)) * np.cos(ANGLES),
        10 + 5 * (1 + 0.5 * np.sin(3 * ANGLES)) * np.sin(ANGLES),
        0.3 + np.cos(2 * ANGLES),
        0.1 + np.sin(3 * ANGLES),
    ]
)
"""A start that can be written down, for other programs."""


def flown(start: np.ndarray = START, **changes: Any) -> np.ndarray:
    """The state (4, N) at the end of a flight."""
    a_job = builders.job(
        "cucker_smale2007", n=start.shape[1], metrics=(), every=10**6, **changes
    )
    simulation = builders.place(Simulation(a_job), *start)
    while simulation.steps_left > 0 and simulation.advance(10**6):
        pass
    return builders.state(simulation.flock)


def diameter(rows: np.ndarray) -> float:
    """The greatest distance of two columns (2, N)."""
    return float(np.hypot(*(rows[:, :, None] - rows[:, None, :])).max())


PROGRAMS = (
    ("sum", 0.4, 1, 0.00017345594, 13.5560048059),
    ("sum", 0.8, 5, 0.0002322413678, 13.9306035936),
    ("mean", 0.4, 5, 0.9040576063, 17.2732197808),
    ("mean", 0.8, 1, 2.414427634, 14.2541487969),
    ("mean", 0.8, 20, 1.431609314, 40.2838851256),
)
"""Weights, beta, time, diameters of velocities and of places: by Runge-Kutta steps of
0.001 of an independent program.
"""


@pytest.mark.parametrize(
    ("weights", "beta", "time", "velocity", "place"), slow_but(PROGRAMS[:4], PROGRAMS)
)
def test_diameters_are_those_of_an_independent_program(
    weights: str, beta: float, time: float, velocity: float, place: float
) -> None:
    """Steps are of the first order here. With the errors of 2 h, h and h / 2 the parts
    of orders h and h^2 fall out, and what is left is below 1 % of that of h: of the
    logarithm of the velocities, which fall by up to 10^4.
    """
    assert diameter(START[2:]) == pytest.approx(2.554080699, rel=1e-9)
    assert diameter(START[:2]) == pytest.approx(13.50419944, rel=1e-9)
    steps = 500 * time if time > 1 else 1000
    found = []
    for finer in (1, 2, 4):
        changes = {"weights": weights, "exponent": beta, "steps": steps * finer}
        end = flown(dt=time / (steps * finer), **changes)
        found.append([math.log(diameter(end[2:])), diameter(end[:2])])
    coarse, half, quarter = np.array(found)
    limit = (coarse - 6 * half + 8 * quarter) / 3
    truth = np.array([math.log(velocity), place])
    margin = 0.01 * np.abs(quarter - truth) + 1e-8
    assert (np.abs(limit - truth) < margin).all()
    ratio = np.abs(coarse - truth) / np.abs(half - truth)
    assert ratio == pytest.approx(2, rel=0.05)


@pytest.mark.parametrize("weights", ["sum", "mean"])
def test_the_mean_velocity_is_constant(weights: str) -> None:
    """To the rounding of sums of 50 numbers in each of 500 steps."""
    end = flown(weights=weights, steps=500)
    assert end[2:].mean(axis=1) == pytest.approx([0.3, 0.1], abs=1e-13)


@pytest.mark.parametrize("beta", [0.0, 0.4, 0.5, 0.8, 3.0])
def test_the_velocity_diameter_never_grows(beta: float) -> None:
    """Each new velocity is a mean of old ones, as 0.01 times 49 weights of at most 1 is
    below 1. A mean of fifty is off by a few roundings at most. The frame of step 0 is
    that of the start which was drawn.
    """
    a_job = builders.job(
        "cucker_smale2007",
        exponent=beta,
        steps=400,
        metrics=(),
        series=("velocity_diameter", "group_speed"),
    )
    simulation = builders.place(Simulation(a_job), *START)
    recorded = simulation.result(began=0.0).series
    series = {name: values[1:] for name, values in recorded.items()}
    assert (np.diff(series["velocity_diameter"]) < 1e-14).all()
    assert series["velocity_diameter"][-1] < series["velocity_diameter"][0]
    assert series["group_speed"] == pytest.approx(math.sqrt(0.1), rel=1e-12)


def test_weights_that_do_not_fall_with_distance_give_exponential_decay() -> None:
    """With beta = 0 each boid goes to the mean at the rate K N, or K with weights mean:
    by (1 - K h)^steps in discrete time.
    """
    for weights, rate in (("sum", 0.2 * 50), ("mean", 0.2)):
        end = flown(exponent=0, strength=0.2, weights=weights, steps=30)
        mean = START[2:].mean(axis=1, keepdims=True)
        known = mean + (START[2:] - mean) * (1 - rate * 0.01) ** 30
        np.testing.assert_allclose(end[2:], known, rtol=0, atol=1e-13)


def test_two_boids_pull_each_other_by_the_weight_of_their_distance() -> None:
    start = np.array([[0.0, 3.0], [0.0, 4.0], [1.0, -1.0], [0.0, 2.0]])
    changes = {"strength": 0.7, "decay_length": 2.0, "exponent": 1.5, "steps": 1}
    end = flown(start, dt=0.1, **changes)
    weight = 0.7 / (4 + 25) ** 1.5
    assert end[2] == pytest.approx([1 - 0.2 * weight, -1 + 0.2 * weight], rel=1e-14)
    assert end[3] == pytest.approx([0.2 * weight, 2 - 0.2 * weight], rel=1e-14)


def test_a_boid_moves_with_its_velocity_from_before() -> None:
    end = flown(steps=1)
    np.testing.assert_allclose(end[:2], START[:2] + 0.01 * START[2:], rtol=1e-15)


def test_nobody_beyond_the_range_acts() -> None:
    start = np.array([[1.0, 2.0], [1.0, 1.0], [0.5, 0.0], [0.0, 0.0]])
    for reach, moves in ((1.0, True), (1.0 - 1e-9, False)):
        end = flown(start, interaction_range=reach, steps=1)
        assert (end[2, 1] > 0) == moves
