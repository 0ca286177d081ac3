"""Simulations for the page: any metric can be plotted, and settings change while they
run.
"""

from collections.abc import Iterable
from dataclasses import replace

from sweep.design.jobs import Job
from sweep.spec.derived_metrics import needed
from sweep.spec.recorded import lacks_boids
from sweep.spec.study import RecordSpec
from sweep.trial.robots import robot_layers_of
from sweep.trial.simulation import Simulation
from sweep.trial.world import world_of
from sweep.web.compiling import prepare

MOST_PIXELS = 4_000_000
"""The largest world, in pixels, whose visits are always counted."""


def recorded(job: Job, names: Iterable[str]) -> RecordSpec:
    """What is recorded of each frame to plot these metrics of `job`, some of which may
    be derived from others.
    """
    wanted = list(names)
    derive = job.record.derive if {*wanted} - job.known.metrics.keys() else ()
    metrics = dict.fromkeys((*wanted, *needed(derive)))
    return RecordSpec(
        tuple(name for name in metrics if name in job.known.metrics), derive=derive
    )


def simulation_of(job: Job) -> Simulation:
    """A simulation of `job` for the page: it counts what any metric may need, and keeps
    every frame with all bodies.

    The flight is the same as without all this. In a world of more than MOST_PIXELS, or
    where obstacles move, visits are counted only if the metrics of the job need them.
    """
    prepare(job.model, job.preset, job.known, layers=robot_layers_of(job))
    model = job.known.models[job.model]
    wanted = [
        name
        for name, metric in job.known.metrics.items()
        if not metric.looks and not lacks_boids(model, metric)
    ]
    if not _can_cover(job):
        wanted = [
            name
            for name in wanted
            if not job.known.metrics[name].covers or name in job.record.metrics
        ]
    return Simulation(replace(job, record=RecordSpec(tuple(wanted), trajectories=True)))


def _can_cover(job: Job) -> bool:
    width, height, pixel = (
        float(job.settings[name]) for name in ("width", "height", "pixel")
    )
    fits = width / pixel * (height / pixel) <= MOST_PIXELS
    return pixel <= min(width, height) and fits and world_of(job).paths is None


def changed(earlier: Simulation, job: Job) -> Simulation:
    """A simulation of `job` that goes on where `earlier` is: it takes over its flock,
    generator and counts. Both have the same number of boids. Visits are kept if both
    worlds have the same pixels outside obstacles.
    """
    simulation = simulation_of(job)
    simulation.go_on_from(earlier)
    return simulation
