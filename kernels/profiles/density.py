"""Profiles of the density: waves, and numbers of boids in boxes."""

import math

import numpy as np

from kernels.elementary import sine_cosine
from kernels.jit import jit, jit_with_memory
from kernels.profiles.passage import Passage
from kernels.state import Floats


@jit_with_memory
def structure_factor(passage: Passage, axis: Floats, values: Floats) -> None:
    """Compute the square of the Fourier transform of the positions, per boid.

    The waves are those that fit into the world, in all directions.

    Parameters
    ----------
    passage : Passage
    axis : array of float, shape (K + 1,)
        Edges of the bins of wave number, above 0, in radians per length.
    values : array of float, shape (K,)
        Mean over waves and frames; NaN without a wave, or without a boid.
    """
    unit_x = 2.0 * math.pi / passage.width
    unit_y = 2.0 * math.pi / passage.height
    bins = values.size
    across = int(axis[bins] / unit_x)
    up = int(axis[bins] / unit_y)
    frames, n = passage.x.shape
    cosine, sine = np.zeros((2, up + 1, n))
    waves = np.zeros(bins, np.int64)
    values[:] = 0.0
    for f in range(frames):
        present = 0
        for i in range(n):
            if passage.x[f, i] == passage.x[f, i]:
                present += 1
                for b in range(up + 1):
                    sine[b, i], cosine[b, i] = sine_cosine(b * unit_y * passage.y[f, i])
        if present == 0:
            continue
        for a in range(-across, across + 1):
            for b in range(up + 1):
                if b == 0 and a <= 0:  # a wave and its opposite are one wave
                    continue
                kx = a * unit_x
                ky = b * unit_y
                k = _bin_of(axis, math.sqrt(kx * kx + ky * ky))
                if k >= 0:
                    power = _power(passage, f, kx, sine[b], cosine_y=cosine[b])
                    values[k] += power / present
                    waves[k] += 1
    for k in range(bins):
        values[k] = values[k] / waves[k] if waves[k] > 0 else math.nan


@jit
def _bin_of(edges: Floats, number: float) -> int:
    """Return the bin of a wave number, whose lower edge is included; -1 for none."""
    for k in range(edges.size - 1):
        if edges[k] <= number < edges[k + 1]:
            return k
    return -1


@jit
def _power(
    passage: Passage, f: int, kx: float, sine_y: Floats, cosine_y: Floats
) -> float:
    """Return the power of a wave, from the sine and the cosine of ky y of each boid."""
    real = 0.0
    imaginary = 0.0
    for i in range(passage.x.shape[1]):
        if passage.x[f, i] == passage.x[f, i]:
            sine, cosine = sine_cosine(kx * passage.x[f, i])
            real += cosine * cosine_y[i] - sine * sine_y[i]
            imaginary += sine * cosine_y[i] + cosine * sine_y[i]
    return real * real + imaginary * imaginary


@jit_with_memory
def number_fluctuations(passage: Passage, axis: Floats, values: Floats) -> None:
    """Compute the standard deviation of the number of boids in a box.

    Parameters
    ----------
    passage : Passage
    axis : array of float, shape (K,)
        Numbers of boxes along a side of the world. The boxes divide the world.
    values : array of float, shape (K,)
        Root of the mean square deviation from the mean number of the frame, over boxes
        and frames, in boids; NaN without a boid in any frame.
    """
    frames, n = passage.x.shape
    for k in range(values.size):
        across = int(axis[k])
        counts = np.zeros((across, across), np.int64)
        total = 0.0
        boxes = 0
        for f in range(frames):
            counts[:] = 0
            inside = 0
            for i in range(n):
                x = passage.x[f, i] / passage.width * across
                y = passage.y[f, i] / passage.height * across
                if 0.0 <= x < across and 0.0 <= y < across:
                    counts[int(y), int(x)] += 1
                    inside += 1
            if inside == 0:
                continue
            boxes += across * across
            mean = inside / (across * across)
            for row in range(across):
                for column in range(across):
                    difference = counts[row, column] - mean
                    total += difference * difference
        values[k] = math.sqrt(total / boxes) if boxes > 0 else math.nan
