"""Profiles over distances between boids."""

import math

import numpy as np

from kernels.jit import jit, jit_with_memory
from kernels.profiles.passage import Passage
from kernels.state import Floats
from kernels.torus import nearest_image

ROUNDING = 1e-24
"""Mean square of deviations, relative to that of velocities, that is rounding alone."""


@jit
def distance_of(passage: Passage, f: int, i: int, j: int) -> float:
    """Return the distance of two boids; NaN if one of them has no position.

    Parameters
    ----------
    passage : Passage
    f : int
        Frame.
    i, j : int
        Boids.
    """
    dx = passage.x[f, j] - passage.x[f, i]
    dy = passage.y[f, j] - passage.y[f, i]
    if passage.periodic:
        dx = nearest_image(dx, passage.width)
        dy = nearest_image(dy, passage.height)
    return math.sqrt(dx * dx + dy * dy)


@jit
def _bin(edges: Floats, distance: float) -> int:
    """Return the bin of a distance, whose lower edge is included; -1 for none."""
    bins = edges.size - 1
    if not (edges[0] <= distance < edges[bins]):
        return -1
    k = int((distance - edges[0]) / (edges[bins] - edges[0]) * bins)
    k = min(k, bins - 1)
    while distance < edges[k]:  # the division rounds
        k -= 1
    while distance >= edges[k + 1]:
        k += 1
    return k


@jit
def pair_distribution(passage: Passage, axis: Floats, values: Floats) -> None:
    """Compute the density of boids at a distance from a boid, relative to the mean.

    Parameters
    ----------
    passage : Passage
    axis : array of float, shape (K + 1,)
        Edges of the bins of distance.
    values : array of float, shape (K,)
        Ratio of the number of pairs to the number of pairs of independent boids that
        are anywhere in the world; NaN without two boids in a frame.
    """
    frames, n = passage.x.shape
    values[:] = 0.0
    expected = 0.0
    for f in range(frames):
        present = 0
        for i in range(n):
            if passage.x[f, i] == passage.x[f, i]:
                present += 1
            for j in range(i):
                k = _bin(axis, distance_of(passage, f, i, j))
                if k >= 0:
                    values[k] += 1.0
        expected += 0.5 * present * (present - 1)
    area = passage.width * passage.height
    for k in range(values.size):
        ring = math.pi * (axis[k + 1] * axis[k + 1] - axis[k] * axis[k])
        values[k] = values[k] / (expected * ring / area) if expected > 0 else math.nan


@jit_with_memory
def velocity_correlation_function(
    passage: Passage, axis: Floats, values: Floats
) -> None:
    """Compute the correlation of the deviations of two velocities from the mean.

    Parameters
    ----------
    passage : Passage
    axis : array of float, shape (K + 1,)
        Edges of the bins of distance.
    values : array of float, shape (K,)
        Mean over pairs and frames; NaN without a pair. A frame in which all velocities
        are equal counts for no bin.
    """
    frames, n = passage.x.shape
    pairs = np.zeros(values.size, np.int64)
    values[:] = 0.0
    for f in range(frames):
        mean_x, mean_y, square = _deviations(passage, f)
        if not square > 0.0:
            continue
        for i in range(n):
            for j in range(i):
                k = _bin(axis, distance_of(passage, f, i, j))
                if k >= 0:
                    x = (passage.vx[f, i] - mean_x) * (passage.vx[f, j] - mean_x)
                    y = (passage.vy[f, i] - mean_y) * (passage.vy[f, j] - mean_y)
                    values[k] += (x + y) / square
                    pairs[k] += 1
    for k in range(values.size):
        values[k] = values[k] / pairs[k] if pairs[k] > 0 else math.nan


@jit
def _deviations(passage: Passage, f: int) -> tuple[float, float, float]:
    """Return the mean velocity of a frame, and the mean square of the deviations.

    The mean square is 0 if all velocities are equal but for rounding.
    """
    x = 0.0
    y = 0.0
    present = 0
    n = passage.x.shape[1]
    for i in range(n):
        if passage.x[f, i] == passage.x[f, i]:
            x += passage.vx[f, i]
            y += passage.vy[f, i]
            present += 1
    if present == 0:
        return 0.0, 0.0, 0.0
    x /= present
    y /= present
    square = 0.0
    speeds = 0.0
    for i in range(n):
        if passage.x[f, i] == passage.x[f, i]:
            vx = passage.vx[f, i]
            vy = passage.vy[f, i]
            speeds += vx * vx + vy * vy
            square += (vx - x) * (vx - x) + (vy - y) * (vy - y)
    if not square > ROUNDING * speeds:
        square = 0.0
    return x, y, square / present
