"""Initial conditions: N positions and N velocities.

To add a start, write a function `(n, settings, world, contact, rng, seed)` that draws a
flock, and enter the function in STARTS. The function draws from `rng`, or makes a
generator from `seed`. `contact` is the Reach with margin 0, for quick tests whether a
position is inside an obstacle. The function raises RuntimeError if no free position is
found.
"""

import math
from collections.abc import Callable, Sequence
from functools import partial
from random import Random
from typing import NamedTuple

import numpy as np
from numpy.random import Generator

from kernels.angles import cosine_sine
from kernels.elementary import cos, sin
from kernels.jit import jit
from kernels.registry import Registry
from kernels.rules.headings import turned
from kernels.settings import COMPONENTS, HEADING, INTEGER, Demand, StartSettings
from kernels.state import Flock, World, empty_flock
from kernels.torus import nearest_image
from kernels.worlds import Reach, inside_any

AROUND = 6.0
"""Ratio of the radii of the two discs of `start_around_goal`.

The program of Jadhav et al. (2024) has the squares of sides 6 and 36.
"""
MOST_DRAWS = 100_000
"""Number of draws of one position after which the world has no free position."""


Draw = Callable[[int, StartSettings, World, Reach, Generator, int], Flock]
"""Function that draws an initial flock; see the docstring of this module."""


class Start(NamedTuple):
    """Method to draw the initial flock, and the demands of the method on settings.

    `text` describes the start and `source` is the origin. If each replicate has a
    separate function, `by_replicate` has all functions, and `draw` is the first
    function. `random` is True if flocks are drawn at random.
    """

    draw: Draw
    text: str
    source: str
    demands: tuple[Demand, ...] = ()
    by_replicate: tuple[Draw, ...] = ()
    random: bool = True

    def of_replicate(self, replicate: int) -> Draw:
        """Return the function that draws the flock of a replicate, counted from 0.

        Raises
        ------
        RuntimeError
            If `by_replicate` has no function for the replicate.
        """
        if not self.by_replicate:
            return self.draw
        if replicate >= len(self.by_replicate):
            raise RuntimeError(
                f"{self.source} has the flocks of {len(self.by_replicate)} replicates,"
                f" and this trial is of replicate {replicate}, counted from 0"
            )
        return self.by_replicate[replicate]


def start_numpy(
    n: int,
    settings: StartSettings,
    world: World,
    contact: Reach,
    rng: Generator,
    _seed: int,
) -> Flock:
    """Draw a flock with the random numbers of NumPy.

    Positions are drawn first, then velocities.

    Parameters
    ----------
    n : int
        Number of boids.
    settings : StartSettings
        Region, positions, velocities and speed of the start.
    world : World
        World with its obstacles.
    contact : Reach
        Reach of `world` with margin 0.
    rng : Generator
        Source of all random numbers.
    _seed : int
        Not used.

    Returns
    -------
    Flock
        `n` boids; `previous_vx` and `previous_vy` are 0.

    Raises
    ------
    RuntimeError
        If no free position is found.
    """
    flock = empty_flock(n)
    if not _draw_positions(flock, settings, world, contact, rng):
        raise RuntimeError(
            "no free place for a boid: obstacles fill the region of the start, or"
            " start_distance leaves no room for so many"
        )
    speed = settings.start_speed
    if settings.start_velocities == COMPONENTS:
        flock.vx[:] = rng.uniform(-speed, speed, n)
        flock.vy[:] = rng.uniform(-speed, speed, n)
    else:
        headings = rng.uniform(0.0, 2.0 * math.pi, n).tolist()
        flock.vx[:] = [speed * cos(heading) for heading in headings]
        flock.vy[:] = [speed * sin(heading) for heading in headings]
    return flock


def start_portable(
    n: int,
    settings: StartSettings,
    world: World,
    contact: Reach,
    rng: Generator,
    seed: int,
) -> Flock:
    """Draw a flock that is bitwise identical with any mathematics library.

    Positions equal the positions of `start_numpy`. Headings are drawn again, from [-pi,
    pi). The cosines and sines come from arithmetic alone.

    Parameters
    ----------
    n : int
        Number of boids.
    settings : StartSettings
        Region, positions, velocities and speed of the start.
    world : World
        World with its obstacles.
    contact : Reach
        Reach of `world` with margin 0.
    rng : Generator
        Source of all random numbers.
    seed : int
        Not used.

    Returns
    -------
    Flock

    Raises
    ------
    RuntimeError
        If no free position is found.
    """
    flock = start_numpy(n, settings, world, contact, rng, seed)
    if settings.start_velocities == HEADING:
        turns = map(cosine_sine, rng.uniform(-math.pi, math.pi, n).tolist())
        velocities = settings.start_speed * np.array(list(turns))
        flock.vx[:], flock.vy[:] = velocities.T
    return flock


