"""What was counted during a trial: visited pixels and events."""

import math

from kernels.events import (
    ARRIVAL_STEPS,
    ARRIVED,
    BOID_COLLISIONS,
    COLLISIONS,
    DEAD_ENDS,
    ESCAPES,
    GOALS_REACHED,
    SETTLED,
)
from kernels.jit import jit
from kernels.metrics.ground import Ground
from kernels.recording import COVERED, FIRST_EVENT, SQUARED_VISITS, VISITS, Frames
from kernels.settings import Observation
from kernels.state import Floats


@jit
def coverage(
    frames: Frames,
    filled: int,
    ground: Ground,
    _observation: Observation,
    values: Floats,
) -> None:
    """Visited pixels in per cent of the traversable ones."""
    for f in range(filled):
        values[f] = 100.0 * frames.counts[f, COVERED] / ground.traversable


@jit
def coverage_total(
    frames: Frames,
    filled: int,
    ground: Ground,
    _observation: Observation,
    values: Floats,
) -> None:
    """Visited pixels in per cent of all pixels of the world."""
    for f in range(filled):
        values[f] = 100.0 * frames.counts[f, COVERED] / ground.pixels


@jit
def coverage_cv(
    frames: Frames,
    filled: int,
    ground: Ground,
    observation: Observation,
    values: Floats,
) -> None:
    """Standard deviation over mean of the visit counts of traversable pixels; NaN
    before the first visit.
    """
    pixels = ground.traversable
    for f in range(filled):
        visits = frames.counts[f, VISITS]
        mean = visits / pixels
        spread = frames.counts[f, SQUARED_VISITS] - visits * mean
        variance = max(spread, 0.0) / (pixels - observation.coverage_cv_ddof)
        values[f] = math.sqrt(variance) / mean if visits > 0 else math.nan


@jit
def escapes(
    frames: Frames,
    filled: int,
    _ground: Ground,
    _observation: Observation,
    values: Floats,
) -> None:
    """How often a boid has left the world since the start."""
    for f in range(filled):
        values[f] = frames.counts[f, FIRST_EVENT + ESCAPES]


@jit
def collisions(
    frames: Frames,
    filled: int,
    _ground: Ground,
    _observation: Observation,
    values: Floats,
) -> None:
    """How often a boid's position has entered an obstacle since the start."""
    for f in range(filled):
        values[f] = frames.counts[f, FIRST_EVENT + COLLISIONS]


@jit
def boid_collisions(
    frames: Frames,
    filled: int,
    _ground: Ground,
    _observation: Observation,
    values: Floats,
) -> None:
    """How often a boid has come nearer than contact_distance to another, or others,
    since the start.
    """
    for f in range(filled):
        values[f] = frames.counts[f, FIRST_EVENT + BOID_COLLISIONS]


@jit
def share_arrived(
    frames: Frames,
    filled: int,
    ground: Ground,
    _observation: Observation,
    values: Floats,
) -> None:
    """Boids that have been within goal_radius of the goal, or in turn of each of
    several, in per cent.
    """
    for f in range(filled):
        values[f] = 100.0 * frames.counts[f, FIRST_EVENT + ARRIVED] / ground.boids


@jit
def time_to_goal(
    frames: Frames,
    filled: int,
    ground: Ground,
    _observation: Observation,
    values: Floats,
) -> None:
    """Mean time at which boids first came within goal_radius of the goal, of several in
    turn of the last; NaN if none did.
    """
    for f in range(filled):
        arrived = frames.counts[f, FIRST_EVENT + ARRIVED]
        steps = frames.counts[f, FIRST_EVENT + ARRIVAL_STEPS]
        values[f] = ground.dt * steps / arrived if arrived > 0 else math.nan


@jit
def goals_reached(
    frames: Frames,
    filled: int,
    ground: Ground,
    _observation: Observation,
    values: Floats,
) -> None:
    """Mean number of goals that a boid has reached, one after the other."""
    for f in range(filled):
        values[f] = frames.counts[f, FIRST_EVENT + GOALS_REACHED] / ground.boids


@jit
def equilibrium(
    frames: Frames,
    filled: int,
    ground: Ground,
    _observation: Observation,
    values: Floats,
) -> None:
    """Boids that have moved in step with all their neighbours, at least one, for
    equilibrium_steps, in per cent.
    """
    for f in range(filled):
        values[f] = 100.0 * frames.counts[f, FIRST_EVENT + SETTLED] / ground.boids


@jit
def dead_end_time(
    frames: Frames,
    filled: int,
    ground: Ground,
    _observation: Observation,
    values: Floats,
) -> None:
    """How long boids looked for a free heading and found none, since the start: a sum
    over boids, each step counted as dt.
    """
    for f in range(filled):
        values[f] = ground.dt * frames.counts[f, FIRST_EVENT + DEAD_ENDS]
