"""How forces share one acceleration. The code has no branches: which force exceeds its
limit is random, so the processor would mispredict them.
"""

import math

from kernels.jit import jit

TINY = 1e-300


@jit
def limit(x: float, y: float, most: float) -> tuple[float, float]:
    """The vector (x, y), scaled to length `most` where it is longer: Eq. (9) of
    nguyen2024.
    """
    scale = most / max(math.sqrt(x * x + y * y), TINY)
    scale = scale if scale < 1.0 else 1.0
    return x * scale, y * scale


@jit
def clamp_speed(vx: float, vy: float, least: float, most: float) -> tuple[float, float]:
    """The velocity (vx, vy), scaled to the speed `most` where it is faster, to `least`
    where it is slower.

    A boid at rest has no direction and stays so. Eq. (22) of patel2023.
    """
    speed = math.sqrt(vx * vx + vy * vy)
    moving = speed if speed > 0.0 else 1.0
    scale = least / moving if 0.0 < speed < least else 1.0
    scale = most / moving if speed > most else scale
    return vx * scale, vy * scale


@jit
def serve(
    ax: float, ay: float, x: float, y: float, budget: float
) -> tuple[float, float, float]:
    """The acceleration (ax, ay) plus the part of the force (x, y) that fits in
    `budget`, and the budget that is left.

    A force that fits is added whole. One that does not fit is cut to the budget, and
    nothing is left for later forces. Section 2 of aziel_chen2025.
    """
    length = math.sqrt(x * x + y * y)
    scale = budget / max(length, TINY)
    scale = scale if scale < 1.0 else 1.0
    left = budget - length
    left = left if left > 0.0 else 0.0
    return ax + x * scale, ay + y * scale, left


@jit
def limit_components(x: float, y: float, most: float) -> tuple[float, float]:
    """The vector (x, y) with either component cut to the interval from -`most` to
    `most`.
    """
    return max(-most, min(x, most)), max(-most, min(y, most))


@jit
def add_in_turn(
    ax: float, ay: float, x: float, y: float, has_room: bool, most: float
) -> tuple[float, float, bool]:
    """The acceleration (ax, ay) plus the whole of (x, y) while there is room, and
    whether there is still room.

    There is no room once the sum is longer than `most`. Algorithm 9 of rustamani2024.
    """
    ax = ax + x if has_room else ax
    ay = ay + y if has_room else ay
    return ax, ay, has_room & (ax * ax + ay * ay <= most * most)
