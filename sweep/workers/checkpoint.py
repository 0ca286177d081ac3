"""Checkpoints of long trials.

After any interruption a trial resumes from its checkpoint, and the results are bitwise
identical.

    checkpoints/<trial_id>.state   the last written state; named .tried-1 or .tried-2
                                   during a try to resume
    checkpoints/<trial_id>.frames  the frames so far, each written once

A trial of one kernel call has no checkpoint. Any other trial looks for its checkpoint
at the beginning. The trial writes checkpoints at intervals so long that writing takes
about 1 % of its time. Frames of many boids at every step may take more time, but each
frame is written only once, and all frames are in memory too.

A trial that dies whenever it resumes from its checkpoint must not retry forever. So the
file is renamed before it is read, and renamed back after the first kernel call. A file
that still has the name of a try is tried once more; then the trial begins again at step
0. The workers write checkpoints, and the process that stores the results deletes the
checkpoints (`checkpoint_folder.py`). A worker that cannot write, or does not see the
study's folder, warns once and runs the trial without checkpoints.
"""

import logging
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cache
from itertools import pairwise
from pathlib import Path

from sweep.design import Job
from sweep.store import make_folder, own_key
from sweep.trial import Result, Simulation, attempt, fly, in_groups, is_brief
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
"""Least time between two checkpoints, as a multiple of the time of the last writing."""


