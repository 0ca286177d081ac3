"""Several goals in turn: each boid goes to the first one, and from each that it has
reached to the next.

A boid has reached its goal when it is nearer to it than `goal_radius` after a step, or
at the start. Then the next one is its goal, so that it reaches at most one in a step.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.jit import jit
from kernels.settings import WorldSettings
from kernels.state import Floats, Flock, World


class Route(NamedTuple):
    """The places (G,) of G goals, of which the first is the goal of the world. With
    `repeat` the first one follows on the last, which is kept otherwise.
    """

    x: Floats
    y: Floats
    repeat: bool


class Goals(NamedTuple):
    """The goals of N boids: `reached` (N,) is how many each has reached."""

    route: Route
    reached: NDArray[np.int64]


def build_route(settings: WorldSettings) -> Route | None:
    """The goals of a world. None where there is a single one: then kernels are compiled
    without any of this.
    """
    if not settings.next_goals:
        return None
    places = [(settings.goal_x, settings.goal_y), *settings.next_goals]
    x, y = np.array(places).T.copy()
    return Route(x, y, settings.goals_repeat)


def build_goals(route: Route | None, n: int) -> Goals | None:
    """The goals of `n` boids that have reached none."""
    return None if route is None else Goals(route, np.zeros(n, np.int64))


def at_last_goal(world: World, route: Route | None) -> World:
    """The same world with the last goal as its goal: metrics measure by that one."""
    if route is None:
        return world
    return world._replace(goal_x=float(route.x[-1]), goal_y=float(route.y[-1]))


def go_on_to(mine: Goals | None, earlier: Goals | None) -> None:
    """Let boids go on to the goals that they had in an `earlier` flight."""
    if mine is not None and earlier is not None:
        mine.reached[:] = earlier.reached


@jit
def goal_of(world: World, goals: Goals | None, i: int) -> tuple[float, float]:
    """x and y of the goal to which boid `i` goes now; `goals` are those of the
    Workspace.
    """
    if goals is None:
        return world.goal_x, world.goal_y
    k = _index(goals, i)
    return goals.route.x[k], goals.route.y[k]


@jit
def _index(goals: Goals, i: int) -> int:
    """Which of the goals is that of boid `i`."""
    if goals.route.repeat:
        return int(goals.reached[i] % goals.route.x.size)
    return int(min(goals.reached[i], goals.route.x.size - 1))


@jit
def note_reached(goals: Goals | None, flock: Flock, radius: float) -> None:
    """Note who is nearer to its goal than `radius`, and goes to the next one."""
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
    """Whether boid `i` at (x, y) is nearer to the goal of the world than `radius`; of
    several goals, whether it has reached all of them.
    """
    if goals is None:
        dx, dy = x - world.goal_x, y - world.goal_y
        return bool(dx * dx + dy * dy < radius * radius)
    return bool(goals.reached[i] >= goals.route.x.size)


@jit
def all_reached(goals: Goals | None, arrived: int) -> int:
    """How many goals all boids together have reached, of which so many have arrived."""
    if goals is None:
        return arrived
    total = 0
    for i in range(goals.reached.size):
        total += goals.reached[i]
    return total
