"""Shape of the swarm: radius, distances between boids, elongation, rotation."""

import math

import numpy as np

from kernels.jit import jit, jit_with_memory
from kernels.metrics.flocks import labels, largest
from kernels.metrics.ground import VX, VY, Ground, X, Y
from kernels.recording import Frames
from kernels.settings import Observation
from kernels.state import Floats


@jit
def _centre_distance(frames: Frames, f: int, i: int, x: float, y: float) -> float:
    dx, dy = frames.bodies[f, X, i] - x, frames.bodies[f, Y, i] - y
    return math.sqrt(dx * dx + dy * dy)


@jit
def _centre(frames: Frames, f: int) -> tuple[float, float]:
    """Return the centre of mass of frame `f`."""
    n = frames.bodies.shape[2]
    x, y = 0.0, 0.0
    for i in range(n):
        x += frames.bodies[f, X, i]
        y += frames.bodies[f, Y, i]
    return x / n, y / n


@jit
def _mean_distance(frames: Frames, f: int, x: float, y: float) -> float:
    """Return the mean distance of the boids of frame `f` from (x, y)."""
    total = 0.0
    for i in range(frames.bodies.shape[2]):
        total += _centre_distance(frames, f, i, x, y)
    return float(total / frames.bodies.shape[2])


@jit
def flock_radius(
    frames: Frames,
    filled: int,
    _ground: Ground,
    _observation: Observation,
    values: Floats,
) -> None:
    """Compute the mean distance from the centre of mass.

    Parameters
    ----------
    frames, filled, _ground, _observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Mean over boids, in lengths.
    """
    for f in range(filled):
        x, y = _centre(frames, f)
        values[f] = _mean_distance(frames, f, x, y)


@jit
def dispersion(
    frames: Frames,
    filled: int,
    _ground: Ground,
    _observation: Observation,
    values: Floats,
) -> None:
    """Compute the standard deviation of the distances from the centre of mass.

    Parameters
    ----------
    frames, filled, _ground, _observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Standard deviation with ddof 0, in lengths.
    """
    n = frames.bodies.shape[2]
    for f in range(filled):
        x, y = _centre(frames, f)
        mean = _mean_distance(frames, f, x, y)
        total = 0.0
        for i in range(n):
            off = _centre_distance(frames, f, i, x, y) - mean
            total += off * off
        values[f] = math.sqrt(total / n)


@jit
def angular_momentum(
    frames: Frames,
    filled: int,
    _ground: Ground,
    _observation: Observation,
    values: Floats,
) -> None:
    """Compute the absolute mean of the cross product of two unit vectors.

    The first vector points from the centre of mass to a boid, the second vector along
    the velocity of the boid. A boid at rest or at the centre counts as 0.

    Couzin, Krause, James, Ruxton and Franks (2002), Collective memory and spatial
    sorting in animal groups, J. theor. Biol. 218, 1: the group angular momentum.

    Parameters
    ----------
    frames, filled, _ground, _observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Angular momentum from 0 to 1; 1 if all boids circle the centre in one direction.
    """
    n = frames.bodies.shape[2]
    for f in range(filled):
        x, y = _centre(frames, f)
        total = 0.0
        for i in range(n):
            dx, dy = frames.bodies[f, X, i] - x, frames.bodies[f, Y, i] - y
            vx, vy = frames.bodies[f, VX, i], frames.bodies[f, VY, i]
            size = math.sqrt(dx * dx + dy * dy) * math.sqrt(vx * vx + vy * vy)
            if size > 0.0:
                total += (dx * vy - dy * vx) / size
        values[f] = abs(total) / n


@jit_with_memory
def nearest_neighbour_distance(
    frames: Frames,
    filled: int,
    _ground: Ground,
    _observation: Observation,
    values: Floats,
) -> None:
    """Compute the mean distance to the nearest neighbour.

    The search sweeps outwards along x and compares about N sqrt(N) pairs.

    Parameters
    ----------
    frames, filled, _ground, _observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Mean over boids, in lengths; NaN for one boid.
    """
    n = frames.bodies.shape[2]
    for f in range(filled):
        x, y = frames.bodies[f, X], frames.bodies[f, Y]
        order = np.argsort(x)
        total = 0.0
        for k in range(n):
            best = math.inf
            for way in (-1, 1):
                other = k + way
                while 0 <= other < n:
                    dx = x[order[other]] - x[order[k]]
                    dy = y[order[other]] - y[order[k]]
                    if dx * dx >= best:
                        break
                    best = min(best, dx * dx + dy * dy)
                    other += way
            total += math.sqrt(best)
        values[f] = total / n if n > 1 else math.nan


@jit_with_memory
def in_contact(
    frames: Frames,
    filled: int,
    _ground: Ground,
    observation: Observation,
    values: Floats,
) -> None:
    """Compute the fraction of boids with a neighbour nearer than contact_distance.

    The mean over frames is the fraction of the time that a boid spends in contact.

    Parameters
    ----------
    frames, filled, _ground, observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Percent of all boids.
    """
    n, reach = frames.bodies.shape[2], observation.contact_distance
    touching = np.zeros(n, np.bool_)
    for f in range(filled):
        x, y = frames.bodies[f, X], frames.bodies[f, Y]
        order = np.argsort(x)
        touching[:] = False
        for k in range(n):
            for other in range(k + 1, n):
                i, j = order[k], order[other]
                dx, dy = x[j] - x[i], y[j] - y[i]
                if dx >= reach:
                    break
                if dx * dx + dy * dy < reach * reach:
                    touching[i] = True
                    touching[j] = True
        touched = 0  # np.sum would load modules of numba for 0.3 s
        for i in range(n):
            touched += int(touching[i])
        values[f] = 100.0 * touched / n


