"""One drive loop over `concurrent.futures.Executor`: jobs in, results out, none lost and none twice.

The loop knows nothing of what a job is. It sends chunks of about a second of work, longest jobs first, keeps
a bounded number of them in flight, and yields each chunk's results as soon as they are back. When a worker
process dies, the jobs that were in flight are suspects: they run one at a time with nothing else in flight,
so that a job which kills its worker convicts itself and every other one is delivered. A worker that is ended
because its job is beyond a limit (`sweep.watch`) makes no suspects: it is known which job that was. The order
of the results depends on timing and must not matter to anyone.
"""

import time
import traceback
from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future, wait
from dataclasses import dataclass, field
from typing import Generic, NamedTuple, TypeVar

from sweep.chunks import Chunks
from sweep.executors import ExecutorFactory, WorkersError
from sweep.interrupts import HeldInterrupt
from sweep.watch import Limits, Seat, Verdict, Watch

J = TypeVar("J")
R = TypeVar("R")

MAX_ATTEMPTS = 3
POLL_SECONDS = 0.2
NO_LIMITS = Limits()


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
    overdue: Callable[[J, str], R] | None = None,
    limits: Limits = NO_LIMITS,
    chunk_seconds: float = 1.0,
) -> Iterator[list[R]]:
    """Run every job once and yield the results chunk by chunk, in the order in which they come back.

    `cost` estimates the seconds of a job; the estimates are corrected by what is measured, so only their
    ratios matter much. `failed` makes the result of a job that raised (given the traceback) or that ended its
    worker process MAX_ATTEMPTS times while running alone. `run` and the jobs are pickled.

    `limits` hold for each job in a worker process on this machine. The worker of a job beyond one is ended; jobs
    lost with it run again. The result of a job that took too long is made by `overdue` (default: by `failed`), that
    of one which took too much memory, and did so again when running alone, by `failed`.

    Ctrl-C is held back while the loop is in use, so that it cannot cut the caller's handling of a batch: the
    workers are ended, what had finished is yielded, then KeyboardInterrupt is raised. A second Ctrl-C is
    raised on the spot. SIGTERM and SIGHUP count as Ctrl-C where `sweep.interrupts` has made them so. Closing the
    iterator early also ends the workers. Raises WorkersError when no worker can be given a job.
    """
    chunks = Chunks(map(cost, jobs), len(jobs), workers=executor.workers, seconds=chunk_seconds)
    with HeldInterrupt() as interrupt, Watch(limits, 2 * executor.workers) as watch:
        loop = _Loop(jobs, run, executor, failed, overdue or failed, chunks, watch)
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
    seat: Seat | None


@dataclass
class _Loop(Generic[J, R]):
    """What is in flight and what is suspect. Suspects stay queued until their own run alone is decided."""

    jobs: Sequence[J]
    run: Callable[[J], R]
    executor: ExecutorFactory
    failed: Callable[[J, str], R]
    overdue: Callable[[J, str], R]
    chunks: Chunks
    watch: Watch
    pool: Executor | None = None
    in_flight: dict[Future[tuple[list[R | Failure], float]], _Chunk] = field(default_factory=dict)
    again: deque[list[int]] = field(default_factory=deque)
    suspects: deque[int] = field(default_factory=deque)
    attempts: Counter[int] = field(default_factory=Counter)

    def refill(self) -> bool:
        """Submit what may run now; False when nothing is left to wait for."""
        if self.suspects and not self.in_flight:
            self._submit([self.suspects[0]], alone=True)
        while not self.suspects and len(self.in_flight) < 2 * self.executor.workers:
            indices = self.again.popleft() if self.again else self.chunks.take()
            if not indices:
                break
            self._submit(indices, alone=False)
            if self.pool is None:
                break
        return bool(self.in_flight)

    def finished(self) -> Iterator[list[R]]:
        """The results of the chunks that are back; waits at most POLL_SECONDS for the first of them."""
        done, _ = wait(self.in_flight, timeout=POLL_SECONDS, return_when="FIRST_COMPLETED")
        if not done:
            self.executor.check()
        if any(isinstance(future.exception(), BrokenExecutor) for future in done):
            self._drop_pool()  # with it all chunks in flight are over
            done = {future for future in self.in_flight if future.done()}
        for future in [future for future in self.in_flight if future in done]:
            chunk = self.in_flight.pop(future)
            verdict, error = self.watch.leave(chunk.seat), future.exception()
            results = self._results(chunk, future) if error is None else self._judged(chunk, error, verdict)
            if results:
                yield results

    def salvaged(self) -> Iterator[list[R]]:
        """The results of the chunks that were back when the executor was stopped."""
        for future, chunk in self.in_flight.items():
            if future.done() and future.exception() is None:
                yield self._results(chunk, future)

    def _submit(self, indices: list[int], *, alone: bool) -> None:
        if self.pool is None:
            self.pool = _started(self.executor, self.run)
            self.watch.ended = False
        seat = self.watch.take()
        try:
            future = self.pool.submit(_run_chunk, self.run, [self.jobs[index] for index in indices], seat)
        except Exception as error:  # the pool broke, or was shut down, since it was last used
            future = Future()
            future.set_exception(error)
            self._drop_pool()
        self.in_flight[future] = _Chunk(indices, alone, seat)

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

    def _judged(self, chunk: _Chunk, error: BaseException, verdict: Verdict | None) -> list[R]:
        """What is known for certain of the jobs of a chunk that is lost; all others get another turn."""
        if verdict is not None:
            return self._ended(chunk, verdict)
        if self.watch.ended and isinstance(error, BrokenExecutor):
            return self._innocent(chunk)
        if not chunk.alone:
            self.suspects.extend(chunk.indices)
            return []
        index = self.suspects[0]
        self.attempts[index] += 1
        if self.attempts[index] < MAX_ATTEMPTS:
            return []
        self.suspects.popleft()
        return [self.failed(self.jobs[index], _verdict(error))]

    def _ended(self, chunk: _Chunk, verdict: Verdict) -> list[R]:
        """The result of the job that was beyond a limit, unless jobs before it may have left the memory so full."""
        if chunk.alone:
            index = self.suspects.popleft()
        else:
            index = chunk.indices.pop(verdict.position)
            self._innocent(chunk)
            if not verdict.late:
                self.suspects.append(index)
                return []
        return [(self.overdue if verdict.late else self.failed)(self.jobs[index], verdict.error)]

    def _innocent(self, chunk: _Chunk) -> list[R]:
        """No result; the jobs of the chunk get another turn."""
        if chunk.indices and not chunk.alone:
            self.again.append(chunk.indices)
        return []

    def _drop_pool(self) -> None:
        self.executor.stop()
        self.pool = None


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


def _run_chunk(run: Callable[[J], R], jobs: Sequence[J], seat: Seat | None = None) -> tuple[list[R | Failure], float]:
    """Run in a worker: the outcome of each job, and the wall seconds they took together."""
    start = time.perf_counter()
    outcomes = [_attempt(run, job) for job in (jobs if seat is None else seat.noting(jobs))]
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
