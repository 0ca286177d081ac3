"""Engines that run jobs in this process, or in worker processes on this machine.

An engine is an `ExecutorFactory`: its number of workers, `start` and `stop`, and the
keeper of the limits of a job. `cluster.py` has another engine.
"""

import glob
import os
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
"""Folder in which Linux keeps semaphores with names."""
SEMAPHORE = "boidsweep"
"""Part of the names of our semaphores."""
PATIENCE_SECONDS = 5.0
ONE_THREAD = {
    f"{library}_NUM_THREADS": "1"
    for library in ("NUMBA", "OMP", "OPENBLAS", "MKL", "BLIS", "VECLIB_MAXIMUM")
}


class NotYetError(Exception):
    """There is no executor now, but there may be one soon: ask again."""


class ConnectionLostError(BrokenExecutor):
    """The fate of a chunk is not known, as the connection to its worker was cut.

    No job is to blame.
    """


class WorkerDiedError(Exception):
    """One chunk is lost, and no other: worker processes ended while they ran it.

    Attributes
    ----------
    times : int
        Number of these processes, perhaps 0.
    """

    def __init__(self, times: int, words: str) -> None:
        super().__init__(words)
        self.times = times


class SpoiltWorkerError(Exception):
    """One chunk is lost, and its worker cannot run another one.

    The worker cannot tell which job was to blame: all workers are to be replaced. No
    other chunk is to blame.
    """


class JobEndedError(Exception):
    """One chunk is lost, and no other: one of its jobs was beyond a limit.

    So its worker was ended; `verdict` tells about the job.
    """

    def __init__(self, verdict: "Overrun") -> None:
        super().__init__(verdict.error)
        self.verdict = verdict


class ExecutorFactory(Protocol):
    """An engine, as the drive loop uses it.

    All methods may be called repeatedly. A future fails with a BrokenExecutor if its
    executor and everything in flight are lost, and with any other error if only its
    chunk is lost.
    """

    @property
    def workers(self) -> int:
        """Number of jobs that can run at once, now."""

    def start(self) -> Executor:
        """Return the running executor, a new one if there is none.

        Raises NotYetError where there may be one soon.
        """

    def stop(self) -> None:
        """End the executor at once, and return when its processes are gone.

        Running chunks end too, as far as they can be ended.
        """

    def check(self) -> None:
        """Break an executor that has not noticed that it is broken.

        The drive loop calls this while nothing comes back.
        """

    def watch(self, limits: "Limits") -> "Watching":
        """Return what keeps limits of jobs."""

    @property
    def flying(self) -> "Flying":
        """Way in which its workers run trials; the drive loop does not use it."""


class FliesOnProcessors:
    """An engine whose workers run trials on processors."""

    @property
    def flying(self) -> "Flying":
        """Way in which its workers run trials."""
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
    """The engine of this process, for debugging and tests; a crashing job ends it."""

    workers: int = 1

    def start(self) -> Executor:
        """Return an executor that runs each job as it is submitted."""
        return _InProcess()

    def stop(self) -> None:
        """Do nothing: no job is running between two calls."""

    def check(self) -> None:
        """Do nothing: no job can be lost within one process."""

    def watch(self, limits: "Limits") -> "Watching":  # noqa: ARG002
        """Return a keeper without limits: none can be kept from within the process."""
        from sweep.workers.watch import LimitKeeper

        return LimitKeeper()


@dataclass
class Loky(FliesOnProcessors):
    """The engine of a pool of processes on this machine.

    Each process has one thread per numerical library. The pool stays warm for a later
    drive with the same object; idle processes end by themselves after IDLE_SECONDS. On
    Linux they also end with the thread that started them, elsewhere within a second
    after the process that started them.

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
        """Return the running pool, a new one if there is none."""
        from joblib.externals.loky import ProcessPoolExecutor

        if self._pool is None:
            self._missed = None
            if sys.platform == "linux":
                _own_semaphores()
            with safe_path(), _deaf_workers():
                # A pool of our own: loky's shared one could be resized or shut down
                # under us by any joblib user.
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
        """End the pool at once; its processes are gone afterwards."""
        if self._pool is None:
            return
        try:
            self._pool.pool.shutdown(wait=False, kill_workers=True)
            self._pool.manager.join(PATIENCE_SECONDS)
        finally:
            # An interrupt leaves no process either, nor does a pool that waits for a
            # result in vain.
            self._pool.end()
            self._pool.manager.join()
        self._pool = None

    def check(self) -> None:
        """End a pool that waits for the rest of a result whose sender was killed.

        Without this it would wait for ever.
        """
        if self._pool is None or not self._pool.lacks_a_process():
            self._missed = None
        elif self._missed is None:
            self._missed = time.monotonic()
        elif time.monotonic() - self._missed > UNNOTICED_SECONDS:
            self._pool.end()

    def watch(self, limits: "Limits") -> "Watching":
        """Return what keeps limits: a thread of this process ends its children."""
        from sweep.workers.watch import LimitKeeper

        return LimitKeeper(limits, 2 * self.workers)


class _Pool:
    """A running loky pool, with the parts that outlive its own references to them."""

    def __init__(self, pool: Any) -> None:
        self.pool = pool
        self.manager: threading.Thread = pool._executor_manager_thread
        self._processes = pool._processes
        self._writer = pool._result_queue._writer

    def lacks_a_process(self) -> bool:
        """Return whether a process is dead that the pool believes to be alive."""
        return any(
            process.exitcode is not None for process in list(self._processes.values())
        )

    def end(self) -> None:
        """Kill the processes, and tell the pool's reader that nothing follows."""
        for process in list(self._processes.values()):
            if process.exitcode is None:
                end(process.pid)
        if not self._writer.closed:
            self._writer.close()


@contextmanager
def _deaf_workers() -> Iterator[None]:
    """Let processes that are started inside ignore the signals that stop a launch.

    Where the system can do that, they ignore them from their first instruction on.
    """
    with deaf() as so:
        if so:
            from multiprocessing import resource_tracker

            # Starting it later, between the workers, would lift the mask.
            resource_tracker.ensure_running()
        yield


def _own_semaphores() -> None:
    """Name semaphores by their process from now on, and remove those of dead processes.

    loky's resource tracker removes semaphores when a process ends, however it ends; but
    not where it is killed too, with a whole process group or container.
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
