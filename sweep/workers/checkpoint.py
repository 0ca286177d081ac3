"""Long trials write checkpoints. Whatever ends a trial, it goes on from its checkpoint
and gives the same bits.

    checkpoints/<trial_id>.state   the state as it was last written; named .tried-1 or
                                   .tried-2 while it is on trial
    checkpoints/<trial_id>.frames  the frames so far, each written once

A trial of one kernel call has no checkpoint. Any other looks for its checkpoint when it
begins. It writes one when it has run for a while since the last, and so seldom that
writing takes about a hundredth of its time. Frames of many boids at every step may take
more time, but each is written only once, and all of them are in memory too.

A trial that dies when it goes on from its checkpoint must not do so for ever. So the
file is renamed before it is read, and renamed back when the first kernel call is over.
A file that still has the name of a try is tried once more; then the trial begins anew.
The workers write checkpoints, and whoever stores the results deletes them
(`checkpoint_folder.py`). A worker that cannot write, or does not see the study's
folder, says so once and runs the trial without checkpoints.
"""

import logging
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cache
from itertools import pairwise
from pathlib import Path

from sweep.design.jobs import Job
from sweep.store.durable import make_folder
from sweep.store.user_key import own_key
from sweep.trial.lanes import fly, in_groups
from sweep.trial.result import Result
from sweep.trial.simulation import Simulation, attempt, is_brief
from sweep.workers.checkpoint_file import (
    Saved,
    add_frames,
    drop_frames,
    read_frames,
    read_state,
    write_state,
)
from sweep.workers.checkpoint_folder import delete_files, frames_file, state_files
from sweep.workers.last_state import Lasting, frame_type_of

LOG = logging.getLogger("sweep")

TIMES_LONGER = 100.0
"""Between two checkpoints a trial runs at least so many times longer than it took to
write the last one.
"""


@dataclass(frozen=True)
class Checkpointed:
    """`run`, that of `sweep.trial.simulation`, with checkpoints in `folder` every so
    many seconds, without a folder with none; its results are the same, but for the last
    state where a job records that.

    Both are sealed with `key`, which the coordinator hands to its workers. `together`
    says that trials may fly together.
    """

    run: Callable[[Job], Result]
    folder: Path | None
    every: float
    key: bytes = field(default_factory=own_key, repr=False)
    together: bool = False

    def __call__(self, job: Job) -> Result:
        """The result of `job`. Its `seconds`, and its time limit, include those of all
        attempts that it goes on from, and of the earlier trial.

        A trial that raises begins anew, at step 0, the next time.
        """
        if job.record.last_states:
            result = attempt(self._simulate, job)
            return replace(result, job=replace(job, earlier=None))
        if self.folder is None or is_brief(job):
            return self.run(job)
        return attempt(self._simulate, job)

    def several(self, jobs: Sequence[Job]) -> list[Result]:
        """The results of `jobs`, in their order; those that have no checkpoint fly
        together where that is faster.
        """
        return in_groups(jobs, self, self._together if self.together else None)

    def _together(self, jobs: Sequence[Job]) -> list[Result]:
        began, folder = time.perf_counter(), self.folder
        if folder is None or is_brief(jobs[0]):
            return fly([Simulation(job, together=True) for job in jobs], began)
        if any(_is_begun(folder, job) for job in jobs):
            return [self(job) for job in jobs]
        simulations = [Simulation(job, together=True) for job in jobs]
        checkpoints = [
            _Checkpoint(folder, one, self.every, self.key) for one in simulations
        ]

        def between(seconds: float, settle: Callable[[], None]) -> None:
            if any(one.is_due(seconds) for one in checkpoints):
                settle()
                for one in checkpoints:
                    one.after_call(seconds)

        try:
            return fly(simulations, began, between)
        except Exception:
            for one in checkpoints:
                one.discard()
            raise

    def _simulate(self, job: Job) -> Result:
        began = time.perf_counter()
        if not job.record.last_states:
            return self._from(Simulation(job), began, 0.0)[0]
        lasting = Lasting(job, self.key)
        result, simulation = self._from(lasting.simulation, began, lasting.seconds)
        return replace(result, last_state=lasting.last_state(result, simulation))

    def _from(
        self, simulation: Simulation, began: float, spent: float
    ) -> tuple[Result, Simulation]:
        """The result of a simulation that has taken `spent` seconds before, and the
        simulation at its end, which is another one where there is a checkpoint.
        """
        if self.folder is None or is_brief(simulation.job):
            return simulation.result(began - spent), simulation
        checkpoint = _Checkpoint(self.folder, simulation, self.every, self.key)
        try:
            resumed = checkpoint.resume()
            spent = spent if resumed is None else resumed
            simulation = checkpoint.simulation
            result = simulation.result(began - spent, checkpoint.after_call)
        except Exception:
            checkpoint.discard()
            raise
        return result, simulation


