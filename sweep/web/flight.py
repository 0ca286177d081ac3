"""Runs with all frames in memory.

A page can go to any of the frames, and a file can be written from the frames.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sweep.design import Job
from sweep.replays import Report, frames
from sweep.trial import joined, measured, with_last_positions
from sweep.web.running import recorded

MOST_BYTES = 256 * 2**20
"""Largest memory, in bytes, that the frames of a run take.

A larger run keeps every second frame, or every third, and so on.
"""


class KeptFlight(NamedTuple):
    """The frames 0, `every`, 2 `every`, ... and the last of a run.

    Attributes
    ----------
    study : str
        Name of the study.
    job : Job
        The trial.
    every : int
        Steps between two frames.
    steps : array (F,)
        Steps done at each frame.
    bodies : array (F, 4, N)
        x, y, vx and vy of each frame.
    values : dict of str to array (F,)
        Values of each metric.
    """

    study: str
    job: Job
    every: int
    steps: NDArray[np.int64]
    bodies: NDArray[np.float64]
    values: dict[str, NDArray[np.float64]]

    def place(self, step: int) -> int:
        """Return the index of the latest frame that is not after `step`."""
        return max(0, int(np.searchsorted(self.steps, step, side="right")) - 1)


def silent(_done: int, _total: int) -> None:
    """Report no progress."""


def fly(
    study: str,
    job: Job,
    metrics: tuple[str, ...] = (),
    *,
    every: int = 0,
    until: int | None = None,
    report: Report = silent,
) -> KeptFlight:
    """Run a trial and keep the frames.

    A run that diverges ends with the last finite frame. An exception of the trial is
    raised unchanged.

    Parameters
    ----------
    study : str
        Name of the study, which files of the run mention.
    job : Job
        The trial.
    metrics : tuple of str, optional
        Metrics that are measured at each frame.
    every : int, default 0
        Steps between two frames; 0 keeps as many frames as MOST_BYTES hold.
    until : int, optional
        Step at which the run is cut off; by default the run is complete.
    report : callable, optional
        Called with the number of steps done and the number of all steps.
    """
    every = every or _every(job, len(metrics))
    pieces = []
    record = recorded(job, metrics)
    for taken in frames(job, every, report, record):
        pieces.append(taken)
        if until is not None and len(taken.steps) and taken.steps[-1] >= until:
            break
    run = joined(pieces)
    count = (
        len(run.steps)
        if until is None
        else int(np.searchsorted(run.steps, until, side="right"))
    )
    values = measured(record, run, job.settings)
    return KeptFlight(
        study,
        job,
        every,
        steps=run.steps[:count],
        bodies=with_last_positions(run.bodies[:count]),
        values={name: values[name][:count] for name in metrics},
    )


def _every(job: Job, metrics: int) -> int:
    frame = 8 * (4 * int(job.settings["n"]) + metrics + 1)
    return max(1, -(-int(job.settings["steps"]) * frame // MOST_BYTES))
