"""Obstacles that move: where each is after any number of steps.

Each has a velocity of its own, which is constant. On a torus its middle comes back in
across the opposite border; else it is mirrored at the borders of the world. So its
place is a function of the number of steps alone: nothing of it is kept between steps,
and a trial that goes on from a checkpoint has the same bits.

In each step obstacles move first, and then boids: those of step k meet obstacles where
they are after k steps, and so do events and metrics of the frame after it.
"""

import math
from typing import NamedTuple

import numpy as np

from kernels.angles import cosine_sine
from kernels.chance import ChanceKey, chance
from kernels.jit import jit
from kernels.robots.purposes import WAY
from kernels.settings import TORUS
from kernels.shapes import Obstacles, is_arena, velocity_of
from kernels.state import Corners, Floats, World
from kernels.worlds import Reach, enter_obstacles


class Motion(NamedTuple):
    """What moves the obstacles of `world`, whose arrays belong to one flight.

    `x`, `y` (M,) are their middles at the start, `corner_x`, `corner_y` (V,) the
    vertices of polygons, `vx`, `vy` (M,) velocities, and `dt` the time of a step.
    Obstacles act up to `margin` beyond their surface.
    """

    world: World
    x: Floats
    y: Floats
    corner_x: Floats
    corner_y: Floats
    vx: Floats
    vy: Floats
    dt: float
    margin: float


def given_velocities(obstacles: Obstacles, speed: float) -> Floats | None:
    """The velocities (2, M) of obstacles, NaN where their direction is drawn; None
    where none moves. Those without a velocity of their own have `speed`, but for
    arenas, which stay.
    """
    drawn = (math.nan, math.nan) if speed > 0.0 else (0.0, 0.0)
    velocities = [
        (0.0, 0.0) if is_arena(one) else (velocity_of(one) or drawn)
        for one in obstacles
    ]
    found = np.array(velocities, np.float64).reshape(-1, 2).T.copy()
    return found if found.any() else None


def velocities_of(given: Floats, speed: float, key: ChanceKey) -> Floats:
    """The velocities (2, M) of a trial: where they are not given, `speed` in a
    direction that depends on the key and on the number of the obstacle.
    """
    found = given.copy()
    for m in np.flatnonzero(np.isnan(given[0])).tolist():
        turn = math.pi * (2.0 * chance(key, m, 0, 0, WAY) - 1.0)
        found[:, m] = speed * np.array(cosine_sine(turn))
    return found


def build_motion(
    world: World, velocities: Floats, dt: float, margin: float = 0.0
) -> Motion:
    """What moves obstacles of `world` from where they are, with velocities (2, M) and
    steps of `dt`, which act up to `margin` beyond their surface. The world that it
    moves has arrays of its own.
    """
    corners = world.corners
    own = world._replace(
        obstacle_x=world.obstacle_x.copy(),
        obstacle_y=world.obstacle_y.copy(),
        corners=corners and corners._replace(x=corners.x.copy(), y=corners.y.copy()),
    )
    (vx, vy), none = velocities, np.zeros(0)
    return Motion(
        own,
        world.obstacle_x,
        world.obstacle_y,
        corners.x if corners else none,
        corners.y if corners else none,
        vx,
        vy,
        dt,
        margin,
    )


@jit
def place_obstacles(motion: Motion | None, step: int) -> None:
    """Put the obstacles of a world where they are after so many steps."""
    if motion is not None:
        _place(motion.world.corners, motion, step)


@jit
def move_obstacles(motion: Motion | None, reach: Reach, step: int) -> None:
    """Put the obstacles of a world where they are after so many steps, and enter them
    there into `reach`.
    """
    if motion is not None:
        _place(motion.world.corners, motion, step)
        enter_obstacles(motion.world, motion.margin, reach)


@jit
def _place(corners: Corners | None, motion: Motion, step: int) -> None:
    world, time = motion.world, step * motion.dt
    wraps = world.borders == TORUS
    for m in range(motion.x.size):
        x, y = motion.x[m], motion.y[m]
        world.obstacle_x[m] = place_along(x, motion.vx[m] * time, world.width, wraps)
        world.obstacle_y[m] = place_along(y, motion.vy[m] * time, world.height, wraps)
        if corners is not None:
            for k in range(corners.first[m], corners.first[m + 1]):
                corners.x[k] = motion.corner_x[k] + (world.obstacle_x[m] - x)
                corners.y[k] = motion.corner_y[k] + (world.obstacle_y[m] - y)


@jit
def place_along(start: float, way: float, length: float, wraps: bool) -> float:
    """Where a middle is that has gone a `way` along one axis from `start`: wrapped into
    a world of this `length`, or mirrored at its ends, as a triangle wave. What begins
    outside is mirrored where it begins.
    """
    if way == 0.0:
        return start
    if wraps:
        place = start + way
        return place - length * math.floor(place / length)
    low = 0.0 if start >= 0.0 else start
    span = max(length, start) - low
    place = (start - low) + way
    place -= 2.0 * span * math.floor(place / (2.0 * span))
    return low + (2.0 * span - place if place > span else place)
