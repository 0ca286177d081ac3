"""Spectrum of the graph that joins boids nearer than `flock_range`."""

import math

import numpy as np

from kernels.jit import jit, jit_with_memory
from kernels.metrics.flocks import labels
from kernels.metrics.ground import Ground, X, Y
from kernels.recording import Frames
from kernels.settings import Observation
from kernels.state import Floats

BISECTIONS, SMALLEST = 60, 1e-30
"""Number of bisections, down to rounding, and the replacement of a pivot of 0."""


@jit_with_memory
def algebraic_connectivity(
    frames: Frames,
    filled: int,
    _ground: Ground,
    observation: Observation,
    values: Floats,
) -> None:
    """Compute the second smallest eigenvalue of the Laplacian of the graph.

    The computation takes about N^3 operations per frame.

    M. Fiedler (1973), Algebraic connectivity of graphs, Czechoslovak Mathematical
    Journal 23, 298. The method is Householder reflections and Sturm sequences, see G.
    Golub, C. Van Loan (2013), Matrix Computations, sections 8.3.1 and 8.4.1.

    Parameters
    ----------
    frames, filled, _ground, observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Eigenvalue; 0 if the graph has several components, NaN for one boid.
    """
    n, reach = frames.bodies.shape[2], observation.flock_range
    matrix = np.zeros((n, n))
    work, beside = np.zeros(n), np.zeros(n)
    for f in range(filled):
        x, y = frames.bodies[f, X], frames.bodies[f, Y]
        flock = labels(x, y, reach)
        values[f] = 0.0 if n > 1 else math.nan
        if n > 1 and (flock == flock[0]).all():
            _laplacian(x, y, reach, matrix)
            _tridiagonal(matrix, work, beside)
            values[f] = _second_smallest(matrix, beside)


@jit
def _laplacian(x: Floats, y: Floats, reach: float, matrix: Floats) -> None:
    """Write the degrees on the diagonal, and -1 for each connected pair."""
    for i in range(x.size):
        degree = 0.0
        for j in range(x.size):
            dx, dy = x[j] - x[i], y[j] - y[i]
            joined = 1.0 if i != j and dx * dx + dy * dy < reach * reach else 0.0
            matrix[i, j] = -joined
            degree += joined
        matrix[i, i] = degree


@jit
def _tridiagonal(matrix: Floats, work: Floats, beside: Floats) -> None:
    """Reduce a symmetric matrix (n, n) to a tridiagonal matrix of equal eigenvalues.

    The diagonal stays in place, and the function writes the secondary diagonal into
    `beside`.
    """
    n = work.size
    for k in range(n - 1):
        square = 0.0
        for i in range(k + 1, n):
            square += matrix[i, k] * matrix[i, k]
        size = math.sqrt(square)
        first = matrix[k + 1, k]
        beside[k] = -size if first > 0.0 else size
        # The column keeps all components of the reflected v but the first.
        matrix[k + 1, k] = first - beside[k]
        length = 2.0 * (square - first * beside[k])
        if length > 0.0:
            _reflect(matrix, k, length, work)


@jit
def _reflect(matrix: Floats, k: int, length: float, work: Floats) -> None:
    """Reflect the part to the right of and below column k: A - v w' - w v'.

    The vector v is below the diagonal of the column; `length` is the square of v.
    """
    n = work.size
    along = 0.0
    for i in range(k + 1, n):
        total = 0.0
        for j in range(k + 1, n):
            total += matrix[i, j] * matrix[j, k]
        work[i] = 2.0 * total / length
        along += work[i] * matrix[i, k]
    for i in range(k + 1, n):
        work[i] -= along / length * matrix[i, k]
    for i in range(k + 1, n):
        for j in range(k + 1, n):
            matrix[i, j] -= matrix[i, k] * work[j] + work[i] * matrix[j, k]


@jit
def _second_smallest(matrix: Floats, beside: Floats) -> float:
    """Return the second smallest eigenvalue of a tridiagonal matrix.

    No eigenvalue is below 0. Bisection finds the least number with two eigenvalues
    below this number.
    """
    n = matrix.shape[0]
    low, high = 0.0, 0.0
    for i in range(n):
        high += matrix[i, i]
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        below, pivot = 0, 1.0
        for i in range(n):
            left = beside[i - 1] * beside[i - 1] / pivot if i > 0 else 0.0
            pivot = matrix[i, i] - middle - left
            if pivot == 0.0:
                pivot = SMALLEST
            below += int(pivot < 0.0)
        low, high = (low, middle) if below > 1 else (middle, high)
    return 0.5 * (low + high)
