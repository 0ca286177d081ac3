"""The tasks of a worker of a dask cluster.

A worker reports its fingerprint, runs chunks, and lets a warden watch the jobs.
"""

import json
import os
import pickle
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple, TypeVar

from sweep.workers.executors import ONE_THREAD
from sweep.workers.fingerprint import own_part, refusal
from sweep.workers.watch import Limits
from sweep.workers.worker import compile_ahead, run_chunk

J = TypeVar("J")

WARDEN = (
    "import sys; sys.path[:] = {path!r};"
    " from sweep.workers.warden import main; main({process}, {scheduler!r})"
)
_task = threading.local()
_wardens: list["subprocess.Popen[bytes]"] = []


def introduce() -> str:
    """Return the fingerprint of this worker, including all code that a trial needs.

    The function imports this code first.
    """
    os.environ.update(ONE_THREAD)  # for libraries that are not loaded yet
    import sweep.trial.simulation  # noqa: F401

    return own_part()


def perform(task: bytes) -> bytes:
    """Run a pickled task, and return the pickled result of its function.

    If this worker differs from the fingerprint that the sender expects, the result is a
    string with the reason. The function is unpacked only if the code is equal. The
    worker tells the scheduler that the task begins before the function runs.
    """
    from distributed import get_worker

    worker = get_worker()
    topic, name, expected, load = pickle.loads(task)
    introduce()
    if reason := refusal(expected):
        return pickle.dumps(
            f"worker {worker.address} has another environment: {reason}"
        )
    function, args, kwargs = pickle.loads(load)
    if function is run_chunk:
        compile_ahead(args[1], getattr(args[0], "together", False))
    _tell(worker, topic, name)
    _task.names = {"topic": topic, "name": name}
    return pickle.dumps(function(*args, **kwargs))


def _tell(worker: Any, topic: str, message: str) -> None:
    """Send a message to listeners of `topic`; return when the scheduler has it."""
    from distributed.utils import sync

    sync(worker.loop, worker.scheduler.log_event, topic=topic, msg=message)


class Post(NamedTuple):
    """The limits of a chunk's jobs, which a warden keeps (`sweep.workers.warden`)."""

    limits: Limits

    def noting(self, jobs: Sequence[J]) -> Iterator[J]:
        """Yield the jobs of a chunk, and first report each job to the warden."""
        task = _task.names | {"limits": self.limits}
        try:
            for position, job in enumerate(jobs):
                _note(task | {"position": position, "since": time.monotonic()})
                yield job
        finally:
            _note(None)


def _note(job: dict[str, Any] | None) -> None:
    line = json.dumps(job).encode() + b"\n"
    warden = _wardens[-1] if _wardens and _wardens[-1].poll() is None else _new_warden()
    assert warden.stdin is not None
    warden.stdin.write(line)
    warden.stdin.flush()


def _new_warden() -> "subprocess.Popen[bytes]":
    from distributed import get_worker

    scheduler = get_worker().scheduler.address
    code = WARDEN.format(path=sys.path, process=os.getpid(), scheduler=scheduler)
    warden = subprocess.Popen(
        [sys.executable, "-c", code], stdin=subprocess.PIPE, start_new_session=True
    )
    _wardens.append(warden)
    return warden
