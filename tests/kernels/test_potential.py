"""The pair potential of a model is that of its own rules."""

from typing import Any

import numpy as np
import pytest

from kernels.catalogue import BUILT_IN
from kernels.metrics.energy import _boid_potential
from kernels.models import MODELS
from sweep.spec.settings import settings_of
from sweep.trial.simulation import Simulation
from tests import builders

N, SHIFT = 12, 1e-4


def drawn(seed: int) -> np.ndarray:
    """Positions (2, N) in the middle of a world, near enough for both rules."""
    return np.random.default_rng(seed).normal(600.0, 25.0, (2, N))


def at_rest(model: str, positions: np.ndarray, **changes: Any) -> Simulation:
    """A simulation of one step in which boids at rest feel separation and cohesion
    alone, as nothing else acts.
    """
    quiet = builders.isotropic(model) | {
        "alignment_weight": 0,
        "min_speed": 0,
        "max_speed": 1e9,
    }
    world = {"width": 1200, "height": 1200, "n": N, "steps": 1, "update": "synchronous"}
    simulation = Simulation(builders.job(model, **world, **quiet, **changes))
    return builders.place(simulation, *positions, np.zeros(N), np.zeros(N))


def gradient(rule: Any, positions: np.ndarray, i: int) -> np.ndarray:
    """That of boid `i`'s potential by its own position, by central differences."""
    slopes = []
    for axis in (0, 1):
        sides = []
        for shift in (SHIFT, -SHIFT):
            moved = positions.copy()
            moved[axis, i] += shift
            sides.append(_boid_potential(rule, moved[0], moved[1], i))
        slopes.append((sides[0] - sides[1]) / (2 * SHIFT))
    return np.array(slopes)


WITH_POTENTIAL = [model for model in MODELS if MODELS[model].pair_potential]
CASES = [
    (
        model,
        {"protected_count_once": once}
        if "protected_count_once" in settings_of(model, BUILT_IN)
        else {},
    )
    for model in WITH_POTENTIAL
    for once in (True, False)
    if once or "protected_count_once" in settings_of(model, BUILT_IN)
]


@pytest.mark.parametrize(("model", "changes"), CASES)
def test_its_gradient_is_minus_the_acceleration_of_separation_and_cohesion(
    model: str, changes: dict[str, Any]
) -> None:
    """The potential is a parabola in pieces, so central differences only round: 1e-13
    of some 100, over 1e-4.

    A neighbour at a distance within 1e-4 px of a range would jump; the fixed seeds have
    none.
    """
    met = []
    for seed in range(5):
        positions = drawn(seed)
        simulation = at_rest(model, positions, **changes)
        rule = simulation.flight.ground.potential
        builders.to_end(simulation)
        for i in range(N):
            acceleration = np.array([simulation.flock.vx[i], simulation.flock.vy[i]])
            np.testing.assert_allclose(
                -gradient(rule, positions, i), acceleration, rtol=0, atol=1e-7
            )
            met.append(np.hypot(*acceleration) > 1e-3)
    assert np.mean(met) > 0.9
