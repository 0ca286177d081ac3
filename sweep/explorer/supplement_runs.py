"""A stored trial again: it is run, compared bit by bit with what is stored, and flown
once more with its frames. A worker does it.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sweep.design.jobs import Job
from sweep.replays.bits import differences
from sweep.tables.stored_trials import StoredTrial
from sweep.trial.simulation import simulate
from sweep.web.encoding import frame
from sweep.web.flight import fly
from sweep.web.protocol import Reply
from sweep.web.senses import faced, senses_of


class RunOrder(NamedTuple):
    """A trial that is to be recorded: of which study, its job, what is stored of it,
    the metric whose values are kept, and the steps between two frames.
    """

    study: str
    job: Job
    stored: StoredTrial
    metric: str
    every: int


class RecordedRun(NamedTuple):
    """A trial that was run again.

    `differences` says where it differs from what is stored, and `error` why it failed.
    `steps` (F,) are those of its frames, `values` (F,) those of the metric, and
    `frames` their bytes one after the other. `senses` is what a page needs to tell whom
    a boid sees.
    """

    trial_id: str
    differences: tuple[str, ...]
    steps: NDArray[np.int64]
    values: NDArray[np.float64]
    frames: bytes
    senses: Reply
    error: str = ""


def record(order: RunOrder) -> RecordedRun:
    """Run a trial again, compare it and record it. An exception of it is raised."""
    job, name = order.job, order.metric
    found = differences(order.study, order.stored, simulate(job))
    flight = fly(order.study, job, (name,), every=order.every)
    size = float(job.settings["width"]), float(job.settings["height"])
    bodies = faced(job, flight.bodies)
    frames = [
        frame(int(step), one, size)
        for step, one in zip(flight.steps, bodies, strict=True)
    ]
    return RecordedRun(
        job.trial_id,
        tuple(map(str, found)),
        flight.steps,
        flight.values[name],
        b"".join(frames),
        senses_of(job, flight.bodies),
    )


def not_recorded(order: RunOrder, error: str) -> RecordedRun:
    """What is left of a trial that failed where it was run again."""
    nothing = np.empty(0)
    return RecordedRun(
        order.job.trial_id, (), nothing.astype(np.int64), nothing, b"", {}, error
    )
