"""The final state of a trial, from which a trial with more steps resumes.

The two trials differ only in the number of steps, and are bitwise identical up to the
final state.

    boidsweep checkpoint 2 8f3a02c1...   the format, and the seal of the remaining file
    {"beginning": ..., "state_bytes": ...}   a header in JSON
    ...                                  the two files of a checkpoint: see
                                         `sweep.workers.checkpoint_file`

The coordinator finds the earlier trial by its id, which covers the code and all
parameters but the steps (`sweep.store.last_states`). The worker then compares the
libraries and the machine, as for a checkpoint, and how both trials begin: flock,
scenery and random numbers must be bitwise identical. If anything differs, the trial
begins at step 0.
"""

import json
import logging
import zlib
from functools import cache

from sweep.design import Job, LastState
from sweep.trial import Result, Simulation, every_so_many, joined
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
"""Maximum size of a final state in bytes. A cell of parquet can hold twice as much."""


class Lasting:
    """The simulation of a job that records its final state.

    The simulation is at step 0, or at the step where the earlier trial has ended.

    Parameters
    ----------
    job : Job
        Job, perhaps with the final state of an earlier trial.
    key : bytes
        Key with which final states are sealed.

    Attributes
    ----------
    simulation : Simulation
    seconds : float
        Wall seconds of the earlier trial; 0 without an earlier trial.
    """

    def __init__(self, job: Job, key: bytes) -> None:
        self.simulation = Simulation(job)
        self.seconds = 0.0
        self._key = key
        self._beginning = self.simulation.beginning()
        if job.earlier is None:
            return
        try:
            self.seconds = self._go_on_from(job.earlier)
        except Exception as error:  # a damaged state must not fail the trial
            _say_once(str(error))
            self.simulation = Simulation(job)

    def _go_on_from(self, earlier: LastState) -> float:
        content = unsealed(earlier.content, self._key)
        first_line, _, content = content.partition(b"\n")
        header = json.loads(first_line)
        if header.get("beginning") != self._beginning:
            raise ValueError("belongs to a trial that begins in another way")
        simulation = self.simulation
        size = int(header["state_bytes"])
        saved = state_of(
            content[:size],
            earlier.trial_id,
            simulation.state(),
            self._key,
            differing=_differing,
        )
        taken = frames_of(content[size:], frame_type_of(simulation), saved.crc)
        simulation.restore(saved.state)
        simulation.taken = [every_so_many(taken, simulation.job.record.every)]
        return saved.seconds

    def last_state(self, result: Result, simulation: Simulation) -> bytes:
        """Return the sealed final state of a trial.

        Parameters
        ----------
        result : Result
            Result of the trial.
        simulation : Simulation
            The trial at its end.

        Returns
        -------
        bytes
            ``b""`` if the result is not done, or if the final state has more than
            MOST_BYTES.
        """
        if result.status != "done":
            return b""
        trial = result.job.trial_id
        taken = joined(simulation.taken)
        frames = frame_bytes(frame_type_of(simulation), taken)
        count = len(taken.steps)
        saved = Saved(simulation.state(), result.seconds, count, zlib.crc32(frames))
        content = state_bytes(trial, saved, self._key, libraries())
        fields = {"beginning": self._beginning, "state_bytes": len(content)}
        header = json.dumps(fields).encode()
        last_state = sealed(b"".join([header, b"\n", content, frames]), self._key)
        if len(last_state) > MOST_BYTES:
            _say_large(trial)
            return b""
        return last_state


def frame_type_of(simulation: Simulation) -> FrameType:
    """Return the record of a frame of a trial."""
    record = simulation.job.record
    return frame_type(
        len(record.metrics),
        simulation.schedule.n if record.looks else 0,
        len(simulation.flight.model.state),
    )


def _differing(code: str) -> str:
    """Return how libraries differ from the libraries of a final state; "" if equal."""
    return differences(libraries(), code)


@cache
def _say_once(error: str) -> None:
    LOG.warning(
        "the final state of an earlier trial %s; affected trials begin at step 0",
        error,
    )


@cache
def _say_large(trial: str) -> None:
    LOG.warning(
        "trial %s: its final state has more than %s bytes, and is not stored",
        trial,
        f"{MOST_BYTES:,}",
    )
