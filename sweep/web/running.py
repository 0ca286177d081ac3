"""Simulations for the page.

Any metric can be plotted, and parameters can change during a run.
"""

from collections.abc import Iterable
from dataclasses import replace

from sweep.design import Job
from sweep.spec import RecordSpec, needed
from sweep.trial import (
    Simulation,
    counts,
    counts_visits,
    looking,
    pixels_of,
    world_of,
)

MOST_PIXELS = 4_000_000
"""The largest world, in pixels, whose visits are counted for a picture alone."""


def recorded(job: Job, names: Iterable[str], *, visits: bool = False) -> RecordSpec:
    """Return the record of each frame that gives these metrics of `job`.

    Frames have all bodies. Some of the metrics may be derived from further metrics.

    Parameters
    ----------
    job : Job
        The trial.
    names : iterable of str
        Names of metrics.
    visits : bool, default False
        Whether visits of pixels are counted even if no metric needs visits.
    """
    plotted = list(names)
    derive = job.record.derive if {*plotted} - job.catalogue.metrics.keys() else ()
    metrics = dict.fromkeys((*plotted, *needed(derive)))
    return RecordSpec(
        tuple(name for name in metrics if name in job.catalogue.metrics),
        derive=derive,
        heatmaps=visits,
        trajectories=True,
    )


def simulation_of(job: Job, record: RecordSpec) -> Simulation:
    """Return a simulation of `job` for the page, which counts events for `record`.

    The record does not change the run. Visits are left out in a world of more than
    MOST_PIXELS, or with moving obstacles, unless a metric needs visits.
    """
    visits = record.heatmaps and can_cover(job)
    return Simulation(replace(job, record=replace(record, heatmaps=visits)))


def can_cover(job: Job) -> bool:
    """Return whether visits of the world of a trial are counted for a picture."""
    rows, columns, _ = pixels_of(job)
    return 0 < rows * columns <= MOST_PIXELS and world_of(job).paths is None


def counts_for(simulation: Simulation, record: RecordSpec) -> bool:
    """Return whether a simulation has counted what `record` needs since its start."""
    metrics = simulation.job.catalogue.metrics
    visits = record.heatmaps and can_cover(simulation.job)
    return (counts_visits(simulation) or not visits) and all(
        counts(simulation, metrics[name]) for name in record.metrics
    )


def changed(earlier: Simulation, job: Job, record: RecordSpec) -> Simulation:
    """Return a simulation of `job` that continues from the step of `earlier`.

    The new simulation takes over the flock, the generator and the counts of `earlier`.
    The two simulations have equal numbers of boids. Visits are kept where the two
    worlds have equal pixels.

    Parameters
    ----------
    earlier : Simulation
        Simulation at the step of the change.
    job : Job
        The trial after the change.
    record : RecordSpec
        The record of both simulations.
    """
    simulation = simulation_of(job, record)
    simulation.go_on_from(earlier)
    looking.go_on_covering(simulation, earlier)
    return simulation
