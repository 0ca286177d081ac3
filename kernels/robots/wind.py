"""Motion of the medium that carries boids: wind, and gusts.

The velocities of boids, and all rules of models, are relative to the medium. The medium
has a uniform velocity, the sum of (wind_x, wind_y) and a gust, and carries all boids at
the beginning of each step.

The components of the gust are independent Ornstein-Uhlenbeck processes: Uhlenbeck and
Ornstein (1930), On the theory of the Brownian motion, Physical Review 36, 823-841. The
gust is constant during a step. The exact solution over a step is
g <- exp(-dt / gust_time) g + gust sqrt(1 - exp(-2 dt / gust_time)) z, with z a standard
normal number. So the gust is stationary from the start, for any `dt`.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.chance import ChanceKey, normals
from kernels.elementary import exp, expm1
from kernels.jit import jit, jit_apart
from kernels.neighbours import Grid, move_all
from kernels.robots.purposes import FIRST_GUST, GUST
from kernels.rules.borders import confine
from kernels.settings import Medium
from kernels.state import Floats, Flock, World


class Wind(NamedTuple):
    """Motion of the medium, for steps and a world of fixed size.

    Attributes
    ----------
    x, y : float
        Mean velocity.
    gust : float
        Standard deviation of each component of a gust.
    kept : float
        Fraction of a gust that is left after a step.
    new : float
        Factor of the standard normal number that a step adds to `now`.
    dt : float
        Time of a step.
    width, height : float
        Size of the world.
    borders : int
        OPEN, TORUS or BOUNDED.
    now : array of float, shape (2,)
        Gust of the next step, as a multiple of `gust`.
    """

    x: float
    y: float
    gust: float
    kept: float
    new: float
    dt: float
    width: float
    height: float
    borders: int
    now: Floats


def is_calm(medium: Medium) -> bool:
    """Return whether the medium is at rest."""
    return medium.wind_x == medium.wind_y == medium.gust == 0.0


def build_wind(medium: Medium, key: ChanceKey, dt: float, world: World) -> Wind | None:
    """Return the wind at the start of a trial, None if the medium is at rest.

    The gust has the stationary distribution. With None, kernels are compiled without
    wind.

    Parameters
    ----------
    medium : Medium
        Mean wind, and size and correlation time of gusts.
    key : ChanceKey
        Key of the random numbers.
    dt : float
        Time of a step.
    world : World
    """
    if is_calm(medium):
        return None
    parts = dt / medium.gust_time if medium.gust_time > 0.0 else math.inf
    return Wind(
        x=medium.wind_x,
        y=medium.wind_y,
        gust=medium.gust,
        kept=exp(-parts),
        new=math.sqrt(-expm1(-2.0 * parts)),
        dt=dt,
        width=world.width,
        height=world.height,
        borders=world.borders,
        now=np.array(normals(key, 0, 0, 0, FIRST_GUST)),
    )


def go_on_blowing(mine: Wind | None, earlier: Wind | None) -> None:
    """Resume a wind with the gust of an `earlier` wind.

    The gust is stored as a multiple of the standard deviation. So the gust remains
    stationary if the standard deviation changes.
    """
    if mine is not None and earlier is not None:
        mine.now[:] = earlier.now


@jit
def blow(
    wind: Wind | None,
    flock: Flock,
    grid: Grid,
    key: ChanceKey,
    clock: NDArray[np.int64],
) -> None:
    """Carry each boid of a flock by the wind of one step.

    The border acts on position and velocity as in a separate step. The neighbour search
    is updated with the new positions.

    Parameters
    ----------
    wind : Wind or None
        Wind; with None, the flock does not change.
    flock : Flock
        Flock, changed in place.
    grid : Grid
        Grid of the neighbour search.
    key : ChanceKey
        Key of the gusts.
    clock : array of int, shape (1,)
        Number of steps that have begun.
    """
    if wind is not None:
        _carry(wind, flock, key, clock[0])
        move_all(grid, flock)


@jit_apart
def _carry(wind: Wind, flock: Flock, key: ChanceKey, step: int) -> None:
    way_x = (wind.x + wind.gust * wind.now[0]) * wind.dt
    way_y = (wind.y + wind.gust * wind.now[1]) * wind.dt
    for i in range(flock.x.size):
        flock.x[i], flock.vx[i] = confine(
            flock.x[i] + way_x, flock.vx[i], wind.width, wind.borders
        )
        flock.y[i], flock.vy[i] = confine(
            flock.y[i] + way_y, flock.vy[i], wind.height, wind.borders
        )
    if wind.gust > 0.0:
        one, other = normals(key, step, 0, 0, GUST)
        wind.now[0] = wind.kept * wind.now[0] + wind.new * one
        wind.now[1] = wind.kept * wind.now[1] + wind.new * other
