"""jadhav2024."""

import math
from typing import Any, NamedTuple

import numpy as np

from tests.naive.flight import Bird, bordered, displacement, neighbours, walk
from tests.naive.rules import Vector
from tests.naive.strombom2014 import unit


class Headed(NamedTuple):
    """A boid that keeps its heading at rest."""

    position: Vector
    velocity: Vector
    heading: Vector


def jadhav2024(
    s: dict[str, Any], world: Any, flock: list[Bird], rng: np.random.Generator
) -> list[Headed]:
    """One step, with the settings `s`; the last bird is the dog."""
    goal = np.array([world.goal_x, world.goal_y])
    last = len(flock) - 1
    reach = s["repulsion_range"]
    before = [Headed(*bird[:2], _heading(bird)) for bird in flock]

    def anywhere() -> Vector:
        angle = rng.uniform(-math.pi, math.pi)
        return np.array([math.cos(angle), math.sin(angle)])

    def herd(seen: list[Headed], i: int) -> dict[int, Vector]:
        """The ways to all other sheep in sight."""
        found = neighbours(world, seen, i, s["interaction_range"], inclusive=True)
        return {j: way for j, way in found if j != last}

    def chosen(ways: dict[int, Vector]) -> list[int]:
        """A shuffle in hand: each draw takes one of those that are left."""
        ranked = sorted(ways, key=lambda j: float(ways[j] @ ways[j]))
        left = sorted(ranked[: s["attraction_nearest"]])
        taken = []
        for _ in range(min(len(left), s["attraction_chosen"])):
            place = int(rng.random() * len(left))
            taken.append(left[place])
            left[place] = left[0]
            left = left[1:]
        return taken

    def sheep(seen: list[Headed], i: int) -> Vector:
        ways = herd(seen, i)
        own = seen[i].heading
        crowd = [-unit(way) for way in ways.values() if math.hypot(*way) < reach]
        away = unit(np.sum([np.zeros(2), *crowd], axis=0))
        towards = s["inertia"] * own + s["repulsion_strength"] * away
        to_dog = displacement(world, seen[i].position, seen[last].position)
        if math.hypot(*to_dog) > s["detection_range"]:
            return s["sheep_speed"] * unit(towards) if away.any() else np.zeros(2)
        attracting = chosen(ways)
        aligning = attracting[: s["alignment_chosen"]]
        centre = np.sum([np.zeros(2), *(unit(ways[j]) for j in attracting)], axis=0)
        course = np.sum([np.zeros(2), *(seen[j].heading for j in aligning)], axis=0)
        towards = towards + s["attraction_strength"] * unit(centre)
        aligned = unit(course)
        if s["alignment_sum"] == "components":
            aligned = np.sign(course.sum()) * np.ones(2)
        towards = towards + s["alignment_strength"] * aligned
        towards = towards - s["flight_strength"] * unit(to_dog)
        towards = towards + s["noise"] * anywhere()
        return s["sheep_speed"] * unit(towards if towards.any() else own)

    def dog(seen: list[Headed]) -> Vector:
        ways = list(herd(seen, last).values())
        if ways and min(math.hypot(*way) for way in ways) <= reach:
            return s["near_speed"] * seen[last].heading
        target = seen[last].heading
        if ways:
            centre = np.mean(ways, axis=0)
            off = [math.hypot(*(way - centre)) for way in ways]
            k = int(np.argmax(off))
            if off[k] >= reach * len(ways) ** (2 / 3):
                target = ways[k] + reach * unit(ways[k] - centre)
            else:
                to_goal = displacement(world, seen[last].position, goal)
                target = centre + reach * math.sqrt(len(ways)) * unit(centre - to_goal)
        return s["dog_speed"] * unit(unit(target) + s["dog_noise"] * anywhere())

    def new_state(seen: list[Headed], i: int) -> Headed:
        velocity = dog(seen) if i == last else sheep(seen, i)
        bird = bordered(world, before[i].position + s["dt"] * velocity, velocity)
        heading = unit(bird.velocity) if bird.velocity.any() else before[i].heading
        return Headed(*bird, heading)

    return walk(s, before, new_state)


def _heading(bird: Any) -> Vector:
    """That of the last move; a bird of the start has none but that of its velocity."""
    return bird[2] if len(bird) > 2 else unit(bird.velocity)
