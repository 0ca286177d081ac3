"""The engines that run jobs: in this process, or in worker processes on this machine.

An engine is an `ExecutorFactory`: its number of workers, `start` and `stop`.
"""

import os
import signal
from collections.abc import Callable
from concurrent.futures import Executor, Future
from dataclasses import dataclass, field
from multiprocessing import resource_tracker
from typing import Any, ParamSpec, Protocol, TypeVar

T = TypeVar("T")
P = ParamSpec("P")

IDLE_SECONDS = 30.0
ONE_THREAD = {
    f"{library}_NUM_THREADS": "1" for library in ("NUMBA", "OMP", "OPENBLAS", "MKL", "BLIS", "VECLIB_MAXIMUM")
}


class ExecutorFactory(Protocol):
    """What the drive loop asks of an engine.

    `start` returns the running executor, a new one if there is none; `stop` ends it at once, running chunks
    included, and returns when its processes are gone. Both may be called repeatedly.
    """

    @property
    def workers(self) -> int: ...

    def start(self) -> Executor: ...

    def stop(self) -> None: ...


class _InProcess(Executor):
    def submit(self, fn: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        future: Future[T] = Future()
        future.set_result(fn(*args, **kwargs))
        return future


@dataclass(frozen=True)
class Serial:
    """Runs every job in this process, for debugging and tests: a job that crashes takes us along."""

    workers: int = 1

    def start(self) -> Executor:
        return _InProcess()

    def stop(self) -> None:
        """Nothing is running between two calls."""


@dataclass
class Loky:
    """Runs jobs in `workers` processes on this machine, each with one thread per numerical library.

    `initializer` is called once in every new process, e.g. to warm caches. The pool stays warm for a later
    drive with the same object; idle processes leave by themselves after half a minute.
    """

    workers: int
    initializer: Callable[[], None] | None = None
    _pool: Any = field(default=None, init=False, repr=False)

    def start(self) -> Executor:
        from joblib.externals.loky import ProcessPoolExecutor

        if self._pool is None:
            # A pool of our own: loky's shared one could be resized or shut down under us by any joblib user.
            self._pool = ProcessPoolExecutor(
                max_workers=self.workers,
                timeout=IDLE_SECONDS,
                initializer=_prepare_worker,
                initargs=(self.initializer,),
                env=ONE_THREAD,
            )
            _spawn(self._pool)
        pool: Executor = self._pool
        return pool

    def stop(self) -> None:
        pool, self._pool = self._pool, None
        if pool is not None:
            pool.shutdown(wait=True, kill_workers=True)


def _spawn(pool: Executor) -> None:
    """Start the pool's processes deaf to Ctrl-C from their first instruction on, not only once prepared."""
    resource_tracker.ensure_running()  # starting it later, between the workers, would lift the mask
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        pool.submit(int)
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)


def _prepare_worker(initializer: Callable[[], None] | None) -> None:
    # Ctrl-C in a terminal reaches the whole process group; the coordinator alone decides what it means.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if initializer is not None:
        initializer()


def core_count() -> int:
    """The number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
