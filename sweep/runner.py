"""One drive loop over `concurrent.futures.Executor`: jobs in, results out, none lost and none twice.

The loop knows nothing of what a job is. It sends chunks of about a second of work, longest jobs first, keeps
a bounded number of them in flight, and yields each chunk's results as soon as they are back. When a worker
process dies, the jobs that were in flight are suspects: they run one at a time with nothing else in flight,
so that a job which kills its worker convicts itself and every other one is delivered. The order of the
results depends on timing and must not matter to anyone.
"""

import signal
import threading
import time
import traceback
from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future, wait
from dataclasses import dataclass, field
from types import FrameType, TracebackType
from typing import Generic, NamedTuple, TypeVar

from sweep.chunks import Chunks
from sweep.executors import ExecutorFactory

J = TypeVar("J")
R = TypeVar("R")

MAX_ATTEMPTS = 3
POLL_SECONDS = 0.2


class WorkersError(RuntimeError):
    """No worker process can be given a job: none stays alive, or `run` cannot be sent to it."""


@dataclass(frozen=True)
class Failure:
    """What became of a job that never returned: `error` is a traceback or one sentence."""

    error: str


def drive(
    jobs: Sequence[J],
    run: Callable[[J], R],
    *,
    executor: ExecutorFactory,
    cost: Callable[[J], float],
    failed: Callable[[J, str], R],
    chunk_seconds: float = 1.0,
) -> Iterator[list[R]]:
    """Run every job once and yield the results chunk by chunk, in the order in which they come back.

    `cost` estimates the seconds of a job; the estimates are corrected by what is measured, so only their
    ratios matter much. `failed` makes the result of a job that raised (given the traceback) or that ended its
    worker process MAX_ATTEMPTS times while running alone. `run` and the jobs are pickled.

    Ctrl-C is held back while the loop is in use, so that it cannot cut the caller's handling of a batch: the
    workers are ended, what had finished is yielded, then KeyboardInterrupt is raised. A second Ctrl-C is
    raised on the spot. Closing the iterator early also ends the workers. Raises WorkersError when no worker
    can be given a job.
    """
    chunks = Chunks(map(cost, jobs), len(jobs), workers=executor.workers, seconds=chunk_seconds)
    loop = _Loop(jobs, run, executor, failed, chunks)
    with _HeldInterrupt() as interrupt:
        try:
            while not interrupt.asked and loop.refill():
                yield from loop.finished()
        except BaseException:
            executor.stop()
            raise
        if interrupt.asked:
            executor.stop()
            yield from loop.salvaged()
            raise KeyboardInterrupt


class _Chunk(NamedTuple):
    indices: list[int]
    alone: bool


