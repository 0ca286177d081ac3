"""The drive loop over `concurrent.futures.Executor`: jobs go in, results come out.

No result is lost, and no result comes twice.

The loop has no knowledge of the content of a job. It sends chunks of about a second of
work, the longest jobs first or all in order. The loop limits the number of submitted
chunks, and yields the results of a chunk on arrival.

A pool breaks when a worker process dies. Then all submitted jobs are suspects. Each
suspect runs alone, with no further job submitted. So a job that kills its worker is
identified, and all other results are delivered.

On a cluster only one chunk is lost, and the pool continues. The jobs of the chunk are
sent one by one among all remaining jobs, and a job that is lost repeatedly fails.

There are no suspects in three cases:

- A worker was ended because a job exceeded a limit (`watch.py`): that job is known.
- A connection was cut: no job is the cause.
- A worker reports that it is spoilt: its chunk is known. All workers are replaced, and
  the chunks of the remaining workers are sent again.

The order of the results depends on timing; no caller may rely on the order. Each chunk
carries the fingerprint of this process: a worker with different code or libraries
rejects the chunk.
"""

import time
from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future, wait
from dataclasses import dataclass, field
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Generic, NamedTuple, TypeVar

from sweep.errors import WorkersError
from sweep.trial import HeldInterrupt
from sweep.workers import fingerprint
from sweep.workers.chunks import Chunks, Dealing
from sweep.workers.executors import (
    ConnectionLostError,
    ExecutorFactory,
    JobEndedError,
    NotYetError,
    SpoiltWorkerError,
    WorkerDiedError,
)
from sweep.workers.watch import NO_LIMITS, JobNote, Limits, Overrun, Watching
from sweep.workers.worker import Failure, Outcomes, run_chunk

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

J = TypeVar("J")
R = TypeVar("R")
T = TypeVar("T")

MAX_ATTEMPTS = 3
POLL_SECONDS = 0.2


def drive(
    jobs: Sequence[J],
    run: Callable[[J], R],
    *,
    executor: ExecutorFactory,
    costs: Callable[[Sequence[J]], "ArrayLike"],
    failed: Callable[[J, str], R],
    overdue: Callable[[J, str], R] | None = None,
    limits: Limits = NO_LIMITS,
    deal: "Callable[[ArrayLike], Dealing]" = Chunks,
    ended: Callable[[], bool] = lambda: False,
    goes_on: Callable[[int, R], bool] = lambda _index, _result: False,
) -> Iterator[list[R]]:
    """Run every job once, and yield the results chunk by chunk on arrival.

    The worker of a job beyond a limit is ended. Jobs that are lost with the worker run
    again. If a job took too much memory, the job runs again alone, and fails if the
    memory is exceeded again.

    Ctrl-C is held back while the loop is in use, so that the caller can process results
    without interruption. The workers are ended, finished results are yielded, then
    KeyboardInterrupt is raised. A second Ctrl-C is raised at once. SIGTERM and SIGHUP
    count as Ctrl-C where `interrupts.py` has set this up. Closing the iterator early
    also ends the workers.

    Parameters
    ----------
    jobs : sequence
        Jobs to run; each must allow pickling.
    run : callable
        Runs one job in a worker; must allow pickling.
    executor : ExecutorFactory
        Maker of the pool of workers.
    costs : callable
        Estimates the seconds of each job. Measured times correct the estimates, so
        mainly the ratios matter.
    failed : callable
        Makes the result of a job that raised an error, from the job and the traceback.
        It also makes the result of a job that ended its worker MAX_ATTEMPTS times while
        running alone.
    overdue : callable, optional
        Makes the result of a job that took too long; by default `failed`.
    limits : Limits, default NO_LIMITS
        Limits of each job, as far as the engine can enforce limits.
    deal : callable, default Chunks
        Divides jobs with such costs among workers.
    ended : callable, optional
        Called repeatedly. After a return value of True, the workers are ended, and only
        finished results are yielded.
    goes_on : callable, optional
        Called with each result and the index of its job. After a return value of True,
        another job has replaced the job at this index, and runs soon.

    Yields
    ------
    list
        Results of a chunk.

    Raises
    ------
    WorkersError
        If no worker can run a job, or if a worker has different code from this process.
        Finished results are yielded before.
    KeyboardInterrupt
        After Ctrl-C.
    """
    chunks = deal(costs(jobs))
    with HeldInterrupt() as interrupt, executor.watch(limits) as watch:
        loop = _DriveLoop(
            jobs,
            run,
            executor,
            failed=failed,
            overdue=overdue or failed,
            goes_on=goes_on,
            chunks=chunks,
            watch=watch,
            interrupt=interrupt,
        )
        try:
            while not (interrupt.asked or ended()) and loop.refill():
                yield from loop.finished()
            if not (interrupt.asked or ended()):
                return
        except WorkersError:
            executor.stop()
            yield from loop.salvaged()
            raise
        except BaseException:
            executor.stop()
            raise
        executor.stop()
        yield from loop.salvaged()
        if interrupt.asked:
            raise KeyboardInterrupt


