"""A run with all its frames in memory, so that a page can go to any of them and a file
can be written from them.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sweep.design.jobs import Job
from sweep.replays.flight import Report, frames
from sweep.trial.derived import measured
from sweep.trial.state import joined
from sweep.web.running import recorded

MOST_BYTES = 256 * 2**20
"""The most memory that the frames of a run may take. Of a larger run only every second
frame is kept, or every third, and so on.
"""


class KeptFlight(NamedTuple):
    """The frames 0, `every`, 2 `every`, ... and the last of a run of `job`, a trial of
    `study`.

    `steps` (F,) are the steps done, `bodies` (F, 4, N) x, y, vx and vy, and `values`
    has (F,) of each metric.
    """

    study: str
    job: Job
    every: int
    steps: NDArray[np.int64]
    bodies: NDArray[np.float64]
    values: dict[str, NDArray[np.float64]]

    def place(self, step: int) -> int:
        """The index of the latest frame that is not after `step`."""
        return max(0, int(np.searchsorted(self.steps, step, side="right")) - 1)


def silent(_done: int, _whole: int) -> None:
    """Reports no progress."""


def fly(
    study: str,
    job: Job,
    metrics: tuple[str, ...] = (),
    *,
    every: int = 0,
    until: int | None = None,
    report: Report = silent,
) -> KeptFlight:
    """Run a trial and keep its frames.

        study    the name of the study, which files of the run mention
        job      the trial
        metrics  the metrics that are measured at each frame
        every    steps between two frames; 0 keeps as many frames as MOST_BYTES hold
        until    the step at which the run is cut off; None runs to the end
        report   is told how many of how many steps are done

    An exception of the trial is raised as it is. A run that diverges ends with its last
    finite frame.
    """
    every = every or _every(job, len(metrics))
    pieces = []
    record = recorded(job, metrics)
    for taken in frames(job, every, report, record):
        pieces.append(taken)
        if until is not None and len(taken.steps) and taken.steps[-1] >= until:
            break
    whole = joined(pieces)
    count = (
        len(whole.steps)
        if until is None
        else int(np.searchsorted(whole.steps, until, side="right"))
    )
    values = measured(record, whole, job.settings)
    series = {name: values[name][:count] for name in metrics}
    return KeptFlight(
        study, job, every, whole.steps[:count], whole.bodies[:count], series
    )


def _every(job: Job, metrics: int) -> int:
    frame = 8 * (4 * int(job.settings["n"]) + metrics + 1)
    return max(1, -(-int(job.settings["steps"]) * frame // MOST_BYTES))
