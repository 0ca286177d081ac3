"""Positions of boids relative to obstacles and the goal."""

import math

from kernels.jit import jit
from kernels.metrics.ground import Ground, X, Y
from kernels.moving import place_obstacles
from kernels.recording import Frames
from kernels.settings import Observation
from kernels.state import Floats, World
from kernels.worlds import obstacle_distance


@jit
def _clearance(world: World, x: float, y: float) -> float:
    """Return the distance of (x, y) from the nearest surface of an obstacle.

    The distance is negative inside an obstacle, and infinite without obstacles.
    """
    nearest = math.inf
    for m in range(world.obstacle_x.size):
        nearest = min(nearest, obstacle_distance(world, m, x, y))
    return nearest


@jit
def clearance(
    frames: Frames,
    filled: int,
    ground: Ground,
    _observation: Observation,
    values: Floats,
) -> None:
    """Compute the mean distance of boids from the nearest obstacle.

    Parameters
    ----------
    frames, filled, ground, _observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Mean over boids, in lengths, negative inside an obstacle; NaN without
        obstacles.
    """
    n = frames.bodies.shape[2]
    for f in range(filled):
        place_obstacles(ground.motion, frames.step[f])
        total = 0.0
        for i in range(n):
            total += _clearance(
                ground.world, frames.bodies[f, X, i], frames.bodies[f, Y, i]
            )
        values[f] = total / n if ground.world.obstacle_x.size > 0 else math.nan


@jit
def least_clearance(
    frames: Frames,
    filled: int,
    ground: Ground,
    _observation: Observation,
    values: Floats,
) -> None:
    """Compute the distance of the boid nearest to an obstacle.

    Parameters
    ----------
    frames, filled, ground, _observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Distance, in lengths, negative inside an obstacle; NaN without obstacles.
    """
    for f in range(filled):
        place_obstacles(ground.motion, frames.step[f])
        least = math.inf
        for i in range(frames.bodies.shape[2]):
            least = min(
                least,
                _clearance(
                    ground.world, frames.bodies[f, X, i], frames.bodies[f, Y, i]
                ),
            )
        values[f] = least if ground.world.obstacle_x.size > 0 else math.nan


@jit
def depth_outside(
    frames: Frames,
    filled: int,
    ground: Ground,
    _observation: Observation,
    values: Floats,
) -> None:
    """Compute the mean distance of boids from the free part of the world.

    The distance is the distance to the world for a boid outside, or the depth of a boid
    in an obstacle. A boid at an allowed position counts as 0.

    The metric is phi_wall of Vasarhelyi et al. (2018).

    Parameters
    ----------
    frames, filled, ground, _observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Mean over boids, in lengths.
    """
    world, n = ground.world, frames.bodies.shape[2]
    for f in range(filled):
        place_obstacles(ground.motion, frames.step[f])
        total = 0.0
        for i in range(n):
            x, y = frames.bodies[f, X, i], frames.bodies[f, Y, i]
            across = max(-x, x - world.width, 0.0)
            along = max(-y, y - world.height, 0.0)
            outside = math.sqrt(across * across + along * along)
            total += max(outside, -_clearance(world, x, y))
        values[f] = total / n


@jit
def goal_distance(
    frames: Frames,
    filled: int,
    ground: Ground,
    _observation: Observation,
    values: Floats,
) -> None:
    """Compute the mean distance of boids from the goal.

    Parameters
    ----------
    frames, filled, ground, _observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Mean over boids, in lengths.
    """
    n = frames.bodies.shape[2]
    for f in range(filled):
        total = 0.0
        for i in range(n):
            dx = frames.bodies[f, X, i] - ground.world.goal_x
            dy = frames.bodies[f, Y, i] - ground.world.goal_y
            total += math.sqrt(dx * dx + dy * dy)
        values[f] = total / n


@jit
def goal_spread(
    frames: Frames,
    filled: int,
    ground: Ground,
    observation: Observation,
    values: Floats,
) -> None:
    """Compute the mean distance of boids at the goal from the centre of these boids.

    A boid is at the goal if the distance to the goal is below goal_radius.

    Parameters
    ----------
    frames, filled, ground, observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Mean over these boids, in lengths; NaN for fewer than two.
    """
    radius2 = observation.goal_radius * observation.goal_radius
    for f in range(filled):
        there, x, y = 0, 0.0, 0.0
        for i in range(frames.bodies.shape[2]):
            dx = frames.bodies[f, X, i] - ground.world.goal_x
            dy = frames.bodies[f, Y, i] - ground.world.goal_y
            if dx * dx + dy * dy < radius2:
                there += 1
                x += dx
                y += dy
        total = 0.0
        for i in range(frames.bodies.shape[2]):
            dx = frames.bodies[f, X, i] - ground.world.goal_x
            dy = frames.bodies[f, Y, i] - ground.world.goal_y
            if dx * dx + dy * dy < radius2:
                dx, dy = dx - x / there, dy - y / there
                total += math.sqrt(dx * dx + dy * dy)
        values[f] = total / there if there > 1 else math.nan
