"""Metrics of a herd of sheep and the dog, the boid after the sheep.

The dog counts only in the metric of the dog.
"""

import math

from kernels.jit import jit
from kernels.metrics.ground import Ground, X, Y
from kernels.recording import FIRST_STATE, Frames
from kernels.settings import Observation
from kernels.state import Floats

SHEEP = 0
DOG = 1
"""Indices of the kinds of boids that these metrics measure."""


@jit
def _task_time(frames: Frames, f: int) -> float:
    """Return the time at which the task was done; 0 before.

    The time is the first row of the state.
    """
    return float(frames.bodies[f, FIRST_STATE, 0])


@jit
def _herd_centre(frames: Frames, ground: Ground, f: int) -> tuple[float, float, int]:
    """Return the centre of mass and the number of the sheep in frame `f`."""
    x, y, sheep = 0.0, 0.0, 0
    for i in range(frames.bodies.shape[2]):
        if ground.kind[i] == SHEEP:
            x += frames.bodies[f, X, i]
            y += frames.bodies[f, Y, i]
            sheep += 1
    share = 1.0 / sheep if sheep > 0 else math.nan
    return x * share, y * share, sheep


@jit
def herded(
    frames: Frames,
    filled: int,
    _ground: Ground,
    _observation: Observation,
    values: Floats,
) -> None:
    """Compute whether the task of the dog is done.

    Parameters
    ----------
    frames, filled, _ground, _observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        1 once the task is done, else 0.
    """
    for f in range(filled):
        values[f] = 1.0 if _task_time(frames, f) > 0.0 else 0.0


@jit
def herding_time(
    frames: Frames,
    filled: int,
    _ground: Ground,
    _observation: Observation,
    values: Floats,
) -> None:
    """Compute the time at which the task of the dog was done.

    Parameters
    ----------
    frames, filled, _ground, _observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Time since the start; NaN before the task is done.
    """
    for f in range(filled):
        time = _task_time(frames, f)
        values[f] = time if time > 0.0 else math.nan


@jit
def herd_radius(
    frames: Frames,
    filled: int,
    ground: Ground,
    _observation: Observation,
    values: Floats,
) -> None:
    """Compute the mean distance of sheep from the centre of mass of the sheep.

    Parameters
    ----------
    frames, filled, ground, _observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Mean over sheep, in lengths; NaN without sheep.
    """
    for f in range(filled):
        x, y, sheep = _herd_centre(frames, ground, f)
        total = 0.0
        for i in range(frames.bodies.shape[2]):
            if ground.kind[i] == SHEEP:
                dx, dy = frames.bodies[f, X, i] - x, frames.bodies[f, Y, i] - y
                total += math.sqrt(dx * dx + dy * dy)
        values[f] = total / sheep if sheep > 0 else math.nan


@jit
def herd_goal_distance(
    frames: Frames,
    filled: int,
    ground: Ground,
    _observation: Observation,
    values: Floats,
) -> None:
    """Compute the distance of the centre of mass of the sheep from the goal.

    Parameters
    ----------
    frames, filled, ground, _observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Distance, in lengths; NaN without sheep.
    """
    for f in range(filled):
        x, y, _ = _herd_centre(frames, ground, f)
        dx, dy = x - ground.world.goal_x, y - ground.world.goal_y
        values[f] = math.sqrt(dx * dx + dy * dy)


@jit
def dog_offset(
    frames: Frames,
    filled: int,
    ground: Ground,
    _observation: Observation,
    values: Floats,
) -> None:
    """Compute the distance of the dog from the line from the goal through the sheep.

    The line passes through the centre of mass of the sheep. The distance is positive if
    the dog is anticlockwise of the line, seen from the goal.

    Parameters
    ----------
    frames, filled, ground, _observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Signed distance, in lengths; NaN if the centre is at the goal, and without a
        dog or sheep.
    """
    for f in range(filled):
        x, y, sheep = _herd_centre(frames, ground, f)
        x, y = x - ground.world.goal_x, y - ground.world.goal_y
        size, n = math.sqrt(x * x + y * y), frames.bodies.shape[2]
        values[f] = math.nan
        if sheep < n and size > 0.0:
            dx = frames.bodies[f, X, n - 1] - ground.world.goal_x
            dy = frames.bodies[f, Y, n - 1] - ground.world.goal_y
            values[f] = (x * dy - y * dx) / size


@jit
def dog_distance(
    frames: Frames,
    filled: int,
    ground: Ground,
    _observation: Observation,
    values: Floats,
) -> None:
    """Compute the distance of the dog from the centre of mass of the sheep.

    Parameters
    ----------
    frames, filled, ground, _observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Mean over dogs, in lengths; NaN without a dog or sheep.
    """
    for f in range(filled):
        x, y, _ = _herd_centre(frames, ground, f)
        total = 0.0
        dogs = 0
        for i in range(frames.bodies.shape[2]):
            if ground.kind[i] == DOG:
                dx = frames.bodies[f, X, i] - x
                dy = frames.bodies[f, Y, i] - y
                total += math.sqrt(dx * dx + dy * dy)
                dogs += 1
        values[f] = total / dogs if dogs > 0 else math.nan
