"""What can be seen of a flight without changing it: whom a boid sees, who flocks
together, what one step would do.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from kernels.elementary import atan2
from kernels.flight import Flight
from kernels.metrics.flocks import labels
from kernels.near import build_near
from kernels.neighbours import cone, search, square_range
from kernels.recording import silent
from kernels.robots.sensing import publish
from kernels.state import Floats, World
from kernels.workspace import Workspace


class Seen(NamedTuple):
    """What one boid sees: the range, the field of view in degrees, the angle it is
    about, and who is in it.

    The angle is None where the boid sees all round. `known` has x and y of where it
    knows these neighbours to be; it is empty where they are there.
    """

    range: float
    fov: float
    heading: float | None
    neighbours: list[int]
    known: list[list[float]]


def seen_by(flight: Flight, boid: int) -> Seen:
    """What `boid` sees of the flock as it is, before a wind carries it, as a model's
    `advance` searches.

    In a sequential update those before it move first. The range is the longest of the
    model's.
    """
    rows = flight.work.robots.rows
    params = rows[0][boid] if rows else flight.params
    reach, fov, inclusive = flight.model.sight(params)
    flock, work = flight.flock, flight.work
    own = others = flock
    if work.near.senses is not None:
        flock, work = _copied(flock), _copied(work)
        work = work._replace(robots=work.robots._replace(wind=None))
        others = work.before
        publish(flock, others, work)
        own = work.near.senses.own
    faced = flight.model.faces_heading
    ahead_x = float((work.heading_x if faced else own.vx)[boid])
    ahead_y = float((work.heading_y if faced else own.vy)[boid])
    near = build_near(flock.x.size, work.near.topology, work.near.senses)
    found = search(
        others,
        _world_of(flight, work),
        work.grid,
        boid,
        square_range(reach, inclusive),
        cone(fov),
        ahead_x,
        ahead_y,
        near,
    )
    who = near.boid[:found]
    all_round = fov >= 360.0 or ahead_x == ahead_y == 0.0
    return Seen(
        reach,
        360.0 if all_round else fov,
        None if all_round else atan2(ahead_y, ahead_x),
        who.tolist(),
        np.stack([others.x[who], others.y[who]], axis=1).tolist()
        if others is not flock
        else [],
    )


def flocks(flight: Flight) -> NDArray[np.int64]:
    """For every boid the label of its flock, as the metrics of flocks find them; shape
    (N,).
    """
    flock = flight.flock
    return labels(flock.x, flock.y, flight.observation.flock_range)


def velocities_after(flight: Flight, params: Any, rng: Generator) -> Floats:
    """The velocities (2, N) that one step with `params` would give. Those that are the
    flight's own differ from robot to robot as in the flight.
    """
    flock, work = _copied(flight.flock), _copied(flight.work)
    for table in work.robots.rows:
        for name, value in params._asdict().items():
            if value != getattr(flight.params, name):
                table[name] = value
    record = silent(flight.record, work)
    world = _world_of(flight, work)
    flight.model.advance(flock, world, params, work, record, rng, 1)
    return np.stack([flock.vx, flock.vy])


def _world_of(flight: Flight, work: Workspace) -> World:
    """The world of a flight with the obstacles that a workspace moves."""
    return flight.world if work.motion is None else work.motion.world


def _copied(tree: Any) -> Any:
    """A tuple whose arrays, and those of the tuples in it, are its own."""
    if isinstance(tree, np.ndarray):
        return tree.copy()
    if not isinstance(tree, tuple):
        return tree
    parts = map(_copied, tree)
    return type(tree)(*parts) if hasattr(tree, "_fields") else tuple(parts)
