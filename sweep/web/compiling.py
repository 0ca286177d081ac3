"""Compilation of code that a page is about to need.

A compiler holds Python's lock for up to seconds, and all pages of this process would
stop meanwhile. So the compiler works in a separate process. This process only loads
the compiled code from the cache. Code that no cache can hold is compiled here.
"""

import pickle
import subprocess
import sys
from collections.abc import Iterable
from contextlib import suppress
from functools import cache

from kernels.catalogue import Catalogue
from sweep.design import Job
from sweep.errors import CodeError
from sweep.spec import RecordSpec, Streams, preset_settings
from sweep.trial import (
    Simulation,
    compiling_seconds,
    is_compiled,
    looking,
    of_own_code,
    say_compiling,
    with_layers,
)


def waiting(job: Job, metrics: Iterable[str]) -> str:
    """Return the text for a user who waits for the compilation of a trial and metrics.

    The text is "" where nothing is to be compiled.
    """
    if seconds := compiling_seconds(job):
        return f"compiling {job.model}, once: about {seconds:.0f} s on an idle core"
    if names := _new(job.known, metrics):
        return f"compiling {', '.join(names)}, once: some seconds"
    return ""


def _new(known: Catalogue, metrics: Iterable[str]) -> list[str]:
    return [
        name
        for name in metrics
        if name in known.metrics and not is_compiled(known.metrics[name])
    ]


@cache
def prepare(
    model: str,
    preset: str,
    known: Catalogue,
    metrics: tuple[str, ...] = (),
    layers: frozenset[type] = frozenset(),
) -> None:
    """Compile a model and metrics, with everything that a page shows of a run.

    No step and no frame waits for a compiler afterwards.

    Parameters
    ----------
    model : str
        Name of the model.
    preset : str
        Name of its preset.
    known : Catalogue
        Models and metrics by name.
    metrics : tuple of str, optional
        Names of the metrics.
    layers : frozenset of type, optional
        Layers of the robots.

    Raises
    ------
    CodeError
        If custom code cannot be run; the message names the line.
    """
    job = small(model, preset, known, metrics, layers=layers)
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
    """Return a trial of two boids on the empty map, which belongs to no point.

    A trial of a recording has the individuals of the first event.

    Parameters
    ----------
    model : str
        Name of the model.
    preset : str
        Name of its preset.
    known : Catalogue
        Models and metrics by name.
    metrics : tuple of str, optional
        Names of the recorded metrics.
    layers : frozenset of type, optional
        Layers of the robots.
    """
    settings = preset_settings(model, preset, known) | {"map": "empty"}
    if not known.models[model].events:
        settings |= {"n": 2}
    settings |= with_layers(layers)
    return Job(
        trial_id="",
        point="",
        replicate=0,
        seed=0,
        literal=False,
        model=model,
        preset=preset,
        settings=settings,
        record=RecordSpec(metrics),
        streams=Streams("common", "common", "common"),
        time_limit=None,
        known=known,
    )


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
