"""The engine of a GPU: worker processes on this machine that share it.

A worker prepares a batch of trials, has the GPU fly it, and makes results of what comes
back. The first and the last are Python on a processor, and the GPU takes the batches of
several processes in turn: so while it flies one batch, other workers prepare the next
ones. A process whose use of the GPU has failed cannot use it any more. Then the workers
are replaced, and the trials of its batch are tried again in two halves. The coordinator
asks which GPU there is, and flies nothing on it.

A new pool flies one step of a trial before any batch is sent. So a GPU that does not
answer, or a model that it cannot fly, ends the launch with the reason; what is done is
stored.
"""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cache, partial
from typing import Protocol

from sweep.design.cost import trial_bytes
from sweep.design.design import evenly
from sweep.design.jobs import Job
from sweep.errors import ChoiceError
from sweep.spec.study import Study
from sweep.text import so_many
from sweep.trial.result import Result
from sweep.trial.simulation import one_step
from sweep.workers.chunks import Batches
from sweep.workers.executors import Loky, SpoiltWorkerError, core_count
from sweep.workers.flying import NewTrials, Sent

LEAST_WORKERS, MOST_WORKERS = 2, 16
"""Workers if their number is not given: one for each core, as to prepare trials takes
processors. With fewer than two the GPU waits for them; and each holds memory of the
GPU, some hundred megabytes before its first trial.
"""
MOST_BYTES = 2**28
"""Of the results of a batch, which are sent from process to process as one."""
MOST_LOOKED = 200
"""Of so many trials of a study it is asked whether a GPU can fly them. Each is prepared
for that, which takes some milliseconds.
"""

MEMORY = "memory_limit: the memory of one trial of a batch is not known"


class FliesSeveral(Protocol):
    """Flies trials, and gives their results in their order. It raises what concerns the
    device; what concerns one trial is in its result.
    """

    def several(self, jobs: Sequence[Job]) -> list[Result]: ...


@dataclass(frozen=True)
class InBatches:
    """What is sent to a worker: `trials` fly there. `first` is flown where none is
    sent, which is how a new pool is asked whether it answers.
    """

    trials: FliesSeveral
    first: Job = field(repr=False)

    def __call__(self, job: Job) -> Result:
        return self.several([job])[0]

    def several(self, jobs: Sequence[Job]) -> list[Result]:
        """The results of `jobs`, in their order. Raises SpoiltWorkerError."""
        try:
            return self.trials.several(jobs or [self.first])[: len(jobs)]
        except Exception as error:
            said = f"the GPU gave no results: {type(error).__name__}: {error}"
            raise SpoiltWorkerError(said) from error


@dataclass(frozen=True)
class OnDevice:
    """Workers send whole batches of at most `at_once` trials to a device. `trials` is
    pickled; `refusal` says why a trial cannot fly there, "" where it can.
    """

    trials: FliesSeveral
    refusal: Callable[[Job], str]
    at_once: int
    device: dict[str, str] | None

    def check(self, study: Study, jobs: Sequence[Job]) -> None:
        """Raise ChoiceError with every reason why trials of a study cannot fly there.
        Of more than MOST_LOOKED jobs, so many are looked at.
        """
        looked = [jobs[place] for place in evenly(len(jobs), MOST_LOOKED)]
        found, first = Counter[str](), dict[str, Job]()
        if study.policy.memory is not None:
            found[MEMORY] = len(looked)
        for job in looked:
            if why := self.refusal(job):
                found[why] += 1
                first.setdefault(why, job)
        if found:
            reasons = [
                why
                if count == len(looked)
                else f"{why} ({count:,} of {so_many(len(looked), 'trial')}, as those"
                f" of point {first[why].point})"
                for why, count in found.items()
            ]
            raise ChoiceError(
                "\n  ".join(["trials cannot fly on a GPU:", *reasons]), study.name
            )

    def prepare(self, job: Job) -> None:
        """Nothing is compiled for processors."""

    def sent(self, new: NewTrials) -> Sent:
        """New trials fly in batches, from step 0 on and without checkpoints."""
        return self._sent(new.jobs, new.jobs[int(new.seconds.argmax())])

    def sent_again(self, jobs: Sequence[Job]) -> Sent:
        """Stored trials fly as new ones."""
        return self._sent(jobs, jobs[0])

    def _sent(self, jobs: Sequence[Job], longest: Job) -> Sent:
        states = len(longest.known.models[longest.model].state)
        room = MOST_BYTES / trial_bytes(longest.settings, longest.record, states)
        at_once = max(1, min(self.at_once, int(room)))
        return Sent(
            InBatches(self.trials, one_step(jobs[0])),
            partial(Batches, at_once=at_once),
        )


@dataclass
class Cuda(Loky):
    """Runs trials on a GPU that CUDA knows, the first that this process sees, by
    `workers` processes.
    """

    @property
    def flying(self) -> OnDevice:
        """How they fly."""
        from sweep.trial.on_device import AT_ONCE, DeviceTrials, refusal_of

        return OnDevice(DeviceTrials(), refusal_of, AT_ONCE, this_gpu())


def gpu_problem() -> str:
    """Why this machine has no GPU that flies trials; "" where it has one."""
    from sweep.trial.on_device import problem

    return problem()


def gpu_workers(asked: int) -> int:
    """How many workers share the GPU: as many as are asked for; for 0 one for each
    core, within bounds.
    """
    return asked or min(max(LEAST_WORKERS, core_count()), MOST_WORKERS)


@cache
def this_gpu() -> dict[str, str]:
    """The name of the GPU, the CUDA version of its driver, and the versions of what
    compiles for it: what the bits of a trial that it flew may depend on.
    """
    from sweep.trial.on_device import gpu

    found = gpu()
    major, minor = divmod(found.driver, 1000)
    return {
        "name": found.name,
        "driver": f"{major}.{minor // 10}",
        **found.versions,
    }
