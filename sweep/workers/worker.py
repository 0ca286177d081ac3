"""Runs a chunk of jobs in a worker process."""

import time
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeVar

from sweep.workers import fingerprint
from sweep.workers.watch import JobNote

J = TypeVar("J")
R = TypeVar("R")


@dataclass(frozen=True)
class Failure:
    """A job that raised an error, or whose worker died. `error` is a traceback or one
    sentence.
    """

    error: str


Outcomes = tuple[list[R | Failure], float] | str
"""The outcome of each job of a chunk, and the wall seconds of all together. Or one
sentence: why the worker refuses the chunk.
"""


def run_chunk(
    run: Callable[[J], R], jobs: Sequence[J], seat: JobNote | None, expected: str
) -> Outcomes[R]:
    """Run the jobs of a chunk, one after the other, or together if `run` can do that.

    run       runs one job; it may have a method `several` that takes all jobs
    jobs      the jobs
    seat     is told which job runs; None without limits
    expected  the fingerprint of the coordinator; a worker with another one refuses
    """
    if refusal := fingerprint.refusal(expected):
        return refusal
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


def _attempt(run: Callable[[J], R], job: J) -> R | Failure:
    try:
        return run(job)
    except (Exception, SystemExit):
        return Failure(traceback.format_exc())
