"""The twins of single rules, and of how forces share an acceleration."""

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from kernels.settings import BOUNDED, TORUS
from tests.naive.polygons import Vector, nearest_of_border, winding


def limit(x: float, y: float, most: float) -> Vector:
    return shortened(np.array([x, y]), most)


def shortened(force: Vector, most: float) -> Vector:
    length = math.hypot(*force)
    return force * (most / length) if length > most else force


def clamp_speed(vx: float, vy: float, least: float, most: float) -> Vector:
    speed = math.hypot(vx, vy)
    wanted = most if speed > most else max(speed, least)
    return np.array([vx, vy]) / speed * wanted if speed > 0.0 else np.zeros(2)


def serve(
    ax: float, ay: float, x: float, y: float, budget: float
) -> tuple[float, float, float]:
    part = shortened(np.array([x, y]), budget)
    return ax + part[0], ay + part[1], max(budget - math.hypot(x, y), 0.0)


def limit_components(x: float, y: float, most: float) -> Vector:
    return np.clip([x, y], -most, most)


def add_in_turn(
    ax: float, ay: float, x: float, y: float, has_room: bool, most: float
) -> tuple[float, float, bool]:
    if has_room:
        ax, ay = ax + x, ay + y
    return ax, ay, has_room and math.hypot(ax, ay) <= most


def within(near: Any, found: int, range2: float) -> tuple[Vector, Vector]:
    """Indices (K,) and displacements (K, 2) of the first `found` neighbours that are
    nearer than sqrt(range2).
    """
    close = near.distance2[:found] < range2
    return near.boid[:found][close], np.column_stack([near.dx, near.dy])[:found][close]


def separation_unit(near: Any, found: int, range2: float) -> Vector:
    _, towards = within(near, found, range2)
    lengths = np.linalg.norm(towards, axis=1)
    return (-towards / np.maximum(lengths, 1.0)[:, None]).sum(axis=0)


def separation_linear(near: Any, found: int, range2: float) -> Vector:
    return -within(near, found, range2)[1].sum(axis=0)


def alignment_from(
    vx: float, vy: float, seen: Any, near: Any, found: int, range2: float
) -> Vector:
    others, _ = within(near, found, range2)
    velocities = np.column_stack([seen.vx, seen.vy])
    return velocities[others].mean(axis=0) - [vx, vy] if len(others) else np.zeros(2)


def separation_direction(near: Any, found: int, range2: float) -> Vector:
    _, towards = within(near, found, range2)
    pushes = [-d / math.hypot(*d) ** 2 for d in towards if d.any()]
    push = sum(pushes, np.zeros(2))
    return push / math.hypot(*push) if push.any() else push


def alignment(seen: Any, i: int, near: Any, found: int, range2: float) -> Vector:
    others, _ = within(near, found, range2)
    velocities = np.column_stack([seen.vx, seen.vy])
    return (
        velocities[others].mean(axis=0) - velocities[i] if len(others) else np.zeros(2)
    )


def cohesion(near: Any, found: int, range2: float) -> Vector:
    _, towards = within(near, found, range2)
    return towards.mean(axis=0) if len(towards) else np.zeros(2)


def flocking_sums(seen: Any, near: Any, found: int, crowd2: float) -> Vector:
    others, towards = within(near, found, math.inf)
    velocities = np.column_stack([seen.vx, seen.vy])[others]
    return np.concatenate(
        [
            within(near, found, crowd2)[1].sum(axis=0),
            towards.sum(axis=0),
            velocities.sum(axis=0),
        ]
    )


def ranged_sums(
    seen: Any,
    near: Any,
    found: int,
    separation2: float,
    alignment2: float,
    cohesion2: float,
) -> Vector:
    others, _ = within(near, found, alignment2)
    velocities = np.column_stack([seen.vx, seen.vy])[others]
    _, towards = within(near, found, cohesion2)
    return np.concatenate(
        [
            separation_unit(near, found, separation2),
            velocities.sum(axis=0),
            [len(others)],
            towards.sum(axis=0),
            [len(towards)],
        ]
    )


def protected_sums(
    seen: Any, near: Any, found: int, crowd2: float, range2: float, crowd_apart: bool
) -> Vector:
    sums = np.zeros(7)
    for k in range(found):
        towards, j = np.array([near.dx[k], near.dy[k]]), near.boid[k]
        in_crowd = near.distance2[k] < crowd2
        if in_crowd:
            sums[:2] += towards
        if near.distance2[k] < range2 and not (in_crowd and crowd_apart):
            sums[2:] += [*towards, seen.vx[j], seen.vy[j], 1]
    return sums


def wander(rng: np.random.Generator, width: float) -> Vector:
    return rng.uniform(-width, width, 2)


def seek(dx: float, dy: float, vx: float, vy: float, gain: float) -> Vector:
    return np.array([dx, dy]) * gain - [vx, vy]


def arrival(
    dx: float,
    dy: float,
    vx: float,
    vy: float,
    stop: float,
    slow: float,
    most: float,
    gain: float,
) -> Vector:
    distance = math.hypot(dx, dy)
    if distance < stop:
        return np.zeros(2)
    speed = min(most * distance / slow, most)
    return gain * speed / distance * np.array([dx, dy]) - [vx, vy]


def is_taken(occupancy: Any, x: float, y: float) -> bool:
    rows, columns = occupancy.taken.shape
    row, column = (
        math.floor(y * occupancy.per_length),
        math.floor(x * occupancy.per_length),
    )
    return (
        bool(occupancy.taken[row, column])
        if 0 <= row < rows and 0 <= column < columns
        else True
    )


