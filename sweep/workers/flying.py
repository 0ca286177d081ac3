"""Ways in which the workers of an engine run trials: on processors, or on a device.

An engine sends jobs to workers and has no knowledge of trials. This module decides
which trials run on processors, how many at once, and which trials are impossible;
`gpu.py` does so for a GPU.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, Protocol

from sweep.design import Job
from sweep.spec import Study
from sweep.trial import AT_ONCE, Result, Trials, run, warm, worth_flying_together
from sweep.workers.checkpoint import Checkpointed
from sweep.workers.chunks import Chunks, Dealing
from sweep.workers.watch import NO_LIMITS, Limits

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

GRACE_SECONDS = 10.0
"""Seconds beyond the time limit after which a trial is ended from outside.

A trial reads the clock between kernel calls, unless it hangs in a kernel call.
"""


class NewTrials(NamedTuple):
    """Trials of a study that run for the first time.

    Attributes
    ----------
    study : Study
    jobs : sequence of Job
    seconds : ndarray of float64, shape (number of jobs,)
        Estimated seconds of each job on a processor.
    workers : int
        Number of workers.
    folder : Path or None
        Folder for checkpoints; None if checkpoints are impossible.
    """

    study: Study
    jobs: Sequence[Job]
    seconds: "NDArray[np.float64]"
    workers: int
    folder: Path | None


class Sent(NamedTuple):
    """The function that is sent to workers with jobs, and the way of dealing jobs.

    Attributes
    ----------
    trial : callable
        Runs a trial, or many trials by the method `several`.
    deal : callable
        Makes a Dealing from the costs of jobs: longest first, or `in_order`.
    limits : Limits
        Limits of each job.
    """

    trial: Callable[[Job], Result]
    deal: Callable[..., Dealing] = Chunks
    limits: Limits = NO_LIMITS


class Flying(Protocol):
    """A way in which the workers of an engine run trials."""

    @property
    def device(self) -> dict[str, str] | None:
        """Description of the device for the origin of trials; None for a processor."""

    @property
    def called(self) -> str:
        """The device in a sentence."""

    def check(self, study: Study, jobs: Sequence[Job]) -> None:
        """Raise ChoiceError, with all reasons, if some jobs cannot run there.

        Parameters
        ----------
        study : Study
        jobs : sequence of Job
            Jobs of the study.
        """

    def refusal(self, job: Job, /) -> str:
        """Return why a job cannot run there; "" if it can."""

    def prepare(self, job: Job, /) -> None:
        """Do work once that each worker would repeat, for jobs such as this one."""

    def sent(self, new: NewTrials) -> Sent:
        """Return the function that is sent with new trials, and its options."""

    def sent_again(self, jobs: Sequence[Job], /) -> Sent:
        """Return the function that is sent with stored trials that run again."""


@dataclass(frozen=True)
class OnProcessors:
    """Trials on processors: one per worker, or several in the lanes of a processor.

    Long trials write checkpoints.
    """

    device: dict[str, str] | None = None
    called: str = "processors"

    def check(self, study: Study, jobs: Sequence[Job]) -> None:
        """Do nothing: every trial can run on a processor.

        Parameters
        ----------
        study : Study
        jobs : sequence of Job
            Jobs of the study.
        """

    def refusal(self, _job: Job) -> str:
        """Return "": every trial can run on a processor."""
        return ""

    def prepare(self, job: Job) -> None:
        """Compile the kernels once here, so that workers need not."""
        warm(job)

    def sent(self, new: NewTrials) -> Sent:
        """Return a function that runs new trials, in batches if batches are faster.

        Trials that are long, or record last states, resume from checkpoints and from
        earlier trials. Trials with limits, or with last states, run alone.
        """
        study = new.study
        limit = study.time_limit
        last_states = study.record.last_states
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
        """Return a function that runs trials alone, also trials of earlier batches."""
        return Sent(run)
