"""The result of a trial, as plain values."""

from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sweep.design import Job, LastFlock

Floats = NDArray[np.float64]
FAILED = ("failed", "timeout")
"""Statuses of trials that raised an error or exceeded a limit.

A diverged trial is not included: divergence is a result of the model.
"""


ENDINGS = {
    "diverged": "{what} was not a finite number after step {step}",
    "timeout": "time limit of {limit} s reached after step {step}",
}
"""Reasons why a trial ended early, by status."""


class ProfileValues(NamedTuple):
    """Values of a profile.

    Attributes
    ----------
    at : array of float, shape (K,)
        Positions along the axis, in its unit: centres of bins, lags, sides of boxes, or
        numbers of individuals.
    value : array of float, shape (K,)
        NaN where nothing could be measured.
    """

    at: Floats
    value: Floats


@dataclass(frozen=True, slots=True)
class Result:
    """Result of a trial.

    Attributes
    ----------
    job : Job
    status : str
        "done", "failed", "diverged" or "timeout".
    seconds : float
    step : int
        Last step taken.
    error : str
    last : dict of float
        Each metric at the last frame; empty unless the trial is done.
    mean : dict of float
        Mean of each metric over the frames of the second half, or of an event over all
        frames; empty unless the trial is done.
    frames : array of int, shape (F,), optional
        Steps of the recorded frames.
    series : dict of arrays, shape (F,)
        Values of metrics in these frames.
    heatmap : array of int, shape (rows, columns), optional
        Visit counts, -1 in obstacles.
    profiles : dict of ProfileValues
        Profiles by name; empty unless the trial is done.
    trajectory : array of float, shape (F, 4, N), optional
        x, y, vx and vy of every boid.
    states : array of float, shape (F, S, N), optional
        The S state values per boid that the model has.
    last_state : bytes
        Sealed state from which a longer trial resumes; b"" if it is not recorded.
    last_flock : LastFlock, optional
        Final flock, if it is recorded and the trial is done.
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
    profiles: dict[str, ProfileValues] = field(default_factory=dict)
    trajectory: NDArray[np.float64] | None = None
    states: NDArray[np.float64] | None = None
    last_state: bytes = field(default=b"", repr=False)
    last_flock: LastFlock | None = field(default=None, repr=False)

    @property
    def has_failed(self) -> bool:
        """True if the status is in FAILED."""
        return self.status in FAILED


def failed(job: Job, error: str) -> Result:
    """Return the result of a job that never returned one."""
    return Result(job, "failed", 0.0, error=error)


def overdue(job: Job, error: str) -> Result:
    """Return the result of a job that was ended because it exceeded the time limit."""
    return Result(job, "timeout", 0.0, error=error)


def after(attempts: int, result: Result) -> Result:
    """Return the result of a trial after some attempts, which a last error reports."""
    if attempts == 1 or not result.has_failed:
        return result
    return replace(result, error=f"after {attempts} attempts: {result.error}")


def result_bytes(result: Result) -> int:
    """Return the number of bytes of the large fields of a result."""
    flock = result.last_flock
    last = (flock.bodies, flock.headings, flock.state) if flock else ()
    arrays = (result.heatmap, result.trajectory, result.states, *last)
    sizes = (array.nbytes for array in arrays if array is not None)
    return len(result.last_state) + int(sum(sizes))
