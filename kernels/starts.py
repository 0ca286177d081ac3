"""Initial flocks: N positions and N velocities."""

import math
from random import Random

from numpy.random import Generator

from kernels.jit import jit
from kernels.settings import COMPONENTS, INTEGER, StartSettings
from kernels.state import Flock, World, empty_flock
from kernels.worlds import Reach, inside_any

MOST_DRAWS = 100_000
"""Draws of one position after which the world is taken to have no free place."""


def start_numpy(n: int, settings: StartSettings, world: World, contact: Reach, rng: Generator) -> Flock:
    """`n` boids as `settings` say; `contact` is the Reach with margin 0.

    Raises RuntimeError where no free place is found.
    """
    flock = empty_flock(n)
    if not _draw_positions(flock, settings, world, contact, rng):
        raise RuntimeError("no free place for a boid: obstacles fill the region of the start")
    speed = settings.start_speed
    if settings.start_velocities == COMPONENTS:
        flock.vx[:] = rng.uniform(-speed, speed, n)
        flock.vy[:] = rng.uniform(-speed, speed, n)
    else:
        # Not np.cos, whose last bit depends on the processor.
        headings = rng.uniform(0.0, 2.0 * math.pi, n).tolist()
        flock.vx[:] = [speed * math.cos(heading) for heading in headings]
        flock.vy[:] = [speed * math.sin(heading) for heading in headings]
    return flock


@jit
def _draw_positions(flock: Flock, settings: StartSettings, world: World, contact: Reach, rng: Generator) -> bool:
    """Draw every position, until it is free if it must be; False where no free place is found.

    Integer positions include both borders.
    """
    margin = settings.start_margin
    for i in range(flock.x.size):
        for _ in range(MOST_DRAWS):
            u, v = rng.random(), rng.random()
            x = margin + u * (world.width - 2.0 * margin)
            y = margin + v * (world.height - 2.0 * margin)
            if settings.start_positions == INTEGER:
                x = math.ceil(margin) + math.floor(u * (math.floor(world.width - 2.0 * margin) + 1.0))
                y = math.ceil(margin) + math.floor(v * (math.floor(world.height - 2.0 * margin) + 1.0))
            flock.x[i], flock.y[i] = x, y
            if not settings.start_free or not inside_any(world, contact, x, y):
                break
        else:
            return False
    return True


def start_python_random(n: int, settings: StartSettings, world: World, contact: Reach, seed: int) -> Flock:
    """The start of aziel_chen2025's program, draw for draw, from Python's `random.Random(seed)`.

    For each boid x and y until the place is free, three draws that the program spends elsewhere, then the heading.
    Raises RuntimeError where no free place is found.
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
            raise RuntimeError("no free place for a boid: obstacles fill the region of the start")
        draws.random(), draws.random(), draws.random()
        heading = draws.uniform(0.0, 2.0 * math.pi)
        flock.x[i], flock.y[i] = x, y
        flock.vx[i], flock.vy[i] = speed * math.cos(heading), speed * math.sin(heading)
    return flock
