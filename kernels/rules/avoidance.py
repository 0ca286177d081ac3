"""Steering around the occupied cells of a grid."""

import math

from kernels.elementary import atan2, cos, sin
from kernels.jit import jit
from kernels.occupancy import Occupancy, is_taken

ROUNDING = 1e-9
"""Margin that is added before a number is rounded down.

Floating point may make a path of five steps slightly shorter than five.
"""


@jit
def steer_to_avoid(
    occupancy: Occupancy,
    x: float,
    y: float,
    vx: float,
    vy: float,
    look_ahead: float,
    path_step: float,
    turn: float,
) -> tuple[float, float, bool]:
    """Return the unit vector of the free heading nearest to the velocity.

    A heading is free if the path of length `look_ahead` in its direction is free. The
    search proceeds in steps of `turn`, up to half a turn to either side, and tries the
    side of increasing angles first. The vector is zero if the current heading is free,
    if no heading is free, and for a boid at rest. The rule is Algorithm 7 of
    rustamani2024, which would not terminate without a free heading.

    Parameters
    ----------
    occupancy : Occupancy
        Grid of occupied cells.
    x, y : float
        Position of the boid, in lengths.
    vx, vy : float
        Velocity of the boid; the rule uses its direction alone.
    look_ahead : float
        Length of the path.
    path_step : float
        Distance between the points of a path, in lengths.
    turn : float
        Step of the search, in radians.

    Returns
    -------
    x, y : float
        Unit vector, or zero.
    is_dead_end : bool
        True if no heading is free.
    """
    if vx == 0.0 and vy == 0.0:
        return 0.0, 0.0, False
    heading = atan2(vy, vx)
    if _is_free(occupancy, x, y, heading, look_ahead, path_step):
        return 0.0, 0.0, False
    for k in range(1, math.floor(math.pi / turn) + 1):
        for side in (1.0, -1.0):
            free = heading + side * (k * turn)
            if _is_free(occupancy, x, y, free, look_ahead, path_step):
                return cos(free), sin(free), False
    return 0.0, 0.0, True


@jit
def _is_free(
    occupancy: Occupancy, x: float, y: float, heading: float, length: float, step: float
) -> bool:
    """Return whether the points of a path are free.

    The distance between points is `step`. The two ends are excluded, as in Algorithm 8
    of rustamani2024.
    """
    along, across = length * cos(heading), length * sin(heading)
    points = math.floor(length / step + ROUNDING)
    for k in range(1, points):
        share = k / points
        if is_taken(occupancy, x + share * along, y + share * across):
            return False
    return True
