"""vicsek1995."""

import cmath
import math
from typing import Any

import numpy as np

from tests.naive.flight import Bird, bordered, neighbours, walk


def vicsek1995(
    s: dict[str, Any], world: Any, flock: list[Bird], rng: np.random.Generator
) -> list[Bird]:
    """One step, with the settings `s`, of Eqs. (1) and (2) of the paper: headings are
    angles, and their mean is the angle of the mean of exp(i theta).
    """

    def heading(bird: Bird) -> float:
        return math.atan2(bird.velocity[1], bird.velocity[0])

    def new_state(flock: list[Bird], i: int) -> Bird:
        others = neighbours(world, flock, i, s["interaction_range"], True)
        group = [flock[i], *(flock[j] for j, _ in others)]
        mean = sum(cmath.exp(1j * heading(bird)) for bird in group) / len(group)
        if s["noise_type"] == "vectorial":
            around = cmath.exp(1j * rng.uniform(-math.pi, math.pi))
            angle = cmath.phase(mean + s["noise"] * around)
        else:
            angle = cmath.phase(mean) + rng.uniform(-s["noise"] / 2, s["noise"] / 2)
        new = s["max_speed"] * np.array([math.cos(angle), math.sin(angle)])
        way = new if s["moves_with"] == "new_heading" else flock[i].velocity
        return bordered(world, flock[i].position + s["dt"] * way, new)

    return walk(flock, s["update"], new_state)
