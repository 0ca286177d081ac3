"""From recorded frames to numbers.

A metric is a kernel `(frames, filled, world, observation, values)` that writes one number for each of the `filled`
first frames into `values`. To add one, write it and enter it in METRICS.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.jit import jit, jit_with_memory
from kernels.recording import COLLISIONS, COVERED, ESCAPES, SQUARED_VISITS, VISITS, Frames
from kernels.settings import Observation
from kernels.state import Floats

X, Y, VX, VY, PREVIOUS_VX, PREVIOUS_VY = range(6)


class Ground(NamedTuple):
    """What coverage is relative to: the traversable pixels and all pixels of the world."""

    traversable: int
    pixels: int


class Metric(NamedTuple):
    """A metric looks at the bodies, or at what was counted on the way.

    `covers` and `counts` say that it needs, instead of the bodies, the visited pixels, or escapes and collisions.
    """

    measure: Callable[[Frames, int, Ground, Observation, Floats], None]
    unit: str
    text: str
    source: str
    covers: bool = False
    counts: bool = False


@jit
def speed(frames: Frames, filled: int, _ground: Ground, _observation: Observation, values: Floats) -> None:
    """Mean of |v|."""
    n = frames.bodies.shape[2]
    for f in range(filled):
        total = 0.0
        for i in range(n):
            vx, vy = frames.bodies[f, VX, i], frames.bodies[f, VY, i]
            total += math.sqrt(vx * vx + vy * vy)
        values[f] = total / n


@jit
def _centre_distance(frames: Frames, f: int, i: int, x: float, y: float) -> float:
    dx, dy = frames.bodies[f, X, i] - x, frames.bodies[f, Y, i] - y
    return math.sqrt(dx * dx + dy * dy)


@jit
def _centre(frames: Frames, f: int) -> tuple[float, float]:
    """The centre of mass of frame `f`."""
    n = frames.bodies.shape[2]
    x, y = 0.0, 0.0
    for i in range(n):
        x += frames.bodies[f, X, i]
        y += frames.bodies[f, Y, i]
    return x / n, y / n


@jit
def _mean_distance(frames: Frames, f: int, x: float, y: float) -> float:
    """The mean distance of the boids of frame `f` from (x, y)."""
    total = 0.0
    for i in range(frames.bodies.shape[2]):
        total += _centre_distance(frames, f, i, x, y)
    return float(total / frames.bodies.shape[2])


@jit
def flock_radius(frames: Frames, filled: int, _ground: Ground, _observation: Observation, values: Floats) -> None:
    """Mean distance from the centre of mass."""
    for f in range(filled):
        x, y = _centre(frames, f)
        values[f] = _mean_distance(frames, f, x, y)


@jit
def dispersion(frames: Frames, filled: int, _ground: Ground, _observation: Observation, values: Floats) -> None:
    """Standard deviation (ddof 0) of the distances from the centre of mass."""
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
def _turn(frames: Frames, f: int, i: int) -> float:
    """The difference of heading from the step before, radians in (-2 pi, 2 pi); 0 at rest and at the start."""
    vx, vy = frames.bodies[f, VX, i], frames.bodies[f, VY, i]
    before_x, before_y = frames.bodies[f, PREVIOUS_VX, i], frames.bodies[f, PREVIOUS_VY, i]
    if (vx == 0.0 and vy == 0.0) or (before_x == 0.0 and before_y == 0.0):
        return 0.0
    return math.atan2(before_y, before_x) - math.atan2(vy, vx)


@jit
def turn_rate(frames: Frames, filled: int, _ground: Ground, _observation: Observation, values: Floats) -> None:
    """Mean angle between the velocities before and after the last step, in [0, 180] degrees."""
    n = frames.bodies.shape[2]
    for f in range(filled):
        total = 0.0
        for i in range(n):
            angle = abs(_turn(frames, f, i))
            total += min(angle, 2.0 * math.pi - angle)
        values[f] = math.degrees(total / n)


@jit
def turn_rate_unwrapped(
    frames: Frames, filled: int, _ground: Ground, _observation: Observation, values: Floats
) -> None:
    """Mean absolute difference of the two headings as numbers in (-180, 180], so in [0, 360) degrees."""
    n = frames.bodies.shape[2]
    for f in range(filled):
        total = 0.0
        for i in range(n):
            total += abs(_turn(frames, f, i))
        values[f] = math.degrees(total / n)


@jit
def polarization(frames: Frames, filled: int, _ground: Ground, _observation: Observation, values: Floats) -> None:
    """Length of the mean unit velocity: 1 where all head the same way. A boid at rest counts as zero."""
    n = frames.bodies.shape[2]
    for f in range(filled):
        x, y = 0.0, 0.0
        for i in range(n):
            vx, vy = frames.bodies[f, VX, i], frames.bodies[f, VY, i]
            size = math.sqrt(vx * vx + vy * vy)
            if size > 0.0:
                x += vx / size
                y += vy / size
        values[f] = math.sqrt(x * x + y * y) / n


@jit_with_memory
def nearest_neighbour_distance(
    frames: Frames, filled: int, _ground: Ground, _observation: Observation, values: Floats
) -> None:
    """Mean distance to the nearest other boid; NaN for one boid. Sweeps outwards along x, so about N sqrt(N) pairs."""
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
def _flocks(x: Floats, y: Floats, reach: float) -> tuple[int, int]:
    """Number of connected components of boids nearer than `reach`, and the size of the largest."""
    n = x.size
    order = np.argsort(x)
    parent = np.arange(n)
    for k in range(n):
        i = order[k]
        for other in range(k + 1, n):
            j = order[other]
            dx, dy = x[j] - x[i], y[j] - y[i]
            if dx >= reach:
                break
            if dx * dx + dy * dy < reach * reach:
                parent[_root(parent, i)] = _root(parent, j)
    sizes = np.zeros(n, np.int64)
    for i in range(n):
        sizes[_root(parent, i)] += 1
    return int(np.sum(sizes > 0)), int(sizes.max())


@jit
def _root(parent: NDArray[np.int64], i: int) -> int:
    """The representative of `i`'s component; halves the path to it."""
    while parent[i] != i:
        parent[i] = parent[parent[i]]
        i = parent[i]
    return i


