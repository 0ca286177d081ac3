"""Several goals in turn: each boid goes from one goal to the next.

A boid has reached its goal if the distance to the goal is below `goal_radius` after a
step, or at the start. Then the boid goes to the next goal, so a boid reaches at most
one goal per step.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.jit import jit
from kernels.settings import WorldSettings
from kernels.state import Floats, Flock, World


class Route(NamedTuple):
    """Positions (G,) of G goals; the first goal is the goal of the world.

    With `repeat` the first goal follows the last goal. Without `repeat` boids keep the
    last goal.
    """

    x: Floats
    y: Floats
    repeat: bool


class Goals(NamedTuple):
    """Goals of N boids: `reached` (N,) is the number of goals reached per boid."""

    route: Route
    reached: NDArray[np.int64]


def build_route(settings: WorldSettings) -> Route | None:
    """Return the goals of a world; None if there is a single goal.

    With None kernels are compiled without any code for several goals.
    """
    if not settings.next_goals:
        return None
    places = [(settings.goal_x, settings.goal_y), *settings.next_goals]
    x, y = np.array(places).T.copy()
    return Route(x, y, settings.goals_repeat)


def build_goals(route: Route | None, n: int) -> Goals | None:
    """Return the goals of `n` boids before any arrival; None without a route."""
    return None if route is None else Goals(route, np.zeros(n, np.int64))


def at_last_goal(world: World, route: Route | None) -> World:
    """Return a world with the last goal as its goal, for metrics."""
    if route is None:
        return world
    return world._replace(goal_x=float(route.x[-1]), goal_y=float(route.y[-1]))


def go_on_to(mine: Goals | None, earlier: Goals | None) -> None:
    """Continue with the goals of boids in an `earlier` run."""
    if mine is not None and earlier is not None:
        mine.reached[:] = earlier.reached


@jit
def goal_of(world: World, goals: Goals | None, i: int) -> tuple[float, float]:
    """Return the position of the present goal of a boid.

    Parameters
    ----------
    world : World
        Gives the goal if there is a single one.
    goals : Goals or None
        Goals of the Workspace.
    i : int
        Index of the boid.

    Returns
    -------
    tuple of float
        x and y.
    """
    if goals is None:
        return world.goal_x, world.goal_y
    k = _index(goals, i)
    return goals.route.x[k], goals.route.y[k]


@jit
def _index(goals: Goals, i: int) -> int:
    """Return the index of the goal of boid `i`."""
    if goals.route.repeat:
        return int(goals.reached[i] % goals.route.x.size)
    return int(min(goals.reached[i], goals.route.x.size - 1))


@jit
def note_reached(goals: Goals | None, flock: Flock, radius: float) -> None:
    """Note the boids that have reached their goals and go to the next goals.

    Parameters
    ----------
    goals : Goals or None
        Changed in place.
    flock : Flock
    radius : float
        Distance from a goal below which the goal is reached.
    """
    if goals is not None:
        _note_reached(goals, flock, radius)


@jit
def _note_reached(goals: Goals, flock: Flock, radius: float) -> None:
    route, reached = goals.route, goals.reached
    for i in range(flock.x.size):
        if route.repeat or reached[i] < route.x.size:
            k = _index(goals, i)
            dx, dy = flock.x[i] - route.x[k], flock.y[i] - route.y[k]
            reached[i] += int(dx * dx + dy * dy < radius * radius)


@jit
def has_arrived(
    goals: Goals | None, world: World, i: int, x: float, y: float, radius: float
) -> bool:
    """Return whether a boid has arrived at the goal, or at all of several goals.

    Parameters
    ----------
    goals : Goals or None
        None if the world has a single goal.
    world : World
        Gives the single goal.
    i : int
        Index of the boid.
    x, y : float
        Position of the boid.
    radius : float
        Distance from a single goal below which the boid has arrived.

    Returns
    -------
    bool
    """
    if goals is None:
        dx, dy = x - world.goal_x, y - world.goal_y
        return bool(dx * dx + dy * dy < radius * radius)
    return bool(goals.reached[i] >= goals.route.x.size)


@jit
def all_reached(goals: Goals | None, arrived: int) -> int:
    """Return the number of goals that all boids together have reached.

    With a single goal this is `arrived`, the number of boids that have arrived.
    """
    if goals is None:
        return arrived
    total = 0
    for i in range(goals.reached.size):
        total += goals.reached[i]
    return total
