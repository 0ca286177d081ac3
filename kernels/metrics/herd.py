"""A herd of sheep and its dog, the boid after them: the dog counts in none of these but
its own.
"""

import math

from kernels.jit import jit
from kernels.metrics.ground import Ground, X, Y
from kernels.recording import FIRST_STATE, Frames
from kernels.settings import Observation
from kernels.state import Floats

SHEEP = 0
"""The kinds of whom these metrics are."""


@jit
def _task_time(frames: Frames, f: int) -> float:
    """When the task was done, 0 before: the first row of the state."""
    return float(frames.bodies[f, FIRST_STATE, 0])


@jit
def _herd_centre(frames: Frames, ground: Ground, f: int) -> tuple[float, float, int]:
    """The centre of mass of the sheep of frame `f`, and how many they are."""
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
    """1 once the task of the dog is done, else 0."""
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
    """When the task of the dog was done; NaN before."""
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
    """Mean distance of sheep from their centre of mass."""
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
    """Distance of the centre of mass of the sheep from the goal."""
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
    """How far the dog is from the line from the goal through the centre of mass of the
    sheep: more than 0 where it is anticlockwise of it, seen from the goal. NaN where
    the centre is at the goal, and without a dog.
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
