"""What was counted during a trial, pixels and events, and what was summed up."""

import math

from kernels.events import (
    ARRIVAL_STEPS,
    ARRIVED,
    BOID_COLLISIONS,
    CHANGES,
    COLLISIONS,
    DEAD_ENDS,
    ESCAPES,
    FISSIONS,
    FUSIONS,
    GAINS,
    GOALS_REACHED,
    PAIR_COLLISIONS,
    SETTLED,
    SPEEDS,
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


@jit
def pair_collisions(
    frames: Frames,
    filled: int,
    _ground: Ground,
    _observation: Observation,
    values: Floats,
) -> None:
    """How often two boids have come nearer than contact_distance to each other since
    the start: a pair counts once until it is farther apart after a step.
    """
    for f in range(filled):
        values[f] = frames.counts[f, FIRST_EVENT + PAIR_COLLISIONS]


@jit
def collision_rate(
    frames: Frames,
    filled: int,
    ground: Ground,
    _observation: Observation,
    values: Floats,
) -> None:
    """Collisions a boid and unit of time since the start, of two boids or with an
    obstacle; one of two boids counts once. NaN at the start.
    """
    for f in range(filled):
        time = ground.dt * ground.boids * frames.step[f]
        found = (
            frames.counts[f, FIRST_EVENT + PAIR_COLLISIONS]
            + frames.counts[f, FIRST_EVENT + COLLISIONS]
        )
        values[f] = found / time if time > 0.0 else math.nan


@jit
def fissions(
    frames: Frames,
    filled: int,
    _ground: Ground,
    _observation: Observation,
    values: Floats,
) -> None:
    """How often flocks have parted from one recorded frame to the next, since the
    start: see kernels.events.regroup.
    """
    for f in range(filled):
        values[f] = frames.counts[f, FIRST_EVENT + FISSIONS]


@jit
def fusions(
    frames: Frames,
    filled: int,
    _ground: Ground,
    _observation: Observation,
    values: Floats,
) -> None:
    """How often flocks have joined from one recorded frame to the next, since the
    start: see kernels.events.regroup.
    """
    for f in range(filled):
        values[f] = frames.counts[f, FIRST_EVENT + FUSIONS]


@jit
def path_length(
    frames: Frames,
    filled: int,
    ground: Ground,
    _observation: Observation,
    values: Floats,
) -> None:
    """Mean over boids of the integral of |v| over time since the start, each step with
    the speed at its end.
    """
    for f in range(filled):
        values[f] = ground.dt * frames.integrals[f, SPEEDS] / ground.boids


@jit
def control_effort(
    frames: Frames,
    filled: int,
    ground: Ground,
    _observation: Observation,
    values: Floats,
) -> None:
    """Mean over boids of the integral of |a|^2 over time since the start, where a is
    the change of the velocity in a step over its time. A velocity that is mirrored at a
    border changes.

    The cost of minimum-energy control: Athans and Falb (1966), Optimal Control.
    A turn at constant speed v and rate w has (v w)^2 a unit of time, in the limit of
    short steps; in steps of dt it is less by the factor (sin(h) / h)^2, h = w dt / 2.
    """
    for f in range(filled):
        changes = frames.integrals[f, CHANGES] / ground.boids
        values[f] = changes / ground.dt


@jit
def mechanical_work(
    frames: Frames,
    filled: int,
    ground: Ground,
    _observation: Observation,
    values: Floats,
) -> None:
    """Mean over boids of the work that motors do for a unit of mass, since the start:
    the integral of the power v a where it is positive. What a boid loses in slowing
    down is not regained.

    It is the sum of all gains of |v|^2 / 2 from step to step. A fall and a rise of the
    speed within one step are not seen.
    """
    for f in range(filled):
        values[f] = frames.integrals[f, GAINS] / ground.boids
