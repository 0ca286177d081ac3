"""Slow twins of the kernels, written for the eye: plain loops, NumPy where it reads better, no cell grid.

Every public kernel of kernels/rules and kernels/arbitration has a twin of the same name and the same arguments; every
model one that takes a single step; every metric one in METRICS, from the six rows of one frame to a number.
"""

import math
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np

from kernels.settings import BOUNDED, TORUS

Vector = np.ndarray


def limit(x: float, y: float, most: float) -> Vector:
    return shortened(np.array([x, y]), most)


def shortened(force: Vector, most: float) -> Vector:
    length = math.hypot(*force)
    return force * (most / length) if length > most else force


def serve(ax: float, ay: float, x: float, y: float, budget: float) -> tuple[float, float, float]:
    part = shortened(np.array([x, y]), budget)
    return ax + part[0], ay + part[1], max(budget - math.hypot(x, y), 0.0)


def within(near: Any, found: int, range2: float) -> tuple[Vector, Vector]:
    """Indices (K,) and displacements (K, 2) of the first `found` neighbours that are nearer than sqrt(range2)."""
    close = near.distance2[:found] < range2
    return near.boid[:found][close], np.column_stack([near.dx, near.dy])[:found][close]


def separation_unit(near: Any, found: int, range2: float) -> Vector:
    _, towards = within(near, found, range2)
    lengths = np.linalg.norm(towards, axis=1)
    return (-towards / np.maximum(lengths, 1.0)[:, None]).sum(axis=0)


def alignment(seen: Any, i: int, near: Any, found: int, range2: float) -> Vector:
    others, _ = within(near, found, range2)
    velocities = np.column_stack([seen.vx, seen.vy])
    return velocities[others].mean(axis=0) - velocities[i] if len(others) else np.zeros(2)


def cohesion(near: Any, found: int, range2: float) -> Vector:
    _, towards = within(near, found, range2)
    return towards.mean(axis=0) if len(towards) else np.zeros(2)


def flocking_sums(seen: Any, near: Any, found: int, crowd2: float) -> Vector:
    others, towards = within(near, found, math.inf)
    velocities = np.column_stack([seen.vx, seen.vy])[others]
    return np.concatenate([within(near, found, crowd2)[1].sum(axis=0), towards.sum(axis=0), velocities.sum(axis=0)])


def wander(rng: np.random.Generator, width: float) -> Vector:
    return rng.uniform(-width, width, 2)


def confine(position: float, velocity: float, length: float, borders: int) -> tuple[float, float]:
    if borders == TORUS and not 0.0 <= position < length:
        return position + math.copysign(length, -position), velocity
    if borders == BOUNDED and not 0.0 <= position <= length:
        return (-position if position < 0.0 else 2.0 * length - position), -velocity
    return position, velocity


def away_from_obstacles(world: Any, margin: float, x: float, y: float) -> Iterator[tuple[Vector, float]]:
    """Unit vector away from, and distance to, the centre of each obstacle within `margin` of its size."""
    rows = zip(world.obstacle_x, world.obstacle_y, world.half_width, world.half_height, strict=True)
    for centre_x, centre_y, half_width, half_height in rows:
        away = np.array([x - centre_x, y - centre_y])
        distance = math.hypot(*away)
        if 0.0 < distance < max(half_width, half_height) + margin:
            yield away / distance, distance


def repulsion_unit(world: Any, reach: Any, margin: float, x: float, y: float) -> Vector:  # noqa: ARG001
    return sum((unit for unit, _ in away_from_obstacles(world, margin, x, y)), np.zeros(2))


def repulsion_inverse(world: Any, reach: Any, margin: float, epsilon: float, x: float, y: float) -> Vector:  # noqa: ARG001
    forces = (unit / (distance + epsilon) for unit, distance in away_from_obstacles(world, margin, x, y))
    return sum(forces, np.zeros(2))


def wall_repulsion(position: float, length: float, epsilon: float) -> float:
    return 1.0 / (position + epsilon) - 1.0 / (length - position + epsilon)


def displacement(world: Any, position: Vector, other: Vector) -> Vector:
    """From a position to another, on a torus that is seen across its borders the short way round."""
    d, box = other - position, np.array([world.width, world.height])
    return d - box * np.sign(d) * (np.abs(d) > box / 2) if world.minimum_image else d


