"""Limits of a job, enforced from outside.

A worker is ended if its job takes too long or too much memory.

Only another process can stop a job that hangs within one call, or that fills the
memory. So each worker notes on a board which job of its chunk runs, and since when. The
board is a small file that worker and coordinator map into memory. A thread of the
coordinator reads the board many times per second and kills the worker of a job beyond a
limit. The drive loop decides about that job, and about further jobs that were lost with
the worker.
"""

import mmap
import os
import tempfile
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, NamedTuple, Protocol, TypeVar

from sweep.errors import WorkersError

if TYPE_CHECKING:
    import psutil

J = TypeVar("J")

WATCH_SECONDS = 0.05
SINCE, POSITION, PROCESS = range(3)
NOTES = 3
IDLE = 0.0


class Limits(NamedTuple):
    """Limits of a job; None for no limit.

    Attributes
    ----------
    deadline : float or None
        Wall seconds that a job may take.
    memory : int or None
        Resident bytes of the worker during the job. The interpreter and its libraries
        take about 200 MB of this memory.
    """

    deadline: float | None = None
    memory: int | None = None


class Overrun(NamedTuple):
    """A job of a chunk that was ended.

    Attributes
    ----------
    position : int
        Position of the job in its chunk, from 0 on.
    late : bool
        Whether the job took too long; otherwise it took too much memory.
    error : str
        Description of the exceeded limit.
    """

    position: int
    late: bool
    error: str


NO_LIMITS = Limits()


class JobNote(Protocol):
    """Companion of a chunk that makes the current job known outside the worker."""

    def noting(self, jobs: Sequence[J]) -> Iterator[J]:
        """Yield the jobs of a chunk, and note the current job."""


class Watching(Protocol):
    """A keeper of limits of jobs, as a context manager.

    Each submitted chunk may have a seat.
    """

    ended: bool
    """True after a worker, and its pool, was ended; the caller resets the value."""

    def __enter__(self) -> "Watching": ...

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None: ...

    def take(self) -> JobNote | None:
        """Return a seat for a chunk to be sent, if a seat is free."""

    def leave(self, note: JobNote | None) -> Overrun | None:
        """Free the seat of a finished chunk, and return the verdict on one job."""


class Seat(NamedTuple):
    """The seat of a chunk on the board, for the worker that runs the chunk."""

    path: str
    number: int

    def noting(self, jobs: Sequence[J]) -> Iterator[J]:
        """Yield the jobs of a chunk, and note the current job on the board."""
        notes = board(self.path)
        first = NOTES * self.number
        notes[first + PROCESS] = float(os.getpid())
        try:
            for position, job in enumerate(jobs):
                notes[first + SINCE] = IDLE
                notes[first + POSITION] = float(position)
                notes[first + SINCE] = time.monotonic()
                yield job
        finally:
            notes[first + SINCE] = IDLE


class LimitKeeper:
    """Context manager that enforces limits of jobs.

    Only child processes of this process are ended. So jobs in this process, or on
    further machines, have no limit. Entering may raise WorkersError.

    Parameters
    ----------
    limits : Limits, default NO_LIMITS
    seats : int, default 0
        Maximum number of simultaneous chunks with limits.
    """

    def __init__(self, limits: Limits = NO_LIMITS, seats: int = 0) -> None:
        self.limits = limits
        self.ended = False
        """True after a worker was ended; the caller resets the value for new workers.
        """
        self._free = list(range(seats))
        self._verdicts: dict[int, Overrun | None] = {}
        self._lock = threading.Lock()
        self._over = threading.Event()
        self._thread = threading.Thread(
            target=self._keep_watching, name="limits", daemon=True
        )

    def __enter__(self) -> "LimitKeeper":
        if self.limits != NO_LIMITS:
            try:
                descriptor, path = tempfile.mkstemp(prefix="sweep-limits-")
                self._file = Path(path)
                with os.fdopen(descriptor, "wb") as file:
                    file.write(bytes(8 * NOTES * len(self._free)))
            except OSError as error:
                raise WorkersError(
                    f"the limits of trials need a small temporary file: {error}"
                ) from error
            self._board = board(str(self._file))
            self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self.limits != NO_LIMITS:
            self._over.set()
            self._thread.join()
            with suppress(OSError):  # Windows deletes no file that a worker still maps
                self._file.unlink()

    def take(self) -> JobNote | None:
        """Return a seat for a chunk; None without limits, or without a free seat."""
        if self.limits == NO_LIMITS or not self._free:
            return None
        with self._lock:
            number = self._free.pop()
            self._board[NOTES * number + SINCE] = IDLE
            self._verdicts[number] = None
        return Seat(str(self._file), number)

    def leave(self, note: JobNote | None) -> Overrun | None:
        """Free the seat of a finished chunk, and return the verdict on one job."""
        if not isinstance(note, Seat):
            return None
        with self._lock:
            self._free.append(note.number)
            return self._verdicts.pop(note.number)

    def _keep_watching(self) -> None:
        while not self._over.wait(WATCH_SECONDS):
            with self._lock:
                for number, verdict in self._verdicts.items():
                    if verdict is None:
                        self._verdicts[number] = self._judge_seat(number)

    def _judge_seat(self, number: int) -> Overrun | None:
        """End the worker at a seat if its job exceeds a limit."""
        import psutil

        first = NOTES * number
        since, position, process = self._board[first : first + NOTES]
        if since == IDLE:
            return None
        try:
            worker = psutil.Process(int(process))
            late, error = beyond(self.limits, time.monotonic() - since, worker)
            if (
                not error
                or self._board[first + SINCE] != since
                or worker.ppid() != os.getpid()
            ):
                return None
            self.ended = True
            worker.kill()
        except psutil.Error:  # the worker has ended by itself
            return None
        return Overrun(int(position), late, error)


def beyond(
    limits: Limits, seconds: float, worker: "psutil.Process"
) -> tuple[bool, str]:
    """Return whether a job is late, and the limit that the job exceeds.

    Parameters
    ----------
    limits : Limits
    seconds : float
        Wall seconds that the job has taken.
    worker : psutil.Process
        Worker that runs the job.

    Returns
    -------
    late : bool
    error : str
        Description of the exceeded limit; "" for a job within its limits.
    """
    if limits.deadline is not None and seconds > limits.deadline:
        return True, f"did not return within {limits.deadline:g} s, and was ended"
    if limits.memory is not None and (held := worker.memory_info().rss) > limits.memory:
        return (
            False,
            (
                f"memory limit of {limits.memory / 2**20:.0f} MiB:"
                f" its worker held {held / 2**20:.0f} MiB"
            ),
        )
    return False, ""


@lru_cache(maxsize=4)
def board(path: str) -> "memoryview[float]":
    """Return the board: `since`, `position` and `process` of every seat.

    Each number has 8 bytes, which are written in one operation.
    """
    descriptor = os.open(path, os.O_RDWR)
    try:
        return memoryview(mmap.mmap(descriptor, 0)).cast("d")
    finally:
        os.close(descriptor)