def start_ordered(
    n: int,
    settings: StartSettings,
    world: World,
    contact: Reach,
    rng: Generator,
    seed: int,
) -> Flock:
    """Draw the flock of `start_portable`, with the velocity of the first boid for all.

    Parameters
    ----------
    n : int
        Number of boids, at least 1.
    settings : StartSettings
        Region, positions, velocities and speed of the start.
    world : World
        World with its obstacles.
    contact : Reach
        Reach of `world` with margin 0.
    rng : Generator
        Source of all random numbers.
    seed : int
        Not used.

    Returns
    -------
    Flock

    Raises
    ------
    RuntimeError
        If no free position is found.
    """
    flock = start_portable(n, settings, world, contact, rng, seed)
    flock.vx[:], flock.vy[:] = flock.vx[0], flock.vy[0]
    return flock


def start_opposite(
    n: int,
    settings: StartSettings,
    world: World,
    contact: Reach,
    rng: Generator,
    seed: int,
) -> Flock:
    """Draw a flock in a quarter of the world, the last boid in the opposite quarter.

    The flock is in the quarter of the greatest x and y. Velocities equal the velocities
    of `start_portable`. The positions of `start_portable` are drawn too, and then
    replaced.

    Parameters
    ----------
    n : int
        Number of boids.
    settings : StartSettings
        Margin, `start_free`, velocities and speed of the start.
    world : World
        World with its obstacles.
    contact : Reach
        Reach of `world` with margin 0.
    rng : Generator
        Source of all random numbers.
    seed : int
        Not used.

    Returns
    -------
    Flock

    Raises
    ------
    RuntimeError
        If no free position is found.
    """
    flock = start_portable(n, settings, world, contact, rng, seed)
    if not _draw_in_quarters(flock, settings, world, contact, rng):
        raise RuntimeError(
            "no free place for a boid: obstacles fill the quarter of its start"
        )
    return flock


def start_around_goal(
    n: int,
    settings: StartSettings,
    world: World,
    contact: Reach,
    rng: Generator,
    seed: int,
) -> Flock:
    """Draw the flock of `start_portable`, with a random direction from the goal.

    The centre of the disc has its distance from the goal. The last boid is in a larger
    disc around the same centre.

    Parameters
    ----------
    n : int
        Number of boids.
    settings : StartSettings
        Region, positions, velocities and speed of the start.
    world : World
        World with its obstacles and goal.
    contact : Reach
        Reach of `world` with margin 0.
    rng : Generator
        Source of all random numbers.
    seed : int
        Not used.

    Returns
    -------
    Flock

    Raises
    ------
    RuntimeError
        If no free position is found.
    """
    x = settings.start_center_x - world.goal_x
    y = settings.start_center_y - world.goal_y
    cosine, sine = cosine_sine(rng.uniform(-math.pi, math.pi))
    x, y = turned(x, y, cosine, sine)
    turned_settings = settings._replace(
        start_center_x=world.goal_x + x, start_center_y=world.goal_y + y
    )
    flock = start_portable(n, turned_settings, world, contact, rng, seed)
    larger = turned_settings._replace(start_radius=AROUND * settings.start_radius)
    last = start_portable(1, larger, world, contact, rng, seed)
    flock.x[-1] = last.x[0]
    flock.y[-1] = last.y[0]
    return flock


@jit
def _draw_in_quarters(
    flock: Flock, settings: StartSettings, world: World, contact: Reach, rng: Generator
) -> bool:
    """Draw every position of `start_opposite` until it is allowed.

    Return False if no allowed position is found.
    """
    last, margin = flock.x.size - 1, settings.start_margin
    across, along = 0.5 * world.width - margin, 0.5 * world.height - margin
    for i in range(flock.x.size):
        left = margin if i == last else 0.5 * world.width
        top = margin if i == last else 0.5 * world.height
        for _ in range(MOST_DRAWS):
            u, v = rng.random(), rng.random()
            flock.x[i], flock.y[i] = left + u * across, top + v * along
            if _is_allowed(settings, world, contact, flock.x[i], flock.y[i]):
                break
        else:
            return False
    return True


