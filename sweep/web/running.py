"""Simulations to look at: any metric can be plotted, settings change while they run."""

from dataclasses import replace
from functools import cache

from kernels.metrics import METRICS
from sweep.design.jobs import Job
from sweep.spec.settings import preset_settings
from sweep.spec.study import RecordSpec, Streams
from sweep.trial.looking import seen_by
from sweep.trial.simulation import Simulation

MOST_PIXELS = 4_000_000
"""Of a world whose visits are counted in any case."""


def simulation_of(job: Job) -> Simulation:
    """The simulation of `job` that counts what any metric may need, and keeps every
    frame with all bodies.

    What is counted and kept changes nothing of the flight. Where there are very many
    pixels, visits are only counted for the metrics of the job.
    """
    _compile(job.model, job.preset)
    wanted = [
        name
        for name, metric in METRICS.items()
        if metric.counts or metric.pairs or metric.covers
    ]
    if not _can_cover(job):
        wanted = [
            name
            for name in wanted
            if not METRICS[name].covers or name in job.record.metrics
        ]
    return Simulation(replace(job, record=RecordSpec(tuple(wanted), trajectories=True)))


@cache
def _compile(model: str, preset: str) -> None:
    """Compile what runs of a model need, so that the first step need not."""
    settings = preset_settings(model, preset) | {"n": 2, "map": "empty"}
    streams = Streams("common", "common", "common")  # it is of no point
    job = Job(
        "", "", 0, 0, False, model, preset, settings, RecordSpec(()), streams, None
    )
    simulation = Simulation(job)
    simulation.advance(1)
    seen_by(simulation, 0)


def _can_cover(job: Job) -> bool:
    width, height, pixel = (
        float(job.settings[name]) for name in ("width", "height", "pixel")
    )
    return (
        pixel <= min(width, height) and width / pixel * (height / pixel) <= MOST_PIXELS
    )


def changed(earlier: Simulation, job: Job) -> Simulation:
    """The simulation of `job` in the place of `earlier`, which has as many boids: its
    flock, generator and counts.

    Visits are kept where the same pixels can be visited.
    """
    simulation = simulation_of(job)
    simulation.go_on_from(earlier)
    return simulation
