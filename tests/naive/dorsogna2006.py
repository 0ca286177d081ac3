"""dorsogna2006."""

import math
from typing import Any

import numpy as np

from tests.naive.flight import Bird, bordered, neighbours, walk
from tests.naive.rules import Vector


def dorsogna2006(
    s: dict[str, Any], world: Any, flock: list[Bird], _rng: np.random.Generator
) -> list[Bird]:
    """One step, with the settings `s`: the force is the slope of the potential by
    Eq. (3), and the propulsion a speed that follows the logistic curve.
    """

    def slope(r: float) -> float:
        repulsion, attraction = (
            s[f"{kind}_strength"]
            * math.exp(-r / s[f"{kind}_length"])
            / s[f"{kind}_length"]
            for kind in ("repulsion", "attraction")
        )
        return attraction - repulsion

    def propelled(velocity: Vector) -> Vector:
        """Half a step of e' = 2 e (alpha - beta e) / m for e = |v|^2."""
        square = float(velocity @ velocity)
        if square == 0.0:
            return velocity
        most = s["propulsion"] / s["friction"]
        growth = math.exp(s["propulsion"] * s["dt"] / s["mass"])
        grown = most / (1.0 + (most / square - 1.0) / growth)
        return velocity * math.sqrt(grown / square)

    def new_state(flock: list[Bird], i: int) -> Bird:
        force = np.zeros(2)
        for _, d in neighbours(world, flock, i, s["interaction_range"], True):
            if (r := float(np.hypot(*d))) > 0:
                force += slope(r) * d / r
        velocity = propelled(flock[i].velocity) + s["dt"] * force / s["mass"]
        velocity = propelled(velocity)
        return bordered(world, flock[i].position + s["dt"] * velocity, velocity)

    return walk(s, flock, new_state)