def steer_to_avoid(
    occupancy: Any,
    x: float,
    y: float,
    vx: float,
    vy: float,
    look_ahead: float,
    path_step: float,
    turn: float,
) -> tuple[float, float, bool]:
    """The headings in the order in which they are looked at, and the first whose points
    are free.
    """
    if vx == vy == 0.0:
        return 0.0, 0.0, False
    turns = [0.0] + [
        side * k * turn for k in range(1, int(math.pi / turn) + 1) for side in (1, -1)
    ]
    headings = [math.atan2(vy, vx) + angle for angle in turns]
    points = np.linspace(0.0, look_ahead, int(look_ahead / path_step + 1e-9) + 1)[1:-1]
    for k, heading in enumerate(headings):
        path = [
            (x + length * math.cos(heading), y + length * math.sin(heading))
            for length in points
        ]
        if not any(is_taken(occupancy, *place) for place in path):
            return (
                (math.cos(heading), math.sin(heading), False)
                if k > 0
                else (0.0, 0.0, False)
            )
    return 0.0, 0.0, True


def confine(
    position: float, velocity: float, length: float, borders: int
) -> tuple[float, float]:
    if borders == TORUS and not 0.0 <= position < length:
        return position + math.copysign(length, -position), velocity
    if borders == BOUNDED and not 0.0 <= position <= length:
        return (-position if position < 0.0 else 2.0 * length - position), -velocity
    return position, velocity


def turn_back(position: float, length: float, margin: float) -> float:
    if position < margin:
        return 1.0
    return -1.0 if position > length - margin else 0.0


def away_from(world: Any, m: int, x: float, y: float) -> tuple[float, float, float]:
    """The way from the middle of a disc or a rectangle, and its larger half width; that
    from the nearest point of the border of a polygon, from any depth within what is
    solid the other way.
    """
    if vertices := vertices_of(world, m):
        away = (x, y) - nearest_of_border(vertices, x, y)
        if bool(winding(vertices, x, y)) != world.corners.is_arena[m]:
            return -away[0], -away[1], math.inf
        return away[0], away[1], 0.0
    size = max(world.half_width[m], world.half_height[m])
    return x - world.obstacle_x[m], y - world.obstacle_y[m], size


def away_from_obstacles(
    world: Any, margin: float, x: float, y: float
) -> Iterator[tuple[Vector, float]]:
    """Unit vector away from, and distance to, the centre of each obstacle within
    `margin` of its size, or the nearest point of a polygon.
    """
    for m in range(len(world.obstacle_x)):
        dx, dy, size = away_from(world, m, x, y)
        away = np.array([dx, dy])
        distance = math.hypot(*away)
        if 0.0 < distance < size + margin:
            yield away / distance, distance


def vertices_of(world: Any, m: int) -> list[tuple[float, float]]:
    """The vertices of obstacle `m`; none where it is a disc or a rectangle."""
    if world.corners is None:
        return []
    own = slice(world.corners.first[m], world.corners.first[m + 1])
    return list(zip(world.corners.x[own], world.corners.y[own], strict=True))


def repulsion_unit(world: Any, reach: Any, margin: float, x: float, y: float) -> Vector:  # noqa: ARG001
    return sum(
        (unit for unit, _ in away_from_obstacles(world, margin, x, y)), np.zeros(2)
    )


def repulsion_inverse(
    world: Any,
    reach: Any,  # noqa: ARG001
    margin: float,
    epsilon: float,
    x: float,
    y: float,
) -> Vector:
    forces = (
        unit / (distance + epsilon)
        for unit, distance in away_from_obstacles(world, margin, x, y)
    )
    return sum(forces, np.zeros(2))


def repulsion_linear(
    world: Any,
    reach: Any,  # noqa: ARG001
    margin: float,
    x: float,
    y: float,
) -> Vector:
    return sum(
        (
            unit * distance
            for unit, distance in away_from_obstacles(world, margin, x, y)
        ),
        np.zeros(2),
    )


def wall_repulsion(position: float, length: float, epsilon: float) -> float:
    return 1.0 / (position + epsilon) - 1.0 / (length - position + epsilon)


def velocity_sum(
    seen: Any, i: int, near: Any, found: int
) -> tuple[float, float, float]:
    group = [i, *near.boid[:found]]
    return sum(seen.vx[group]), sum(seen.vy[group]), float(len(group))


def velocity_sum_from(
    vx: float, vy: float, seen: Any, near: Any, found: int
) -> tuple[float, float, float]:
    group = near.boid[:found]
    return vx + sum(seen.vx[group]), vy + sum(seen.vy[group]), float(found + 1)


def direction(x: float, y: float, other_x: float, other_y: float) -> Vector:
    for vector in (np.array([x, y]), np.array([other_x, other_y])):
        if vector.any():
            return vector / math.hypot(*vector)
    return np.zeros(2)


def random_turn(rng: np.random.Generator, width: float) -> Vector:
    angle = rng.uniform(-width / 2, width / 2)
    return np.array([math.cos(angle), math.sin(angle)])


def turned(x: float, y: float, cosine: float, sine: float) -> Vector:
    return np.array([[cosine, -sine], [sine, cosine]]) @ [x, y]


def turned_towards(
    x: float, y: float, to_x: float, to_y: float, cosine: float, sine: float
) -> Vector:
    """By complex numbers: the real part of a product is that of the cosine."""
    apart = complex(x, -y) * complex(to_x, to_y)
    if apart.real >= cosine:
        return np.array([to_x, to_y])
    new = complex(x, y) * complex(cosine, sine if apart.imag >= 0 else -sine)
    return np.array([new.real, new.imag])
