"""The run of a chunk of jobs in a worker process."""

import os
import time
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeVar

from sweep.trial import NOTHING_IS_KEPT
from sweep.workers import fingerprint
from sweep.workers.watch import JobNote

if TYPE_CHECKING:
    from kernels.catalogue import Catalogue

J = TypeVar("J")
R = TypeVar("R")
_compiled: "set[tuple[Catalogue, str]]" = set()


@dataclass(frozen=True)
class Failure:
    """A job that raised an error.

    Attributes
    ----------
    error : str
        Traceback of the error.
    """

    error: str


Outcomes = tuple[list[R | Failure], float] | str
"""The outcome of each job of a chunk, and the wall seconds of all jobs together.

If the worker rejects the chunk, a sentence with the reason.
"""


def run_chunk(
    run: Callable[[J], R], jobs: Sequence[J], seat: JobNote | None, expected: str
) -> Outcomes[R]:
    """Run the jobs of a chunk, one after the other, or together if `run` can do that.

    Parameters
    ----------
    run : callable
        Runs one job; may have a method `several` that takes all jobs.
    jobs : sequence
        Jobs of the chunk.
    seat : JobNote or None
        Notes which job runs; None without limits. With limits, jobs run one by one.
    expected : str
        Fingerprint of the coordinator. A worker with another fingerprint rejects the
        chunk.
    """
    if refusal := fingerprint.refusal(expected):
        return refusal
    if seat is not None and NOTHING_IS_KEPT in os.environ:
        compile_ahead(jobs)
    start = time.perf_counter()
    several: Callable[[Sequence[J]], list[R]] | None = getattr(run, "several", None)
    outcomes: list[R | Failure]
    if several is not None and seat is None:
        outcomes = [*several(jobs)]
    else:  # limits are those of one job at a time
        outcomes = [
            _attempt(run, job) for job in (jobs if seat is None else seat.noting(jobs))
        ]
    return outcomes, time.perf_counter() - start


def compile_ahead(jobs: Sequence[object], together: bool = False) -> None:
    """Compile the code of trials before the time of a trial counts.

    Parameters
    ----------
    jobs : sequence
        Jobs of a chunk; jobs that are not trials are ignored.
    together : bool, default False
        Whether to compile the code of batches of trials, too.
    """
    from sweep.design import Job
    from sweep.trial import first_group, warm, warm_together

    for job in jobs:
        if not isinstance(job, Job):
            continue
        kind = job.catalogue, f"{job.model} {job.record}"
        if kind not in _compiled:
            warm(job)
            _compiled.add(kind)
            trials = [trial for trial in jobs if isinstance(trial, Job)]
            if together and (group := first_group(trials)):
                warm_together(group)


def _attempt(run: Callable[[J], R], job: J) -> R | Failure:
    try:
        return run(job)
    except (Exception, SystemExit):
        return Failure(traceback.format_exc())
