"""Steering round what an occupancy grid holds."""

import math

from kernels.elementary import atan2, cos, sin
from kernels.jit import jit
from kernels.occupancy import Occupancy, is_taken

ROUNDING = 1e-9
"""Added before rounding down: floating point may make a path of five steps slightly
less than five.
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
    """The unit vector of the free heading nearest to the velocity, and whether there is
    none.

    A heading is free if the path of length `look_ahead` is. The search goes in steps of
    `turn` radians up to half a turn to either side, and looks at the side of growing
    angles first. The vector is zero if the way ahead is free, if no heading is free,
    and for a boid at rest. This is Algorithm 7 of rustamani2024, which would loop for
    ever if no heading is free.
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
    """Whether the points of a path are free. There is a point every `step`; both ends
    are left out, as in Algorithm 8.
    """
    along, across = length * cos(heading), length * sin(heading)
    points = math.floor(length / step + ROUNDING)
    for k in range(1, points):
        share = k / points
        if is_taken(occupancy, x + share * along, y + share * across):
            return False
    return True
