"""A dask.distributed cluster as an engine: workers anywhere run the chunks, this process alone drives and stores.

A chunk is a task of the cluster. What it is goes there as bytes, so that the scheduler needs nothing of this package,
and a worker looks at its own code and libraries before it unpacks them (`remote.py`). Workers that join late get
work, those that leave lose none; while there are none, or while the scheduler is away, the launch waits and says so.
The cluster belongs to somebody: it is never shut down, only our tasks are cancelled.

A worker that dies takes two tasks or so with it, the one that it was at and the next. Dask gives both to others, and
after some deaths it gives both up, but only the first is to blame: each chunk tells the scheduler that it begins,
before it does, and what counts against a job is how often it had begun.

Trials hold Python's lock, so that a worker of several threads is refused: two trials in two threads took 1.14 times
as long as one after the other. A task that is cancelled while it runs goes on to its end, and its result is dropped.
Limits of trials hold as `sweep.running.warden` keeps them: a worker without a nanny that is ended is not replaced.
"""

import asyncio
import logging
import pickle
import time
from collections import Counter
from collections.abc import Callable, Iterable
from concurrent.futures import CancelledError, Executor, Future, InvalidStateError
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any, ParamSpec, TypeVar
from uuid import uuid4

from sweep.running.executors import ConnectionLostError, JobEndedError, NotYetError, WorkerDiedError, WorkersError
from sweep.running.fingerprint import differences, fingerprint
from sweep.running.remote import Post
from sweep.running.watch import NO_LIMITS, Limits, Place, Verdict, Watch, Watching

T = TypeVar("T")
P = ParamSpec("P")

CONNECT_SECONDS = 10.0
ANSWER_SECONDS = 5.0
AWAY_SECONDS = 600.0
"""How long a scheduler that has answered before may be away."""
LOOK_SECONDS = 2.0
MOST_NAMED = 4
INTRODUCE = "__import__('sweep.running.remote', fromlist=['']).introduce()"
PERFORM = "__import__('sweep.running.remote', fromlist=['']).perform(task)"
LOG = logging.getLogger("sweep")


@dataclass
class Dask:
    """Runs jobs on the cluster of the scheduler at `address`, or of the one that `scheduler_file` describes.

    `workers` is the number of threads that the cluster has now, one a worker. `connect` may be called before any work:
    it raises WorkersError where no scheduler answers, or a worker differs from this process. A scheduler that is lost
    afterwards may be away for AWAY_SECONDS; the chunks that were in flight go again.
    """

    address: str | None = None
    scheduler_file: str | None = None
    _pool: "_Tasks | None" = field(default=None, init=False, repr=False)
    _lost: float | None = field(default=None, init=False, repr=False)
    _said: str = field(default="", init=False, repr=False)

    @property
    def workers(self) -> int:
        return self._pool.threads() if self._pool else 0

    def connect(self) -> None:
        """Make sure that a scheduler answers, and that the workers it has now can run our trials."""
        with suppress(NotYetError):
            self.start()

    def start(self) -> Executor:
        if self._pool is None:
            self._pool = _Tasks(self._client())
            self._lost = None
        try:
            self._pool.look(everyone=True)
        except OSError as error:
            self.stop()
            raise self._waiting(f"{self._where} does not answer: {error}") from error
        if not self._pool.threads():
            raise self._waiting(f"no worker at {self._where}; waiting for one")
        self._said = ""
        return self._pool

    def stop(self) -> None:
        """Cancel our tasks and take leave."""
        if self._pool is not None:
            pool, self._pool, self._lost = self._pool, None, time.monotonic()
            pool.end()

    def check(self) -> None:
        """Give up what is in flight once the connection is gone: dask waits for a scheduler's answer for ever."""
        if self._pool is None:
            return
        if not self._pool.connected():
            self._pool.end()
        elif not self._pool.threads():
            self._waiting(f"no worker at {self._where}; waiting for one")
        else:
            self._said = ""

    def watch(self, limits: Limits) -> Watching:
        """A warden beside each worker."""
        return _Posts(limits)

    @property
    def _where(self) -> str:
        return self.address or f"the scheduler of {self.scheduler_file}"

    def _client(self) -> Any:
        from distributed import Client

        # What it says of lost connections, in many lines, is said by us in one.
        logging.getLogger("distributed.client").setLevel(logging.CRITICAL)
        first = self._lost is None
        timeout = CONNECT_SECONDS if first else ANSWER_SECONDS
        try:
            connect: Any = Client
            return connect(self.address, scheduler_file=self.scheduler_file, timeout=timeout, set_as_default=False)
        except (OSError, ValueError, ImportError) as error:
            if self._lost is None:
                raise WorkersError(f"no dask scheduler answers at {self._where}: {error}") from error
            if time.monotonic() - self._lost > AWAY_SECONDS:
                away = f"the dask scheduler at {self._where} has been away for {AWAY_SECONDS / 60:.0f} minutes"
                raise WorkersError(f"{away}; what is done is stored, and the same command goes on") from error
            raise self._waiting(f"the connection to {self._where} is lost; waiting for it to come back") from error

    def _waiting(self, words: str) -> NotYetError:
        if words != self._said:
            LOG.warning(words)
            self._said = words
        return NotYetError(words)


