"""The tasks of this process on a dask cluster, over one connection, and the workers.

A worker that dies loses about two tasks: the running task and the next task. Dask gives
the two tasks to further workers, and gives up after some deaths, but only the running
task can be the cause. So each chunk tells the scheduler when it begins, and only later
deaths count against a job.
"""

import asyncio
import pickle
import time
from collections import Counter
from collections.abc import Callable, Iterable
from concurrent.futures import CancelledError, Executor, Future, InvalidStateError
from contextlib import suppress
from typing import Any, ParamSpec, TypeVar
from uuid import uuid4

from sweep.errors import WorkersError
from sweep.workers.connection import Connection
from sweep.workers.executors import ConnectionLostError, JobEndedError, WorkerDiedError
from sweep.workers.fingerprint import differences, fingerprint
from sweep.workers.watch import Overrun

T = TypeVar("T")
P = ParamSpec("P")

ANSWER_SECONDS = 5.0
INTRODUCE_SECONDS = 30.0
ASK_SECONDS = 2.0
MOST_NAMED = 4
INTRODUCE = "__import__('sweep.workers.remote', fromlist=['']).introduce()"
PERFORM = "__import__('sweep.workers.remote', fromlist=['']).perform(task)"
LOST = "the connection to the cluster is lost"


class Tasks(Executor):
    """An executor of tasks on a cluster, with knowledge of the workers."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._client = connection.client
        self._topic = f"sweep-{uuid4().hex}"
        self._begun: Counter[str] = Counter()
        self._futures: dict[str, Future[Any]] = {}
        self._sent: dict[str, Any] = {}
        self._checked: set[str] = set()
        self._threads: dict[str, int] = {}
        self._asked_at = -ASK_SECONDS
        self._client.subscribe_topic(self._topic, self._note)

    def submit(
        self, fn: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs
    ) -> Future[T]:
        """Send a task, and return a future.

        If the connection is lost, the method raises ConnectionLostError, and so does
        the future. The future raises WorkerDiedError if dask gives up the task.

        Parameters
        ----------
        fn : callable
            Function of the task; must allow pickling.
        *args, **kwargs
            Arguments of the function.
        """
        from distributed.protocol.pickle import dumps

        if not self.connected():
            raise ConnectionLostError(LOST)
        name = f"sweep-{uuid4().hex}"
        work = dumps((fn, args, kwargs))  # type: ignore[no-untyped-call]
        task = pickle.dumps((self._topic, name, fingerprint(), work))
        future: Future[T] = Future()
        self._futures[name] = future
        self._sent[name] = self._client.submit(
            eval, PERFORM, {"task": task}, key=name, pure=False
        )
        self._client.loop.add_callback(self._deliver, name, self._sent[name])
        return future

    def _note(self, event: tuple[float, Any]) -> None:
        """Note that a task begins, or that its worker is being ended."""
        _, message = event
        if isinstance(message, str):
            self._begun[message] += 1
            return
        name, position, late, error = message
        self._settle(name, None, JobEndedError(Overrun(position, late, error)))
        if sent := self._sent.pop(name, None):
            self._client.loop.add_callback(
                self._client.cancel, [sent], asynchronous=True, force=True
            )

    async def _deliver(self, name: str, sent: Any) -> None:
        """Set the outcome of a task in its future; runs in the thread of the client."""
        result: object = None
        failure: Exception | None = None
        try:
            packed = await self._client.gather(sent, asynchronous=True)
        except (CancelledError, asyncio.CancelledError):
            failure = ConnectionLostError(LOST)
        except Exception as error:
            failure = self._failure(name, sent, error)
        else:
            result, failure = _unpacked(packed)
        self._sent.pop(name, None)
        self._settle(name, result, failure)

    def _failure(self, name: str, sent: Any, error: Exception) -> Exception:
        """Return the error of a task, or else an error of the connection."""
        from distributed.comm.core import CommClosedError

        if type(error).__name__ == "KilledWorker":
            return WorkerDiedError(self._begun[name], "dask gave it up")
        if (
            sent.status != "error"
            or isinstance(error, CommClosedError)
            or not self.connected()
        ):
            return ConnectionLostError(str(error))
        self._checked.clear()  # a worker without this code may raise any error
        return error

    def _settle(self, name: str, result: object, failure: Exception | None) -> None:
        future = self._futures.pop(name, None)
        self._begun.pop(name, None)
        if future is None:
            return
        with suppress(InvalidStateError):
            if failure is None:
                future.set_result(result)
            else:
                future.set_exception(failure)

    def connected(self) -> bool:
        """Return whether the scheduler is connected, as far as is known."""
        return self._connection.alive()

    def threads(self) -> int:
        """Return the number of threads of all workers, known at most ASK_SECONDS ago.

        Raises WorkersError for a worker that cannot run the trials. New workers are
        asked for fingerprints only after an error that different code may explain;
        otherwise a worker reports its fingerprint with its first task.
        """
        if time.monotonic() - self._asked_at > ASK_SECONDS:
            with suppress(OSError):
                self.ask_workers(everyone=not self._checked)
        return sum(self._threads.values())

    def ask_workers(self, *, everyone: bool) -> None:
        """Find the present workers, and check that each has one thread.

        Raises OSError if the scheduler does not answer, and WorkersError for a worker
        that cannot run the trials.

        Parameters
        ----------
        everyone : bool
            Whether to ask all new workers for fingerprints.
        """
        self._asked_at = time.monotonic()
        scheduler = self._client.scheduler
        if scheduler is None or not self.connected():
            raise ConnectionError(LOST)
        self._threads = self._client.sync(
            scheduler.ncores, callback_timeout=ANSWER_SECONDS
        )
        several = [
            f"{address} has {number}"
            for address, number in self._threads.items()
            if number > 1
        ]
        if several:
            raise WorkersError(
                "a worker must have one thread, because trials hold Python's lock:"
                f' {_some(several)}; start workers with "--nworkers N --nthreads 1"'
            )
        unknown = self._threads.keys() - self._checked
        if unknown and everyone:
            self._ask(sorted(unknown))

    def _ask(self, workers: list[str]) -> None:
        async def answering() -> Any:
            return await self._client.run(
                eval, INTRODUCE, workers=workers, on_error="return"
            )

        try:
            answers = self._client.sync(answering, callback_timeout=INTRODUCE_SECONDS)
        except TimeoutError:
            # A slow or hanging worker reports its fingerprint with its first task.
            return
        foreign = []
        for address, answer in answers.items():
            if isinstance(answer, str):
                reason = differences(fingerprint(), answer)
            else:
                reason = (
                    ""
                    if isinstance(answer, OSError)
                    else f"{type(answer).__name__}: {answer}"
                )
            if reason:
                foreign.append(f"{address}: {reason}")
            else:
                self._checked.add(address)
        if foreign:
            raise WorkersError(
                f"workers have another environment than this process: {_some(foreign)}"
            )

    def end(self) -> None:
        """Close the connection, which cancels unfinished tasks."""
        self._connection.close()
        for name in list(self._futures):
            self._settle(name, None, ConnectionLostError("cancelled"))


def _unpacked(packed: bytes) -> tuple[object, Exception | None]:
    try:
        return pickle.loads(packed), None
    except Exception as error:
        return None, error


def _some(texts: Iterable[str]) -> str:
    listed = sorted(texts)
    more = f" and {len(listed) - MOST_NAMED} more" if len(listed) > MOST_NAMED else ""
    return "; ".join(listed[:MOST_NAMED]) + more
