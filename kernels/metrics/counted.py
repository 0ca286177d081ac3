"""Counts of pixels and events in a trial, and integrals over time."""

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
        Percent of all pixels, including pixels in obstacles.
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

    The coefficient is the standard deviation of the visit counts over the mean.

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
    """Count the exits of boids from the world since the start.

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
    """Count the entries of boid positions into obstacles since the start.

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
    """Count the contacts of single boids since the start.

    A boid is in contact if the distance to at least one further boid is below
    contact_distance. The beginning of a contact is an event.

    Parameters
    ----------
    frames, filled, _ground, _observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Number of events of all boids; the two boids of a pair count separately.
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

    With several goals, a boid must have been at each goal in turn.

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

    With several goals in turn, the last goal counts.

    Parameters
    ----------
    frames, filled, ground, _observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Mean over the boids that have arrived, in times; NaN before any arrival.
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
    """Compute the mean number of goals that a boid has reached in turn.

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

    A boid is in equilibrium if for equilibrium_steps the boid has had neighbours, and
    velocities close to the velocities of all neighbours.

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
    """Compute the time that boids have spent in dead ends since the start.

    Parameters
    ----------
    frames, filled, ground, _observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Sum over boids, in times; a step counts as dt. In a dead end a boid looks for
        a free heading and finds no free heading.
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
    """Count the contacts of two boids since the start.

    Two boids are in contact below contact_distance. A pair counts once until the pair
    is farther apart after a step.

    Parameters
    ----------
    frames, filled, _ground, _observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Number of contacts of all pairs.
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

    Collisions are contacts of two boids and entries into obstacles. A contact of two
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
    """Count the fissions of flocks between recorded frames since the start.

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
    """Count the fusions of flocks between recorded frames since the start.

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

    The length is the integral of |v| over time, with the speed at the end of each step.

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

    The acceleration a is the change of the velocity in a step over the time of the
    step. The mirroring of a velocity at a border is a change.

    This integral is the cost of minimum-energy control: Athans and Falb (1966), Optimal
    Control. A turn at constant speed v and rate w costs (v w)^2 per unit of time, in
    the limit of short steps. In steps of dt the cost is lower by the factor (sin(h) /
    h)^2, with h = w dt / 2.

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

    The work is the integral of the power v a where the power is positive. A boid that
    slows down does not regain the energy.

    The work equals the sum of all gains of |v|^2 / 2 from step to step. Changes of the
    speed within one step are not detected.

    Parameters
    ----------
    frames, filled, ground, _observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Mean over boids, in length^2/time^2.
    """
    for f in range(filled):
        values[f] = frames.integrals[f, GAINS] / ground.boids
