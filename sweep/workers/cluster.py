"""A dask.distributed cluster as an engine.

The workers may be on any machine; only this process sends jobs and stores results.

A chunk is a task of the cluster. The content of a chunk is sent as bytes, so that the
scheduler does not need this package. A worker compares code and libraries before it
unpacks the content (`remote.py`). Workers that join late get work. No work is lost with
workers that leave. While there are no workers, or while the scheduler is away, the
launch waits and warns. The cluster may have further users: boidsweep never shuts the
cluster down, and cancels only its own tasks.

A scheduler that has never answered may have a wrong address: the launch tries to
connect for CONNECT_SECONDS, even if the scheduler closes or rejects connections. A
scheduler that has answered before may be away for AWAY_SECONDS.

Trials hold Python's lock, so a worker of several threads is rejected: two trials in two
threads took 1.14 times as long as one after the other. A running task that is cancelled
continues to its end, and the result is dropped. `sweep.workers.warden` enforces the
limits of trials by ending the worker. Without a nanny the worker is not replaced.
"""

import logging
import time
from concurrent.futures import Executor
from contextlib import suppress
from dataclasses import dataclass, field

from sweep.errors import WorkersError
from sweep.workers.connection import Connection, ConnectionImpossibleError, exposed
from sweep.workers.executors import FliesOnProcessors, NotYetError
from sweep.workers.remote import Post
from sweep.workers.tasks import Tasks
from sweep.workers.watch import NO_LIMITS, JobNote, LimitKeeper, Limits, Watching

CONNECT_SECONDS = 10.0
"""Seconds that a scheduler may take to answer for the first time."""
AGAIN_SECONDS = 5.0
AWAY_SECONDS = 600.0
"""Seconds that a scheduler that has answered may be away."""
PAUSE_SECONDS = 0.2
PLAIN = (
    "%s: the connection is not encrypted: anybody who can reach the scheduler can run"
    " code on its workers and on this machine. Use a private network, or tls://"
    " (see the guide, More than one machine)"
)
LOG = logging.getLogger("sweep")


@dataclass
class Dask(FliesOnProcessors):
    """The engine of a dask cluster, found by address or by file.

    A scheduler that is lost after its first answer may be away for AWAY_SECONDS. The
    limit also applies to a scheduler that is lost repeatedly before its workers are
    known. Chunks that were not finished are sent again.

    Attributes
    ----------
    address : str or None
        Address of the scheduler of the cluster, such as ``tcp://10.0.0.1:8786``.
    scheduler_file : str or None
        File in which the scheduler has written its address.
    """

    address: str | None = None
    scheduler_file: str | None = None
    _pool: "Tasks | None" = field(default=None, init=False, repr=False)
    _lost: float | None = field(default=None, init=False, repr=False)
    _last_warning: str = field(default="", init=False, repr=False)
    _warned: bool = field(default=False, init=False, repr=False)

    @property
    def workers(self) -> int:
        """Number of threads that the cluster has now, one per worker."""
        return self._pool.threads() if self._pool else 0

    def connect(self) -> None:
        """Check that a scheduler answers and that present workers can run our trials.

        The check may precede any work. Raises WorkersError if no scheduler answers, or
        if a worker differs from this process.
        """
        with suppress(NotYetError):
            self.start()

    def start(self) -> Executor:
        """Return the executor of the cluster, and connect first if necessary.

        Raises NotYetError while there is no worker, or the scheduler is away. Raises
        WorkersError if no scheduler answers, or if a worker differs from this process.
        """
        try:
            if self._pool is None:
                self._pool = Tasks(self._connection())
            self._pool.ask_workers(everyone=True)
        except OSError as error:
            self.stop()
            raise self._away(error) from error
        self._lost = None
        if not self._pool.threads():
            raise self._waiting(f"no worker at {self._where}; waiting for one")
        self._last_warning = ""
        return self._pool

    def stop(self) -> None:
        """Cancel the tasks of this process and close the connection."""
        if self._pool is not None:
            pool = self._pool
            self._pool = None
            self._lost = self._lost or time.monotonic()
            pool.end()

    def check(self) -> None:
        """Give up all unfinished tasks if the connection is lost.

        Otherwise dask would wait for an answer of the scheduler forever.
        """
        if self._pool is None:
            return
        if not self._pool.connected():
            self._pool.end()
        elif not self._pool.threads():
            self._waiting(f"no worker at {self._where}; waiting for one")
        else:
            self._last_warning = ""

    def watch(self, limits: Limits) -> Watching:
        """Return the keeper of the limits of jobs: a warden next to each worker."""
        return _Posts(limits)

    @property
    def _where(self) -> str:
        return self.address or f"the scheduler of {self.scheduler_file}"

    def _connection(self) -> Connection:
        """Return a new connection.

        Raises OSError if a scheduler that has answered before does not answer.
        """
        seconds = CONNECT_SECONDS if self._lost is None else AGAIN_SECONDS
        end = time.monotonic() + seconds
        while True:
            try:
                connection = Connection(self.address, self.scheduler_file, seconds)
                break
            except ConnectionImpossibleError as error:
                raise WorkersError(
                    f"{self._where}: no connection can be made: {error}"
                ) from error
            except OSError as error:
                if self._lost is not None:
                    raise
                seconds = end - time.monotonic()
                if seconds <= 0:
                    raise WorkersError(
                        f"no dask scheduler answers at {self._where}: {error}"
                    ) from error
                self._waiting(
                    f"{self._where} does not answer yet;"
                    f" trying for {CONNECT_SECONDS:.0f} s"
                )
            time.sleep(PAUSE_SECONDS)
        if not self._warned and exposed(connection.address):
            LOG.warning(PLAIN, connection.address)
        self._warned = True
        return connection

    def _away(self, error: OSError) -> Exception:
        """Return the error for a lost scheduler, by the duration of the absence."""
        assert self._lost is not None
        minutes = f"{AWAY_SECONDS / 60:.0f} minutes"
        if time.monotonic() - self._lost > AWAY_SECONDS:
            away = (
                f"the dask scheduler at {self._where} has been away for {minutes}"
                f" ({error})"
            )
            return WorkersError(
                f"{away}; finished trials are stored, and the same command resumes"
                " the run"
            )
        return self._waiting(
            f"the connection to {self._where} is lost;"
            f" waiting up to {minutes} for it to come back"
        )

    def _waiting(self, message: str) -> NotYetError:
        if message != self._last_warning:
            LOG.warning(message)
            self._last_warning = message
        return NotYetError(message)


class _Posts(LimitKeeper):
    """Keeper that sends limits together with each chunk."""

    def __init__(self, limits: Limits) -> None:
        super().__init__()
        self._post = None if limits == NO_LIMITS else Post(limits)

    def take(self) -> JobNote | None:
        return self._post