@jit
def _draw_positions(
    flock: Flock, settings: StartSettings, world: World, contact: Reach, rng: Generator
) -> bool:
    """Draw every position again until it is allowed.

    Return False if no allowed position is found.
    """
    left, across = _span(settings, settings.start_center_x, world.width)
    top, along = _span(settings, settings.start_center_y, world.height)
    for i in range(flock.x.size):
        for _ in range(MOST_DRAWS):
            u, v = rng.random(), rng.random()
            if settings.start_positions == INTEGER:
                flock.x[i] = math.ceil(left) + math.floor(
                    u * (math.floor(across) + 1.0)
                )
                flock.y[i] = math.ceil(top) + math.floor(v * (math.floor(along) + 1.0))
            else:
                flock.x[i], flock.y[i] = left + u * across, top + v * along
            if _is_allowed(
                settings, world, contact, flock.x[i], flock.y[i]
            ) and _is_apart(settings, world, flock, i):
                break
        else:
            return False
    return True


@jit
def _span(settings: StartSettings, center: float, length: float) -> tuple[float, float]:
    """Return the lower end and the extent of the region of the start along one axis.

    The region is the world without margins, or the part of the disc in this region.
    Integer positions include the two ends.
    """
    margin, radius = settings.start_margin, settings.start_radius
    if radius == 0.0:
        return margin, length - 2.0 * margin
    low = max(margin, center - radius)
    return low, min(length - margin, center + radius) - low


@jit
def _is_allowed(
    settings: StartSettings, world: World, contact: Reach, x: float, y: float
) -> bool:
    """Return whether a boid may start at a point.

    The point must be in the disc, if a disc is given, and free if `start_free` demands
    this.
    """
    dx, dy = x - settings.start_center_x, y - settings.start_center_y
    outside = (
        settings.start_radius > 0.0
        and dx * dx + dy * dy > settings.start_radius * settings.start_radius
    )
    return not (outside or (settings.start_free and inside_any(world, contact, x, y)))


@jit
def _is_apart(settings: StartSettings, world: World, flock: Flock, i: int) -> bool:
    """Return whether boid `i` is at least start_distance from all boids before it."""
    least = settings.start_distance
    if least > 0.0:
        for j in range(i):
            dx, dy = flock.x[i] - flock.x[j], flock.y[i] - flock.y[j]
            if world.minimum_image:
                dx = nearest_image(dx, world.width)
                dy = nearest_image(dy, world.height)
            if dx * dx + dy * dy < least * least:
                return False
    return True


def start_python_random(
    n: int,
    settings: StartSettings,
    world: World,
    contact: Reach,
    _rng: Generator,
    seed: int,
) -> Flock:
    """Draw the start of the program of aziel_chen2025, draw for draw.

    Random numbers come from `random.Random(seed)` of Python. For each boid the function
    draws x and y until the position is free. Three draws follow that the program uses
    elsewhere, and then the draw of the heading.

    Parameters
    ----------
    n : int
        Number of boids.
    settings : StartSettings
        Margin and speed of the start, and `start_free`.
    world : World
        World with its obstacles.
    contact : Reach
        Reach of `world` with margin 0.
    _rng : Generator
        Not used.
    seed : int
        Seed of the random numbers.

    Returns
    -------
    Flock

    Raises
    ------
    RuntimeError
        If no free position is found.
    """
    draws = Random(seed)
    flock = empty_flock(n)
    margin, speed = settings.start_margin, settings.start_speed
    for i in range(n):
        for _ in range(MOST_DRAWS):
            x = draws.uniform(margin, world.width - margin)
            y = draws.uniform(margin, world.height - margin)
            if not settings.start_free or not inside_any(world, contact, x, y):
                break
        else:
            raise RuntimeError(
                "no free place for a boid: obstacles fill the region of the start"
            )
        draws.random(), draws.random(), draws.random()
        heading = draws.uniform(0.0, 2.0 * math.pi)
        flock.x[i], flock.y[i] = x, y
        flock.vx[i], flock.vy[i] = speed * cos(heading), speed * sin(heading)
    return flock


