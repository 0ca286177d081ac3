"""Views of a simulation in addition to its frames, and changes by a live session.

No view changes the simulation.
"""

import copy
from typing import NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from kernels import coverage, inspection
from kernels.coverage import heatmap
from kernels.inspection import Seen, velocities_after
from kernels.metrics import Metric
from kernels.model import Rule, Sight
from kernels.recording import keep_frame
from kernels.state import Floats
from sweep.trial.simulation import Simulation


class Pixels(NamedTuple):
    """Pixels of a world in which visits are counted.

    Attributes
    ----------
    rows, columns : int
    per_length : float
        Pixels per unit of length.
    radius : float
        Radius of a visit around a boid, in pixels.
    truncated : bool
        Whether the radius is around the pixel that contains the boid.
    """

    rows: int
    columns: int
    per_length: float
    radius: float
    truncated: bool


def sight(simulation: Simulation) -> Sight:
    """Return the field of view of boids, with the current parameters."""
    flight = simulation.flight
    return flight.model.sight(flight.params)


def faces_heading(simulation: Simulation) -> bool:
    """Return whether a boid at rest keeps its heading.

    Otherwise a boid at rest perceives all directions.
    """
    return simulation.flight.model.faces_heading


def is_measured(simulation: Simulation) -> bool:
    """Return whether boids use measurements and messages instead of exact values."""
    return simulation.flight.work.near.senses is not None


def pixels(simulation: Simulation) -> Pixels:
    """Return the pixels in which visits are counted."""
    coverage = simulation.flight.record.coverage
    return Pixels(
        rows=coverage.rows,
        columns=coverage.columns,
        per_length=coverage.per_length,
        radius=coverage.radius,
        truncated=coverage.stamp.size > 0,
    )


def seen_by(simulation: Simulation, boid: int) -> Seen:
    """Return the neighbours that a boid perceives now, see kernels.inspection."""
    return inspection.seen_by(simulation.flight, boid)


def flocks(simulation: Simulation) -> NDArray[np.int64]:
    """Return the label of the flock of every boid, shape (N,)."""
    return inspection.flocks(simulation.flight)


def counts_visits(simulation: Simulation) -> bool:
    """Return whether visits are counted."""
    return simulation.flight.record.covering


def counts(simulation: Simulation, metric: Metric) -> bool:
    """Return whether a simulation counts the visits and events that a metric needs."""
    record = simulation.flight.record
    watch = record.watch
    switches = (
        (metric.covers, record.covering),
        (metric.counts, watch.counting),
        (metric.pairs, watch.pairing),
        (metric.integrates, watch.integrating),
        (metric.follows, watch.following),
    )
    return all(on for needed, on in switches if needed)


def visits(simulation: Simulation) -> NDArray[np.int32]:
    """Return the visits of each pixel, shape (rows, columns), -1 in obstacles."""
    return heatmap(simulation.flight.record.coverage)


def rules(simulation: Simulation) -> list[str]:
    """Return the rules of the model that have a weight above zero."""
    return [rule.name for rule in _acting(simulation)]


def _acting(simulation: Simulation) -> list[Rule]:
    flight = simulation.flight
    return [
        rule for rule in flight.model.rules if getattr(flight.params, rule.weight) > 0
    ]


def accelerations(simulation: Simulation) -> Floats:
    """Return the acceleration of each rule alone, shape (rules, 2, N).

    The acceleration is the change of velocity in one step, divided by dt, minus the
    value without rules. If a model limits the sum of forces, or prioritises rules, the
    result is not the rule's fraction of the sum.
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
    """Return the velocities (2, N) after one step with some weights."""
    flight = simulation.flight
    with copy.copy(simulation.noise).lent() as rng:
        return velocities_after(flight, flight.params._replace(**weights), rng)


def retake_frame(simulation: Simulation) -> None:
    """Record a frame of the present step again, after `take_frames`.

    The present state must be finite, and the job must record every step.

    Parameters
    ----------
    simulation : Simulation
    """
    keep_frame(simulation.flight.flock, simulation.flight.record)


def go_on_covering(simulation: Simulation, earlier: Simulation) -> None:
    """Take over visits of a run whose obstacles differ, after `go_on_from`.

    Pixels that are outside obstacles in both runs keep their visits. A world with other
    pixels begins without visits.

    Parameters
    ----------
    simulation : Simulation
        The run that continues.
    earlier : Simulation
        The run before the change.
    """
    coverage.go_on_covering(
        simulation.flight.record.coverage, earlier.flight.record.coverage
    )
