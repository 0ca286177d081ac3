"""Separation, alignment and cohesion over the neighbours of a boid.

The neighbours are the first `found` entries of `near`, in ascending order of index.
"""

import math

from kernels.arbitration import TINY
from kernels.fours import below, four, minus, parts, plus, times
from kernels.indices import whole
from kernels.jit import jit
from kernels.near import Near
from kernels.state import Flock


@jit
def separation_unit(near: Near, found: int, range2: float) -> tuple[float, float]:
    """Return the sum of d / max(|d|, 1) over near neighbours: Eq. (4) of nguyen2024.

    The displacement d is x_i - x_j, from the neighbour to the boid.

    Parameters
    ----------
    near : Near
        Neighbours of the boid.
    found : int
        Number of neighbours.
    range2 : float
        Square of the distance below which a neighbour counts.
    """
    x, y = 0.0, 0.0
    _shorten(near, found, range2)
    for k in range(found):
        x -= near.dx[k] * near.factor[k]
        y -= near.dy[k] * near.factor[k]
    return x, y


@jit
def _shorten(near: Near, found: int, range2: float) -> None:
    """Write the factors of `separation_unit` into `near`.

    The factor is 1 / max(|d|, 1) for neighbours nearer than sqrt(range2), else 0. The
    loop has no sums, so that the processor computes several neighbours at once.
    """
    for k in range(whole(found)):
        factor = 1.0 / max(math.sqrt(near.distance2[k]), 1.0)
        near.factor[k] = factor if near.distance2[k] < range2 else 0.0


@jit
def separation_direction(near: Near, found: int, range2: float) -> tuple[float, float]:
    """Return the unit vector along the sum of d / |d|^2 over near neighbours.

    The displacement d is x_i - x_j. The vector is zero without neighbours, or if the
    sum is zero. The rule is Algorithm 2 of rustamani2024.

    Parameters
    ----------
    near : Near
        Neighbours of the boid.
    found : int
        Number of neighbours.
    range2 : float
        Square of the distance below which a neighbour counts.
    """
    x, y = 0.0, 0.0
    for k in range(found):
        if 0.0 < near.distance2[k] < range2:
            x -= near.dx[k] / near.distance2[k]
            y -= near.dy[k] / near.distance2[k]
    length = max(math.sqrt(x * x + y * y), TINY)
    return x / length, y / length


@jit
def separation_linear(near: Near, found: int, range2: float) -> tuple[float, float]:
    """Return the sum of d = x_i - x_j over near neighbours: Eq. (6) of patel2023.

    Parameters
    ----------
    near : Near
        Neighbours of the boid.
    found : int
        Number of neighbours.
    range2 : float
        Square of the distance below which a neighbour counts.
    """
    x, y = 0.0, 0.0
    for k in range(found):
        close = 1.0 if near.distance2[k] < range2 else 0.0
        x -= close * near.dx[k]
        y -= close * near.dy[k]
    return x, y


@jit
def alignment(
    seen: Flock, i: int, near: Near, found: int, range2: float
) -> tuple[float, float]:
    """Return the mean velocity of near neighbours, minus the velocity of the boid.

    The rule is Eq. (5) of nguyen2024. The vector is zero without neighbours.

    Parameters
    ----------
    seen : Flock
        Perceived flock.
    i : int
        Index of the boid.
    near : Near
        Neighbours of the boid.
    found : int
        Number of neighbours.
    range2 : float
        Square of the distance below which a neighbour counts.
    """
    return alignment_from(seen.vx[i], seen.vy[i], seen, near, found, range2)


@jit
def alignment_from(
    vx: float, vy: float, seen: Flock, near: Near, found: int, range2: float
) -> tuple[float, float]:
    """Return `alignment` for a boid with a given velocity: Eq. (10) of patel2023.

    Parameters
    ----------
    vx, vy : float
        Velocity of the boid, in place of the velocity in `seen`.
    seen : Flock
        Perceived flock.
    near : Near
        Neighbours of the boid.
    found : int
        Number of neighbours.
    range2 : float
        Square of the distance below which a neighbour counts.
    """
    mean_vx, mean_vy, count = 0.0, 0.0, 0
    for k in range(found):
        close = near.distance2[k] < range2
        # Unconditional reads: the processor would mispredict a branch around the reads.
        other_vx, other_vy = seen.vx[near.boid[k]], seen.vy[near.boid[k]]
        mean_vx += other_vx if close else 0.0
        mean_vy += other_vy if close else 0.0
        count += int(close)
    if count == 0:
        return 0.0, 0.0
    share = 1.0 / count
    return mean_vx * share - vx, mean_vy * share - vy


