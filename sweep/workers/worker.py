"""What a worker does with a chunk of jobs."""

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
    """The fate of a job that never returned: `error` is a traceback or one sentence."""

    error: str


Outcomes = tuple[list[R | Failure], float] | str
"""The outcome of each job of a chunk, and the wall seconds that they took together; or
why the worker refuses the chunk.
"""


def run_chunk(
    run: Callable[[J], R], jobs: Sequence[J], place: JobNote | None, expected: str
) -> Outcomes[R]:
    """Run the jobs, unless this process differs from the one whose fingerprint is
    `expected`.
    """
    if refusal := fingerprint.refusal(expected):
        return refusal
    start = time.perf_counter()
    outcomes = [
        _attempt(run, job) for job in (jobs if place is None else place.noting(jobs))
    ]
    return outcomes, time.perf_counter() - start


def _attempt(run: Callable[[J], R], job: J) -> R | Failure:
    try:
        return run(job)
    except (Exception, SystemExit):
        return Failure(traceback.format_exc())
