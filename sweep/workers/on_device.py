"""Trials on a device: workers that send batches of trials there.

A worker prepares a batch of trials, sends the batch to the device, and makes results of
the returned values. Preparation and results take Python on a processor, and a GPU runs
the batches of several processes in turn. So while the GPU runs one batch, further
workers prepare the next batches.

After a failure of the device, a process cannot use the device any more. Then the
workers are replaced, and the trials of the batch run again in two halves. The
coordinator runs no trial there.

A new pool runs one step of a trial before any batch is sent. So a device that does not
answer, or a model that the device cannot run, ends the launch with the reason. Finished
trials are stored.
"""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Protocol

from sweep.design import Job, evenly, trial_bytes
from sweep.errors import ChoiceError
from sweep.spec import Study
from sweep.text import so_many
from sweep.trial import Result, one_step
from sweep.workers.chunks import Batches
from sweep.workers.executors import SpoiltWorkerError
from sweep.workers.flying import NewTrials, Sent

MOST_BYTES = 2**28
"""Maximum size of the results of a batch, which are sent as one object."""
MOST_LOOKED = 200
"""Maximum number of trials of a study that are checked for a GPU.

A check prepares the trial, which takes some milliseconds.
"""

MEMORY = "memory_limit: the memory of one trial of a batch is not known"


class FliesSeveral(Protocol):
    """A function that runs trials on a device."""

    def several(self, jobs: Sequence[Job]) -> list[Result]:
        """Return the results of jobs, in their order.

        An error of the device is raised. An error of one trial is in the result of that
        trial.
        """


@dataclass(frozen=True)
class InBatches:
    """The function that is sent to a worker.

    Attributes
    ----------
    trials : FliesSeveral
        Runs trials on the device.
    first : Job
        Job that runs if no job is sent, as a test of a new pool.
    called : str
        The device in a sentence.
    """

    trials: FliesSeveral
    first: Job = field(repr=False)
    called: str

    def __call__(self, job: Job) -> Result:
        """Return the result of a job."""
        return self.several([job])[0]

    def several(self, jobs: Sequence[Job]) -> list[Result]:
        """Return the results of jobs, in their order.

        Raises SpoiltWorkerError for any error of the device.
        """
        try:
            return self.trials.several(jobs or [self.first])[: len(jobs)]
        except Exception as error:
            message = f"{self.called} gave no results: {type(error).__name__}: {error}"
            raise SpoiltWorkerError(message) from error


@dataclass(frozen=True)
class OnDevice:
    """Trials on a device, to which workers send whole batches.

    Attributes
    ----------
    trials : FliesSeveral
        Runs trials on the device; must allow pickling.
    refusal : callable
        Returns why a trial cannot run there; "" if it can.
    at_once : int
        Largest number of trials of a batch.
    device : dict of str or None
        Description of the device for the origin of trials.
    called : str, default "a GPU"
        The device in a sentence.
    """

    trials: FliesSeveral
    refusal: Callable[[Job], str]
    at_once: int
    device: dict[str, str] | None
    called: str = "a GPU"

    def check(self, study: Study, jobs: Sequence[Job]) -> None:
        """Raise ChoiceError with every reason why trials of a study cannot run there.

        Parameters
        ----------
        study : Study
        jobs : sequence of Job
            Jobs of the study. At most MOST_LOOKED jobs are checked.
        """
        looked = [jobs[index] for index in evenly(len(jobs), MOST_LOOKED)]
        counts = Counter[str]()
        first = dict[str, Job]()
        if study.policy.memory is not None:
            counts[MEMORY] = len(looked)
        for job in looked:
            if why := self.refusal(job):
                counts[why] += 1
                first.setdefault(why, job)
        if counts:
            reasons = [
                why
                if count == len(looked)
                else f"{why} ({count:,} of {so_many(len(looked), 'trial')}, for example"
                f" at point {first[why].point})"
                for why, count in counts.items()
            ]
            raise ChoiceError(
                "\n  ".join([f"trials cannot run on {self.called}:", *reasons]),
                study.name,
            )

    def prepare(self, job: Job) -> None:
        """Do nothing: nothing is compiled for processors."""

    def sent(self, new: NewTrials) -> Sent:
        """Return a function for batches, from step 0 and without checkpoints."""
        return self._sent(new.jobs, new.jobs[int(new.seconds.argmax())])

    def sent_again(self, jobs: Sequence[Job]) -> Sent:
        """Return a function for batches: stored trials run as new ones."""
        return self._sent(jobs, jobs[0])

    def _sent(self, jobs: Sequence[Job], longest: Job) -> Sent:
        states = len(longest.catalogue.models[longest.model].state)
        room = MOST_BYTES / trial_bytes(longest.settings, longest.record, states)
        at_once = max(1, min(self.at_once, int(room)))
        return Sent(
            InBatches(self.trials, one_step(jobs[0]), self.called),
            partial(Batches, at_once=at_once),
        )
