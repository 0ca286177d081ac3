"""How the workers of an engine fly trials: on processors, or on a device.

An engine hands jobs to workers and knows nothing of trials. What is to be flown, how
many trials at once, and which trials cannot fly there at all, is said here for
processors, and in `gpu.py` for a GPU.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, Protocol

from sweep.design.jobs import Job
from sweep.spec.study import Study
from sweep.trial.lanes import AT_ONCE, Trials, worth_flying_together
from sweep.trial.result import Result
from sweep.trial.simulation import run, warm
from sweep.workers.checkpoint import Checkpointed
from sweep.workers.chunks import Chunks, Dealing
from sweep.workers.watch import NO_LIMITS, Limits

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

GRACE_SECONDS = 10.0
"""How much longer than its time limit a trial may take before it is ended from outside.
A trial looks at the clock itself between kernel calls, unless it hangs in one.
"""


class NewTrials(NamedTuple):
    """Trials of a study that are to be flown for the first time: the estimated seconds
    of each on a processor, shape (number of jobs,), how many `workers` there are, and
    the folder for checkpoints, None where there can be none.
    """

    study: Study
    jobs: Sequence[Job]
    seconds: "NDArray[np.float64]"
    workers: int
    folder: Path | None


class Sent(NamedTuple):
    """What is sent to workers with jobs: `trial` flies one, or several by its method of
    that name; `deal` makes chunks of them, longest first or `in_order`. `limits` hold
    for each job.
    """

    trial: Callable[[Job], Result]
    deal: Callable[..., Dealing] = Chunks
    limits: Limits = NO_LIMITS


class Flying(Protocol):
    """How the workers of an engine fly trials.

    `check` raises ChoiceError where some of the jobs of a study cannot fly there, with
    all reasons; `refusal` is why one cannot, "" where it can. `prepare` does once what
    each worker would do otherwise. `sent` and `sent_again` say what is sent with new
    trials, and with stored ones. `device` is what the origin of trials says of where
    they fly, None where that is a processor.
    """

    @property
    def device(self) -> dict[str, str] | None: ...

    def check(self, study: Study, jobs: Sequence[Job]) -> None: ...

    def refusal(self, job: Job, /) -> str: ...

    def prepare(self, job: Job, /) -> None: ...

    def sent(self, new: NewTrials) -> Sent: ...

    def sent_again(self, jobs: Sequence[Job], /) -> Sent: ...


@dataclass(frozen=True)
class OnProcessors:
    """Each worker flies a trial on its processor, or some in the lanes of that; long
    ones write checkpoints.
    """

    device: dict[str, str] | None = None

    def check(self, study: Study, jobs: Sequence[Job]) -> None:
        """Every trial can fly on a processor."""

    def refusal(self, _job: Job) -> str:
        """Every trial can fly on a processor."""
        return ""

    def prepare(self, job: Job) -> None:
        """Compile here once. Otherwise each worker would compile the same."""
        warm(job)

    def sent(self, new: NewTrials) -> Sent:
        """New trials fly together where that is faster. Those that are long, or keep
        their last states, go on from what is there of them.
        """
        study = new.study
        limit, last_states = study.time_limit, study.record.last_states
        limits = Limits(
            None if limit is None else limit + GRACE_SECONDS, study.policy.memory
        )
        together = (
            limits == NO_LIMITS
            and not last_states
            and worth_flying_together(new.jobs, new.seconds.sum() / max(1, new.workers))
        )
        trial: Callable[[Job], Result] = Trials(together)
        folder = new.folder if study.checkpoint else None
        if folder or last_states:
            every = study.checkpoint or math.inf
            trial = Checkpointed(run, folder, every, together=together)
        deal = partial(Chunks, at_once=AT_ONCE) if together else Chunks
        return Sent(trial, deal, limits)

    def sent_again(self, _jobs: Sequence[Job]) -> Sent:
        """Stored trials fly alone, whether or not they flew together."""
        return Sent(run)
