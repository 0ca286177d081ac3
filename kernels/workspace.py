"""Workspace of a model: inputs of `advance` besides flock, world and parameters."""

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
    """Grids, states and layers that `advance` reads and changes.

    `grid` and `near` find neighbours, `reach` and `occupancy` find obstacles. `before`
    is the flock before a step, or the states that boids know of the flock; see
    kernels.robots.sensing.

    `heading_x` and `heading_y` (N,) keep the last nonzero velocity, (1, 0) at first.
    Models with headings of boids at rest use these arrays.

    `state` (S, N) has the state rows of the model, in order. `state_before` holds the
    state before the step, which `observe` copies. The shape of the two arrays is (0, N)
    for a model without state. `kind` (N,) has the index of the kind of each boid; 0
    without kinds. `robots` are the layers between the model and the boids. `goals` hold
    the present goal of each boid, see kernels.goals; None with a single goal. `motion`
    moves obstacles; None if no obstacle moves. With None kernels are compiled without
    motion.
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
    """Return the workspace of an initial flock.

    The workspace keeps `state`, `kind`, `robots`, `senses`, `goals` and `motion`
    without a copy.

    Parameters
    ----------
    flock : Flock
        Initial flock of N boids.
    world : World
        World of the flock.
    search_range : float
        Largest distance at which the model searches neighbours, in the unit of length.
    topology : Topology
        Rule that selects neighbours among perceived boids. The search reads all boids
        if the grid has no lists.
    reach : Reach
        Grid of the obstacles that act on a boid.
    occupancy : Occupancy
        Occupancy grid; the empty grid of `no_occupancy` for a model without an
        occupancy grid.
    state : Floats
        Rows of the state of the model, shape (S, N).
    kind : Kinds
        Index of the kind of each boid, shape (N,).
    robots : Robots
        Layers between the model and the boids.
    senses : Senses, optional
        Sensing layer of the boids; by default boids know the true positions and
        velocities.
    goals : Goals, optional
        Goals in turn; by default the world has one goal.
    motion : Motion, optional
        Motion of obstacles; by default no obstacle moves.

    Returns
    -------
    Workspace
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
