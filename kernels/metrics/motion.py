"""Motion of boids: speed, turns, agreement of headings."""

import math

from kernels.elementary import atan2
from kernels.jit import jit
from kernels.metrics.ground import PREVIOUS_VX, PREVIOUS_VY, VX, VY, Ground
from kernels.recording import Frames
from kernels.settings import Observation
from kernels.state import Floats


@jit
def speed(
    frames: Frames,
    filled: int,
    _ground: Ground,
    _observation: Observation,
    values: Floats,
) -> None:
    """Compute the mean of |v|.

    Parameters
    ----------
    frames, filled, _ground, _observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Mean over boids, in length/time.
    """
    n = frames.bodies.shape[2]
    for f in range(filled):
        total = 0.0
        for i in range(n):
            vx, vy = frames.bodies[f, VX, i], frames.bodies[f, VY, i]
            total += math.sqrt(vx * vx + vy * vy)
        values[f] = total / n


@jit
def _turn(frames: Frames, f: int, i: int) -> float:
    """Return the heading one step before minus the heading, in (-2 pi, 2 pi) radians.

    The result is 0 at rest and at the start.
    """
    vx, vy = frames.bodies[f, VX, i], frames.bodies[f, VY, i]
    before_x, before_y = (
        frames.bodies[f, PREVIOUS_VX, i],
        frames.bodies[f, PREVIOUS_VY, i],
    )
    if (vx == 0.0 and vy == 0.0) or (before_x == 0.0 and before_y == 0.0):
        return 0.0
    return atan2(before_y, before_x) - atan2(vy, vx)


@jit
def turn_rate(
    frames: Frames,
    filled: int,
    _ground: Ground,
    _observation: Observation,
    values: Floats,
) -> None:
    """Compute the mean angle between the velocities before and after the last step.

    Parameters
    ----------
    frames, filled, _ground, _observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Mean over boids, in [0, 180] degrees per step.
    """
    n = frames.bodies.shape[2]
    for f in range(filled):
        total = 0.0
        for i in range(n):
            angle = abs(_turn(frames, f, i))
            total += min(angle, 2.0 * math.pi - angle)
        values[f] = math.degrees(total / n)


@jit
def turn_rate_unwrapped(
    frames: Frames,
    filled: int,
    _ground: Ground,
    _observation: Observation,
    values: Floats,
) -> None:
    """Compute the mean absolute difference of the headings around the last step.

    The headings are numbers in (-180, 180] degrees, and their difference is not
    wrapped.

    Parameters
    ----------
    frames, filled, _ground, _observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Mean over boids, in [0, 360) degrees per step.
    """
    n = frames.bodies.shape[2]
    for f in range(filled):
        total = 0.0
        for i in range(n):
            total += abs(_turn(frames, f, i))
        values[f] = math.degrees(total / n)


@jit
def polarization(
    frames: Frames,
    filled: int,
    _ground: Ground,
    _observation: Observation,
    values: Floats,
) -> None:
    """Compute the length of the mean unit velocity.

    A boid at rest counts as a zero vector.

    Parameters
    ----------
    frames, filled, _ground, _observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Length from 0 to 1; 1 if all boids have one heading.
    """
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


@jit
def velocity_correlation(
    frames: Frames,
    filled: int,
    _ground: Ground,
    _observation: Observation,
    values: Floats,
) -> None:
    """Compute the mean cosine of the angle between the velocities of two boids.

    The mean is over all pairs. A pair with a boid at rest counts as 0.

    If all boids are in one flock, the metric is phi_corr of Vasarhelyi et al. (2018).
    The square of the sum of the unit vectors is the sum over pairs, twice, plus the sum
    over boids.

    Parameters
    ----------
    frames, filled, _ground, _observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Mean over pairs, at most 1, if all boids have one heading; NaN for one boid.
    """
    n = frames.bodies.shape[2]
    for f in range(filled):
        x, y, moving = 0.0, 0.0, 0
        for i in range(n):
            vx, vy = frames.bodies[f, VX, i], frames.bodies[f, VY, i]
            size = math.sqrt(vx * vx + vy * vy)
            if size > 0.0:
                x += vx / size
                y += vy / size
                moving += 1
        values[f] = (x * x + y * y - moving) / (n * (n - 1)) if n > 1 else math.nan


@jit
def velocity_diameter(
    frames: Frames,
    filled: int,
    _ground: Ground,
    _observation: Observation,
    values: Floats,
) -> None:
    """Compute the greatest |v_i - v_j| of two boids.

    Cucker and Smale (2007), Emergent behavior in flocks, ask when it tends to 0.

    Parameters
    ----------
    frames, filled, _ground, _observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Greatest difference, in length/time; 0 if all velocities are equal.
    """
    n = frames.bodies.shape[2]
    for f in range(filled):
        most = 0.0
        for i in range(n):
            for j in range(i):
                x = frames.bodies[f, VX, i] - frames.bodies[f, VX, j]
                y = frames.bodies[f, VY, i] - frames.bodies[f, VY, j]
                most = max(most, x * x + y * y)
        values[f] = math.sqrt(most)


@jit
def group_speed(
    frames: Frames,
    filled: int,
    _ground: Ground,
    _observation: Observation,
    values: Floats,
) -> None:
    """Compute the length of the mean velocity: the speed of the centre of mass.

    Parameters
    ----------
    frames, filled, _ground, _observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Speed, in length/time.
    """
    n = frames.bodies.shape[2]
    for f in range(filled):
        x, y = 0.0, 0.0
        for i in range(n):
            x += frames.bodies[f, VX, i]
            y += frames.bodies[f, VY, i]
        values[f] = math.sqrt(x * x + y * y) / n
