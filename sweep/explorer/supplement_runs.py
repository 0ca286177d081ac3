"""The second run of a stored trial.

A worker runs the trial, and compares the results bit by bit with the stored results.
Then the worker runs the trial once more to record the frames. A page that computes
trials gets the start of the trial instead of frames.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sweep.design import Job
from sweep.explorer.supplement_starts import (
    NO_RANGES,
    ComputedStart,
    Ranges,
    computed_start,
)
from sweep.replays import differences
from sweep.tables import StoredTrial
from sweep.trial import simulate
from sweep.web import Reply, faced, fly, frame, packed, packed_frames, senses_of


class RunOrder(NamedTuple):
    """A trial that is to be recorded.

    `stored` has the stored results. `metric` is the metric whose values are recorded,
    and `every` is the number of steps between two frames. `compute` means that the page
    computes the trial, and `ranges` are the ranges of the parameters that vary.
    """

    study: str
    job: Job
    stored: StoredTrial
    metric: str
    every: int
    compute: bool = False
    ranges: Ranges = NO_RANGES


class RecordedRun(NamedTuple):
    """A trial that was run again.

    `differences` are the differences from the stored results, and `error` is the reason
    for a failure, or "". `steps` (F,) are the steps of the frames, and `values` (F,)
    the values of the metric. `frames` has all frames in sequence, packed. `senses` has
    the facts from which a page computes perceived neighbours. `start` is the start of a
    trial that the page computes; such a run has no frames.
    """

    trial_id: str
    differences: tuple[str, ...]
    steps: NDArray[np.int64]
    values: NDArray[np.float64]
    frames: str
    senses: Reply
    start: ComputedStart | None = None
    error: str = ""


def record(order: RunOrder) -> RecordedRun:
    """Run a trial again, compare the results and record the frames.

    An exception of the trial is raised.
    """
    job = order.job
    name = order.metric
    different = differences(order.study, order.stored, simulate(job))
    if order.compute:
        return RecordedRun(
            trial_id=job.trial_id,
            differences=tuple(map(str, different)),
            steps=np.empty(0, np.int64),
            values=np.empty(0),
            frames=packed(b""),
            senses=senses_of(job, np.empty((0, 4, 0))),
            start=computed_start(job, order.ranges),
        )
    flight = fly(order.study, job, (name,), every=order.every)
    size = float(job.settings["width"]), float(job.settings["height"])
    bodies = faced(job, flight.bodies)
    frames = [
        frame(int(step), boids, size)
        for step, boids in zip(flight.steps, bodies, strict=True)
    ]
    return RecordedRun(
        trial_id=job.trial_id,
        differences=tuple(map(str, different)),
        steps=flight.steps,
        values=flight.values[name],
        frames=packed_frames(frames),
        senses=senses_of(job, flight.bodies),
    )


def not_recorded(order: RunOrder, error: str) -> RecordedRun:
    """Return the record of a trial that failed in the second run."""
    return RecordedRun(
        trial_id=order.job.trial_id,
        differences=(),
        steps=np.empty(0, np.int64),
        values=np.empty(0),
        frames=packed(b""),
        senses={},
        error=error,
    )