def angle_between(a: Vector, b: Vector) -> float:
    """Radians in [0, pi]; 0 where a vector has no direction."""
    if not a.any() or not b.any():
        return 0.0
    return abs(math.remainder(math.atan2(a[1], a[0]) - math.atan2(b[1], b[0]), math.tau))


class Bird(NamedTuple):
    """One boid as the model twins see it."""

    position: Vector
    velocity: Vector


def birds(flock: Any) -> list[Bird]:
    return [Bird(np.array([x, y]), np.array([vx, vy])) for x, y, vx, vy in zip(*flock[:4], strict=True)]


def neighbours(
    world: Any, flock: list[Bird], i: int, reach: float, inclusive: bool, fov: float = 360.0, slack: float = 0.0
) -> list[tuple[int, Vector]]:
    """Index of, and displacement to, those that boid `i` sees; `slack` widens range and half angle (radians)."""
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


def walk(flock: list[Bird], update: str, new_state: Callable[[list[Bird], int], Bird]) -> list[Bird]:
    """The flock after every boid took its new state, seeing those before it in their new states, or not."""
    if update == "synchronous":
        return [new_state(flock, i) for i in range(len(flock))]
    flock = list(flock)
    for i in range(len(flock)):
        flock[i] = new_state(flock, i)
    return flock


def bordered(world: Any, position: Vector, velocity: Vector) -> Bird:
    pairs = zip(position, velocity, (world.width, world.height), strict=True)
    x, y = (confine(p, v, length, world.borders) for p, v, length in pairs)
    return Bird(np.array([x[0], y[0]]), np.array([x[1], y[1]]))


def nguyen2024(s: dict[str, Any], world: Any, flock: list[Bird], rng: np.random.Generator) -> list[Bird]:
    """One step, with the settings `s`, of the section nguyen2024 of the models' description."""

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
            force += s["cohesion_weight"] * shortened(np.mean([d for _, d in others], axis=0), most)
        force += s["wander_weight"] * wander(rng, s["wander_range"])
        repulsion = repulsion_unit(world, None, s["obstacle_range"], *me.position)
        return force + s["obstacle_weight"] * shortened(repulsion, most)

    def new_state(flock: list[Bird], i: int) -> Bird:
        velocity = flock[i].velocity + acceleration(flock, i) * s["dt"]
        position = flock[i].position + s["displacement_factor"] * velocity * s["dt"]
        position, velocity = bordered(world, position, velocity)
        return Bird(position, velocity * (1 - s["drag"]))

    return walk(flock, s["update"], new_state)


def aziel_chen2025(s: dict[str, Any], world: Any, flock: list[Bird], rng: np.random.Generator) -> list[Bird]:  # noqa: ARG001
    """One step, with the settings `s`, of the section aziel_chen2025 of the models' description."""

    def forces(flock: list[Bird], i: int) -> list[Vector]:
        me, eps = flock[i], s["epsilon"]
        seen = neighbours(world, flock, i, s["perception_range"], s["range_inclusive"], s["fov"])
        crowd = neighbours(world, flock, i, s["separation_range"], s["range_inclusive"])
        crowd = [(j, d) for j, d in crowd if j in dict(seen)]
        separation = s["separation_weight"] * sum((-d for _, d in crowd), np.zeros(2))
        obstacle = s["obstacle_weight"] * repulsion_inverse(world, None, s["obstacle_range"], eps, *me.position)
        box = np.array([world.width, world.height])
        wall = s["wall_weight"] * (1 / (me.position + eps) - 1 / (box - me.position + eps))
        target = s["target_weight"] * (np.array([s["target_x"], s["target_y"]]) - me.position)
        social = [np.zeros(2)] * 2
        if seen:
            alignment = np.mean([flock[j].velocity for j, _ in seen], axis=0) - me.velocity
            social = [s["alignment_weight"] * alignment, s["cohesion_weight"] * np.mean([d for _, d in seen], axis=0)]
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

    return walk(flock, s["update"], new_state)


