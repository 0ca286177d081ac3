"""What a trial gave, as plain values."""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from sweep.design.jobs import Job, LastFlock

FAILED = ("failed", "timeout")
"""The statuses of trials that did not end by themselves. A diverged trial did:
divergence is what the model gives.
"""


ENDINGS = {
    "diverged": "{what} was not a finite number after step {step}",
    "timeout": "time limit of {limit} s reached after step {step}",
}
"""Why a trial ended before its time, by its status."""


@dataclass(frozen=True, slots=True)
class Result:
    """What a trial gave.

    `status` is done, failed, diverged or timeout; `step` the last step taken. `last`
    and `mean` hold each metric at the last frame and its mean over the frames of the
    last half, and are empty unless done. `frames` (F,) and each of `series` (F,) are
    the steps and values of the recorded frames; `heatmap` (rows, columns) holds visit
    counts, -1 in obstacles; `trajectory` (F, 4, N) holds x, y, vx and vy of every boid
    in them, and `states` (F, S, N) the rows of the model's state. `last_state` are the
    sealed bytes from which a longer trial goes on, empty where none are kept.
    `last_flock` is where boids are at the end of a trial that is done and keeps it.
    """

    job: Job
    status: str
    seconds: float
    step: int = 0
    error: str = ""
    last: dict[str, float] = field(default_factory=dict)
    mean: dict[str, float] = field(default_factory=dict)
    frames: NDArray[np.int64] | None = None
    series: dict[str, NDArray[np.float64]] = field(default_factory=dict)
    heatmap: NDArray[np.int32] | None = None
    trajectory: NDArray[np.float64] | None = None
    states: NDArray[np.float64] | None = None
    last_state: bytes = field(default=b"", repr=False)
    last_flock: LastFlock | None = field(default=None, repr=False)

    @property
    def has_failed(self) -> bool:
        return self.status in FAILED


def failed(job: Job, error: str) -> Result:
    """The result of a job that never returned one."""
    return Result(job, "failed", 0.0, error=error)


def overdue(job: Job, error: str) -> Result:
    """The result of a job that was ended because it did not return in time."""
    return Result(job, "timeout", 0.0, error=error)


def after(attempts: int, result: Result) -> Result:
    """The result of a trial tried so often; if it failed again its error says so."""
    if attempts == 1 or not result.has_failed:
        return result
    return replace(result, error=f"after {attempts} attempts: {result.error}")


def result_bytes(result: Result) -> int:
    """The bytes of what can be large."""
    flock = result.last_flock
    last = (flock.bodies, flock.headings, flock.state) if flock else ()
    arrays = (result.heatmap, result.trajectory, result.states, *last)
    known = (array.nbytes for array in arrays if array is not None)
    return len(result.last_state) + int(sum(known))
