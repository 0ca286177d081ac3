"""nanobot."""

from typing import Any

import numpy as np

from tests.naive.flight import Bird, bordered, neighbours, walk
from tests.naive.rules import clamp_speed, turn_back


def nanobot(
    s: dict[str, Any],
    world: Any,
    flock: list[Bird],
    rng: np.random.Generator,  # noqa: ARG001
) -> list[Bird]:
    """One step, with the settings `s`, of the document's pseudocode."""

    def new_state(flock: list[Bird], i: int) -> Bird:
        (position, v), dt = flock[i], s["dt"]
        crowd = neighbours(world, flock, i, s["separation_range"], False)
        others = neighbours(world, flock, i, s["perception_range"], False)
        if s["protected_count_once"]:
            others = [(j, d) for j, d in others if j not in dict(crowd)]
        if others:
            v = v + dt * s["cohesion_weight"] * np.mean([d for _, d in others], axis=0)
            v = v + dt * s["alignment_weight"] * (
                np.mean([flock[j].velocity for j, _ in others], axis=0) - v
            )
        for _, d in crowd:
            v = v - dt * s["separation_weight"] * d
        sides = zip(position, (world.width, world.height), strict=True)
        v = v + dt * s["border_turn"] * np.array(
            [turn_back(p, side, s["border_margin"]) for p, side in sides]
        )
        v = clamp_speed(*v, s["min_speed"], s["max_speed"])
        return bordered(world, position + dt * v, v)

    return walk(s, flock, new_state)
