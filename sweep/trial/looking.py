"""What can be seen of a simulation besides its frames, without changing it."""

import copy
from typing import NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from kernels import inspection
from kernels.coverage import heatmap
from kernels.inspection import Seen, velocities_after
from kernels.model import Rule, Sight
from kernels.state import Floats
from sweep.trial.simulation import Simulation


class Pixels(NamedTuple):
    """The pixels of a world that are visited, `per_length` of them a length.

    A visit counts those within `radius` pixels of a boid, or, where places are
    `truncated`, of the pixel that it lies in.
    """

    rows: int
    columns: int
    per_length: float
    radius: float
    truncated: bool


def sight(simulation: Simulation) -> Sight:
    """Whom boids see, with the settings as they are."""
    flight = simulation.flight
    return flight.model.sight(flight.params)


def faces_heading(simulation: Simulation) -> bool:
    """Whether a boid at rest looks where it last flew; else it sees all round."""
    return simulation.flight.model.faces_heading


def is_measured(simulation: Simulation) -> bool:
    """Whether boids know what they measured and heard, and not all that they see."""
    return simulation.flight.work.near.senses is not None


def pixels(simulation: Simulation) -> Pixels:
    """The pixels whose visits are counted."""
    of = simulation.flight.record.coverage
    return Pixels(of.rows, of.columns, of.per_length, of.radius, of.stamp.size > 0)


def seen_by(simulation: Simulation, boid: int) -> Seen:
    """What `boid` sees of the flock as it is, see kernels.inspection."""
    return inspection.seen_by(simulation.flight, boid)


def flocks(simulation: Simulation) -> NDArray[np.int64]:
    """For every boid the label of its flock; shape (N,)."""
    return inspection.flocks(simulation.flight)


def counts_visits(simulation: Simulation) -> bool:
    """Whether visits are counted."""
    return simulation.flight.record.covering


def visits(simulation: Simulation) -> NDArray[np.int32]:
    """Visits by pixel, shape (rows, columns), -1 in obstacles."""
    return heatmap(simulation.flight.record.coverage)


def rules(simulation: Simulation) -> list[str]:
    """The rules of the model that have a weight above zero."""
    return [rule.name for rule in _acting(simulation)]


def _acting(simulation: Simulation) -> list[Rule]:
    flight = simulation.flight
    return [
        rule for rule in flight.model.rules if getattr(flight.params, rule.weight) > 0
    ]


def accelerations(simulation: Simulation) -> Floats:
    """What each rule does alone: the change of velocity over dt in one step, less that
    of no rule; (rules, 2, N).

    That is not its share of the sum where a model limits forces together, or serves one
    before another.
    """
    params = simulation.flight.params
    none = {rule.weight: 0.0 for rule in simulation.flight.model.rules}
    idle = _tried(simulation, none)
    alone = [
        _tried(simulation, none | {rule.weight: getattr(params, rule.weight)})
        for rule in _acting(simulation)
    ]
    by_rule = np.array(alone).reshape(-1, *idle.shape) - idle
    return cast(
        Floats, np.nan_to_num(by_rule / float(params.dt), posinf=0.0, neginf=0.0)
    )


def _tried(simulation: Simulation, weights: dict[str, float]) -> Floats:
    """The velocities (2, N) that one step with these weights would give."""
    flight = simulation.flight
    with copy.copy(simulation.noise).lent() as rng:
        return velocities_after(flight, flight.params._replace(**weights), rng)
