"""Compilation of code that a page is about to need.

A compiler holds Python's lock for up to seconds, and all pages of this process would
stop meanwhile. So the compiler works in a separate process. This process only loads
the compiled code from the cache. Code that no cache can hold is compiled here.
"""

import pickle
import subprocess
import sys
from collections.abc import Hashable, Iterable
from contextlib import suppress
from dataclasses import replace

from kernels.catalogue import Catalogue
from sweep.design import Job
from sweep.errors import CodeError
from sweep.spec import RecordSpec
from sweep.trial import (
    Simulation,
    compiled_for,
    compiling_seconds,
    is_compiled,
    layers_of,
    looking,
    of_own_code,
    one_step,
    say_compiling,
)
from sweep.web.running import can_cover


def waiting(job: Job, metrics: Iterable[str]) -> str:
    """Return the text for a user who waits for the compilation of a trial and metrics.

    The text is "" where nothing is to be compiled.
    """
    if seconds := compiling_seconds(job):
        model = compiled_for(job)
        return f"compiling {model}, once: about {seconds:.0f} s on an idle core"
    if names := _new(job.catalogue, metrics):
        return f"compiling {', '.join(names)}, once: some seconds"
    return ""


def _new(catalogue: Catalogue, metrics: Iterable[str]) -> list[str]:
    return [
        name
        for name in metrics
        if name in catalogue.metrics and not is_compiled(catalogue.metrics[name])
    ]


PREPARED = set[Hashable]()
"""The kernels that this process has compiled or loaded: models with layers, metrics."""
IN_PROGRESS: list[str] = []
"""The compilations of this process that have begun and not ended, in words."""


def prepare(job: Job, metrics: tuple[str, ...]) -> None:
    """Compile what a page needs of a trial, with everything that the page shows.

    No step and no frame waits for a compiler afterwards.

    Parameters
    ----------
    job : Job
        The trial.
    metrics : tuple of str
        Names of the metrics.

    Raises
    ------
    CodeError
        If custom code cannot be run; the message names the line.
    """
    kernels = (job.model, job.catalogue, layers_of(job), metrics)
    if kernels in PREPARED:
        return
    say_compiling(job)
    record = RecordSpec(metrics, heatmaps=can_cover(job), trajectories=True)
    step = replace(one_step(job), record=record)
    if notice := waiting(job, metrics):
        IN_PROGRESS.append(notice)
        try:
            _apart(step)
        finally:
            IN_PROGRESS.remove(notice)
    _take_one_step(step)
    PREPARED.add(kernels)


def _take_one_step(job: Job) -> None:
    try:
        simulation = Simulation(job)
        simulation.advance(1)
        simulation.take_frames(job.record)
    except Exception as error:
        if message := of_own_code(error):
            raise CodeError(message) from error
        raise
    looking.seen_by(simulation, 0)
    looking.flocks(simulation)
    looking.accelerations(simulation)


def _apart(job: Job) -> None:
    """Take the step in another process.

    The step is repeated in this process, which then reports any error.
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
