"""What is drawn besides the boids: whom one sees, who flocks together, where boids have
been, what each rule does.

All of it is taken from a simulation without changing it.
"""

import copy
import math
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from kernels.metrics.flocks import labels
from sweep.spec.settings import fields
from sweep.trial.simulation import Simulation

Floats = NDArray[np.float64]

MOST_CELLS = 100_000
"""Of a coverage that is drawn; a larger one is coarsened."""
WEIGHT = "_weight"
NEVER = 2**62
"""A step that is not reached: nothing is recorded of what is only tried."""


class View(NamedTuple):
    """What one boid sees: the range, the field of view in degrees, the angle it is
    about, and who is in it.

    The angle is None where the boid sees all round.
    """

    range: float
    fov: float
    heading: float | None
    neighbours: list[int]


def view(simulation: Simulation, boid: int) -> View:
    """What `boid` sees of the flock as it is, by the comparison of kernels.neighbours.

    In a sequential update those before it move first. The range is the longest of the
    model's.
    """
    flock, world, params = simulation.flock, simulation.world, simulation.params
    reach = float(simulation.model.interaction_range(params))
    fov = float(getattr(params, "fov", 360.0))
    ahead_x, ahead_y = _ahead(simulation, boid)
    dx, dy = flock.x - flock.x[boid], flock.y - flock.y[boid]
    if world.minimum_image:
        dx, dy = _nearest_image(dx, world.width), _nearest_image(dy, world.height)
    distance2, along = dx * dx + dy * dy, dx * ahead_x + dy * ahead_y
    inclusive = bool(getattr(params, "range_inclusive", False))
    range2 = np.nextafter(reach * reach, math.inf) if inclusive else reach * reach
    bound = _cone(fov) * (ahead_x * ahead_x + ahead_y * ahead_y)
    seen = (distance2 < range2) & (along * np.abs(along) >= bound * distance2)
    seen[boid] = False
    all_round = fov >= 360.0 or ahead_x == ahead_y == 0.0
    heading = None if all_round else math.atan2(ahead_y, ahead_x)
    return View(
        reach, 360.0 if all_round else fov, heading, np.flatnonzero(seen).tolist()
    )


def _ahead(simulation: Simulation, boid: int) -> tuple[float, float]:
    """Where a boid looks: along its velocity or, where the model says heading, its last
    one that was not zero.
    """
    vx, vy = float(simulation.flock.vx[boid]), float(simulation.flock.vy[boid])
    fov = fields(simulation.model.name).get("fov")
    if vx == vy == 0.0 and fov and "heading" in fov.text:
        return float(simulation.work.heading_x[boid]), float(
            simulation.work.heading_y[boid]
        )
    return vx, vy


def _cone(fov: float) -> float:
    cosine = math.cos(math.radians(0.5 * fov))
    return -4.0 if fov >= 360.0 else cosine * abs(cosine)


def _nearest_image(d: Floats, period: float) -> Floats:
    return np.where(
        d > 0.5 * period, d - period, np.where(d < -0.5 * period, d + period, d)
    )


def flocks(simulation: Simulation) -> NDArray[np.int64]:
    """Each boid's flock as a label (N,), as the metric flock_count finds flocks."""
    flock = simulation.flock
    return labels(flock.x, flock.y, simulation.observation.flock_range)


def coverage(simulation: Simulation) -> NDArray[np.int32]:
    """Visits by pixel as the coverage metrics count them, negative in obstacles; the
    most of each block of pixels.

    Blocks are single pixels where there are no more than MOST_CELLS of them.
    """
    counted = simulation.record.coverage
    visits = counted.visits.reshape(counted.rows, counted.columns)
    side = math.ceil(math.sqrt(visits.size / MOST_CELLS))
    if side <= 1:
        return visits
    return _most(_most(visits, side).T, side).T


def _most(table: NDArray[np.int32], side: int) -> NDArray[np.int32]:
    """The most of each `side` rows, one after the other; np.maximum.reduceat takes
    fifteen times as long.
    """
    most = table[::side].copy()
    for row in range(1, side):
        others = table[row::side]
        np.maximum(most[: len(others)], others, out=most[: len(others)])
    return most


def rules(simulation: Simulation) -> list[str]:
    """The rules of the model that have a weight above zero, without that word."""
    params = simulation.params
    return [
        name.removesuffix(WEIGHT)
        for name in params._fields
        if name.endswith(WEIGHT) and getattr(params, name) > 0
    ]


def accelerations(simulation: Simulation) -> Floats:
    """What each rule does alone: the change of velocity over dt in one step, less that
    of no rule; (rules, 2, N).

    That is not its share of the sum where a model limits forces together, or serves one
    before another.
    """
    none = {name: 0.0 for name in simulation.params._fields if name.endswith(WEIGHT)}
    idle = _tried(simulation, none)
    alone = [
        _tried(
            simulation,
            none | {name + WEIGHT: getattr(simulation.params, name + WEIGHT)},
        )
        for name in rules(simulation)
    ]
    by_rule = np.array(alone).reshape(-1, *idle.shape) - idle
    return cast(
        Floats,
        np.nan_to_num(by_rule / float(simulation.params.dt), posinf=0.0, neginf=0.0),
    )


def _tried(simulation: Simulation, weights: dict[str, float]) -> Floats:
    """The velocities (2, N) of a copy of the flock, after a step with these weights."""
    flock, work = _copied(simulation.flock), _copied(simulation.work)
    record, params = _lean(simulation.record), simulation.params._replace(**weights)
    with copy.copy(simulation.noise).lent() as rng:
        simulation.model.advance(flock, simulation.world, params, work, record, rng, 1)
    return np.stack([flock.vx, flock.vy])


def _copied(tree: Any) -> Any:
    """A NamedTuple whose arrays, and those of the NamedTuples in it, are its own."""
    if isinstance(tree, np.ndarray):
        return tree.copy()
    return type(tree)(*map(_copied, tree)) if isinstance(tree, tuple) else tree


def _lean(record: Any) -> Any:
    """A record of the same types into which nothing of a step is written but its number
    and dead ends.
    """
    watch = record.watch._replace(
        counting=False, pairing=False, events=record.watch.events.copy()
    )
    return record._replace(
        progress=np.array([1, 0]), every=NEVER, last=NEVER, covering=False, watch=watch
    )
