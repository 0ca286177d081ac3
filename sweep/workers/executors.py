"""Engines that run jobs in this process, or in worker processes on this machine.

An engine is an `ExecutorFactory`: the number of workers, `start` and `stop`, and a
keeper of the limits of jobs. `cluster.py` has another engine.
"""

import glob
import os
import queue
import secrets
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Executor, Future
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, ParamSpec, Protocol, TypeVar

from sweep.store import end, end_with, here, started
from sweep.surroundings import SAFE_PATH, SETTINGS, ignore_settings, safe_path
from sweep.trial import SIGNALS, deaf

if TYPE_CHECKING:
    from sweep.workers.flying import Flying
    from sweep.workers.watch import Limits, Overrun, Watching

T = TypeVar("T")
P = ParamSpec("P")

IDLE_SECONDS = 30.0
UNNOTICED_SECONDS = 1.0
SHARED_MEMORY = Path("/dev/shm")
"""Folder in which Linux stores named semaphores."""
SEMAPHORE = "boidsweep"
"""Part of the names of boidsweep's semaphores."""
PATIENCE_SECONDS = 5.0
ONE_THREAD = {
    f"{library}_NUM_THREADS": "1"
    for library in ("NUMBA", "OMP", "OPENBLAS", "MKL", "BLIS", "VECLIB_MAXIMUM")
}


class NotYetError(Exception):
    """There is no executor now, but a later request may succeed."""


class ConnectionLostError(BrokenExecutor):
    """The outcome of a chunk is unknown: the connection to the worker was cut.

    No job is the cause.
    """


class WorkerDiedError(Exception):
    """A single chunk is lost: worker processes ended while they ran the chunk.

    Attributes
    ----------
    times : int
        Number of processes that ended, perhaps 0.
    """

    def __init__(self, times: int, message: str) -> None:
        super().__init__(message)
        self.times = times


class SpoiltWorkerError(Exception):
    """A single chunk is lost, and the worker cannot run another chunk.

    The worker cannot tell which job was the cause, so all workers must be replaced. No
    job of another chunk is the cause.
    """


class JobEndedError(Exception):
    """A single chunk is lost: a job of the chunk exceeded a limit.

    The worker was ended for this reason; `verdict` describes the job.
    """

    def __init__(self, verdict: "Overrun") -> None:
        super().__init__(verdict.error)
        self.verdict = verdict


class ExecutorFactory(Protocol):
    """Interface of an engine for the drive loop.

    All methods may be called repeatedly. A future fails with a BrokenExecutor if the
    executor and all submitted chunks are lost. If only one chunk is lost, its future
    fails with a different error.
    """

    @property
    def workers(self) -> int:
        """Number of jobs that can run at once, now."""

    def start(self) -> Executor:
        """Return the running executor, or else a new one.

        Raises NotYetError if a later call may succeed.
        """

    def stop(self) -> None:
        """End the executor at once, and return after the end of all processes.

        Running chunks end too, if the engine can end them.
        """

    def check(self) -> None:
        """Break an executor that is broken but has not noticed.

        The drive loop calls this while no result arrives.
        """

    def watch(self, limits: "Limits") -> "Watching":
        """Return the keeper of the limits of jobs."""

    @property
    def flying(self) -> "Flying":
        """Way in which the workers run trials; the drive loop ignores this property."""


class FliesOnProcessors:
    """An engine that runs trials on processors."""

    @property
    def flying(self) -> "Flying":
        """Way in which the workers run trials."""
        from sweep.workers.flying import OnProcessors

        return OnProcessors()


class _InProcess(Executor):
    def submit(
        self, fn: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs
    ) -> Future[T]:
        future: Future[T] = Future()
        future.set_result(fn(*args, **kwargs))
        return future


@dataclass(frozen=True)
class Serial(FliesOnProcessors):
    """The engine of this process, for debugging and tests.

    A job that crashes ends this process.
    """

    workers: int = 1

    def start(self) -> Executor:
        """Return an executor that runs each job on submission."""
        return _InProcess()

    def stop(self) -> None:
        """Do nothing: no job is running between two calls."""

    def check(self) -> None:
        """Do nothing: no job can be lost within one process."""

    def watch(self, limits: "Limits") -> "Watching":  # noqa: ARG002
        """Return a keeper without limits: a process cannot limit its own jobs."""
        from sweep.workers.watch import LimitKeeper

        return LimitKeeper()


