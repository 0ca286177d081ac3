"""A moving medium: what it does to a flock in one step, and the gusts of a trial."""

import math
from typing import Any

import numpy as np

from kernels.chance import normals
from kernels.robots.purposes import FIRST_GUST, GUST
from kernels.robots.robots import ChanceKeys
from tests.naive.flight import Bird
from tests.naive.rules import Vector, confine


def way_of_step(s: dict[str, Any], keys: ChanceKeys, k: int) -> Vector:
    """The way by which the medium moves in step k, from 0 on: the gust is the sum of
    all random numbers so far, each less by the time since then.
    """
    kept = math.exp(-s["dt"] / s["gust_time"]) if s["gust_time"] > 0 else 0.0
    new = math.sqrt(1.0 - kept * kept)
    gust = kept**k * np.array(normals(keys.made, 0, 0, 0, FIRST_GUST))
    for j in range(k):
        fresh = np.array(normals(keys.flown, j, 0, 0, GUST))
        gust = gust + kept ** (k - 1 - j) * new * fresh
    return (np.array([s["wind_x"], s["wind_y"]]) + s["gust"] * gust) * s["dt"]


def carried(flock: list[Bird], world: Any, way: Vector) -> list[Bird]:
    """The flock after the medium has moved by `way`, and the borders have acted."""
    sides = world.width, world.height
    moved = []
    for bird in flock:
        axes = zip(bird.position + way, bird.velocity, sides, strict=True)
        new = [confine(x, v, side, world.borders) for x, v, side in axes]
        moved.append(Bird(*np.array(new).T))
    return moved
