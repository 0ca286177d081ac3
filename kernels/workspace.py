"""What a model's `advance` works with, besides the flock,
its world and its parameters.
"""

import math
from typing import NamedTuple

import numpy as np

from kernels.goals import Goals
from kernels.moving import Motion
from kernels.near import Near, Topology, build_near
from kernels.neighbours import Grid, build_grid
from kernels.occupancy import Occupancy
from kernels.robots.robots import Robots
from kernels.robots.senses import Senses
from kernels.state import Floats, Flock, Kinds, World, empty_flock, laid_out
from kernels.worlds import Reach


class Workspace(NamedTuple):
    """`grid` and `near` find neighbours, `reach` and `occupancy` obstacles; `before` is
    the flock before a step, or what boids know of it, see kernels.robots.sensing.

    `heading_x` and `heading_y` (N,) keep the last velocity that was not zero, at first
    (1, 0). Models use them in which a boid at rest still has a heading.

    `state` (S, N) has the rows of the model's state in their order, and `state_before`
    what they were before the step, which `observe` keeps; both are (0, N) for a model
    without. `kind` (N,) has for each boid the index of its kind, 0 where there are
    none. `robots` are the layers between the model and its boids. `goals` say to which
    of several goals each boid goes, see kernels.goals; None where there is one.
    `motion` moves obstacles, and is None where none moves: then kernels are compiled
    without it.
    """

    grid: Grid
    near: Near
    reach: Reach
    occupancy: Occupancy
    before: Flock
    heading_x: Floats
    heading_y: Floats
    state: Floats
    state_before: Floats
    kind: Kinds
    robots: Robots
    goals: Goals | None = None
    motion: Motion | None = None


def build_workspace(
    flock: Flock,
    world: World,
    search_range: float,
    topology: Topology,
    reach: Reach,
    occupancy: Occupancy,
    state: Floats,
    kind: Kinds,
    robots: Robots,
    senses: Senses | None = None,
    goals: Goals | None = None,
    motion: Motion | None = None,
) -> Workspace:
    """The workspace of `flock`, whose model searches neighbours up to `search_range`.
    `state`, `kind`, `robots`, `senses`, `goals` and `motion` become its own.
    """
    n = flock.x.size
    cell = min(search_range, topology.around)
    grid = build_grid(flock, world, cell, published=senses is not None)
    if grid.everyone:
        topology = topology._replace(around=math.inf)
    at_rest = (flock.vx == 0.0) & (flock.vy == 0.0)
    return Workspace(
        grid,
        build_near(n, topology, senses),
        reach,
        occupancy,
        laid_out(empty_flock(n)),
        np.where(at_rest, 1.0, flock.vx),
        np.where(at_rest, 0.0, flock.vy),
        state,
        state.copy(),
        kind,
        robots,
        goals,
        motion,
    )
