"""Separation, alignment and cohesion over the `found` first neighbours in `near`, in ascending order of index."""

import math

from kernels.jit import jit
from kernels.neighbours import Near
from kernels.state import Flock


@jit
def separation_unit(near: Near, found: int, range2: float) -> tuple[float, float]:
    """The sum of d / max(|d|, 1), d = x_i - x_j, over neighbours nearer than sqrt(range2): Eq. (4) of nguyen2024."""
    x, y = 0.0, 0.0
    for k in range(found):
        if near.distance2[k] < range2:
            scale = 1.0 / max(math.sqrt(near.distance2[k]), 1.0)
            x -= near.dx[k] * scale
            y -= near.dy[k] * scale
    return x, y


@jit
def alignment(seen: Flock, i: int, near: Near, found: int, range2: float) -> tuple[float, float]:
    """Mean velocity of the neighbours nearer than sqrt(range2), less that of boid `i`: Eq. (5) of nguyen2024.

    Zero without neighbours.
    """
    vx, vy, count = 0.0, 0.0, 0
    for k in range(found):
        if near.distance2[k] < range2:
            vx += seen.vx[near.boid[k]]
            vy += seen.vy[near.boid[k]]
            count += 1
    if count == 0:
        return 0.0, 0.0
    share = 1.0 / count
    return vx * share - seen.vx[i], vy * share - seen.vy[i]


@jit
def cohesion(near: Near, found: int, range2: float) -> tuple[float, float]:
    """From boid to the mean position of its neighbours nearer than sqrt(range2): Eq. (6) of nguyen2024.

    Zero without neighbours.
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
def flocking_sums(
    seen: Flock, near: Near, found: int, crowd2: float
) -> tuple[float, float, float, float, float, float]:
    """The sums behind f_col, f_coh and f_ali of aziel_chen2025, in one pass since they share their neighbours.

    x and y of: displacements to those nearer than sqrt(crowd2), displacements to all, velocities of all.
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
