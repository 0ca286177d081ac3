"""Combination of forces into one acceleration.

The code has no branches. The force that exceeds a limit is random, so the processor
would mispredict branches.
"""

import math

from kernels.jit import jit

TINY = 1e-300


@jit
def limit(x: float, y: float, most: float) -> tuple[float, float]:
    """Return the vector (x, y), with its length limited to `most`.

    Source: Eq. (9) of nguyen2024.

    Parameters
    ----------
    x, y : float
        Components of the vector.
    most : float
        The largest length, in the unit of the vector.

    Returns
    -------
    tuple of float
        Components of the limited vector.
    """
    scale = most / max(math.sqrt(x * x + y * y), TINY)
    scale = scale if scale < 1.0 else 1.0
    return x * scale, y * scale


@jit
def clamp_speed(vx: float, vy: float, least: float, most: float) -> tuple[float, float]:
    """Return the velocity (vx, vy) with its speed clamped to [`least`, `most`].

    A boid at rest has no direction and stays at rest. Source: Eq. (22) of patel2023.

    Parameters
    ----------
    vx, vy : float
        Components of the velocity.
    least, most : float
        The smallest and the largest speed.

    Returns
    -------
    tuple of float
        Components of the clamped velocity.
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
    """Add the part of a force that fits in `budget` to an acceleration.

    A force within the budget is added in full. A longer force is cut to the budget and
    uses up the budget. Source: section 2 of aziel_chen2025.

    Parameters
    ----------
    ax, ay : float
        Components of the acceleration so far.
    x, y : float
        Components of the force.
    budget : float
        Length that is left for this force and for later forces.

    Returns
    -------
    tuple of float
        Components of the new acceleration, and the budget that is left.
    """
    length = math.sqrt(x * x + y * y)
    scale = budget / max(length, TINY)
    scale = scale if scale < 1.0 else 1.0
    left = budget - length
    left = left if left > 0.0 else 0.0
    return ax + x * scale, ay + y * scale, left


@jit
def limit_components(x: float, y: float, most: float) -> tuple[float, float]:
    """Return the vector (x, y) with each component cut to [-`most`, `most`].

    Parameters
    ----------
    x, y : float
        Components of the vector.
    most : float
        The largest absolute value of a component.

    Returns
    -------
    tuple of float
        Components of the limited vector.
    """
    return max(-most, min(x, most)), max(-most, min(y, most))


@jit
def add_in_turn(
    ax: float, ay: float, x: float, y: float, has_room: bool, most: float
) -> tuple[float, float, bool]:
    """Add a term to an acceleration if there is still room.

    There is no room once the sum is longer than `most`. Source: Algorithm 9 of
    rustamani2024.

    Parameters
    ----------
    ax, ay : float
        Components of the acceleration so far.
    x, y : float
        Components of the term.
    has_room : bool
        True if the sum of earlier terms was not longer than `most`.
    most : float
        Length up to which the sum has room for another term.

    Returns
    -------
    tuple
        Components of the new acceleration, and whether there is still room.
    """
    ax = ax + x if has_room else ax
    ay = ay + y if has_room else ay
    return ax, ay, has_room & (ax * ax + ay * ay <= most * most)