@jit_with_memory
def flock_count(frames: Frames, filled: int, _ground: Ground, observation: Observation, values: Floats) -> None:
    """Number of flocks: connected components of boids nearer than `flock_range`."""
    for f in range(filled):
        values[f] = _flocks(frames.bodies[f, X], frames.bodies[f, Y], observation.flock_range)[0]


@jit_with_memory
def largest_flock(frames: Frames, filled: int, _ground: Ground, observation: Observation, values: Floats) -> None:
    """Number of boids in the largest flock."""
    for f in range(filled):
        values[f] = _flocks(frames.bodies[f, X], frames.bodies[f, Y], observation.flock_range)[1]


@jit
def coverage(frames: Frames, filled: int, ground: Ground, _observation: Observation, values: Floats) -> None:
    """Visited pixels in per cent of the traversable ones."""
    for f in range(filled):
        values[f] = 100.0 * frames.counts[f, COVERED] / ground.traversable


@jit
def coverage_total(frames: Frames, filled: int, ground: Ground, _observation: Observation, values: Floats) -> None:
    """Visited pixels in per cent of all pixels of the world."""
    for f in range(filled):
        values[f] = 100.0 * frames.counts[f, COVERED] / ground.pixels


@jit
def coverage_cv(frames: Frames, filled: int, ground: Ground, observation: Observation, values: Floats) -> None:
    """Standard deviation over mean of the visit counts of traversable pixels; NaN before the first visit."""
    pixels = ground.traversable
    for f in range(filled):
        visits = frames.counts[f, VISITS]
        mean = visits / pixels
        spread = frames.counts[f, SQUARED_VISITS] - visits * mean
        variance = max(spread, 0.0) / (pixels - observation.coverage_cv_ddof)
        values[f] = math.sqrt(variance) / mean if visits > 0 else math.nan


@jit
def escapes(frames: Frames, filled: int, _ground: Ground, _observation: Observation, values: Floats) -> None:
    """How often a boid has left the world since the start."""
    for f in range(filled):
        values[f] = frames.counts[f, ESCAPES]


@jit
def collisions(frames: Frames, filled: int, _ground: Ground, _observation: Observation, values: Floats) -> None:
    """How often a boid's position has entered an obstacle since the start."""
    for f in range(filled):
        values[f] = frames.counts[f, COLLISIONS]


_NGUYEN, _AZIEL = "nguyen2024, section 2.3", "aziel_chen2025, section 3.2"
METRICS: dict[str, Metric] = {
    "speed": Metric(speed, "px/step", "mean speed", _NGUYEN),
    "flock_radius": Metric(flock_radius, "px", "mean distance from the centre of mass", _NGUYEN),
    "turn_rate": Metric(turn_rate, "degrees", "mean change of heading in a step, wrapped to [0, 180]", _NGUYEN),
    "turn_rate_unwrapped": Metric(
        turn_rate_unwrapped, "degrees", "the same without wrapping, in [0, 360), as nguyen2024 ran it", _NGUYEN
    ),
    "dispersion": Metric(dispersion, "px", "standard deviation of distances from the centre of mass", _NGUYEN),
    "polarization": Metric(polarization, "", "length of the mean unit velocity", "Vicsek et al. (1995)"),
    "nearest_neighbour_distance": Metric(
        nearest_neighbour_distance, "px", "mean distance to the nearest other boid", "Clark and Evans (1954)"
    ),
    "flock_count": Metric(flock_count, "", "number of groups connected within flock_range", "patel2023, section III"),
    "largest_flock": Metric(largest_flock, "boids", "size of the largest such group", "patel2023, section III"),
    "coverage": Metric(coverage, "%", "visited share of the traversable pixels", _AZIEL, covers=True),
    "coverage_total": Metric(coverage_total, "%", "visited share of all pixels", "aziel_chen2025, as run", covers=True),
    "coverage_cv": Metric(
        coverage_cv, "", "coefficient of variation of visits to traversable pixels", "aziel_chen2025, section 4.2",
        covers=True,
    ),
    "escapes": Metric(escapes, "", "times a boid left the world", "ours", counts=True),
    "collisions": Metric(collisions, "", "times a boid entered an obstacle", "ours", counts=True),
}  # fmt: skip
