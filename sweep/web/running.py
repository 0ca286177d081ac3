"""Simulations for the page.

Any metric can be plotted, and parameters can change during a run.
"""

from collections.abc import Iterable
from dataclasses import replace

from sweep.design import Job
from sweep.spec import RecordSpec, lacks_boids, needed
from sweep.trial import Simulation, robot_layers_of, world_of
from sweep.web.compiling import prepare

MOST_PIXELS = 4_000_000
"""The largest world, in pixels, whose visits are always counted."""


def recorded(job: Job, names: Iterable[str]) -> RecordSpec:
    """Return the record of each frame that gives these metrics of `job`.

    Some of the metrics may be derived from further metrics.
    """
    plotted = list(names)
    derive = job.record.derive if {*plotted} - job.known.metrics.keys() else ()
    metrics = dict.fromkeys((*plotted, *needed(derive)))
    return RecordSpec(
        tuple(name for name in metrics if name in job.known.metrics), derive=derive
    )


def simulation_of(job: Job) -> Simulation:
    """Return a simulation of `job` for the page.

    The simulation counts all events that a metric may need, and keeps every frame with
    all bodies. These records do not change the run. In a world of more than
    MOST_PIXELS, or with moving obstacles, visits are counted only if the metrics of the
    job need visits.
    """
    prepare(job.model, job.preset, job.known, layers=robot_layers_of(job))
    model = job.known.models[job.model]
    metrics = [
        name
        for name, metric in job.known.metrics.items()
        if not metric.looks and not lacks_boids(model, metric)
    ]
    if not _can_cover(job):
        metrics = [
            name
            for name in metrics
            if not job.known.metrics[name].covers or name in job.record.metrics
        ]
    return Simulation(
        replace(job, record=RecordSpec(tuple(metrics), trajectories=True))
    )


def _can_cover(job: Job) -> bool:
    width, height, pixel = (
        float(job.settings[name]) for name in ("width", "height", "pixel")
    )
    fits = width / pixel * (height / pixel) <= MOST_PIXELS
    return pixel <= min(width, height) and fits and world_of(job).paths is None


def changed(earlier: Simulation, job: Job) -> Simulation:
    """Return a simulation of `job` that continues from the step of `earlier`.

    The new simulation takes over the flock, the generator and the counts of `earlier`.
    The two simulations have equal numbers of boids. Visits are kept if the two worlds
    have equal pixels outside obstacles.
    """
    simulation = simulation_of(job)
    simulation.go_on_from(earlier)
    return simulation