@dataclass
class Loky(FliesOnProcessors):
    """The engine of a pool of processes on this machine.

    Each process has one thread per numerical library. The pool stays warm for a later
    drive with this object; idle processes end after IDLE_SECONDS. On Linux a process
    also ends with the thread that started the process. On further systems it ends
    within a second after the starting process.

    Attributes
    ----------
    workers : int
        Number of processes.
    initializer : callable, optional
        Called once in every new process, for example to warm caches.
    """

    workers: int
    initializer: Callable[[], None] | None = None
    _pool: "_Pool | None" = field(default=None, init=False, repr=False)
    _missed: float | None = field(default=None, init=False, repr=False)

    def start(self) -> Executor:
        """Return the running pool, or else a new one."""
        from joblib.externals.loky import ProcessPoolExecutor

        if self._pool is None:
            self._missed = None
            if sys.platform == "linux":
                _own_semaphores()
            with safe_path(), _deaf_workers():
                # A private pool: any joblib user in this process could resize or shut
                # down the shared pool of loky.
                pool = ProcessPoolExecutor(
                    max_workers=self.workers,
                    timeout=IDLE_SECONDS,
                    initializer=_prepare_worker,
                    initargs=(os.getpid(), started(os.getpid()), self.initializer),
                    # Processes that start later have it, too.
                    env=ONE_THREAD | {SAFE_PATH: "1"},
                )
                with deaf():  # once more: the pool's tracker has lifted the mask
                    pool.submit(int)
            self._pool = _Pool(pool)
        running: Executor = self._pool.pool
        return running

    def stop(self) -> None:
        """End the pool and all processes at once."""
        if self._pool is None:
            return
        try:
            self._pool.take_back()
            self._pool.pool.shutdown(wait=False, kill_workers=True)
            self._pool.manager.join(PATIENCE_SECONDS)
        finally:
            # An interrupt leaves no process either, nor does a pool that waits for a
            # result in vain.
            self._pool.end()
            self._pool.manager.join()
            self._pool.join_feeder()
        self._pool = None

    def check(self) -> None:
        """End a pool that waits for the rest of a result of a killed process.

        Otherwise the pool would wait forever.
        """
        if self._pool is None or not self._pool.lacks_a_process():
            self._missed = None
        elif self._missed is None:
            self._missed = time.monotonic()
        elif time.monotonic() - self._missed > UNNOTICED_SECONDS:
            self._pool.end()

    def watch(self, limits: "Limits") -> "Watching":
        """Return a keeper of limits: a thread that ends child processes."""
        from sweep.workers.watch import LimitKeeper

        return LimitKeeper(limits, 2 * self.workers)


class _Pool:
    """A running loky pool, and parts that the pool itself drops at the end."""

    def __init__(self, pool: Any) -> None:
        self.pool = pool
        self.manager: threading.Thread = pool._executor_manager_thread
        self._processes = pool._processes
        self._writer = pool._result_queue._writer
        self._jobs = pool._call_queue

    def lacks_a_process(self) -> bool:
        """Return whether a process is dead that the pool considers alive."""
        return any(
            process.exitcode is not None for process in list(self._processes.values())
        )

    def end(self) -> None:
        """Kill the processes, and tell the pool's reader that no result follows."""
        for process in list(self._processes.values()):
            if process.exitcode is None:
                end(process.pid)
        if not self._writer.closed:
            self._writer.close()

    def take_back(self) -> None:
        """Take back the jobs that no process has yet; their futures fail at shutdown.

        loky's manager drops these jobs at shutdown, and then raises a KeyError for the
        first number that still waits.
        """
        with suppress(queue.Empty):
            while True:
                self.pool._work_ids.get_nowait()

    def join_feeder(self) -> None:
        """Wait for the thread that sends jobs to the processes, which have ended.

        The thread may hold the last reference to a semaphore. If the interpreter ended
        while the thread removes the semaphore, loky's tracker would miss a semaphore.
        """
        self._jobs.close()
        self._jobs._reader.close()  # a thread that still writes gets an error and ends
        feeder = self._jobs._thread
        if feeder is not None:
            feeder.join()


@contextmanager
def _deaf_workers() -> Iterator[None]:
    """Let processes that are started inside ignore the signals that stop a launch.

    Where the system supports this, the signals are ignored from the first instruction
    on.
    """
    with deaf() as so:
        if so:
            from multiprocessing import resource_tracker

            # Starting it later, between the workers, would lift the mask.
            resource_tracker.ensure_running()
        yield


def _own_semaphores() -> None:
    """Include the process in names of semaphores, and remove those of dead processes.

    loky's resource tracker removes semaphores after the end of a process. If the
    tracker is killed too, for example with a process group or container, semaphores
    remain.
    """
    from joblib.externals.loky.backend.synchronize import SemLock

    def name() -> str:
        return f"/{here()}~{os.getpid()}~{SEMAPHORE}-{secrets.token_hex(4)}"

    SemLock._make_name = staticmethod(name)
    for file in SHARED_MEMORY.glob(f"sem.{glob.escape(here())}~*~{SEMAPHORE}-*"):
        process = file.name.split("~")[1]
        if process.isdecimal() and started(int(process)) is None:
            with suppress(OSError):  # another launch has, or it is another user's
                file.unlink()


def _prepare_worker(
    coordinator: int, began: str | None, initializer: Callable[[], None] | None
) -> None:
    # Ctrl-C in a terminal reaches the whole process group; the coordinator alone
    # decides what it means.
    for number in SIGNALS:
        signal.signal(number, signal.SIG_IGN)
    end_with(coordinator, began)
    ignore_settings(*SETTINGS)
    if initializer is not None:
        initializer()


def worker_count(workers: int) -> int:
    """Return the number of workers on this machine; 0 means one per core."""
    return workers or core_count()


def core_count() -> int:
    """Return the number of cores that this process may use."""
    return (
        len(os.sched_getaffinity(0))
        if hasattr(os, "sched_getaffinity")
        else os.cpu_count() or 1
    )
