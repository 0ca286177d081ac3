"""Flocking of a comparison of frameworks: against a slow twin, in random order."""

import re
from itertools import permutations

import numpy as np
import pytest

from examples import flocking_time
from sweep.trial.simulation import Simulation
from tests.commands import run_trials_here
from tests.examples.flown import job, places

LENGTHS = {"small": 100.0, "large": 150.0}
RANGES = {"small": 5.0, "large": 15.0}


def velocities(simulation: Simulation) -> np.ndarray:
    return np.column_stack([simulation.flock.vx, simulation.flock.vy])


def order(simulation: Simulation) -> np.ndarray:
    """The boids in the order in which they acted in the last step."""
    return simulation.flight.work.state[0].astype(int)


def act(place: np.ndarray, velocity: np.ndarray, i: int, size: str) -> None:
    """One turn, as the declaration has it, with the nearest image of each boid."""
    length = LENGTHS[size]
    way = place - place[i]
    way -= length * np.round(way / length)
    distance = np.hypot(*way.T)
    seen = (distance <= RANGES[size]) & (np.arange(len(place)) != i)
    near = seen & (distance < 1.0)
    turned = 0.03 * way[seen].sum(axis=0) - 0.015 * way[near].sum(axis=0)
    turned += 0.05 * velocity[seen].sum(axis=0)
    new = velocity[i] + turned / max(seen.sum(), 1)
    velocity[i] = new / np.hypot(*new)
    place[i] = (place[i] + velocity[i]) % length


@pytest.mark.parametrize("size", ["small", "large"])
def test_it_does_what_its_slow_twin_does(size: str) -> None:
    """Sums in another order err by 1e-14, and grow little within 20 steps."""
    simulation = Simulation(job("flocking", size, steps=20))
    assert len(places(simulation)) == {"small": 200, "large": 400}[size]
    place, velocity = places(simulation), velocities(simulation)
    begun = velocity.copy()
    for _ in range(20):
        simulation.advance(1)
        for i in order(simulation):
            act(place, velocity, i, size)
    away = places(simulation) - place
    away -= LENGTHS[size] * np.round(away / LENGTHS[size])
    np.testing.assert_allclose(away, 0.0, atol=1e-9)
    np.testing.assert_allclose(velocities(simulation), velocity, atol=1e-9)
    assert np.abs(velocity - begun).max() > 0.5


def test_velocities_are_unit_vectors() -> None:
    simulation = Simulation(job("flocking", "small", steps=3))
    for _ in range(4):
        speeds = np.hypot(*velocities(simulation).T)
        np.testing.assert_allclose(speeds, 1.0, rtol=1e-12)
        simulation.advance(1)


def test_every_order_of_three_is_equally_frequent() -> None:
    """The number of an order of 1200 is binomial: 200 with a standard deviation of 13.
    Five of them are exceeded for one of six orders in 1 of 300,000 cases.
    """
    simulation = Simulation(job("flocking", "small", n=3, steps=1200))
    counts = dict.fromkeys(permutations(range(3)), 0)
    for _ in range(1200):
        simulation.advance(1)
        counts[tuple(order(simulation).tolist())] += 1
    assert sum(counts.values()) == 1200
    assert all(abs(count - 200) < 65 for count in counts.values())


def test_the_script_prints_a_line_per_size(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """With two trials. The times are no test."""
    run_trials_here(monkeypatch)
    monkeypatch.setattr(flocking_time, "TRIALS", 2)
    flocking_time.main()
    line = r"boidsweep Flocking-{} \(ms\): \d+\.\d{{3}}\n"
    lines = line.format("small") + line.format("large")
    assert re.fullmatch(lines, capsys.readouterr().out)
