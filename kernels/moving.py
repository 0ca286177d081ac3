"""Moving obstacles: the position of an obstacle after any number of steps.

Each obstacle has a constant velocity. On a torus the middle of the obstacle re-enters
across the opposite border; in a world without periodic boundaries the borders mirror
the middle. So the position is a function of the number of steps alone. No position is
stored between steps, and a trial that resumes from a checkpoint is bitwise identical.

In each step obstacles move before boids. The boids of step k meet obstacles at the
positions after k steps. Events and metrics of the frame after step k use these
positions too.
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
    """Motion of the obstacles of `world`; the arrays belong to one run.

    `x`, `y` (M,) are the middles at the start, `corner_x`, `corner_y` (V,) the vertices
    of polygons, `vx`, `vy` (M,) velocities, and `dt` the time of a step. An obstacle
    acts up to `margin` beyond its surface.
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
    """Return the velocities (2, M) of obstacles; None if no obstacle moves.

    Entries are NaN for random directions. Obstacles without a given velocity have the
    speed `speed`. Arenas do not move.
    """
    drawn = (math.nan, math.nan) if speed > 0.0 else (0.0, 0.0)
    velocities = [
        (0.0, 0.0) if is_arena(one) else (velocity_of(one) or drawn)
        for one in obstacles
    ]
    found = np.array(velocities, np.float64).reshape(-1, 2).T.copy()
    return found if found.any() else None


def velocities_of(given: Floats, speed: float, key: ChanceKey) -> Floats:
    """Return the velocities of obstacles in a trial.

    Parameters
    ----------
    given : array of float64, shape (2, M)
        Velocities, NaN where the direction is random.
    speed : float
        Speed of obstacles with a random direction.
    key : ChanceKey
        Key of the trial; the direction depends on the key and the number of the
        obstacle.

    Returns
    -------
    array of float64, shape (2, M)
    """
    found = given.copy()
    for m in np.flatnonzero(np.isnan(given[0])).tolist():
        turn = math.pi * (2.0 * chance(key, m, 0, 0, WAY) - 1.0)
        found[:, m] = speed * np.array(cosine_sine(turn))
    return found


def build_motion(
    world: World, velocities: Floats, dt: float, margin: float = 0.0
) -> Motion:
    """Return the motion of obstacles from their present positions.

    Parameters
    ----------
    world : World
        World with obstacles. The motion copies the arrays of obstacles and changes the
        copies.
    velocities : array of float64, shape (2, M)
        Velocities of the obstacles.
    dt : float
        Time of a step.
    margin : float, default 0
        Distance from its surface up to which an obstacle acts.

    Returns
    -------
    Motion
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
    """Move the obstacles of a world to their positions after `step` steps."""
    if motion is not None:
        _place(motion.world.corners, motion, step)


@jit
def move_obstacles(motion: Motion | None, reach: Reach, step: int) -> None:
    """Move obstacles to the positions after `step` steps, and update the reach.

    Parameters
    ----------
    motion : Motion or None
        Its world is changed in place; None if no obstacle moves.
    reach : Reach
        Receives the obstacles at their new positions.
    step : int
        Number of steps done.
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
    """Return the coordinate of a middle that has moved by `way` along one axis.

    If the middle starts outside the world, the start takes the place of the border as
    the mirror.

    Parameters
    ----------
    start : float
        Coordinate at the start.
    way : float
        Signed displacement without borders.
    length : float
        Size of the world along the axis.
    wraps : bool
        True to wrap the coordinate into the world; False to mirror the coordinate at
        the borders, as a triangle wave.

    Returns
    -------
    float
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
