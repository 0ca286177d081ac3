"""Counts of a trial, of pixels and of events, and integrals over its time."""

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
    """Compute the visited fraction of the traversable pixels.

    Parameters
    ----------
    frames, filled, ground, _observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Percent of the traversable pixels.
    """
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
    """Compute the visited fraction of all pixels of the world.

    Parameters
    ----------
    frames, filled, ground, _observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Percent of all pixels, those in obstacles included.
    """
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
    """Compute the coefficient of variation of the visits to traversable pixels.

    It is the standard deviation over the mean of the visit counts.

    Parameters
    ----------
    frames, filled, ground, observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Coefficient of variation, with `coverage_cv_ddof`; NaN before the first
        visit.
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
    """Count how often a boid has left the world since the start.

    Parameters
    ----------
    frames, filled, _ground, _observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Number of escapes of all boids.
    """
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
    """Count how often the position of a boid has entered an obstacle since the start.

    Parameters
    ----------
    frames, filled, _ground, _observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Number of collisions of all boids.
    """
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
    """Count how often a boid has come into contact with others since the start.

    A boid is in contact if it is nearer than contact_distance to at least one other.

    Parameters
    ----------
    frames, filled, _ground, _observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Number of such events of all boids; both boids of a pair count.
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
    """Compute the fraction of boids that have been within goal_radius of the goal.

    Where there are several goals, a boid must have been at each of them in turn.

    Parameters
    ----------
    frames, filled, ground, _observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Percent of all boids.
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
    """Compute the mean time at which boids first came within goal_radius of the goal.

    Where there are several goals in turn, the last one counts.

    Parameters
    ----------
    frames, filled, ground, _observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Mean over the boids that have arrived, in times; NaN if none has.
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
    """Compute the mean number of goals that a boid has reached, one after the other.

    Parameters
    ----------
    frames, filled, ground, _observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Goals per boid.
    """
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
    """Compute the fraction of boids in a local equilibrium.

    Such a boid has moved in step with all its neighbours, at least one, for
    equilibrium_steps.

    Parameters
    ----------
    frames, filled, ground, _observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Percent of all boids.
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
    """Compute how long boids looked for a free heading and found none, since the start.

    Parameters
    ----------
    frames, filled, ground, _observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Sum over boids, in times; each step counts as dt.
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
    """Count how often two boids have come into contact since the start.

    They are in contact if they are nearer than contact_distance. A pair counts once
    until it is farther apart after a step.

    Parameters
    ----------
    frames, filled, _ground, _observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Number of such events of all pairs.
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
    """Compute the collisions per boid and unit of time since the start.

    They are collisions of two boids and collisions with an obstacle. A collision of two
    boids counts once.

    Parameters
    ----------
    frames, filled, ground, _observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Rate per boid, in 1/time; NaN at the start.
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
    """Count how often flocks have parted between recorded frames, since the start.

    See kernels.events.regroup.

    Parameters
    ----------
    frames, filled, _ground, _observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Number of fissions.
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
    """Count how often flocks have joined between recorded frames, since the start.

    See kernels.events.regroup.

    Parameters
    ----------
    frames, filled, _ground, _observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Number of fusions.
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
    """Compute the mean length of the paths of boids since the start.

    It is the integral of |v| over time, each step with the speed at its end.

    Parameters
    ----------
    frames, filled, ground, _observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Mean over boids, in lengths.
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
    """Compute the mean integral of |a|^2 over time since the start.

    The acceleration a is the change of the velocity in a step over its time. A velocity
    that is mirrored at a border changes.

    This is the cost of minimum-energy control: Athans and Falb (1966), Optimal Control.
    A turn at constant speed v and rate w costs (v w)^2 per unit of time, in the limit
    of short steps. In steps of dt it costs less by the factor (sin(h) / h)^2, h = w dt
    / 2.

    Parameters
    ----------
    frames, filled, ground, _observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Mean over boids, in length^2/time^3.
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
    """Compute the mean work of the motors per unit of mass since the start.

    It is the integral of the power v a where the power is positive. A boid that slows
    down does not regain the energy.

    It equals the sum of all gains of |v|^2 / 2 from step to step. A fall and a rise of
    the speed within one step are not seen.

    Parameters
    ----------
    frames, filled, ground, _observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Mean over boids, in length^2/time^2.
    """
    for f in range(filled):
        values[f] = frames.integrals[f, GAINS] / ground.boids
