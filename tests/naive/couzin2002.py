"""couzin2002."""

import cmath
import math
from statistics import NormalDist
from typing import Any

import numpy as np

from tests.naive.flight import Bird, angle_between, bordered, neighbours, walk
from tests.naive.rules import Vector


def unit(vector: Vector) -> Vector:
    length = math.hypot(*vector)
    return vector / length if length > 0 else np.zeros(2)


def couzin2002(
    s: dict[str, Any], world: Any, flock: list[Bird], rng: np.random.Generator
) -> list[Bird]:
    """One step, with the settings `s`, of the paper's rules in the plane: headings are
    angles.
    """

    def desired(flock: list[Bird], i: int) -> Vector:
        inner = s["repulsion_range"]
        middle = inner + s["orientation_width"]
        outer = inner + (s["orientation_width"] + s["attraction_width"])
        others = [
            (j, d, math.hypot(*d)) for j, d in neighbours(world, flock, i, outer, False)
        ]
        crowd = [unit(d) for _, d, r in others if r < inner]
        if crowd:
            return -np.sum(crowd, axis=0)
        followed = [
            (j, d, r)
            for j, d, r in others
            if angle_between(d, flock[i].velocity) <= math.radians(s["fov"] / 2)
        ]
        zero = [np.zeros(2)]
        along = np.sum(
            zero + [unit(flock[j].velocity) for j, _, r in followed if r < middle],
            axis=0,
        )
        towards = np.sum(
            zero + [unit(d) for _, d, r in followed if r >= middle], axis=0
        )
        if s["zone_sums"] == "unit_vectors":
            along, towards = unit(along), unit(towards)
        return along + towards

    def new_state(flock: list[Bird], i: int) -> Bird:
        heading = math.atan2(*flock[i].velocity[::-1])
        wanted = desired(flock, i)
        angle = math.atan2(*wanted[::-1]) if wanted.any() else heading
        angle += s["noise"] * NormalDist().inv_cdf(rng.random() + 2.0**-54)
        most = math.radians(s["max_turn"]) * s["dt"]
        turn = math.remainder(angle - heading, math.tau)
        new = cmath.rect(s["max_speed"], heading + max(-most, min(turn, most)))
        velocity = np.array([new.real, new.imag])
        return bordered(world, flock[i].position + s["dt"] * velocity, velocity)

    return walk(s, flock, new_state)
