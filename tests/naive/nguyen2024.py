"""nguyen2024."""

import math
from typing import Any

import numpy as np

from tests.naive.flight import Bird, bordered, neighbours, walk
from tests.naive.rules import Vector, repulsion_unit, shortened, wander


def nguyen2024(
    s: dict[str, Any], world: Any, flock: list[Bird], rng: np.random.Generator
) -> list[Bird]:
    """One step, with the settings `s`, of the section nguyen2024 of the models'
    description.
    """

    def acceleration(flock: list[Bird], i: int) -> Vector:
        me, most, closed = flock[i], s["max_force"], s["range_inclusive"]
        crowd = neighbours(world, flock, i, s["separation_range"], closed)
        peers = neighbours(world, flock, i, s["alignment_range"], closed)
        others = neighbours(world, flock, i, s["cohesion_range"], closed)
        force = np.zeros(2)
        if crowd:
            push = sum(-d / max(math.hypot(*d), 1.0) for _, d in crowd)
            force += s["separation_weight"] * shortened(push, most)
        if peers:
            turn = np.mean([flock[j].velocity for j, _ in peers], axis=0) - me.velocity
            force += s["alignment_weight"] * shortened(turn, most)
        if others:
            force += s["cohesion_weight"] * shortened(
                np.mean([d for _, d in others], axis=0), most
            )
        force += s["wander_weight"] * wander(rng, s["wander_range"])
        repulsion = repulsion_unit(world, None, s["obstacle_range"], *me.position)
        return force + s["obstacle_weight"] * shortened(repulsion, most)

    def new_state(flock: list[Bird], i: int) -> Bird:
        velocity = flock[i].velocity + acceleration(flock, i) * s["dt"]
        position = flock[i].position + s["displacement_factor"] * velocity * s["dt"]
        position, velocity = bordered(world, position, velocity)
        return Bird(position, velocity * (1 - s["drag"]))

    return walk(s, flock, new_state)
