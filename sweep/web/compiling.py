"""Compiles what a page is about to need.

A compiler holds Python's lock for up to seconds, in which no page of this process would
go on. So it works in a process of its own, and this one only loads what it has left in
the cache. What has no place in a cache is compiled here.
"""

import pickle
import subprocess
import sys
from collections.abc import Iterable
from contextlib import suppress
from functools import cache

from kernels.catalogue import Catalogue
from sweep.design.jobs import Job
from sweep.errors import CodeError
from sweep.spec.settings import preset_settings
from sweep.spec.study import RecordSpec, Streams
from sweep.trial import looking
from sweep.trial.numba_errors import of_own_code
from sweep.trial.robots import with_layers
from sweep.trial.simulation import (
    Simulation,
    compiling_seconds,
    is_compiled,
    say_compiling,
)


def waiting(job: Job, metrics: Iterable[str]) -> str:
    """What is said to somebody who waits until the model of a trial and metrics are
    compiled; "" where nothing is to be compiled.
    """
    if seconds := compiling_seconds(job):
        return f"compiling {job.model}, once: about {seconds:.0f} s on an idle core"
    if names := _new(job.known, metrics):
        return f"compiling {', '.join(names)}, once: some seconds"
    return ""


def _new(known: Catalogue, metrics: Iterable[str]) -> list[str]:
    found = known.metrics
    return [one for one in metrics if one in found and not is_compiled(found[one])]


@cache
def prepare(
    model: str,
    preset: str,
    known: Catalogue,
    metrics: tuple[str, ...] = (),
    layers: frozenset[type] = frozenset(),
) -> None:
    """Compile a model and metrics, for boids with these `layers`, with all that a page
    shows of them, so that no step and no frame waits for it. Raises CodeError, with the
    line, where code of one's own cannot be run.
    """
    job = small(model, preset, known, metrics, layers)
    say_compiling(job)
    if waiting(job, metrics):
        _apart(job)
    _take_one_step(job)


def small(
    model: str,
    preset: str,
    known: Catalogue,
    metrics: tuple[str, ...] = (),
    layers: frozenset[type] = frozenset(),
) -> Job:
    """A trial of two boids with these layers, which belongs to no point."""
    settings = preset_settings(model, preset, known) | {"n": 2, "map": "empty"}
    settings |= with_layers(layers)
    streams = Streams("common", "common", "common")
    return Job(
        *("", "", 0, 0, False, model, preset, settings),
        RecordSpec(metrics),
        streams,
        time_limit=None,
        known=known,
    )


def _take_one_step(job: Job) -> None:
    try:
        simulation = Simulation(job)
        simulation.advance(1)
        simulation.take_frames(job.record)
    except Exception as error:
        if said := of_own_code(error):
            raise CodeError(said) from error
        raise
    looking.seen_by(simulation, 0)
    looking.flocks(simulation)
    looking.accelerations(simulation)


def _apart(job: Job) -> None:
    """Take the step in another process. What goes wrong there goes wrong here too, and
    is said here.
    """
    with suppress(OSError, pickle.PicklingError, AttributeError, TypeError):
        subprocess.run(
            [sys.executable, "-P", "-m", "sweep.web.compiling"],
            input=pickle.dumps(job),
            capture_output=True,
            check=False,
        )


if __name__ == "__main__":
    _take_one_step(pickle.load(sys.stdin.buffer))
