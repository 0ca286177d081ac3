"""rustamani2024."""

import math
from typing import Any, NamedTuple

import numpy as np

from tests.naive.flight import Bird, bordered, neighbours, walk
from tests.naive.rules import (
    Vector,
    add_in_turn,
    arrival,
    limit,
    limit_components,
    seek,
    steer_to_avoid,
)

ORDERS = {
    "safety_first": (
        "obstacle",
        "separation",
        "arrival",
        "seek",
        "alignment",
        "cohesion",
    ),
    "flocking_first": (
        "cohesion",
        "alignment",
        "arrival",
        "seek",
        "obstacle",
        "separation",
    ),
}


class Cells(NamedTuple):
    """What kernels.occupancy.Occupancy holds."""

    taken: Vector
    per_length: float


def cells_within(world: Any, cell: float, inflation: float) -> Cells:
    """The cells whose centres are nearer than `inflation` to one of the discs and
    rectangles.
    """
    rows, columns = math.ceil(world.height / cell), math.ceil(world.width / cell)
    y, x = (np.mgrid[0:rows, 0:columns] + 0.5) * cell
    taken = np.zeros((rows, columns), bool)
    for m in range(len(world.obstacle_x)):
        across, along = np.abs(x - world.obstacle_x[m]), np.abs(y - world.obstacle_y[m])
        if world.is_round[m]:
            distance = np.hypot(across, along) - world.half_width[m]
        else:
            beside, above = across - world.half_width[m], along - world.half_height[m]
            distance = np.hypot(
                np.maximum(beside, 0), np.maximum(above, 0)
            ) + np.minimum(np.maximum(beside, above), 0)
        taken |= distance < inflation
    return Cells(taken, 1 / cell)


def rustamani2024(
    s: dict[str, Any],
    world: Any,
    flock: list[Bird],
    rng: np.random.Generator,  # noqa: ARG001
) -> list[Bird]:
    """One step, with the settings `s`, of the section rustamani2024 of the models'
    description, for boids that move.
    """
    cells = cells_within(world, s["grid_cell"], s["inflation"])

    def limited(vector: Vector, most: float) -> Vector:
        return np.array(
            (limit_components if s["component_limits"] else limit)(*vector, most)
        )

    def flocking(flock: list[Bird], i: int) -> dict[str, Vector]:
        me, closed = flock[i], s["range_inclusive"]
        seen = neighbours(world, flock, i, s["perception_range"], closed, s["fov"])
        crowd = dict(neighbours(world, flock, i, s["separation_range"], closed))
        push = sum(
            (-d / (d @ d) for j, d in seen if j in crowd and d.any()), np.zeros(2)
        )
        if not seen:
            return {
                name: np.zeros(2) for name in ("separation", "alignment", "cohesion")
            }
        return {
            "separation": push / math.hypot(*push) if push.any() else push,
            "alignment": s["alignment_gain"]
            * (np.mean([flock[j].velocity for j, _ in seen], axis=0) - me.velocity),
            "cohesion": np.mean([d for _, d in seen], axis=0),
        }

    def navigation(me: Bird, i: int) -> dict[str, Vector]:
        if i >= math.floor(s["leader_share"] * len(flock) + 0.5):
            return {"seek": np.zeros(2), "arrival": np.zeros(2)}
        to_goal = np.array([s["goal_x"], s["goal_y"]]) - me.position
        distances, most = (
            (s["stop_distance"], s["slow_distance"]),
            s["max_acceleration"],
        )
        there = arrival(
            *to_goal, *me.velocity, *distances, s["max_speed"], s["arrival_gain"]
        )
        return {
            "seek": limited(seek(*to_goal, *me.velocity, s["navigation_gain"]), most),
            "arrival": limited(there, most) if s["arrival_limited"] else there,
        }

    def acceleration(flock: list[Bird], i: int) -> Vector:
        me = flock[i]
        paths = (s["look_ahead"], s["path_step"], s["angle_step"])
        x, y, _ = steer_to_avoid(cells, *me.position, *me.velocity, *paths)
        terms = {"obstacle": np.array([x, y])} | flocking(flock, i) | navigation(me, i)
        ax, ay, has_room = 0.0, 0.0, True
        for name in ORDERS[s["priority"]]:
            ax, ay, has_room = add_in_turn(
                ax,
                ay,
                *s[f"{name}_weight"] * terms[name],
                has_room,
                s["acceleration_pool"],
            )
        return limited(np.array([ax, ay]), s["max_acceleration"])

    def new_state(flock: list[Bird], i: int) -> Bird:
        velocity = limited(
            flock[i].velocity + acceleration(flock, i) * s["dt"], s["max_speed"]
        )
        return bordered(world, flock[i].position + velocity * s["dt"], velocity)

    return walk(s, flock, new_state)