class _Chunk(NamedTuple):
    indices: list[int]
    alone: bool
    note: JobNote | None


@dataclass
class _DriveLoop(Generic[J, R]):
    """The submitted jobs, and the suspects.

    A suspect stays queued until its run alone has ended.
    """

    jobs: Sequence[J]
    run: Callable[[J], R]
    executor: ExecutorFactory
    failed: Callable[[J, str], R]
    overdue: Callable[[J, str], R]
    goes_on: Callable[[int, R], bool]
    chunks: Dealing
    watch: Watching
    interrupt: HeldInterrupt
    pool: Executor | None = None
    in_flight: dict[Future[Outcomes[R]], _Chunk] = field(default_factory=dict)
    back: SimpleQueue[Future[Outcomes[R]]] = field(default_factory=SimpleQueue)
    again: deque[list[int]] = field(default_factory=deque)
    suspects: deque[list[int]] = field(default_factory=deque)
    attempts: Counter[int] = field(default_factory=Counter)

    def refill(self) -> bool:
        """Submit the jobs that may run now; return False when no job is left."""
        if not (self.in_flight or self.suspects or self.again or self.chunks.left):
            return False
        if self.pool is None and not self._start():
            time.sleep(POLL_SECONDS)
            return True
        if self.suspects and not self.in_flight:
            self._submit([*self.suspects[0]], alone=True)
        workers = max(1, self.executor.workers)
        while (
            self.pool is not None
            and not self.suspects
            and len(self.in_flight) < 2 * workers
        ):
            indices = self.again.popleft() if self.again else self.chunks.take(workers)
            if not indices:
                break
            self._submit(indices, alone=False)
        return True

    def finished(self) -> Iterator[list[R]]:
        """Yield the results of returned chunks.

        The method waits at most POLL_SECONDS for a first chunk.
        """
        # Futures of an earlier pool are ignored.
        done = [future for future in self._arrived() if future in self.in_flight]
        if not done:
            self.executor.check()
        spoilt = any(isinstance(_error(future), SpoiltWorkerError) for future in done)
        broken = any(isinstance(_error(future), BrokenExecutor) for future in done)
        if spoilt or broken:
            self._drop_pool()  # with it all chunks in flight are over
            done = [future for future in self.in_flight if future.done()]
        for future in done:
            chunk = self.in_flight.pop(future)
            verdict = self.watch.leave(chunk.note)
            error = _error(future)
            if error is None:
                results = self._results(chunk, future)
            elif spoilt and not isinstance(error, SpoiltWorkerError):
                results = self._innocent(chunk)  # this loop has ended its worker
            else:
                results = self._judged(chunk, error, verdict)
            if results:
                yield results

    def salvaged(self) -> Iterator[list[R]]:
        """Yield the results of chunks that returned before the executor stopped."""
        for future, chunk in self.in_flight.items():
            if (
                future.done()
                and _error(future) is None
                and not isinstance(future.result(), str)
            ):
                yield self._results(chunk, future)

    def _arrived(self) -> list[Future[Outcomes[R]]]:
        if not self.in_flight:
            return []
        arrived = []
        try:
            arrived.append(self.back.get(timeout=POLL_SECONDS))
            while True:
                arrived.append(self.back.get_nowait())
        except Empty:
            return arrived

    def _start(self) -> bool:
        """Start a pool, and return whether there is a pool now.

        When the pool is new, no chunk is submitted.
        """
        self.pool = _started(self.executor, self.run, self.interrupt)
        self.watch.ended = False
        return self.pool is not None

    def _submit(self, indices: list[int], *, alone: bool) -> None:
        assert self.pool is not None
        note = self.watch.take()
        jobs = [self.jobs[index] for index in indices]
        expected = fingerprint.fingerprint()
        try:
            future = self.pool.submit(
                run_chunk, self.run, jobs, note, expected=expected
            )
        except Exception as error:
            # The pool broke, or was shut down, since it was last used.
            future = Future()
            future.set_exception(error)
            self._drop_pool()
        self.in_flight[future] = _Chunk(indices, alone, note)
        future.add_done_callback(self.back.put)

    def _results(self, chunk: _Chunk, future: Future[Outcomes[R]]) -> list[R]:
        answer = future.result()
        if isinstance(answer, str):
            raise WorkersError(_refused(answer))
        outcomes, seconds = answer
        if chunk.alone:
            self.suspects.popleft()
        else:
            self.chunks.observe(chunk.indices, seconds)
        results = [
            (
                self.failed(self.jobs[index], outcome.error)
                if isinstance(outcome, Failure)
                else outcome
            )
            for index, outcome in zip(chunk.indices, outcomes, strict=True)
        ]
        self._go_on(chunk.indices, results)
        return results

    def _go_on(self, indices: list[int], results: list[R]) -> None:
        """Queue jobs that have replaced finished jobs, in the same chunk."""
        pairs = zip(indices, results, strict=True)
        going = [index for index, result in pairs if self.goes_on(index, result)]
        for index in going:
            self.attempts.pop(index, None)
        if going:
            self.again.append(going)

    def _judged(
        self, chunk: _Chunk, error: BaseException, verdict: Overrun | None
    ) -> list[R]:
        """Return the certain results of a lost chunk; its remaining jobs run again."""
        if verdict is not None:
            return self._ended(chunk, verdict, others_go_on=False)
        if isinstance(error, JobEndedError):
            return self._ended(chunk, error.verdict, others_go_on=True)
        if isinstance(error, ConnectionLostError) or (
            self.watch.ended and isinstance(error, BrokenExecutor)
        ):
            return self._innocent(chunk)
        if not chunk.alone and isinstance(error, BrokenExecutor):
            self.suspects.extend(self.chunks.split(chunk.indices))
            return []
        if len(chunk.indices) == 1:
            return self._tried(chunk, error)
        parts = self.chunks.split(chunk.indices)
        if chunk.alone:
            self.suspects.popleft()
            self.suspects.extendleft(reversed(parts))
        else:
            self.again.extend(parts)
        return []

    def _tried(self, chunk: _Chunk, error: BaseException) -> list[R]:
        """Return the failed result of a job that was lost MAX_ATTEMPTS times alone.

        A job that was lost fewer times runs again.
        """
        [index] = chunk.indices
        self.attempts[index] += error.times if isinstance(error, WorkerDiedError) else 1
        if self.attempts[index] < MAX_ATTEMPTS:
            return self._innocent(chunk)
        if chunk.alone:
            self.suspects.popleft()
        return [self.failed(self.jobs[index], _verdict(error, self.attempts[index]))]

    def _ended(self, chunk: _Chunk, verdict: Overrun, *, others_go_on: bool) -> list[R]:
        """Return the result of the job that exceeded a limit.

        There is no result if earlier jobs of the worker may have filled the memory:
        then the job runs again.
        """
        if chunk.alone:
            [index] = self.suspects.popleft()
        else:
            index = chunk.indices.pop(verdict.position)
            self._innocent(chunk)
            self.attempts[index] += others_go_on
            if not verdict.late and not others_go_on:
                self.suspects.append([index])
                return []
            if not verdict.late and self.attempts[index] == 1:
                self.again.append([index])
                return []
        return [
            (self.overdue if verdict.late else self.failed)(
                self.jobs[index], verdict.error
            )
        ]

    def _innocent(self, chunk: _Chunk) -> list[R]:
        """Return no result; the jobs of the chunk run again."""
        if chunk.indices and not chunk.alone:
            self.again.append(chunk.indices)
        return []

    def _drop_pool(self) -> None:
        self.executor.stop()
        self.pool = None