def inside_any(world: Any, x: float, y: float) -> bool:
    across, along = np.abs(x - world.obstacle_x), np.abs(y - world.obstacle_y)
    disc = across**2 + along**2 < world.half_width**2
    return bool(np.where(world.is_round, disc, (across < world.half_width) & (along < world.half_height)).any())


def blocked(world: Any, rows: int, columns: int) -> Vector:
    return np.array([[inside_any(world, column, row) for column in range(columns)] for row in range(rows)])


def visits(positions: Vector, radius: float, stamp: bool, rows: int, columns: int) -> Vector:
    """How many footprints at `positions` (K, 2) cover each pixel."""
    row, column = np.mgrid[0:rows, 0:columns]
    counts = np.zeros((rows, columns), int)
    for x, y in np.trunc(positions) if stamp else positions:
        counts += (column - x) ** 2 + (row - y) ** 2 <= radius**2
    return counts


def from_centre(bodies: Vector) -> Vector:
    return np.hypot(*(bodies[:2] - bodies[:2].mean(axis=1, keepdims=True)))


def turns(bodies: Vector) -> Vector:
    moving = bodies[2:4].any(axis=0) & bodies[4:6].any(axis=0)
    headings = np.degrees(np.arctan2(bodies[[3, 5]], bodies[[2, 4]]))
    return np.where(moving, np.abs(headings[0] - headings[1]), 0.0)


def polarization(bodies: Vector) -> float:
    speed = np.hypot(*bodies[2:4])
    unit = np.divide(bodies[2:4], speed, out=np.zeros((2, speed.size)), where=speed > 0)
    return math.hypot(*unit.mean(axis=1))


def distances(bodies: Vector) -> Vector:
    return np.hypot(*(bodies[:2, :, None] - bodies[:2, None, :]))


def nearest(bodies: Vector) -> float:
    apart = distances(bodies) + np.diag(np.full(bodies.shape[1], np.inf))
    return float(apart.min(axis=1).mean()) if bodies.shape[1] > 1 else math.nan


def flock_sizes(bodies: Vector, reach: float) -> list[int]:
    """Sizes of the connected components, found by visiting every boid's neighbours in turn."""
    linked, left, sizes = distances(bodies) < reach, set(range(bodies.shape[1])), []
    while left:
        frontier = {left.pop()}
        size = 0
        while frontier:
            i = frontier.pop()
            size += 1
            reached = {j for j in left if linked[i, j]}
            left -= reached
            frontier |= reached
        sizes.append(size)
    return sizes


def variation(counts: Vector, ground: Any, ddof: int) -> float:
    """The coefficient of variation of visit counts with the given number, sum and sum of squares."""
    mean = counts[1] / ground.traversable
    return (
        math.sqrt((counts[2] / ground.traversable - mean**2) * ground.traversable / (ground.traversable - ddof)) / mean
    )


METRICS: dict[str, Callable[[Vector, Vector, Any, Any], float]] = {
    "speed": lambda bodies, *_: np.hypot(*bodies[2:4]).mean(),
    "flock_radius": lambda bodies, *_: from_centre(bodies).mean(),
    "turn_rate": lambda bodies, *_: np.minimum(turns(bodies), 360 - turns(bodies)).mean(),
    "turn_rate_unwrapped": lambda bodies, *_: turns(bodies).mean(),
    "dispersion": lambda bodies, *_: from_centre(bodies).std(),
    "polarization": lambda bodies, *_: polarization(bodies),
    "nearest_neighbour_distance": lambda bodies, *_: nearest(bodies),
    "flock_count": lambda bodies, _counts, _ground, seen: len(flock_sizes(bodies, seen.flock_range)),
    "largest_flock": lambda bodies, _counts, _ground, seen: max(flock_sizes(bodies, seen.flock_range)),
    "coverage": lambda _, counts, ground, _seen: 100 * counts[0] / ground.traversable,
    "coverage_total": lambda _, counts, ground, _seen: 100 * counts[0] / ground.pixels,
    "coverage_cv": lambda _, counts, ground, seen: variation(counts, ground, seen.coverage_cv_ddof),
    "escapes": lambda _, counts, *_rest: counts[3],
    "collisions": lambda _, counts, *_rest: counts[4],
}
