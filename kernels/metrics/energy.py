"""The potential energy of Eq. (27) of patel2023.

The gradient of the pair potential gives the rules of the model.

For the strengths a of separation, within r_s, and c of cohesion, towards the mean of
the n boids within r_c, with r_s <= r_c:

    V(r) = (a - c/n) (r_s^2 - r^2) / 2    for r < r_s
    V(r) = (c/n) (r^2 - r_s^2) / 2        for r_s <= r < r_c

so that the force on a boid, with n held fixed, is the sum of the two rules. The minimum
of V is 0, at r_s, as in the publication, but V stays finite at distance 0. If only
boids outside r_s cohere, the first line has a in place of a - c/n, and n counts only
the boids outside r_s. If r_s > r_c, which is not checked here, V is not the potential
of the rules.
"""

import math

from kernels.jit import jit, jit_with_memory
from kernels.metrics.flocks import count_flocks, labels, sizes
from kernels.metrics.ground import Ground, X, Y
from kernels.model import PairPotential
from kernels.recording import Frames
from kernels.settings import Observation
from kernels.state import Floats


@jit
def _pair_potential(rule: PairPotential, attraction: float, distance2: float) -> float:
    """Return V of a pair with the squared distance `distance2`.

    The `attraction` is c/n.
    """
    near2 = rule.separation_range * rule.separation_range
    if distance2 < near2:
        strength = rule.separation - (0.0 if rule.cohesion_outside else attraction)
        return 0.5 * strength * (near2 - distance2)
    if distance2 < rule.cohesion_range * rule.cohesion_range:
        return 0.5 * attraction * (distance2 - near2)
    return 0.0


@jit
def _boid_potential(rule: PairPotential, x: Floats, y: Floats, i: int) -> float:
    """Return the sum of V over the pairs of boid `i`."""
    near2 = (
        rule.separation_range * rule.separation_range if rule.cohesion_outside else 0.0
    )
    far2 = rule.cohesion_range * rule.cohesion_range
    n = 0
    for j in range(x.size):
        dx, dy = x[j] - x[i], y[j] - y[i]
        distance2 = dx * dx + dy * dy
        n += int(j != i and near2 <= distance2 and distance2 < far2)
    attraction = rule.cohesion / n if n > 0 else 0.0
    total = 0.0
    for j in range(x.size):
        if j != i:
            dx, dy = x[j] - x[i], y[j] - y[i]
            total += _pair_potential(rule, attraction, dx * dx + dy * dy)
    return total


@jit_with_memory
def potential(
    frames: Frames,
    filled: int,
    ground: Ground,
    _observation: Observation,
    values: Floats,
) -> None:
    """Compute the mean over boids of the sum of V over all pairs of a boid.

    Parameters
    ----------
    frames, filled, ground, _observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Potential energy per boid and unit of mass, in length^2/time^2.
    """
    n = frames.bodies.shape[2]
    for f in range(filled):
        total = 0.0
        for i in range(n):
            total += _boid_potential(
                ground.potential, frames.bodies[f, X], frames.bodies[f, Y], i
            )
        values[f] = total / n


@jit_with_memory
def flock_potential(
    frames: Frames,
    filled: int,
    ground: Ground,
    observation: Observation,
    values: Floats,
) -> None:
    """Compute the mean potential energy of a flock of two or more boids.

    The energy of a flock is the sum over its boids. For each boid all pairs of the boid
    count.

    Parameters
    ----------
    frames, filled, ground, observation
        See kernels.metrics.ground.Metric.
    values : array of float, shape (filled,)
        Mean over these flocks, in length^2/time^2; NaN without such a flock.
    """
    n = frames.bodies.shape[2]
    for f in range(filled):
        x, y = frames.bodies[f, X], frames.bodies[f, Y]
        flock = labels(x, y, observation.flock_range)
        members = sizes(flock)
        total = 0.0
        for i in range(n):
            if members[flock[i]] > 1:
                total += _boid_potential(ground.potential, x, y, i)
        flocks = count_flocks(members, 2)
        values[f] = total / flocks if flocks > 0 else math.nan
