"""The twins of metrics."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from tests.naive.flight import angle_between
from tests.naive.rules import Vector


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


def angular_momentum(bodies: Vector) -> float:
    """By complex numbers: the sine of the angle from the bearing to the heading."""
    bearing = (bodies[0] - bodies[0].mean()) + 1j * (bodies[1] - bodies[1].mean())
    turned = np.conj(bearing) * (bodies[2] + 1j * bodies[3])
    return abs(np.mean(np.where(turned == 0, 0.0, np.sin(np.angle(turned)))))


def algebraic_connectivity(bodies: Vector, reach: float) -> float:
    """From all eigenvalues; 0 where the graph is not connected."""
    if bodies.shape[1] == 1:
        return math.nan
    if len(flocks(bodies, reach)) > 1:
        return 0.0
    joined = (apart(bodies) < reach).astype(float)
    laplacian = np.diag(joined.sum(axis=1)) - joined
    return float(np.linalg.eigvalsh(laplacian)[1])


def distances(bodies: Vector) -> Vector:
    return np.hypot(*(bodies[:2, :, None] - bodies[:2, None, :]))


def apart(bodies: Vector) -> Vector:
    """Distances from others: infinite from oneself."""
    return distances(bodies) + np.diag(np.full(bodies.shape[1], np.inf))


def nearest(bodies: Vector) -> float:
    found = apart(bodies).min(axis=1)
    return float(found.mean()) if bodies.shape[1] > 1 else math.nan


def flocks(bodies: Vector, reach: float) -> list[list[int]]:
    """The connected components, found by visiting every boid's neighbours in turn."""
    linked, left, found = distances(bodies) < reach, set(range(bodies.shape[1])), []
    while left:
        frontier = {left.pop()}
        members = []
        while frontier:
            i = frontier.pop()
            members.append(i)
            reached = {j for j in left if linked[i, j]}
            left -= reached
            frontier |= reached
        found.append(sorted(members))
    return found


def flock_sizes(bodies: Vector, reach: float) -> list[int]:
    return [len(flock) for flock in flocks(bodies, reach)]


def elongation(bodies: Vector, reach: float) -> float:
    """Of the largest flock; where several are as large, of the one that holds the boid
    a union-find calls the first.
    """
    found = flocks(bodies, reach)
    most = max(len(flock) for flock in found)
    assert sum(len(flock) == most for flock in found) == 1 or most < 3, (
        "which flock is the largest is not clear"
    )
    flock = bodies[:, next(members for members in found if len(members) == most)]
    course = flock[2:4].sum(axis=1)
    if most < 3 or not course.any():
        return math.nan
    apart = flock[:2] - flock[:2].mean(axis=1, keepdims=True)
    along, across = (
        course / np.hypot(*course) @ apart,
        np.array([course[1], -course[0]]) / np.hypot(*course) @ apart,
    )
    return (along.std() - across.std()) / (along.std() + across.std())


def neighbours_ahead(bodies: Vector, reach: float) -> float:
    angles = [
        angle_between(bodies[:2, j] - bodies[:2, i], bodies[2:4, i])
        for i in range(bodies.shape[1])
        for j in range(bodies.shape[1])
        if i != j and distances(bodies)[i, j] < reach and bodies[2:4, i].any()
    ]
    return 100 * float(np.mean(np.array(angles) < math.pi / 2)) if angles else math.nan


def clearances(bodies: Vector, world: Any) -> Vector:
    """The distance of each boid from the nearest of the discs and rectangles, negative
    inside.
    """
    across = np.abs(bodies[0][:, None] - world.obstacle_x)
    along = np.abs(bodies[1][:, None] - world.obstacle_y)
    disc = np.hypot(across, along) - world.half_width
    beside, above = across - world.half_width, along - world.half_height
    box = np.hypot(np.maximum(beside, 0), np.maximum(above, 0)) + np.minimum(
        np.maximum(beside, above), 0
    )
    return np.where(world.is_round, disc, box).min(axis=1)


def from_goal(bodies: Vector, world: Any) -> Vector:
    return np.hypot(bodies[0] - world.goal_x, bodies[1] - world.goal_y)


def goal_spread(bodies: Vector, world: Any, radius: float) -> float:
    there = bodies[:, from_goal(bodies, world) < radius]
    return float(from_centre(there).mean()) if there.shape[1] > 1 else math.nan


def potentials(bodies: Vector, rule: Any) -> list[float]:
    """The pair potentials of every boid, summed, by integrating the pair force from its
    rest to the distance.
    """

    def pair(distance: float, cohesion: float) -> float:
        # Both pieces of the force are linear, so the mean of its ends times the length
        # is the integral.
        rest = rule.separation_range
        if distance >= max(rest, rule.cohesion_range):
            return 0.0
        strength = -cohesion
        if distance < rest:
            strength = rule.separation - (0 if rule.cohesion_outside else cohesion)
        return strength * (distance + rest) / 2 * (rest - distance)

    apart = distances(bodies)
    np.fill_diagonal(apart, np.inf)
    inner = rule.separation_range if rule.cohesion_outside else 0.0
    counts = ((apart >= inner) & (apart < rule.cohesion_range)).sum(axis=1)
    return [
        sum(pair(d, rule.cohesion / max(n, 1)) for d in row)
        for row, n in zip(apart, counts, strict=True)
    ]