def _started(
    executor: ExecutorFactory, run: Callable[[J], R], interrupt: HeldInterrupt
) -> Executor | None:
    """Return a pool that has answered once; None if there is no pool yet.

    Without this check, all jobs would fail if workers cannot start.
    """
    failure: Exception | None = None
    for _ in range(MAX_ATTEMPTS):
        try:
            pool = executor.start()
            expected = fingerprint.fingerprint()
            answer = pool.submit(run_chunk, run, [], None, expected=expected)
            while not wait([answer], POLL_SECONDS).done:
                if interrupt.asked:
                    return None
                executor.check()
            refusal = answer.result()
        except (NotYetError, ConnectionLostError):
            return None
        except WorkersError:
            raise
        except Exception as error:
            executor.stop()
            failure = error
        else:
            if isinstance(refusal, str):
                raise WorkersError(_refused(refusal))
            return pool
    edited = fingerprint.edited()  # which may be why, or not
    changed = f"; {_refused(f'other code in {edited}')}" if edited else ""
    raise WorkersError(
        f"no worker process can be given a job: {failure}{changed}"
    ) from failure


def _error(future: Future[T]) -> BaseException | None:
    return (
        ConnectionLostError("cancelled") if future.cancelled() else future.exception()
    )


def _refused(differences: str) -> str:
    changed = "the code or its libraries have changed since this launch began"
    return (
        f"{changed}: {differences}; finished trials are stored:"
        " launch again to resume with the present code"
    )


def _verdict(error: BaseException, times: int) -> str:
    if isinstance(error, BrokenExecutor | WorkerDiedError):
        return (
            f"worker process died {times} times while running this trial alone: {error}"
        )
    return f"no result came back in {times} attempts: {type(error).__name__}: {error}"
