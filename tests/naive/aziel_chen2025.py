"""aziel_chen2025."""

import math
from typing import Any

import numpy as np

from tests.naive.flight import Bird, bordered, neighbours, walk
from tests.naive.rules import Vector, repulsion_inverse, shortened


def aziel_chen2025(
    s: dict[str, Any],
    world: Any,
    flock: list[Bird],
    rng: np.random.Generator,  # noqa: ARG001
) -> list[Bird]:
    """One step, with the settings `s`, of the section aziel_chen2025 of the models'
    description.
    """

    def forces(flock: list[Bird], i: int) -> list[Vector]:
        me, eps = flock[i], s["epsilon"]
        seen = neighbours(
            world, flock, i, s["perception_range"], s["range_inclusive"], s["fov"]
        )
        crowd = neighbours(world, flock, i, s["separation_range"], s["range_inclusive"])
        crowd = [(j, d) for j, d in crowd if j in dict(seen)]
        separation = s["separation_weight"] * sum((-d for _, d in crowd), np.zeros(2))
        obstacle = s["obstacle_weight"] * repulsion_inverse(
            world, None, s["obstacle_range"], eps, *me.position
        )
        box = np.array([world.width, world.height])
        wall = s["wall_weight"] * (
            1 / (me.position + eps) - 1 / (box - me.position + eps)
        )
        target = s["goal_weight"] * (np.array([s["goal_x"], s["goal_y"]]) - me.position)
        social = [np.zeros(2)] * 2
        if seen:
            alignment = (
                np.mean([flock[j].velocity for j, _ in seen], axis=0) - me.velocity
            )
            social = [
                s["alignment_weight"] * alignment,
                s["cohesion_weight"] * np.mean([d for _, d in seen], axis=0),
            ]
        hard = [obstacle + wall] if s["walls_are_obstacles"] else [obstacle, wall]
        if s["priority"] == "separation_first":
            return [separation, *hard, *social, target]
        return [hard[0], separation, *hard[1:], *social, target]

    def new_state(flock: list[Bird], i: int) -> Bird:
        acceleration, budget = np.zeros(2), s["max_acceleration"]
        for force in forces(flock, i):
            acceleration = acceleration + shortened(force, budget)
            budget = max(budget - math.hypot(*force), 0.0)
        velocity = shortened(flock[i].velocity + acceleration * s["dt"], s["max_speed"])
        return bordered(world, flock[i].position + velocity * s["dt"], velocity)

    return walk(s, flock, new_state)