Places = tuple[tuple[float, ...], ...]
"""One row per boid: x, y and the heading in degrees; or x, y, vx and vy."""


def start_given(
    places: Places,
    n: int,
    settings: StartSettings,
    _world: World,
    _contact: Reach,
    _rng: Generator,
    _seed: int,
) -> Flock:
    """Return the flock of a list of boids.

    Parameters
    ----------
    places : Places
        Rows of the boids in the order of their indices.
    n : int
        Number of boids of the trial.
    settings : StartSettings
        `start_speed` is the speed of boids with a listed heading but no listed
        velocity.
    _world, _contact, _rng, _seed
        Not used.

    Returns
    -------
    Flock

    Raises
    ------
    RuntimeError
        If the list has a different number of boids.
    """
    if n != len(places):
        raise RuntimeError(f"{len(places)} boids are given, and n is {n}")
    flock, speed = empty_flock(n), settings.start_speed
    for i, (x, y, *motion) in enumerate(places):
        flock.x[i], flock.y[i] = x, y
        if len(motion) == 1:
            heading = math.radians(motion[0])
            motion = [speed * cos(heading), speed * sin(heading)]
        flock.vx[i], flock.vy[i] = motion
    return flock


GIVEN = "places given one by one"
"""Description of a start with a list of boids."""


def given_start(flocks: Sequence[Places], source: str) -> Start:
    """Return the start with the boids of a list, or of one list per replicate.

    All lists have equal numbers of boids. `source` names the origin of the lists in
    messages.
    """
    draws = tuple(partial(start_given, places) for places in flocks)
    return Start(
        draws[0],
        GIVEN,
        source,
        (
            Demand(
                f"n == {len(flocks[0])}",
                f"{source} has the places of {len(flocks[0])} boids",
            ),
            _inside(flocks, source),
            Demand(
                "start_distance == 0",
                f"{source} says where boids are: it needs start_distance 0",
            ),
        ),
        draws if len(draws) > 1 else (),
        random=False,
    )


def _inside(flocks: Sequence[Places], source: str) -> Demand:
    """Return the demand that all listed positions are in the world.

    Worlds with open borders are exempt.
    """
    x, y = ([place[axis] for flock in flocks for place in flock] for axis in (0, 1))
    return Demand(
        f"borders == 'open' or 0 <= {min(x)} and {max(x)} <= width"
        f" and 0 <= {min(y)} and {max(y)} <= height",
        f"{source} has boids from ({min(x):g}, {min(y):g}) to ({max(x):g},"
        f" {max(y):g}), which lie outside the world",
    )


STARTS = Registry(
    "boidsweep.starts",
    Start,
    {
        "numpy": Start(
            start_numpy, "random, with NumPy's generator of random numbers", "boidsweep"
        ),
        "python_random": Start(
            start_python_random,
            "random in the whole world, with the generator of Python, as in the program"
            " of aziel_chen2025",
            "aziel_chen2025, its program",
            (
                Demand(
                    "start_radius == 0",
                    "start_draws: python_random draws in the whole world:"
                    " it needs start_radius 0",
                ),
                Demand(
                    "start_distance == 0",
                    "start_draws: python_random draws boids wherever others are: it"
                    " needs start_distance 0",
                ),
            ),
        ),
        "portable": Start(
            start_portable,
            "random, and bitwise identical on all systems",
            "boidsweep",
        ),
        "ordered": Start(
            start_ordered,
            "as portable, but all boids have the velocity of the first boid",
            "boidsweep",
        ),
        "opposite": Start(
            start_opposite,
            "as portable, but the last boid is in the quarter opposite to the other"
            " boids",
            "Strombom et al. (2014)",
            (
                Demand(
                    "start_radius == 0",
                    "start_draws: opposite draws in quarters of the world: it needs"
                    " start_radius 0",
                ),
                Demand(
                    "start_positions == 'continuous'",
                    "start_draws: opposite draws anywhere in its quarters: it needs"
                    " start_positions continuous",
                ),
            ),
        ),
        "around_goal": Start(
            start_around_goal,
            "as portable in a disc in a random direction from the goal, but the last"
            " boid in a disc with six times the radius",
            "Jadhav et al. (2024)",
            (
                Demand(
                    "start_radius > 0",
                    "start_draws: around_goal draws in discs: it needs start_radius"
                    " above 0",
                ),
            ),
        ),
    },
)
"""Starts by their names in specs."""