@jit_with_memory
def least_distance(
    frames: Frames,
    filled: int,
    _ground: Ground,
    _observation: Observation,
    values: Floats,
) -> None:
    """Compute the least distance of two boids.

    Parameters
    ----------
    frames, filled, _ground, _observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Distance, in lengths; NaN for one boid.
    """
    n = frames.bodies.shape[2]
    for f in range(filled):
        x, y = frames.bodies[f, X], frames.bodies[f, Y]
        order = np.argsort(x)
        best = math.inf
        for k in range(n):
            for other in range(k + 1, n):
                i, j = order[k], order[other]
                dx, dy = x[j] - x[i], y[j] - y[i]
                if dx * dx >= best:
                    break
                best = min(best, dx * dx + dy * dy)
        values[f] = math.sqrt(best) if n > 1 else math.nan


@jit_with_memory
def pairs_in_contact(
    frames: Frames,
    filled: int,
    _ground: Ground,
    observation: Observation,
    values: Floats,
) -> None:
    """Compute the fraction of pairs of boids that are in contact.

    A pair is in contact if the distance of the two boids is below contact_distance.
    phi_coll of Vasarhelyi et al. (2018) is a fraction, a hundredth of the values.

    Parameters
    ----------
    frames, filled, _ground, observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Percent of all pairs; NaN for one boid.
    """
    n, reach = frames.bodies.shape[2], observation.contact_distance
    for f in range(filled):
        x, y = frames.bodies[f, X], frames.bodies[f, Y]
        order = np.argsort(x)
        pairs = 0
        for k in range(n):
            for other in range(k + 1, n):
                i, j = order[k], order[other]
                dx, dy = x[j] - x[i], y[j] - y[i]
                if dx >= reach:
                    break
                pairs += int(dx * dx + dy * dy < reach * reach)
        values[f] = 200.0 * pairs / (n * (n - 1)) if n > 1 else math.nan


@jit_with_memory
def elongation(
    frames: Frames,
    filled: int,
    _ground: Ground,
    observation: Observation,
    values: Floats,
) -> None:
    """Compute the elongation (a - b) / (a + b) of the largest flock.

    The lengths a and b are the standard deviations of the positions of its boids along
    and across the course of the flock.

    Parameters
    ----------
    frames, filled, _ground, observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        1 for a column, 0 for a round flock, -1 for a broad front; NaN for fewer
        than three boids or without a course.
    """
    for f in range(filled):
        flock = labels(
            frames.bodies[f, X], frames.bodies[f, Y], observation.flock_range
        )
        which, size = largest(flock)
        x, y, vx, vy = 0.0, 0.0, 0.0, 0.0
        for i in range(flock.size):
            if flock[i] == which:
                x += frames.bodies[f, X, i] / size
                y += frames.bodies[f, Y, i] / size
                vx += frames.bodies[f, VX, i]
                vy += frames.bodies[f, VY, i]
        along, across = 0.0, 0.0
        for i in range(flock.size):
            if flock[i] == which:
                dx, dy = frames.bodies[f, X, i] - x, frames.bodies[f, Y, i] - y
                along += (dx * vx + dy * vy) * (dx * vx + dy * vy)
                across += (dx * vy - dy * vx) * (dx * vy - dy * vx)
        a, b = math.sqrt(along), math.sqrt(across)
        values[f] = (a - b) / (a + b) if size > 2 and a + b > 0.0 else math.nan


@jit_with_memory
def neighbours_ahead(
    frames: Frames,
    filled: int,
    _ground: Ground,
    observation: Observation,
    values: Floats,
) -> None:
    """Compute the fraction of the neighbours of moving boids that are ahead.

    A neighbour is ahead if its direction is within 90 degrees of the course of the
    boid.

    Parameters
    ----------
    frames, filled, _ground, observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Percent of the neighbours of all moving boids; NaN without any.
    """
    n, reach2 = (
        frames.bodies.shape[2],
        observation.flock_range * observation.flock_range,
    )
    for f in range(filled):
        x, y = frames.bodies[f, X], frames.bodies[f, Y]
        vx, vy = frames.bodies[f, VX], frames.bodies[f, VY]
        order = np.argsort(x)
        ahead, all_of_them = 0, 0
        for k in range(n):
            for other in range(k + 1, n):
                i, j = order[k], order[other]
                dx, dy = x[j] - x[i], y[j] - y[i]
                if dx >= observation.flock_range:
                    break
                if dx * dx + dy * dy < reach2:
                    ahead += int(dx * vx[i] + dy * vy[i] > 0.0) + int(
                        dx * vx[j] + dy * vy[j] < 0.0
                    )
                    all_of_them += int(vx[i] != 0.0 or vy[i] != 0.0) + int(
                        vx[j] != 0.0 or vy[j] != 0.0
                    )
        values[f] = 100.0 * ahead / all_of_them if all_of_them > 0 else math.nan
