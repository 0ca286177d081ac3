"""The last state of a trial, from which a trial goes on that has more steps and is the
same in all else. Both have the same bits up to there.

    boidsweep checkpoint 2 8f3a02c1...   the format, and the seal of all that follows
    {"beginning": ..., "state_bytes": ...}   a header in JSON
    ...                                  the two files of a checkpoint: see
                                         `sweep.workers.checkpoint_file`

The coordinator finds the trial to go on from by its id, which covers the code and all
settings but the steps (`sweep.store.last_states`). The worker then compares the
libraries and the machine, as for a checkpoint, and how both trials begin: flock,
scenery and random numbers, to the bit. Where something differs the trial begins at
step 0.
"""

import json
import logging
import zlib
from functools import cache

from sweep.design.jobs import Job, LastState
from sweep.trial.result import Result
from sweep.trial.simulation import Simulation
from sweep.trial.state import every_so_many, joined
from sweep.workers.checkpoint_file import (
    FrameType,
    Saved,
    frame_bytes,
    frame_type,
    frames_of,
    sealed,
    state_bytes,
    state_of,
    unsealed,
)
from sweep.workers.fingerprint import differences, libraries

LOG = logging.getLogger("sweep")

MOST_BYTES = 2**30
"""Of a last state. A cell of parquet can hold twice as many."""


class Lasting:
    """The simulation of a job that keeps its last state, either at step 0, or where the
    earlier trial of the job has ended; `seconds` are those that it took.

    `key` is the one with which last states are sealed.
    """

    def __init__(self, job: Job, key: bytes) -> None:
        self.simulation, self.seconds, self._key = Simulation(job), 0.0, key
        self._beginning = self.simulation.beginning()
        if job.earlier is None:
            return
        try:
            self.seconds = self._go_on_from(job.earlier)
        except Exception as error:  # whatever is wrong with it, the trial is not
            _say_once(str(error))
            self.simulation = Simulation(job)

    def _go_on_from(self, earlier: LastState) -> float:
        content = unsealed(earlier.content, self._key)
        header, _, content = content.partition(b"\n")
        about, simulation = json.loads(header), self.simulation
        if about.get("beginning") != self._beginning:
            raise ValueError("is of a trial that begins in another way")
        size = int(about["state_bytes"])
        own, kind = simulation.state(), frame_type_of(simulation)
        trial, key = earlier.trial_id, self._key
        saved = state_of(content[:size], trial, own, key, _refused)
        taken = frames_of(content[size:], kind, saved.crc)
        simulation.restore(saved.state)
        simulation.taken = [every_so_many(taken, simulation.job.record.every)]
        return saved.seconds

    def last_state(self, result: Result, simulation: Simulation) -> bytes:
        """What is kept of a result, which came of `simulation`; nothing unless it is
        done.
        """
        if result.status != "done":
            return b""
        taken = joined(simulation.taken)
        frames = frame_bytes(frame_type_of(simulation), taken)
        state, count = simulation.state(), len(taken.steps)
        saved = Saved(state, result.seconds, count, zlib.crc32(frames))
        trial, key = result.job.trial_id, self._key
        content = state_bytes(trial, saved, key, libraries())
        about = {"beginning": self._beginning, "state_bytes": len(content)}
        header = json.dumps(about).encode()
        kept = sealed(b"".join([header, b"\n", content, frames]), key)
        if len(kept) > MOST_BYTES:
            _say_large(trial)
            return b""
        return kept


def frame_type_of(simulation: Simulation) -> FrameType:
    """The record of a frame of a trial."""
    record = simulation.job.record
    return frame_type(
        len(record.metrics),
        simulation.schedule.n if record.trajectories else 0,
        len(simulation.flight.model.state),
    )


def _refused(code: str) -> str:
    """How the libraries are others than those of a last state; "" where they are the
    same.
    """
    return differences(libraries(), code)


@cache
def _say_once(error: str) -> None:
    LOG.warning(
        "the last state of an earlier trial %s; trials of which that is so begin at"
        " step 0",
        error,
    )


@cache
def _say_large(trial: str) -> None:
    LOG.warning(
        "trial %s: its last state has more than %s bytes, and is not kept",
        trial,
        f"{MOST_BYTES:,}",
    )
