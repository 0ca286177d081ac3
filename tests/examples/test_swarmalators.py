"""Swarmalators: against a slow twin, a solver of equations, and their known states."""

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sweep.trial.simulation import Simulation
from tests.cases import slow_but
from tests.examples.flown import flown, job, places

METRICS = ("./phase_order.py", "speed")


def phases(simulation: Simulation) -> np.ndarray:
    return simulation.flight.work.state[0].copy()


def rates(
    place: np.ndarray, phase: np.ndarray, j: float, k: float
) -> tuple[np.ndarray, np.ndarray]:
    """Eqs. (3) and (4): x' (N, 2) and theta' (N,)."""
    velocity, turn = np.zeros_like(place), np.zeros_like(phase)
    for i in range(len(place)):
        for other in set(range(len(place))) - {i}:
            way = place[other] - place[i]
            distance, ahead = math.hypot(*way), phase[other] - phase[i]
            velocity[i] += way / distance * (1 + j * math.cos(ahead))
            velocity[i] -= way / distance**2
            turn[i] += k * math.sin(ahead) / distance
    return velocity / len(place), turn / len(place)


def test_it_does_what_its_slow_twin_does() -> None:
    a_job = job("swarmalators", "active_phase_wave", n=12, steps=20)
    simulation = Simulation(a_job)
    place, phase = places(simulation), phases(simulation)
    assert np.ptp(phase) > 3
    for _ in range(20):
        velocity, turn = rates(place, phase, 1.0, -0.75)
        place, phase = place + 0.1 * velocity, phase + 0.1 * turn
        simulation.advance(1)
    np.testing.assert_allclose(places(simulation), place, rtol=0, atol=1e-11)
    np.testing.assert_allclose(phases(simulation), phase, rtol=0, atol=1e-11)


def test_two_of_them_follow_their_equations() -> None:
    """For the distance d and the difference D of phases: d' = 1/d - 1 - J cos D, and
    D' = -K sin(D) / d. A step errs by dt^2, so half the step halves the error.
    """

    def pair(_time: float, state: Any) -> list[float]:
        d, ahead = state
        return [1 / d - 1 - 0.5 * math.cos(ahead), -0.7 * math.sin(ahead) / d]

    errors = []
    for dt in (0.02, 0.01):
        fixed = {"n": 2, "steps": 200, "dt": dt, "likeness": 0.5, "coupling": 0.7}
        simulation = Simulation(job("swarmalators", "static_sync", **fixed))
        first, second = places(simulation)
        begin = [math.dist(first, second), np.diff(phases(simulation))[0]]
        exact = solve_ivp(pair, (0, 2), begin, rtol=1e-10, atol=1e-12).y[:, -1]
        simulation.advance(round(2 / dt))
        found = [math.dist(*places(simulation)), np.diff(phases(simulation))[0]]
        errors.append(found - exact)
    assert np.abs(errors[0]).max() < 0.02
    np.testing.assert_allclose(errors[0] / errors[1], 2, atol=0.2)


def test_two_of_them_end_together_at_a_fixed_distance() -> None:
    """1 / (1 + J), where each step leaves 1 - K (1 + J) dt of the difference of their
    phases: it falls exponentially.
    """
    fixed = {"n": 2, "steps": 1000, "likeness": 0.5, "coupling": 0.1}
    simulation = Simulation(job("swarmalators", "static_sync", **fixed))
    simulation.advance(900)
    before = np.diff(phases(simulation))[0]
    simulation.advance(1)
    after = np.diff(phases(simulation))[0]
    assert math.dist(*places(simulation)) == pytest.approx(1 / 1.5, rel=1e-9)
    assert after / before == pytest.approx(1 - 0.1 * 1.5 * 0.1, rel=1e-6)


PRESETS = {
    "static_sync": ((0.999, 1.0), (0.0, 0.2)),
    "static_async": ((0.0, 0.1), (0.0, 0.2)),
    "static_phase_wave": ((0.0, 0.3), (0.95, 1.0)),
    "splintered_phase_wave": ((0.0, 0.2), (0.7, 1.0)),
    "active_phase_wave": ((0.0, 0.2), (0.4, 0.95)),
}
"""The states, with bounds of the coherence of phases and of the wave S."""


@pytest.mark.parametrize(
    "preset", slow_but(["static_phase_wave", "active_phase_wave"], PRESETS)
)
def test_the_states_of_the_paper_come_about(preset: str) -> None:
    """Where J and K are those of its figures, and nothing moves in a static state."""
    mean = flown(job("swarmalators", preset, METRICS)).mean
    bounds = zip(("phase_coherence", "phase_wave"), PRESETS[preset], strict=True)
    for metric, (low, high) in bounds:
        assert low <= mean[metric] <= high + 1e-12, metric
    assert (mean["speed"] < 0.005) == preset.startswith("static")


@pytest.mark.parametrize("preset", slow_but(["active_phase_wave"], PRESETS))
def test_the_mean_phase_and_the_centre_stay(preset: str) -> None:
    """What one does to another, the other does to it, in places and in phases."""
    simulation = Simulation(job("swarmalators", preset, max_speed=1e6))
    before = places(simulation).mean(axis=0), phases(simulation).mean()
    simulation.advance(300)
    assert phases(simulation).mean() == pytest.approx(before[1], abs=1e-10)
    np.testing.assert_allclose(places(simulation).mean(axis=0), before[0], atol=1e-10)


def test_phases_without_a_coupling_stay_what_they_were() -> None:
    simulation = Simulation(job("swarmalators", "static_phase_wave"))
    before = phases(simulation)
    simulation.advance(200)
    np.testing.assert_array_equal(phases(simulation), before)


def test_metrics_are_lengths_of_means_on_the_circle() -> None:
    a_job = job("swarmalators", "active_phase_wave", METRICS, steps=5)
    simulation, series = Simulation(a_job), flown(a_job).series
    simulation.advance(3)
    phase, place = phases(simulation), places(simulation)
    angle = np.arctan2(*(place - place.mean(axis=0)).T[::-1])
    waves = [abs(np.exp(1j * (angle + side * phase)).mean()) for side in (1, -1)]
    coherence = abs(np.exp(1j * phase).mean())
    assert series["phase_coherence"][3] == pytest.approx(coherence, abs=1e-12)
    assert series["phase_wave"][3] == pytest.approx(max(waves), abs=1e-12)
