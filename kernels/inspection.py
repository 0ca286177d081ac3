"""Observation of a run, without a change of the run.

The functions return the perceived neighbours of a boid, the flocks, and the velocities
after one step.
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
    """View of one boid: range, field of view in degrees, heading and neighbours.

    The heading is the middle of the field of view, as an angle; None if the boid sees
    all round. `known` has the x and y of the neighbours as the boid knows the
    neighbours. `known` is empty if the boid knows the true positions.
    """

    range: float
    fov: float
    heading: float | None
    neighbours: list[int]
    known: list[list[float]]


def seen_by(flight: Flight, boid: int) -> Seen:
    """Return the perceived neighbours of `boid` in the present flock, before wind.

    The search equals the search in the `advance` of a model. In a sequential update,
    boids with lower indices move first. The range is the longest range of the model.
    """
    rows = flight.work.robots.rows
    params = rows[0][boid] if rows else flight.params
    reach, fov, inclusive = flight.model.sight(params)
    flock = flight.flock
    work = flight.work
    own = known_flock = flock
    if work.near.senses is not None:
        flock = _copied(flock)
        work = _copied(work)
        work = work._replace(robots=work.robots._replace(wind=None))
        known_flock = work.before
        publish(flock, known_flock, work)
        own = work.near.senses.own
    faced = flight.model.faces_heading
    ahead_x = float((work.heading_x if faced else own.vx)[boid])
    ahead_y = float((work.heading_y if faced else own.vy)[boid])
    near = build_near(flock.x.size, work.near.topology, work.near.senses)
    count = search(
        known_flock,
        _world_of(flight, work),
        work.grid,
        boid,
        range2=square_range(reach, inclusive),
        view=cone(fov),
        ahead_x=ahead_x,
        ahead_y=ahead_y,
        near=near,
    )
    who = near.boid[:count]
    all_round = fov >= 360.0 or ahead_x == ahead_y == 0.0
    return Seen(
        range=reach,
        fov=360.0 if all_round else fov,
        heading=None if all_round else atan2(ahead_y, ahead_x),
        neighbours=who.tolist(),
        known=np.stack([known_flock.x[who], known_flock.y[who]], axis=1).tolist()
        if known_flock is not flock
        else [],
    )


def flocks(flight: Flight) -> NDArray[np.int64]:
    """Return the label of the flock of every boid, shape (N,).

    Labels equal the labels in the metrics of flocks.
    """
    flock = flight.flock
    return labels(flock.x, flock.y, flight.observation.flock_range)


def velocities_after(flight: Flight, params: Any, rng: Generator) -> Floats:
    """Return the velocities that one step with other parameters would give.

    The run does not change.

    Parameters
    ----------
    flight : Flight
    params : Params
        Parameters of the model. If a value equals the value of the run, the parameter
        varies between robots as in the run.
    rng : Generator
        Source of the model's random numbers.

    Returns
    -------
    array of float64, shape (2, N)
    """
    flock = _copied(flight.flock)
    work = _copied(flight.work)
    for table in work.robots.rows:
        for name, value in params._asdict().items():
            if value != getattr(flight.params, name):
                table[name] = value
    record = silent(flight.record, work)
    world = _world_of(flight, work)
    # A custom model may choose any parameter names: only the order is fixed.
    arguments = (flock, world, params, work, record, rng, 1)
    flight.model.advance(*arguments)
    return np.stack([flock.vx, flock.vy])


def _world_of(flight: Flight, work: Workspace) -> World:
    """Return the world of a run with the moving obstacles of a workspace."""
    return flight.world if work.motion is None else work.motion.world


def _copied(tree: Any) -> Any:
    """Return a tuple with copies of all arrays in the tuple, at any depth."""
    if isinstance(tree, np.ndarray):
        return tree.copy()
    if not isinstance(tree, tuple):
        return tree
    parts = map(_copied, tree)
    return type(tree)(*parts) if hasattr(tree, "_fields") else tuple(parts)
