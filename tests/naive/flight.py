"""What the twins of models share: birds, who sees whom, and the order of updates."""

import math
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np

from tests.naive.rules import Vector, confine


def displacement(world: Any, position: Vector, other: Vector) -> Vector:
    """From a position to another, on a torus that is seen across its borders the short
    way round.
    """
    d, box = other - position, np.array([world.width, world.height])
    return d - box * np.sign(d) * (np.abs(d) > box / 2) if world.minimum_image else d


def angle_between(a: Vector, b: Vector) -> float:
    """Radians in [0, pi]; 0 where a vector has no direction."""
    if not a.any() or not b.any():
        return 0.0
    return abs(
        math.remainder(math.atan2(a[1], a[0]) - math.atan2(b[1], b[0]), math.tau)
    )


class Bird(NamedTuple):
    """One boid as the model twins see it."""

    position: Vector
    velocity: Vector


def birds(flock: Any) -> list[Bird]:
    return [
        Bird(np.array([x, y]), np.array([vx, vy]))
        for x, y, vx, vy in zip(*flock[:4], strict=True)
    ]


def neighbours(
    world: Any,
    flock: list[Bird],
    i: int,
    reach: float,
    inclusive: bool,
    fov: float = 360.0,
    slack: float = 0.0,
) -> list[tuple[int, Vector]]:
    """Index of, and displacement to, those that boid `i` sees; `slack` widens range and
    half angle (radians).
    """
    seen = []
    for j, other in enumerate(flock):
        d = displacement(world, flock[i].position, other.position)
        distance = math.sqrt(d[0] * d[0] + d[1] * d[1])
        near = distance <= reach + slack if inclusive else distance < reach + slack
        half = math.radians(fov / 2)
        ahead = fov >= 360.0 or angle_between(d, flock[i].velocity) <= half + slack
        if j != i and near and ahead:
            seen.append((j, d))
    return seen


class OfRobots(dict[str, Any]):
    """Settings of robots that differ: whoever reads one gets that of the robot whose
    turn it is. `own` has those that differ, (N,) each.
    """

    def __init__(self, settings: dict[str, Any], own: dict[str, Any]) -> None:
        super().__init__(settings)
        self.own, self.turn = own, 0

    def __getitem__(self, name: str) -> Any:
        if name in self.own:
            return float(self.own[name][self.turn])
        return super().__getitem__(name)


def turns(s: dict[str, Any], flock: list[Any]) -> Iterator[int]:
    """The index of each boid in its turn."""
    for i in range(len(flock)):
        if isinstance(s, OfRobots):
            s.turn = i
        yield i


def walk(
    s: dict[str, Any], flock: list[Bird], new_state: Callable[[list[Bird], int], Bird]
) -> list[Bird]:
    """The flock after every boid took its new state, seeing those before it in their
    new states, or not.
    """
    if s["update"] == "synchronous":
        return [new_state(flock, i) for i in turns(s, flock)]
    flock = list(flock)
    for i in turns(s, flock):
        flock[i] = new_state(flock, i)
    return flock


def bordered(world: Any, position: Vector, velocity: Vector) -> Bird:
    pairs = zip(position, velocity, (world.width, world.height), strict=True)
    x, y = (confine(p, v, length, world.borders) for p, v, length in pairs)
    return Bird(np.array([x[0], y[0]]), np.array([x[1], y[1]]))