class _Posts(Watch):
    """Gives each chunk its limits to take along."""

    def __init__(self, limits: Limits) -> None:
        super().__init__()
        self._post = None if limits == NO_LIMITS else Post(limits)

    def take(self) -> Place | None:
        return self._post


class _Tasks(Executor):
    """Our tasks on a cluster, and what is known of its workers."""

    def __init__(self, client: Any) -> None:
        self._client = client
        self._topic = f"sweep-{uuid4().hex}"
        self._begun: Counter[str] = Counter()
        self._futures: dict[str, Future[Any]] = {}
        self._sent: dict[str, Any] = {}
        self._checked: set[str] = set()
        self._threads: dict[str, int] = {}
        self._looked = -LOOK_SECONDS
        client.subscribe_topic(self._topic, self._note)

    def submit(self, fn: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """Send a task. Its future fails with ConnectionLostError, or with WorkerDiedError where dask gives it up."""
        from distributed.protocol.pickle import dumps

        name = f"sweep-{uuid4().hex}"
        task = pickle.dumps((self._topic, name, fingerprint(), dumps((fn, args, kwargs))))  # type: ignore[no-untyped-call]
        future: Future[T] = Future()
        self._futures[name] = future
        self._sent[name] = self._client.submit(eval, PERFORM, {"task": task}, key=name, pure=False)
        self._client.loop.add_callback(self._deliver, name, self._sent[name])
        return future

    def _note(self, event: tuple[float, Any]) -> None:
        """A task begins, or the worker of one is being ended."""
        _, message = event
        if isinstance(message, str):
            self._begun[message] += 1
            return
        name, position, late, error = message
        self._settle(name, None, JobEndedError(Verdict(position, late, error)))
        if sent := self._sent.pop(name, None):
            self._client.loop.add_callback(self._client.cancel, [sent], asynchronous=True, force=True)

    async def _deliver(self, name: str, sent: Any) -> None:
        """Hand the outcome of a task over to its future; runs in the client's thread."""
        result: object = None
        failure: Exception | None = None
        try:
            result = pickle.loads(await self._client.gather(sent, asynchronous=True))
        except (CancelledError, asyncio.CancelledError):
            failure = ConnectionLostError("the connection to the cluster is lost")
        except Exception as error:
            failure = self._failure(name, error)
        self._sent.pop(name, None)
        self._settle(name, result, failure)

    def _failure(self, name: str, error: Exception) -> Exception:
        if type(error).__name__ == "KilledWorker":
            return WorkerDiedError(self._begun[name], "dask gave it up")
        if not self.connected():
            return ConnectionLostError(str(error))
        self._checked.clear()  # a worker without our code raises anything
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
        """Whether the scheduler is there, as far as is known."""
        stream = self._client.scheduler_comm
        return self._client.status == "running" and stream is not None and not stream.closed()

    def threads(self) -> int:
        """How many threads all workers have, as of the last look, which is LOOK_SECONDS ago at most.

        Raises WorkersError for a worker that cannot run our trials. What is new is asked what it is where something
        went wrong that other code may explain; without, it says so itself when it gets a task.
        """
        if time.monotonic() - self._looked > LOOK_SECONDS:
            with suppress(OSError):
                self.look(everyone=not self._checked)
        return sum(self._threads.values())

    def look(self, *, everyone: bool) -> None:
        """See which workers there are, and ask those that are new, or all, what they are.

        Raises OSError where the scheduler does not answer, WorkersError for a worker that cannot run our trials.
        """
        self._looked = time.monotonic()
        self._threads = self._client.sync(self._client.scheduler.ncores, callback_timeout=ANSWER_SECONDS)
        several = [f"{address} has {number}" for address, number in self._threads.items() if number > 1]
        if several:
            raise WorkersError(
                f"a worker must have one thread, as trials hold Python's lock: {_some(several)}; "
                'start workers with "--nworkers N --nthreads 1"'
            )
        unknown = self._threads.keys() - self._checked
        if unknown and everyone:
            self._ask(sorted(unknown))

    def _ask(self, workers: list[str]) -> None:
        answers = self._client.run(eval, INTRODUCE, workers=workers, on_error="return")
        foreign = []
        for address, answer in answers.items():
            if isinstance(answer, str):
                reason = differences(fingerprint(), answer)
            else:
                reason = "" if isinstance(answer, OSError) else f"{type(answer).__name__}: {answer}"
            if reason:
                foreign.append(f"{address}: {reason}")
            else:
                self._checked.add(address)
        if foreign:
            raise WorkersError(f"workers have another environment than this process: {_some(foreign)}")

    def end(self) -> None:
        """Take leave, by which our tasks are cancelled; what is in flight is lost."""
        with suppress(OSError):
            self._client.close(timeout=ANSWER_SECONDS)
        for name in list(self._futures):
            self._settle(name, None, ConnectionLostError("cancelled"))


def _some(words: Iterable[str]) -> str:
    listed = sorted(words)
    more = f" and {len(listed) - MOST_NAMED} more" if len(listed) > MOST_NAMED else ""
    return "; ".join(listed[:MOST_NAMED]) + more