def flock_potential(bodies: Vector, rule: Any, reach: float) -> float:
    energy = potentials(bodies, rule)
    sums = [
        sum(energy[i] for i in flock)
        for flock in flocks(bodies, reach)
        if len(flock) > 1
    ]
    return float(np.mean(sums)) if sums else math.nan


def variation(counts: Vector, ground: Any, ddof: int) -> float:
    """The coefficient of variation of visit counts with the given number, sum and sum
    of squares.
    """
    mean = counts[1] / ground.traversable
    return (
        math.sqrt(
            (counts[2] / ground.traversable - mean**2)
            * ground.traversable
            / (ground.traversable - ddof)
        )
        / mean
    )


def herd(bodies: Vector, ground: Any) -> Vector:
    """The bodies of the sheep; those of the dog come after them."""
    return bodies[:, ground.kind == 0]


def dog_offset(bodies: Vector, ground: Any) -> float:
    """By complex numbers: the dog, in a frame whose real axis is the line."""
    goal = complex(ground.world.goal_x, ground.world.goal_y)
    places = bodies[0] + 1j * bodies[1] - goal
    centre = places[ground.kind == 0].mean()
    if (ground.kind == 0).all() or centre == 0:
        return math.nan
    return float((places[-1] / (centre / abs(centre))).imag)


def dog_distance(bodies: Vector, ground: Any) -> float:
    """The mean over dogs, by complex numbers."""
    places = bodies[0] + 1j * bodies[1]
    sheep = places[ground.kind == 0]
    dogs = places[ground.kind == 1]
    if not sheep.size or not dogs.size:
        return math.nan
    return float(np.abs(dogs - sheep.mean()).mean())


def cosines(bodies: Vector) -> Vector:
    """Of the angles between velocities (N, N); 0 where a boid is at rest."""
    moving = bodies[2:4].any(axis=0)
    headings = np.arctan2(bodies[3], bodies[2])
    found = np.cos(headings[:, None] - headings)
    return np.where(moving[:, None] & moving, found, 0.0)


def correlation(bodies: Vector) -> float:
    """Over all pairs of different boids."""
    n = bodies.shape[1]
    pairs = cosines(bodies)[np.triu_indices(n, 1)]
    return float(pairs.mean()) if n > 1 else math.nan


def flock_correlation(bodies: Vector, reach: float) -> float:
    found = [
        np.delete(cosines(bodies[:, flock])[k], k).mean()
        for flock in flocks(bodies, reach)
        if len(flock) > 1
        for k in range(len(flock))
    ]
    return float(np.mean(found)) if found else math.nan


def close_pairs(bodies: Vector, reach: float) -> float:
    """Per cent of the pairs that are nearer than `reach`."""
    apart_ = distances(bodies)[np.triu_indices(bodies.shape[1], 1)]
    return 100 * float(np.mean(apart_ < reach)) if apart_.size else math.nan


def depth(bodies: Vector, world: Any) -> float:
    """The mean distance from the nearest place of the world, or from the border of an
    obstacle.
    """
    size = np.array([[world.width], [world.height]])
    outside = np.hypot(*(bodies[:2] - np.clip(bodies[:2], 0, size)))
    return float(np.maximum(outside, -clearances(bodies, world)).mean())


