"""Flocks: the connected components of boids nearer than `flock_range`."""

import math

import numpy as np
from numpy.typing import NDArray

from kernels.groups import label_groups
from kernels.jit import jit, jit_with_memory
from kernels.metrics.ground import VX, VY, Ground, X, Y
from kernels.recording import Frames
from kernels.settings import Observation
from kernels.state import Floats


@jit_with_memory
def labels(x: Floats, y: Floats, reach: float) -> NDArray[np.int64]:
    """Return for every boid the label of its flock, an int64 array of shape (N,).

    The label is the index of a boid of the flock, equal for all members.

    Parameters
    ----------
    x, y : array of float, shape (N,)
        Positions, in lengths.
    reach : float
        Distance below which two boids are joined.
    """
    found = np.empty(x.size, np.int64)
    label_groups(x, y, np.argsort(x), reach, found)
    return found


@jit_with_memory
def sizes(flock: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return sizes of flocks (N,), at the index of the flock label; 0 elsewhere."""
    members = np.zeros(flock.size, np.int64)
    for i in range(flock.size):
        members[flock[i]] += 1
    return members


@jit_with_memory
def largest(flock: NDArray[np.int64]) -> tuple[int, int]:
    """Return the label and the size of the largest flock, the first of equal flocks."""
    members = sizes(flock)
    which = 0
    for label in range(members.size):
        if members[label] > members[which]:
            which = label
    return which, int(members[which])


@jit
def count_flocks(members: NDArray[np.int64], least: int) -> int:
    """Count the flocks of at least `least` members, from the `sizes` of all."""
    # np.sum would load modules of numba for 0.3 s in each process.
    flocks = 0
    for label in range(members.size):
        flocks += int(members[label] >= least)
    return flocks


@jit_with_memory
def flock_count(
    frames: Frames,
    filled: int,
    _ground: Ground,
    observation: Observation,
    values: Floats,
) -> None:
    """Count the flocks.

    Parameters
    ----------
    frames, filled, _ground, observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Number of flocks; a boid alone is a flock.
    """
    for f in range(filled):
        flock = labels(
            frames.bodies[f, X], frames.bodies[f, Y], observation.flock_range
        )
        values[f] = count_flocks(sizes(flock), 1)


@jit_with_memory
def largest_flock(
    frames: Frames,
    filled: int,
    _ground: Ground,
    observation: Observation,
    values: Floats,
) -> None:
    """Count the boids in the largest flock.

    Parameters
    ----------
    frames, filled, _ground, observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Number of boids.
    """
    for f in range(filled):
        values[f] = largest(
            labels(frames.bodies[f, X], frames.bodies[f, Y], observation.flock_range)
        )[1]


@jit_with_memory
def largest_flock_share(
    frames: Frames,
    filled: int,
    ground: Ground,
    observation: Observation,
    values: Floats,
) -> None:
    """Compute the fraction of boids in the largest flock.

    Parameters
    ----------
    frames, filled, ground, observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Percent of all boids.
    """
    largest_flock(frames, filled, ground, observation, values)
    for f in range(filled):
        values[f] *= 100.0 / frames.bodies.shape[2]


@jit_with_memory
def boids_lost(
    frames: Frames,
    filled: int,
    ground: Ground,
    observation: Observation,
    values: Floats,
) -> None:
    """Count the boids outside the largest flock.

    Parameters
    ----------
    frames, filled, ground, observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Number of boids.
    """
    largest_flock(frames, filled, ground, observation, values)
    for f in range(filled):
        values[f] = frames.bodies.shape[2] - values[f]


@jit_with_memory
def smallest_flock(
    frames: Frames,
    filled: int,
    _ground: Ground,
    observation: Observation,
    values: Floats,
) -> None:
    """Count the boids in the smallest flock.

    Parameters
    ----------
    frames, filled, _ground, observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Number of boids; a boid alone is a flock of one.
    """
    n = frames.bodies.shape[2]
    for f in range(filled):
        members = sizes(
            labels(frames.bodies[f, X], frames.bodies[f, Y], observation.flock_range)
        )
        least = n
        for label in range(n):
            if members[label] > 0:
                least = min(least, int(members[label]))
        values[f] = least


@jit_with_memory
def boids_alone(
    frames: Frames,
    filled: int,
    _ground: Ground,
    observation: Observation,
    values: Floats,
) -> None:
    """Count the boids without a neighbour within flock_range.

    Parameters
    ----------
    frames, filled, _ground, observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Number of boids.
    """
    for f in range(filled):
        members = sizes(
            labels(frames.bodies[f, X], frames.bodies[f, Y], observation.flock_range)
        )
        values[f] = count_flocks(members, 1) - count_flocks(members, 2)


@jit_with_memory
def flock_correlation(
    frames: Frames,
    filled: int,
    _ground: Ground,
    observation: Observation,
    values: Floats,
) -> None:
    """Compute the mean correlation of the velocities of boids of one flock.

    The correlation of a boid is the mean cosine of the angles between its velocity and
    the velocities of the remaining boids of the flock. A pair with a boid at rest
    counts as 0. Boids alone are left out.

    The metric is phi_corr of Vasarhelyi et al. (2018).

    Parameters
    ----------
    frames, filled, _ground, observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Mean over boids, from -1 to 1; NaN if all boids are alone.
    """
    n = frames.bodies.shape[2]
    for f in range(filled):
        flock = labels(
            frames.bodies[f, X], frames.bodies[f, Y], observation.flock_range
        )
        members = sizes(flock)
        sums = np.zeros((3, n))
        for i in range(n):
            vx, vy = frames.bodies[f, VX, i], frames.bodies[f, VY, i]
            size = math.sqrt(vx * vx + vy * vy)
            if size > 0.0:
                sums[0, flock[i]] += vx / size
                sums[1, flock[i]] += vy / size
                sums[2, flock[i]] += 1.0
        total, others = 0.0, 0
        for label in range(n):
            if members[label] > 1:
                x, y, moving = sums[0, label], sums[1, label], sums[2, label]
                total += (x * x + y * y - moving) / (members[label] - 1)
                others += members[label]
        values[f] = total / others if others > 0 else math.nan
