"""cucker_smale2007."""

import math
from typing import Any

import numpy as np

from tests.naive.flight import Bird, bordered, neighbours, walk


def cucker_smale2007(
    s: dict[str, Any], world: Any, flock: list[Bird], _rng: np.random.Generator
) -> list[Bird]:
    """One step, with the settings `s`: the graph Laplacian of the weights, of which a
    boid has a row, on the velocities.
    """

    def new_state(flock: list[Bird], i: int) -> Bird:
        weights = np.zeros(len(flock))
        for j, d in neighbours(world, flock, i, s["interaction_range"], True):
            span = math.hypot(s["decay_length"], *d)
            weights[j] = s["strength"] / span ** (2 * s["exponent"])
        if s["weights"] == "mean":
            weights /= len(flock)
        velocities = np.array([bird.velocity for bird in flock])
        row = -weights
        row[i] += weights.sum()
        velocity = velocities[i] - s["dt"] * (row @ velocities)
        place = flock[i].position + s["dt"] * flock[i].velocity
        return bordered(world, place, velocity)

    return walk(s, flock, new_state)