@dataclass(frozen=True)
class Checkpointed:
    """Function that runs trials, with checkpoints.

    Results equal the results of `run`, except for the last state where a job records
    one.

    Attributes
    ----------
    run : callable
        ``sweep.trial.simulation.run``.
    folder : Path or None
        Folder of checkpoints; None for no checkpoints.
    every : float
        Least wall seconds between two checkpoints.
    key : bytes
        Key that seals checkpoints and last states. The coordinator passes the key to
        its workers.
    together : bool
        Whether trials may run in vectorised batches.
    """

    run: Callable[[Job], Result]
    folder: Path | None
    every: float
    key: bytes = field(default_factory=own_key, repr=False)
    together: bool = False

    def __call__(self, job: Job) -> Result:
        """Return the result of a job.

        The `seconds` of the result, and the time limit, include all attempts from which
        the trial resumes, and the earlier trial. A trial that raises an error begins at
        step 0 the next time.
        """
        if job.record.last_states:
            result = attempt(self._simulate, job)
            return replace(result, job=replace(job, earlier=None))
        if self.folder is None or is_brief(job):
            return self.run(job)
        return attempt(self._simulate, job)

    def several(self, jobs: Sequence[Job]) -> list[Result]:
        """Return the results of jobs, in their order.

        Jobs without a checkpoint run in batches where a batch is faster.
        """
        return in_groups(jobs, self, self._together if self.together else None)

    def _together(self, jobs: Sequence[Job]) -> list[Result]:
        began = time.perf_counter()
        folder = self.folder
        if folder is None or is_brief(jobs[0]):
            return fly([Simulation(job, together=True) for job in jobs], began)
        if any(_is_begun(folder, job) for job in jobs):
            return [self(job) for job in jobs]
        simulations = [Simulation(job, together=True) for job in jobs]
        checkpoints = [
            _Checkpoint(folder, simulation, self.every, self.key)
            for simulation in simulations
        ]

        def between(seconds: float, settle: Callable[[], None]) -> None:
            if any(checkpoint.is_due(seconds) for checkpoint in checkpoints):
                settle()
                for checkpoint in checkpoints:
                    checkpoint.after_call(seconds)

        try:
            return fly(simulations, began, between)
        except Exception:
            for checkpoint in checkpoints:
                checkpoint.discard()
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
        """Return the result of a simulation, and the simulation at its end.

        Before, the simulation has taken `spent` seconds. If there is a checkpoint, the
        returned simulation may be a new object.
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
    return any(path.exists() for path in state_files(folder, job.trial_id))


class _Checkpoint:
    """The checkpoint of one trial, for the worker that runs it as `simulation`."""

    def __init__(
        self, folder: Path, simulation: Simulation, every: float, key: bytes
    ) -> None:
        job = simulation.job
        self.simulation = simulation
        self._key = key
        self._folder = folder
        self._trial = job.trial_id
        self._every = every
        self._paths = state_files(folder, job.trial_id)
        self._frames = frames_file(folder, job.trial_id)
        self._kind = frame_type_of(simulation)
        # The first frame, the last frame, and the frames between.
        self._most_frames = simulation.schedule.steps // job.record.every + 2
        self._written = 0  # elements of `simulation.taken` that are in the file
        self._count = 0  # frames in the file
        self._crc = 0
        self._aside: Path | None = None
        self._due = every

    def resume(self) -> float | None:
        """Resume from the checkpoint, if there is one.

        Returns
        -------
        float or None
            Seconds that the trial had taken before, 0 if the checkpoint is unusable.
            None if there is no checkpoint.
        """
        aside = self._set_aside()
        if aside is None:
            return None
        try:
            saved = read_state(aside, self._trial, self.simulation.state(), self._key)
            taken = read_frames(self._frames, self._kind, saved, self._most_frames)
            self.simulation.restore(saved.state)
        except Exception as error:  # a damaged file must not fail the trial
            LOG.warning("%s: %s; the trial restarts at step 0", aside, error)
            self.discard()
            self.simulation = Simulation(self.simulation.job)
            return 0.0
        self.simulation.taken = [taken]  # replaces frames of an earlier trial
        self._aside = aside
        self._written = 1
        self._count = saved.frames
        self._crc = saved.crc
        self._due = saved.seconds + self._every
        LOG.warning(
            "trial %s: resumes at step %s of %s",
            self._trial,
            f"{self.simulation.step:,}",
            f"{self.simulation.schedule.steps:,}",
        )
        return saved.seconds

    def is_due(self, seconds: float) -> bool:
        """Return whether a checkpoint is due, `seconds` after the trial began."""
        return seconds >= self._due

    def after_call(self, seconds: float) -> None:
        """Write a checkpoint between two kernel calls, if it is due.

        The trial began `seconds` ago. The first call also proves that the trial
        survives its checkpoint, and gives the file its usual name again.
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
            reason = getattr(error, "strerror", None) or str(error)
            _say_once(self._folder, reason or type(error).__name__)
        took = time.perf_counter() - began
        self._due = seconds + took + max(self._every, TIMES_LONGER * took)

    def discard(self) -> None:
        """Delete the checkpoint, if there is one."""
        delete_files(self._folder, self._trial)

    def _set_aside(self) -> Path | None:
        """Return the checkpoint, renamed for the next try.

        Returns None if there is no checkpoint, or no try is left.
        """
        for path, aside in pairwise(self._paths):
            with suppress(OSError):
                return path.replace(aside)
        if self._paths[-1].exists():
            LOG.warning(
                "trial %s: its worker died twice when it resumed from its checkpoint;"
                " the trial restarts at step 0",
                self._trial,
            )
            self.discard()
        return None

    def _put_back(self, aside: Path) -> None:
        with suppress(OSError):
            aside.replace(self._paths[0])

    def _write(self, seconds: float) -> None:
        if self._folder.is_symlink():
            raise OSError(0, "it is a symbolic link")
        try:
            count, crc = self._add_frames()
            saved = Saved(self.simulation.state(), seconds, count, crc)
            write_state(self._paths[0], self._trial, saved, self._key)
        except OSError:
            with suppress(OSError):  # the disk may be full
                drop_frames(self._frames, self._kind, self._count)
            raise
        self._written = len(self.simulation.taken)
        self._count = count
        self._crc = crc

    def _add_frames(self) -> tuple[int, int]:
        new = self.simulation.taken[self._written :]
        while True:
            try:
                return add_frames(
                    self._frames, self._kind, new, self._count, crc=self._crc
                )
            except FileNotFoundError:
                # This is the first checkpoint, or the folder was deleted with the last
                # one of other trials. Its parents are not created: a machine without
                # the study's folder must not get one.
                make_folder(self._folder)


@cache
def _say_once(folder: Path, error: str) -> None:
    LOG.warning(
        "%s: cannot write checkpoints (%s); trials run without checkpoints",
        folder,
        error,
    )