def _is_begun(folder: Path, job: Job) -> bool:
    return any(place.exists() for place in state_files(folder, job.trial_id))


class _Checkpoint:
    """The checkpoint of one trial, used by the worker that runs it as `simulation`."""

    def __init__(
        self, folder: Path, simulation: Simulation, every: float, key: bytes
    ) -> None:
        job = simulation.job
        self.simulation, self._key = simulation, key
        self._folder, self._trial, self._every = folder, job.trial_id, every
        self._places = state_files(folder, job.trial_id)
        self._frames = frames_file(folder, job.trial_id)
        self._kind = frame_type_of(simulation)
        # The first, the last, and those between.
        self._most_frames = simulation.schedule.steps // job.record.every + 2
        self._written, self._count, self._crc = 0, 0, 0
        self._aside: Path | None = None
        self._due = every

    def resume(self) -> float | None:
        """Go on from the checkpoint, if there is a good one. Returns the seconds that
        the trial had taken until then; None where there is no checkpoint.
        """
        found = self._set_aside()
        if found is None:
            return None
        try:
            saved = read_state(found, self._trial, self.simulation.state(), self._key)
            taken = read_frames(self._frames, self._kind, saved, self._most_frames)
            self.simulation.restore(saved.state)
        except Exception as error:  # whatever is wrong with the file, the trial is not
            LOG.warning("%s: %s; the trial begins anew", found, error)
            self.discard()
            self.simulation = Simulation(self.simulation.job)
            return 0.0
        self.simulation.taken = [taken]  # an earlier trial may have left others
        self._aside, self._written, self._count, self._crc = (
            found,
            1,
            saved.frames,
            saved.crc,
        )
        self._due = saved.seconds + self._every
        step, steps = self.simulation.step, self.simulation.schedule.steps
        LOG.warning(
            "trial %s: goes on from step %s of %s",
            self._trial,
            f"{step:,}",
            f"{steps:,}",
        )
        return saved.seconds

    def is_due(self, seconds: float) -> bool:
        """Whether it is time for a checkpoint, `seconds` after the trial began."""
        return seconds >= self._due

    def after_call(self, seconds: float) -> None:
        """Between two kernel calls, `seconds` since the trial began: write a checkpoint
        if it is time.
        """
        if self._aside is not None:
            self._put_back(self._aside)
            self._aside = None
        if not self.is_due(seconds):
            return
        began = time.perf_counter()
        try:
            self._write(seconds)
        except (OSError, MemoryError) as error:
            said = getattr(error, "strerror", None) or str(error)
            _say_once(self._folder, said or type(error).__name__)
        took = time.perf_counter() - began
        self._due = seconds + took + max(self._every, TIMES_LONGER * took)

    def discard(self) -> None:
        """Delete the checkpoint, if there is one."""
        delete_files(self._folder, self._trial)

    def _set_aside(self) -> Path | None:
        """The checkpoint, renamed for the next try; None if there is none, or no try is
        left.
        """
        for place, aside in pairwise(self._places):
            with suppress(OSError):
                return place.replace(aside)
        if self._places[-1].exists():
            LOG.warning(
                "trial %s: its worker died twice when it went on from its checkpoint;"
                " the trial begins anew",
                self._trial,
            )
            self.discard()
        return None

    def _put_back(self, aside: Path) -> None:
        with suppress(OSError):
            aside.replace(self._places[0])

    def _write(self, seconds: float) -> None:
        if self._folder.is_symlink():
            raise OSError(0, "it is a symbolic link")
        try:
            count, crc = self._add_frames()
            saved = Saved(self.simulation.state(), seconds, count, crc)
            write_state(self._places[0], self._trial, saved, self._key)
        except OSError:
            with suppress(OSError):  # the disk may be full
                drop_frames(self._frames, self._kind, self._count)
            raise
        self._written, self._count, self._crc = len(self.simulation.taken), count, crc

    def _add_frames(self) -> tuple[int, int]:
        new = self.simulation.taken[self._written :]
        while True:
            try:
                return add_frames(self._frames, self._kind, new, self._count, self._crc)
            except FileNotFoundError:
                # It is the first checkpoint, or the folder has gone with the last of
                # others. Not its parents: a machine without the study's folder must not
                # get one.
                make_folder(self._folder)


@cache
def _say_once(folder: Path, error: str) -> None:
    LOG.warning(
        "%s: no checkpoint can be written (%s); trials run without", folder, error
    )
