"""vasarhelyi2018."""

import math
from typing import Any, NamedTuple

import numpy as np

from tests.naive.flight import bordered, neighbours, walk
from tests.naive.rules import Vector, shortened


class Drone(NamedTuple):
    """A bird, the velocity that it wants, and the steps until it chooses that anew."""

    position: Vector
    velocity: Vector
    wanted: Vector
    wait: int


def unit(vector: Vector) -> Vector:
    length = math.hypot(*vector)
    return vector / length if length > 0 else np.zeros(2)


def braking(way: float, acceleration: float, slope: float) -> float:
    """D(r, a, p)."""
    if way <= 0:
        return 0.0
    if slope * way < acceleration / slope:
        return slope * way
    return math.sqrt(2 * acceleration * way - (acceleration / slope) ** 2)


def shill(s: dict[str, Any], away: Vector, distance: float, v: Vector) -> Vector:
    """What the shill agent of a wall adds, by the difference of speeds."""
    off = s["shill_speed"] * away - v
    due = braking(
        distance - s["shill_range"], s["shill_acceleration"], s["shill_slope"]
    )
    return max(math.hypot(*off) - due, 0.0) * unit(off)


def nearest_border(world: Any, m: int, place: Vector) -> tuple[Vector, bool]:
    """The nearest point of the border of an obstacle, and whether `place` is within."""
    centre = np.array([world.obstacle_x[m], world.obstacle_y[m]])
    half = np.array([world.half_width[m], world.half_height[m]])
    off = place - centre
    if world.is_round[m]:
        return centre + half[0] * unit(off), bool(math.hypot(*off) < half[0])
    inside = bool((np.abs(off) <= half).all())
    if not inside:
        return centre + np.clip(off, -half, half), False
    faces = [
        (half[axis] - way * off[axis], axis, way) for axis in (0, 1) for way in (1, -1)
    ]
    _, axis, way = min(faces)
    point = place.copy()
    point[axis] = centre[axis] + way * half[axis]
    return point, True


def vasarhelyi2018(
    s: dict[str, Any], world: Any, flock: list[Any], _rng: np.random.Generator
) -> list[Any]:
    """One step, with the settings `s`, of drones that know all, without noise of the
    motors; a flock of birds is one at its start.
    """
    flock = [
        bird if isinstance(bird, Drone) else Drone(*bird, np.zeros(2), 0)
        for bird in flock
    ]

    def wanted(flock: list[Any], i: int) -> Vector:
        me = flock[i]
        sum_ = s["flock_speed"] * unit(me.velocity)
        for j, d in neighbours(world, flock, i, s["interaction_range"], True):
            r = math.hypot(*d)
            sum_ -= s["repulsion_gain"] * max(s["repulsion_range"] - r, 0.0) * unit(d)
            off = flock[j].velocity - me.velocity
            curve = braking(
                r - s["friction_range"],
                s["friction_acceleration"],
                s["friction_slope"],
            )
            due = max(s["friction_tolerance"], curve)
            sum_ += s["friction_gain"] * max(math.hypot(*off) - due, 0.0) * unit(off)
        middle = np.array([world.width, world.height]) / 2
        for axis in (0, 1) if s["walls"] else ():
            off = me.position[axis] - middle[axis]
            away = np.zeros(2)
            away[axis] = -1.0 if off > 0 else 1.0
            sum_ += shill(s, away, middle[axis] - abs(off), me.velocity)
        for m in range(world.obstacle_x.size):
            point, inside = nearest_border(world, m, me.position)
            way = me.position - point
            distance = math.hypot(*way)
            side = -1.0 if inside else 1.0
            sum_ += shill(s, side * unit(way), side * distance, me.velocity)
        if s["speed_limit"] == "cut":
            return shortened(sum_, s["max_speed"])
        return s["flock_speed"] * unit(sum_)

    def new_state(flock: list[Any], i: int) -> Any:
        me, period = flock[i], round(s["control_period"] / s["dt"])
        w, wait = (me.wanted, me.wait) if me.wait else (wanted(flock, i), period)
        come = -math.expm1(-s["dt"] / s["motor_lag"]) if s["motor_lag"] > 0 else 1.0
        change = shortened((w - me.velocity) * come, s["motor_acceleration"] * s["dt"])
        velocity = me.velocity + change
        place = me.position + me.velocity * s["dt"]
        moved = bordered(world, place, velocity)
        return Drone(*moved, bordered(world, place, w).velocity, wait - 1)

    return walk(s, flock, new_state)
