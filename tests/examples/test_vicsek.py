"""Vicsek's model: against a slow twin, and against what is known without computing."""

import math

import numpy as np
import pytest

from sweep.design.jobs import stream
from sweep.trial.simulation import Simulation
from tests.examples.flown import flown, job, places


def velocities(simulation: Simulation) -> np.ndarray:
    return np.column_stack([simulation.flock.vx, simulation.flock.vy])


def one_step(
    place: np.ndarray, velocity: np.ndarray, noise: np.ndarray, side: float
) -> tuple[np.ndarray, np.ndarray]:
    """Eqs. (1) and (2), by angles, of boids with range and speed of the paper."""
    way = place[None] - place[:, None]
    way -= side * np.round(way / side)
    near = (way**2).sum(axis=2) <= 1.0
    angle = np.arctan2(velocity[:, 1], velocity[:, 0])
    mean = np.arctan2(near @ np.sin(angle), near @ np.cos(angle)) + noise
    turned = 0.03 * np.column_stack([np.cos(mean), np.sin(mean)])
    return (place + velocity) % side, turned


@pytest.mark.parametrize("side", [5.0, 2.0], ids=["cells", "all pairs"])
def test_it_does_what_its_slow_twin_does(side: float) -> None:
    a_job = job("vicsek", "as_written", width=side, height=side, steps=60)
    simulation, rng = Simulation(a_job), np.random.default_rng(stream(a_job, "noise"))
    place, velocity = places(simulation), velocities(simulation)
    for _ in range(60):
        noise = rng.uniform(-1.0, 1.0, len(place))
        place, velocity = one_step(place, velocity, noise, side)
        simulation.advance(1)
    np.testing.assert_allclose(places(simulation), place, rtol=0, atol=1e-9)
    np.testing.assert_allclose(velocities(simulation), velocity, rtol=0, atol=1e-9)


def test_without_noise_all_headings_become_one() -> None:
    result = flown(job("vicsek", "as_written", ["polarization"], noise=0, n=40))
    assert result.last["polarization"] == pytest.approx(1.0, abs=1e-6)


SIZES = [(40, 3.1), (100, 5), (400, 10)]
"""The numbers of boids of figure 2a, and the sides of their worlds."""


@pytest.mark.parametrize(("n", "side"), SIZES)
def test_at_full_noise_headings_are_independent(n: int, side: float) -> None:
    """Of N independent headings the order has the mean square 1/N, and for large N the
    mean sqrt(pi / (4 N)), less one part in 16 N. Frames are independent too, so the
    mean of 2000 of them is within 4 standard errors, but for one of 16,000 seeds.
    """
    size = {"n": n, "width": side, "height": side}
    noisy = job("vicsek", "as_written", ["polarization"], noise=math.tau, **size)
    order = flown(noisy).series["polarization"][1:]
    mean = math.sqrt(math.pi / (4 * n))
    error = math.sqrt((1 - math.pi / 4) / n / len(order))
    assert abs(order.mean() - mean) < 4 * error + mean / (16 * n)
    # The square is distributed exponentially, for large N: its deviation is its mean.
    assert abs((order**2).mean() * n - 1) < 4 / math.sqrt(len(order))


def test_order_falls_with_noise() -> None:
    size = {"n": 40, "width": 3.1, "height": 3.1}
    orders = [
        flown(job("vicsek", "as_written", ["polarization"], noise=noise, **size)).mean[
            "polarization"
        ]
        for noise in (0, 1, 2, 3, 4, 5, 6)
    ]
    assert orders == sorted(orders, reverse=True)
    assert orders[0] > 0.99
    assert orders[-1] < 0.2


def test_a_boid_alone_turns_by_the_noise() -> None:
    """Uniformly within +-noise / 2. So the mean cosine is 2 sin(noise / 2) / noise, by
    which the heading of a lone boid decays.
    """
    a_job = job("vicsek", "as_written", noise=2, interaction_range=0, steps=50)
    simulation, turns = Simulation(a_job), []
    for _ in range(50):
        before = velocities(simulation)
        simulation.advance(1)
        after = velocities(simulation)
        cross = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
        turns.append(np.arctan2(cross, (before * after).sum(axis=1)))
    cosine, many = np.cos(turns), np.size(turns)
    assert np.abs(turns).max() == pytest.approx(1.0, abs=1e-2)
    assert np.abs(turns).max() <= 1.0 + 1e-12
    assert abs(cosine.mean() - math.sin(1)) < 4 * cosine.std() / math.sqrt(many)
