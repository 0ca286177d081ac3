"""strombom2014."""

import math
from typing import Any

import numpy as np

from tests.naive.flight import Bird, bordered, displacement, neighbours, walk
from tests.naive.rules import Vector


def unit(vector: Vector) -> Vector:
    length = math.hypot(*vector)
    return vector / length if length > 0 else np.zeros(2)


def strombom2014(
    s: dict[str, Any], world: Any, flock: list[Bird], rng: np.random.Generator
) -> list[Bird]:
    """One step, with the settings `s`; the last bird is the dog. It is done for good
    once all stand still, so that nobody need remember it.
    """
    goal, last = np.array([world.goal_x, world.goal_y]), len(flock) - 1

    def anywhere() -> Vector:
        angle = rng.uniform(-math.pi, math.pi)
        return np.array([math.cos(angle), math.sin(angle)])

    def is_done() -> bool:
        ways = np.array(
            [displacement(world, bird.position, goal) for bird in flock[:last]]
        ).reshape(-1, 2)
        if s["done_when"] == "centre":
            ways = ways.sum(axis=0, keepdims=True) / max(last, 1)
        return last > 0 and bool((np.hypot(*ways.T) < s["target_radius"]).all())

    def in_sight(seen: list[Bird], i: int) -> list[Vector]:
        """The ways to all other sheep."""
        found = neighbours(world, seen, i, s["interaction_range"], inclusive=True)
        return [way for j, way in found if j != last]

    def nearest(ways: list[Vector], count: int) -> list[Vector]:
        """In the order of `ways`; `sorted` is stable."""
        chosen = sorted(range(len(ways)), key=lambda k: float(ways[k] @ ways[k]))
        return [ways[k] for k in sorted(chosen[:count])]

    def sheep(seen: list[Bird], i: int) -> Vector:
        here = seen[i].position
        from_dog = -displacement(world, here, seen[last].position)
        if math.hypot(*from_dog) > s["detection_range"]:
            moves = rng.random() < s["graze_probability"]
            return s["sheep_speed"] * anywhere() if moves else np.zeros(2)
        ways = in_sight(seen, i)
        drawn = nearest(ways, s["attraction_nearest"])
        crowd = [unit(way) for way in ways if math.hypot(*way) < s["repulsion_range"]]
        heading = (
            s["inertia"] * unit(seen[i].velocity)
            - s["repulsion_strength"] * unit(np.sum([np.zeros(2), *crowd], axis=0))
            + s["attraction_strength"] * unit(np.sum([np.zeros(2), *drawn], axis=0))
            + s["flight_strength"] * unit(from_dog)
            + s["noise"] * anywhere()
        )
        return s["sheep_speed"] * unit(heading)

    def dog(seen: list[Bird]) -> Vector:
        here, speed = seen[last].position, s["dog_speed"]
        to_goal = displacement(world, here, goal)
        aim = seen[last].velocity
        herd = nearest(in_sight(seen, last), s["dog_nearest"])
        if herd:
            centre = np.mean(herd, axis=0)
            off = [math.hypot(*(way - centre)) for way in herd]
            k = int(np.argmax(off))
            if off[k] > s["repulsion_range"] * len(herd) ** (2 / 3):
                aim = herd[k] + s["repulsion_range"] * unit(herd[k] - centre)
            else:
                behind = s["repulsion_range"] * math.sqrt(len(herd))
                aim = centre + behind * unit(centre - to_goal)
            if min(math.hypot(*way) for way in herd) < s["near_distance"]:
                speed = s["near_speed"]
        return speed * unit(unit(aim) + s["dog_noise"] * anywhere())

    done = is_done()

    def new_state(seen: list[Bird], i: int) -> Bird:
        velocity = np.zeros(2)
        if not done:
            velocity = dog(seen) if i == last else sheep(seen, i)
        place = flock[i].position + s["dt"] * velocity
        return bordered(world, place, velocity)

    return walk(s, flock, new_state)
