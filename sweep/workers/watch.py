"""Limits of a job, kept from outside: a worker is ended if its job takes too long or
too much memory.

Only another process can stop a job that hangs within one call, or that fills the
memory. So each worker notes on a board which job of its chunk it runs, and since when.
The board is a small file that worker and coordinator map into memory. A thread of the
coordinator reads the board many times a second and kills the worker of a job beyond its
limit. The drive loop decides about that job, and about the others that were lost with
its worker.
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
    """The wall seconds a job may take, and the resident bytes its worker may hold while
    it runs; None for no limit.

    The bytes include those of the interpreter and its libraries, about 200 MB.
    """

    deadline: float | None = None
    memory: int | None = None


class Overrun(NamedTuple):
    """Which job of a chunk was ended, by position, and why; `late` if out of time."""

    position: int
    late: bool
    error: str


NO_LIMITS = Limits()


class JobNote(Protocol):
    """What is sent to a worker with a chunk, so that its current job is known from
    outside.
    """

    def noting(self, jobs: Sequence[J]) -> Iterator[J]: ...


class Watching(Protocol):
    """Keeps limits of jobs while it is entered.

    Each chunk in flight may have a seat. When it is over, `leave` returns the verdict
    on one of its jobs. `ended` says whether a worker, and its whole pool with it, has
    been ended; the caller resets it.
    """

    ended: bool

    def __enter__(self) -> "Watching": ...

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None: ...

    def take(self) -> JobNote | None: ...

    def leave(self, place: JobNote | None) -> Overrun | None: ...


class Seat(NamedTuple):
    """The place of a chunk on the board, for the worker that runs it."""

    path: str
    number: int

    def noting(self, jobs: Sequence[J]) -> Iterator[J]:
        """The jobs of a chunk, each noted on the board while it is in use."""
        notes, first = board(self.path), NOTES * self.number
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
    """Keeps `limits` for up to `seats` chunks at a time; a context manager, which may
    raise WorkersError.

    Only child processes of this one are ended. So jobs in this process, or on other
    machines, have no limit.
    """

    def __init__(self, limits: Limits = NO_LIMITS, seats: int = 0) -> None:
        self.limits = limits
        self.ended = False
        """Whether a worker has been ended; the caller resets it for new workers."""
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
        """A seat for a chunk to be sent; None without limits, or if all are taken."""
        if self.limits == NO_LIMITS or not self._free:
            return None
        with self._lock:
            number = self._free.pop()
            self._board[NOTES * number + SINCE] = IDLE
            self._verdicts[number] = None
        return Seat(str(self._file), number)

    def leave(self, place: JobNote | None) -> Overrun | None:
        """Free the seat of a finished chunk; returns the verdict on one of its jobs."""
        if not isinstance(place, Seat):
            return None
        with self._lock:
            self._free.append(place.number)
            return self._verdicts.pop(place.number)

    def _keep_watching(self) -> None:
        while not self._over.wait(WATCH_SECONDS):
            with self._lock:
                for number, verdict in self._verdicts.items():
                    if verdict is None:
                        self._verdicts[number] = self._judge_seat(number)

    def _judge_seat(self, number: int) -> Overrun | None:
        """End the worker at a seat if its job is beyond a limit."""
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
        except psutil.Error:  # it has ended by itself
            return None
        return Overrun(int(position), late, error)


def beyond(
    limits: Limits, seconds: float, worker: "psutil.Process"
) -> tuple[bool, str]:
    """Whether a job that has taken `seconds` is late, and which limit it is beyond, in
    words; "" for none.
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
    """The board as numbers of 8 bytes, each written at once: `since`, `position` and
    `process` of every seat.
    """
    descriptor = os.open(path, os.O_RDWR)
    try:
        return memoryview(mmap.mmap(descriptor, 0)).cast("d")
    finally:
        os.close(descriptor)