@jit
def cohesion(near: Near, found: int, range2: float) -> tuple[float, float]:
    """Return the vector to the mean position of near neighbours: Eq. (6) of nguyen2024.

    The vector is zero without neighbours.

    Parameters
    ----------
    near : Near
        Neighbours of the boid.
    found : int
        Number of neighbours.
    range2 : float
        Square of the distance below which a neighbour counts.
    """
    x, y, count = 0.0, 0.0, 0
    for k in range(found):
        if near.distance2[k] < range2:
            x += near.dx[k]
            y += near.dy[k]
            count += 1
    if count == 0:
        return 0.0, 0.0
    share = 1.0 / count
    return x * share, y * share


@jit
def ranged_sums(
    seen: Flock,
    near: Near,
    found: int,
    separation2: float,
    alignment2: float,
    cohesion2: float,
) -> tuple[float, float, float, float, float, float, float, float]:
    """Return the sums for the three rules of nguyen2024.

    One pass computes all sums, four numbers at once.

    Parameters
    ----------
    seen : Flock
        Perceived flock.
    near : Near
        Neighbours of the boid.
    found : int
        Number of neighbours.
    separation2, alignment2, cohesion2 : float
        Squares of the distances below which a neighbour counts, by rule.

    Returns
    -------
    away_x, away_y : float
        Sum of `separation_unit`.
    vx, vy : float
        Sum of the velocities of the neighbours within alignment range.
    aligned : float
        Number of the neighbours within alignment range.
    x, y : float
        Sum of the displacements to the neighbours within cohesion range.
    joined : float
        Number of the neighbours within cohesion range.
    """
    bounds = four(cohesion2, cohesion2, alignment2, alignment2)
    none = four(0.0, 0.0, 0.0, 0.0)
    away, sums, counts = none, none, none
    _shorten(near, found, separation2)
    for k in range(found):
        there = four(
            near.dx[k], near.dy[k], seen.vx[near.boid[k]], seen.vy[near.boid[k]]
        )
        factor, counted = near.factor[k], below(near.distance2[k], bounds)
        away = minus(away, times(there, four(factor, factor, factor, factor)))
        sums = plus(sums, times(there, counted))
        counts = plus(counts, counted)
    away_x, away_y, _, _ = parts(away)
    x, y, vx, vy = parts(sums)
    joined, _, aligned, _ = parts(counts)
    return away_x, away_y, vx, vy, aligned, x, y, joined


@jit
def flocking_sums(
    seen: Flock, near: Near, found: int, crowd2: float
) -> tuple[float, float, float, float, float, float]:
    """Return the sums for f_col, f_coh and f_ali of aziel_chen2025.

    One pass computes all sums, because the rules share neighbours.

    Parameters
    ----------
    seen : Flock
        Perceived flock.
    near : Near
        Neighbours of the boid.
    found : int
        Number of neighbours.
    crowd2 : float
        Square of the distance below which a neighbour crowds the boid.

    Returns
    -------
    crowd_x, crowd_y : float
        Sum of the displacements to the neighbours that crowd the boid.
    x, y : float
        Sum of the displacements to all neighbours.
    vx, vy : float
        Sum of the velocities of all neighbours.
    """
    crowd_x, crowd_y, x, y, vx, vy = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(found):
        close = 1.0 if near.distance2[k] < crowd2 else 0.0
        crowd_x += close * near.dx[k]
        crowd_y += close * near.dy[k]
        x += near.dx[k]
        y += near.dy[k]
        vx += seen.vx[near.boid[k]]
        vy += seen.vy[near.boid[k]]
    return crowd_x, crowd_y, x, y, vx, vy


@jit
def protected_sums(
    seen: Flock, near: Near, found: int, crowd2: float, range2: float, crowd_apart: bool
) -> tuple[float, float, float, float, float, float, int]:
    """Return the sums for the three rules of nanobot, computed in one pass.

    Parameters
    ----------
    seen : Flock
        Perceived flock.
    near : Near
        Neighbours of the boid.
    found : int
        Number of neighbours.
    crowd2 : float
        Square of the distance below which a neighbour crowds the boid.
    range2 : float
        Square of the distance below which a neighbour counts for the other rules.
    crowd_apart : bool
        Whether neighbours that crowd the boid are excluded from the other rules.

    Returns
    -------
    crowd_x, crowd_y : float
        Sum of the displacements to the neighbours that crowd the boid.
    x, y : float
        Sum of the displacements to the neighbours of the other rules.
    vx, vy : float
        Sum of the velocities of the neighbours of the other rules.
    count : int
        Number of the neighbours of the other rules.
    """
    crowd_x, crowd_y, x, y, vx, vy, count = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0
    for k in range(found):
        crowds = near.distance2[k] < crowd2
        joins = (near.distance2[k] < range2) & (not (crowds & crowd_apart))
        close, other = 1.0 if crowds else 0.0, 1.0 if joins else 0.0
        crowd_x += close * near.dx[k]
        crowd_y += close * near.dy[k]
        x += other * near.dx[k]
        y += other * near.dy[k]
        vx += other * seen.vx[near.boid[k]]
        vy += other * seen.vy[near.boid[k]]
        count += int(joins)
    return crowd_x, crowd_y, x, y, vx, vy, count
