"""patel2023."""

from typing import Any

import numpy as np

from tests.naive.flight import Bird, bordered, neighbours, turns
from tests.naive.rules import Vector, clamp_speed, repulsion_linear, turn_back


def patel2023(
    s: dict[str, Any],
    world: Any,
    flock: list[Bird],
    rng: np.random.Generator,  # noqa: ARG001
) -> list[Bird]:
    """One step, with the settings `s`, of the section patel2023 of the models'
    description.
    """

    def moved(bird: Bird) -> Bird:
        velocity = clamp_speed(*bird.velocity, s["min_speed"], s["max_speed"])
        return bordered(world, bird.position + velocity * s["dt"], velocity)

    def steered(flock: list[Bird], i: int) -> Bird:
        position, v = flock[i]
        crowd, peers, others = (
            neighbours(world, flock, i, s[f"{rule}_range"], s["range_inclusive"])
            for rule in ("separation", "alignment", "cohesion")
        )
        v = v + s["dt"] * s["separation_weight"] * sum(
            (-d for _, d in crowd), np.zeros(2)
        )
        if peers:
            v = v + s["dt"] * s["alignment_weight"] * (
                np.mean([flock[j].velocity for j, _ in peers], axis=0) - v
            )
        if others:
            v = v + s["dt"] * s["cohesion_weight"] * np.mean(
                [d for _, d in others], axis=0
            )
        v = v + s["dt"] * border(position, v)
        return Bird(
            position,
            v
            + s["dt"]
            * s["obstacle_weight"]
            * repulsion_linear(world, None, s["obstacle_range"], *position),
        )

    def border(position: Vector, velocity: Vector) -> Vector:
        back = np.array(
            [
                turn_back(p, side, s["border_margin"])
                for p, side in zip(position, (world.width, world.height), strict=True)
            ]
        )
        added = {
            "always": velocity,
            "in_margin": velocity * (back != 0),
            "never": 0 * velocity,
        }
        return added[s["border_adds_velocity"]] + s["border_turn"] * back

    if s["update"] == "synchronous":
        gone = [moved(flock[i]) for i in turns(s, flock)]
        return [steered(gone, i) for i in turns(s, gone)]
    flock = list(flock)
    for i in turns(s, flock):
        flock[i] = moved(flock[i])
        flock[i] = steered(flock, i)
    return flock