METRICS: dict[str, Callable[[Vector, Vector, Any, Any], float]] = {
    "speed": lambda bodies, *_: np.hypot(*bodies[2:4]).mean(),
    "flock_radius": lambda bodies, *_: from_centre(bodies).mean(),
    "turn_rate": lambda bodies, *_: np.minimum(
        turns(bodies), 360 - turns(bodies)
    ).mean(),
    "turn_rate_unwrapped": lambda bodies, *_: turns(bodies).mean(),
    "dispersion": lambda bodies, *_: from_centre(bodies).std(),
    "polarization": lambda bodies, *_: polarization(bodies),
    "group_speed": lambda bodies, *_: abs(np.mean(bodies[2] + 1j * bodies[3])),
    "velocity_correlation": lambda bodies, *_: correlation(bodies),
    "flock_correlation": lambda bodies, _counts, _ground, seen: flock_correlation(
        bodies, seen.flock_range
    ),
    "least_distance": lambda bodies, *_: (
        apart(bodies).min() if bodies.shape[1] > 1 else math.nan
    ),
    "pairs_in_contact": lambda bodies, _counts, _ground, seen: close_pairs(
        bodies, seen.contact_distance
    ),
    "smallest_flock": lambda bodies, _counts, _ground, seen: min(
        flock_sizes(bodies, seen.flock_range)
    ),
    "boids_alone": lambda bodies, _counts, _ground, seen: flock_sizes(
        bodies, seen.flock_range
    ).count(1),
    "depth_outside": lambda bodies, _counts, ground, _seen: depth(bodies, ground.world),
    "velocity_diameter": lambda bodies, *_: np.hypot(
        *(bodies[2:4, :, None] - bodies[2:4, None, :])
    ).max(),
    "angular_momentum": lambda bodies, *_: angular_momentum(bodies),
    "nearest_neighbour_distance": lambda bodies, *_: nearest(bodies),
    "in_contact": lambda bodies, _counts, _ground, seen: (
        100 * np.mean(apart(bodies).min(axis=1) < seen.contact_distance)
    ),
    "flock_count": lambda bodies, _counts, _ground, seen: len(
        flock_sizes(bodies, seen.flock_range)
    ),
    "largest_flock": lambda bodies, _counts, _ground, seen: max(
        flock_sizes(bodies, seen.flock_range)
    ),
    "algebraic_connectivity": lambda bodies, _counts, _ground, seen: (
        algebraic_connectivity(bodies, seen.flock_range)
    ),
    "coverage": lambda _, counts, ground, _seen: 100 * counts[0] / ground.traversable,
    "coverage_total": lambda _, counts, ground, _seen: 100 * counts[0] / ground.pixels,
    "coverage_cv": lambda _, counts, ground, seen: variation(
        counts, ground, seen.coverage_cv_ddof
    ),
    "escapes": lambda _, counts, *_rest: counts[3],
    "collisions": lambda _, counts, *_rest: counts[4],
    "boid_collisions": lambda _, counts, *_rest: counts[5],
    "share_arrived": lambda _, counts, ground, _seen: 100 * counts[6] / ground.boids,
    "goals_reached": lambda _, counts, ground, _seen: counts[13] / ground.boids,
    "time_to_goal": lambda _, counts, ground, _seen: (
        counts[7] * ground.dt / counts[6] if counts[6] else math.nan
    ),
    "equilibrium": lambda _, counts, ground, _seen: 100 * counts[8] / ground.boids,
    "dead_end_time": lambda _, counts, ground, _seen: counts[9] * ground.dt,
    "pair_collisions": lambda _, counts, *_rest: counts[10],
    "collision_rate": lambda _, counts, ground, _seen: (
        (counts[4] + counts[10]) / (counts[17] * ground.dt) / ground.boids
        if counts[17]
        else math.nan
    ),
    "fissions": lambda _, counts, *_rest: counts[11],
    "fusions": lambda _, counts, *_rest: counts[12],
    "path_length": lambda _, counts, ground, _seen: (
        counts[14] / ground.boids * ground.dt
    ),
    "control_effort": lambda _, counts, ground, _seen: (
        counts[15] / ground.boids / ground.dt
    ),
    "mechanical_work": lambda _, counts, ground, _seen: counts[16] / ground.boids,
    "largest_flock_share": lambda bodies, _counts, _ground, seen: (
        100 * max(flock_sizes(bodies, seen.flock_range)) / bodies.shape[1]
    ),
    "boids_lost": lambda bodies, _counts, _ground, seen: (
        bodies.shape[1] - max(flock_sizes(bodies, seen.flock_range))
    ),
    "elongation": lambda bodies, _counts, _ground, seen: elongation(
        bodies, seen.flock_range
    ),
    "neighbours_ahead": lambda bodies, _counts, _ground, seen: neighbours_ahead(
        bodies, seen.flock_range
    ),
    "clearance": lambda bodies, _counts, ground, _seen: clearances(
        bodies, ground.world
    ).mean(),
    "least_clearance": lambda bodies, _counts, ground, _seen: clearances(
        bodies, ground.world
    ).min(),
    "goal_distance": lambda bodies, _counts, ground, _seen: from_goal(
        bodies, ground.world
    ).mean(),
    "goal_spread": lambda bodies, _counts, ground, seen: goal_spread(
        bodies, ground.world, seen.goal_radius
    ),
    "potential": lambda bodies, _counts, ground, _seen: np.mean(
        potentials(bodies, ground.potential)
    ),
    "flock_potential": lambda bodies, _counts, ground, seen: flock_potential(
        bodies, ground.potential, seen.flock_range
    ),
    "herded": lambda bodies, *_: int(bodies[6, 0] > 0),
    "herding_time": lambda bodies, *_: bodies[6, 0] or math.nan,
    "herd_radius": lambda bodies, _, ground, __: from_centre(
        herd(bodies, ground)
    ).mean(),
    "herd_goal_distance": lambda bodies, _, ground, __: np.hypot(
        herd(bodies, ground)[0].mean() - ground.world.goal_x,
        herd(bodies, ground)[1].mean() - ground.world.goal_y,
    ),
    "dog_offset": lambda bodies, _, ground, __: dog_offset(bodies, ground),
    "dog_distance": lambda bodies, _, ground, __: dog_distance(bodies, ground),
}
