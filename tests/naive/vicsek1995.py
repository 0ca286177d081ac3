"""vicsek1995."""

import cmath
import math
import operator
from typing import Any

import numpy as np

from tests.naive.flight import Bird, bordered, neighbours, walk


def vicsek1995(
    s: dict[str, Any], world: Any, flock: list[Bird], rng: np.random.Generator
) -> list[Bird]:
    """One step, with the settings `s`, of Eqs. (1) and (2) of the paper: headings are
    angles, and their mean is the angle of the mean of exp(i theta), in which each
    counts by its speed.
    """

    def heading(bird: Bird) -> float:
        return math.atan2(bird.velocity[1], bird.velocity[0])

    def new_state(flock: list[Bird], i: int) -> Bird:
        others = neighbours(world, flock, i, s["interaction_range"], True)
        group = [flock[i], *(flock[j] for j, _ in others)]
        speeds = [math.hypot(*bird.velocity) for bird in group]
        shares = [speed / speeds[0] if speeds[0] else 1.0 for speed in speeds]
        each = [cmath.exp(1j * heading(bird)) for bird in group]
        mean = sum(map(operator.mul, shares, each)) / len(group)
        if s["noise_type"] == "vectorial":
            around = cmath.exp(1j * rng.uniform(-math.pi, math.pi))
            angle = cmath.phase(mean + s["noise"] * around)
        else:
            angle = cmath.phase(mean) + rng.uniform(-s["noise"] / 2, s["noise"] / 2)
        new = s["max_speed"] * np.array([math.cos(angle), math.sin(angle)])
        way = new if s["moves_with"] == "new_heading" else flock[i].velocity
        return bordered(world, flock[i].position + s["dt"] * way, new)

    return walk(s, flock, new_state)
