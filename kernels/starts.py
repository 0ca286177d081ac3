"""Initial flocks: N positions and N velocities.

To add a start, write a function `(n, settings, world, contact, rng, seed)` that draws a
flock, and enter it in STARTS. It draws from `rng`, or from another generator that it
makes from `seed`. `contact` is the Reach with margin 0, which tells quickly whether a
place is inside an obstacle. It raises RuntimeError where it finds no free place.
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
from kernels.settings import COMPONENTS, HEADING, INTEGER, Demand, StartSettings
from kernels.state import Flock, World, empty_flock
from kernels.torus import nearest_image
from kernels.worlds import Reach, inside_any

MOST_DRAWS = 100_000
"""After so many draws of one position we conclude that the world has no free place."""


Draw = Callable[[int, StartSettings, World, Reach, Generator, int], Flock]


class Start(NamedTuple):
    """A way to draw the initial flock: its function, what it is and where it comes
    from, and what it demands of the other settings.

    Where each replicate has a function of its own, these are `by_replicate`, and `draw`
    is the first of them. `random` says that flocks are drawn at random.
    """

    draw: Draw
    text: str
    source: str
    demands: tuple[Demand, ...] = ()
    by_replicate: tuple[Draw, ...] = ()
    random: bool = True

    def of_replicate(self, replicate: int) -> Draw:
        """The function that draws the flock of a replicate, counted from 0.

        Raises RuntimeError for a replicate that has none.
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
    """`n` boids as `settings` say; `contact` is the Reach with margin 0.

    Raises RuntimeError where no free place is found.
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
    """The flock of `start_numpy`, with other headings, whose cosines and sines come
    from arithmetic alone: it has the same bits with any mathematics library.
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
    """The flock of `start_portable`, in which all boids have the velocity of the
    first.
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
    """The flock of `start_portable` in the quarter of the world with the greatest x and
    y, but for the last boid, which starts in the quarter opposite to it.

    Raises RuntimeError where no free place is found.
    """
    flock = start_portable(n, settings, world, contact, rng, seed)
    if not _draw_in_quarters(flock, settings, world, contact, rng):
        raise RuntimeError(
            "no free place for a boid: obstacles fill the quarter of its start"
        )
    return flock


@jit
def _draw_in_quarters(
    flock: Flock, settings: StartSettings, world: World, contact: Reach, rng: Generator
) -> bool:
    """Draw every position of `start_opposite` until it is allowed; False if no allowed
    place is found.
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
    """Draw every position again until it is allowed; False if no allowed place is
    found.
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
    """Where the region of the start begins along one axis, and its extent: the world's,
    or the disc's part of it.

    Integer positions include both ends.
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
    """Whether a boid may start at (x, y): in the disc, where there is one, and free
    where it must be.
    """
    dx, dy = x - settings.start_center_x, y - settings.start_center_y
    outside = (
        settings.start_radius > 0.0
        and dx * dx + dy * dy > settings.start_radius * settings.start_radius
    )
    return not (outside or (settings.start_free and inside_any(world, contact, x, y)))


@jit
def _is_apart(settings: StartSettings, world: World, flock: Flock, i: int) -> bool:
    """Whether boid `i` is at least start_distance from all before it."""
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
    """The start of aziel_chen2025's program, draw for draw, from Python's
    `random.Random(seed)`.

    For each boid x and y until the place is free, three draws that the program spends
    elsewhere, then the heading. Raises RuntimeError where no free place is found.
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
"""A row for each boid: x, y and its heading in degrees; or x, y, vx and vy."""


def start_given(
    places: Places,
    n: int,
    settings: StartSettings,
    _world: World,
    _contact: Reach,
    _rng: Generator,
    _seed: int,
) -> Flock:
    """The `n` boids of a list, at start_speed where their velocities are not given.

    Raises RuntimeError where the list has another number of boids.
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


def given_start(flocks: Sequence[Places], source: str) -> Start:
    """The start with the boids of a list, or of one list for each replicate. All have
    the same number of boids.
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
    """That all given places lie in the world, where its borders keep boids in it."""
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
        "numpy": Start(start_numpy, "of NumPy", "boidsweep"),
        "python_random": Start(
            start_python_random,
            "of aziel_chen2025",
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
            "same bits everywhere",
            "boidsweep",
        ),
        "ordered": Start(
            start_ordered,
            "portable, one velocity",
            "boidsweep",
        ),
        "opposite": Start(
            start_opposite,
            "portable, one apart",
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
    },
)
"""By their names in specs."""
