"""Steering round what an occupancy grid holds."""

import math

from kernels.jit import jit
from kernels.occupancy import Occupancy, is_taken

ROUNDING = 1e-9
"""So that a path of five steps, which floating point may put a little below, has five.
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

    A heading is free if the path of length `look_ahead` is. It is looked for in steps
    of `turn` radians, up to half a turn to either side and at every step on the side of
    growing angles first. The vector is zero where the way ahead is free, where none is,
    and for a boid at rest. Algorithm 7 of rustamani2024, which goes on for ever where
    no heading is free.
    """
    if vx == 0.0 and vy == 0.0:
        return 0.0, 0.0, False
    heading = math.atan2(vy, vx)
    if _is_free(occupancy, x, y, heading, look_ahead, path_step):
        return 0.0, 0.0, False
    for k in range(1, math.floor(math.pi / turn) + 1):
        for side in (1.0, -1.0):
            free = heading + side * (k * turn)
            if _is_free(occupancy, x, y, free, look_ahead, path_step):
                return math.cos(free), math.sin(free), False
    return 0.0, 0.0, True


@jit
def _is_free(
    occupancy: Occupancy, x: float, y: float, heading: float, length: float, step: float
) -> bool:
    """Whether the points of a path are free: one every `step`, but for its two ends, as
    in Algorithm 8.
    """
    along, across = length * math.cos(heading), length * math.sin(heading)
    points = math.floor(length / step + ROUNDING)
    for k in range(1, points):
        share = k / points
        if is_taken(occupancy, x + share * along, y + share * across):
            return False
    return True
