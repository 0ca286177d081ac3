"""Profiles over the time between two frames, and the delay between two boids."""

import math

import numpy as np

from kernels.jit import jit, jit_with_memory
from kernels.profiles.pairs import distance_of
from kernels.profiles.passage import Passage
from kernels.state import Floats, Kinds
from kernels.torus import nearest_image

NEAREST = 6
"""Number of nearest neighbours whose exchange is measured.

M. Ballerini et al. (2008), PNAS 105, 1232: starlings interact with six to seven.
"""


@jit_with_memory
def mean_squared_displacement(passage: Passage, axis: Floats, values: Floats) -> None:
    """Compute the mean square of the distance that boids cover in a time.

    With periodic borders, displacements between consecutive frames are added up. Each
    displacement must be shorter than half of the world.

    Parameters
    ----------
    passage : Passage
    axis : array of float, shape (K,)
        Lags in frames.
    values : array of float, shape (K,)
        Mean over boids and over pairs of frames; NaN without such a pair.
    """
    frames, n = passage.x.shape
    x = passage.x.copy()
    y = passage.y.copy()
    if passage.periodic:
        _unwrap(x, passage.width)
        _unwrap(y, passage.height)
    for k in range(values.size):
        lag = int(axis[k])
        total = 0.0
        count = 0
        for f in range(frames - lag):
            for i in range(n):
                dx = x[f + lag, i] - x[f, i]
                dy = y[f + lag, i] - y[f, i]
                square = dx * dx + dy * dy
                if square == square:
                    total += square
                    count += 1
        values[k] = total / count if count > 0 else math.nan


@jit
def _unwrap(positions: Floats, period: float) -> None:
    """Replace positions on a circle (F, N) by positions along a line."""
    frames, n = positions.shape
    for i in range(n):
        around = math.nan
        along = math.nan
        for f in range(frames):
            now = positions[f, i]
            if now != now:
                continue
            if along == along:
                along += nearest_image(now - around, period)
            else:
                along = now
            around = now
            positions[f, i] = along


@jit_with_memory
def neighbour_overlap(passage: Passage, axis: Floats, values: Floats) -> None:
    """Compute the share of the nearest neighbours that are nearest later, too.

    Parameters
    ----------
    passage : Passage
    axis : array of float, shape (K,)
        Lags in frames.
    values : array of float, shape (K,)
        Mean over boids and over pairs of frames; NaN unless frames have more than
        NEAREST boids.
    """
    frames, n = passage.x.shape
    near = np.full((frames, n, NEAREST), -1)
    distances = np.zeros(NEAREST)
    for f in range(frames):
        for i in range(n):
            _find_nearest(passage, f, i, near[f, i], distances=distances)
    for k in range(values.size):
        lag = int(axis[k])
        same = 0
        count = 0
        for f in range(frames - lag):
            for i in range(n):
                before = near[f, i]
                after = near[f + lag, i]
                if before[NEAREST - 1] < 0 or after[NEAREST - 1] < 0:
                    continue
                count += NEAREST
                for j in before:
                    for other in after:
                        if j == other:
                            same += 1
        values[k] = same / count if count > 0 else math.nan


@jit
def _find_nearest(
    passage: Passage, f: int, i: int, near: Kinds, distances: Floats
) -> None:
    """Write the nearest neighbours of a boid in order, -1 where there are none."""
    near[:] = -1
    distances[:] = math.inf
    for j in range(passage.x.shape[1]):
        distance = distance_of(passage, f, i, j)
        if j == i or not distance < distances[NEAREST - 1]:
            continue
        place = NEAREST - 1
        while place > 0 and distances[place - 1] > distance:
            distances[place] = distances[place - 1]
            near[place] = near[place - 1]
            place -= 1
        distances[place] = distance
        near[place] = j


@jit_with_memory
def directional_delay(passage: Passage, axis: Floats, values: Floats) -> None:
    """Compute the mean delay with which the others turn into the heading of a boid.

    The delay of a pair is the lag with the largest mean cosine between the headings.
    Of equal cosines, the shorter lag counts.

    M. Nagy et al. (2010), Hierarchical group dynamics in pigeon flocks, Nature 464,
    890, take the mean over pairs with a large correlation; here it is over all pairs.

    Parameters
    ----------
    passage : Passage
    axis : array of float, shape (L,)
        Lags in frames, ascending, from 0.
    values : array of float, shape (N,)
        Mean over the other boids, in frames; above 0 for a boid that leads. NaN for a
        boid without a common frame with another boid in motion.
    """
    n = passage.x.shape[1]
    ux = passage.vx.copy()
    uy = passage.vy.copy()
    _normalise(ux, uy)
    pairs = np.zeros(n, np.int64)
    values[:] = 0.0
    for i in range(n):
        for j in range(i):
            best = -math.inf
            delay = math.nan
            for k in range(axis.size):
                lag = int(axis[k])
                for leader, follower, sign in ((i, j, 1.0), (j, i, -1.0)):
                    cosine = _mean_cosine(ux, uy, leader, follower, lag=lag)
                    if cosine > best:
                        best = cosine
                        delay = sign * lag
            if delay == delay:
                values[i] += delay
                values[j] -= delay
                pairs[i] += 1
                pairs[j] += 1
    for i in range(n):
        values[i] = values[i] / pairs[i] if pairs[i] > 0 else math.nan


@jit
def _normalise(x: Floats, y: Floats) -> None:
    """Divide vectors (F, N) by their lengths; a vector of length 0 becomes NaN."""
    frames, n = x.shape
    for f in range(frames):
        for i in range(n):
            size = math.sqrt(x[f, i] * x[f, i] + y[f, i] * y[f, i])
            x[f, i] = x[f, i] / size if size > 0.0 else math.nan
            y[f, i] = y[f, i] / size if size > 0.0 else math.nan


@jit
def _mean_cosine(ux: Floats, uy: Floats, leader: int, follower: int, lag: int) -> float:
    """Return the mean cosine between a heading and another heading `lag` frames later.

    The headings are unit vectors (F, N). NaN without two frames in which both move.
    """
    total = 0.0
    count = 0
    for f in range(ux.shape[0] - lag):
        cosine = ux[f, leader] * ux[f + lag, follower]
        cosine += uy[f, leader] * uy[f + lag, follower]
        if cosine == cosine:
            total += cosine
            count += 1
    return total / count if count > 0 else math.nan