@dataclass
class _Loop(Generic[J, R]):
    """What is in flight and what is suspect. Suspects stay queued until their own run alone is decided."""

    jobs: Sequence[J]
    run: Callable[[J], R]
    executor: ExecutorFactory
    failed: Callable[[J, str], R]
    chunks: Chunks
    pool: Executor | None = None
    in_flight: dict[Future[tuple[list[R | Failure], float]], _Chunk] = field(default_factory=dict)
    suspects: deque[int] = field(default_factory=deque)
    attempts: Counter[int] = field(default_factory=Counter)

    def refill(self) -> bool:
        """Submit what may run now; False when nothing is left to wait for."""
        if self.suspects and not self.in_flight:
            self._submit(_Chunk([self.suspects[0]], alone=True))
        while not self.suspects and len(self.in_flight) < 2 * self.executor.workers:
            indices = self.chunks.take()
            if not indices:
                break
            self._submit(_Chunk(indices, alone=False))
        return bool(self.in_flight)

    def finished(self) -> Iterator[list[R]]:
        """The results of the chunks that are back; waits at most POLL_SECONDS for the first of them."""
        done, _ = wait(self.in_flight, timeout=POLL_SECONDS, return_when="FIRST_COMPLETED")
        for future in [future for future in self.in_flight if future in done]:
            chunk = self.in_flight.pop(future)
            error = future.exception()
            results = self._results(chunk, future) if error is None else self._judged(chunk, error)
            if results:
                yield results

    def salvaged(self) -> Iterator[list[R]]:
        """The results of the chunks that were back when the executor was stopped."""
        for future, chunk in self.in_flight.items():
            if future.done() and future.exception() is None:
                yield self._results(chunk, future)

    def _submit(self, chunk: _Chunk) -> None:
        if self.pool is None:
            self.pool = _started(self.executor, self.run)
        try:
            future = self.pool.submit(_run_chunk, self.run, [self.jobs[index] for index in chunk.indices])
        except Exception as error:  # the pool broke, or was shut down, since it was last used
            future = Future()
            future.set_exception(error)
            self._drop_pool()
        self.in_flight[future] = chunk

    def _results(self, chunk: _Chunk, future: Future[tuple[list[R | Failure], float]]) -> list[R]:
        outcomes, seconds = future.result()
        if chunk.alone:
            self.suspects.popleft()
        else:
            self.chunks.observe(chunk.indices, seconds)
        return [
            self.failed(self.jobs[index], outcome.error) if isinstance(outcome, Failure) else outcome
            for index, outcome in zip(chunk.indices, outcomes, strict=True)
        ]

    def _judged(self, chunk: _Chunk, error: BaseException) -> list[R]:
        if isinstance(error, BrokenExecutor):
            self._drop_pool()
        if not chunk.alone:
            self.suspects.extend(chunk.indices)
            return []
        index = self.suspects[0]
        self.attempts[index] += 1
        if self.attempts[index] < MAX_ATTEMPTS:
            return []
        self.suspects.popleft()
        return [self.failed(self.jobs[index], _verdict(error))]

    def _drop_pool(self) -> None:
        self.executor.stop()
        self.pool = None


class _HeldInterrupt:
    """Remembers a first Ctrl-C in `asked` instead of raising it; a second one is raised.

    Does nothing outside the main thread, or where Ctrl-C is ignored or already handled by someone else.
    """

    def __init__(self) -> None:
        self.asked = False
        self.held = False

    def __enter__(self) -> "_HeldInterrupt":
        in_main_thread = threading.current_thread() is threading.main_thread()
        if in_main_thread and signal.getsignal(signal.SIGINT) is signal.default_int_handler:
            signal.signal(signal.SIGINT, self._hold)
            self.held = True
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self.held and threading.current_thread() is threading.main_thread():
            signal.signal(signal.SIGINT, signal.default_int_handler)

    def _hold(self, number: int, frame: FrameType | None) -> None:
        if self.asked:
            signal.default_int_handler(number, frame)
        self.asked = True


def _started(executor: ExecutorFactory, run: Callable[[J], R]) -> Executor:
    """A pool that has answered: without this, workers that cannot start would convict every job."""
    failure: Exception | None = None
    for _ in range(MAX_ATTEMPTS):
        try:
            pool = executor.start()
            pool.submit(_run_chunk, run, []).result()
            return pool
        except Exception as error:
            executor.stop()
            failure = error
    raise WorkersError(f"no worker process can be given a job: {failure}") from failure


def _run_chunk(run: Callable[[J], R], jobs: Sequence[J]) -> tuple[list[R | Failure], float]:
    """Run in a worker: the outcome of each job, and the wall seconds they took together."""
    start = time.perf_counter()
    outcomes = [_attempt(run, job) for job in jobs]
    return outcomes, time.perf_counter() - start


def _attempt(run: Callable[[J], R], job: J) -> R | Failure:
    try:
        return run(job)
    except (Exception, SystemExit):
        return Failure(traceback.format_exc())


def _verdict(error: BaseException) -> str:
    if isinstance(error, BrokenExecutor):
        return f"worker process died {MAX_ATTEMPTS} times while running this trial alone: {error}"
    return f"no result came back in {MAX_ATTEMPTS} attempts: {type(error).__name__}: {error}"
