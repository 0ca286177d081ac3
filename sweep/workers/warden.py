"""A small process next to a worker of a dask cluster, which enforces limits of jobs.

A thread of the worker could not do this, because a job may hang and hold Python's lock.
The worker writes a line to the warden for each job that begins. The warden checks the
job many times per second. If the job exceeds a limit, the warden

- freezes the worker,
- tells the scheduler, so that the sender of the chunk can take the chunk back,
- kills the worker.

If there is a nanny of dask, the nanny starts another worker. The warden ends with the
worker, because the pipe is closed.
"""

import asyncio
import json
import sys
import threading
import time
from contextlib import suppress
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any

from sweep.workers.watch import WATCH_SECONDS, Limits, beyond

if TYPE_CHECKING:
    import psutil

TAKE_BACK_SECONDS = 1.0
REPORT_SECONDS = 30.0


def main(process: int, scheduler: str) -> None:
    """Watch the jobs that the worker `process` writes to the standard input.

    A job beyond a limit is reported to the scheduler.
    """
    import psutil

    worker = psutil.Process(process)
    job = None
    lines = SimpleQueue[bytes]()
    threading.Thread(target=_read, args=(lines,), daemon=True).start()
    while True:
        # Not by `select`, which does not support pipes on Windows.
        with suppress(Empty):
            line = lines.get(timeout=None if job is None else WATCH_SECONDS)
            if not line:
                return
            job = json.loads(line)
            continue  # another line may be there already
        if job is not None:
            with suppress(psutil.NoSuchProcess):
                _judge(worker, job, scheduler)


def _read(lines: SimpleQueue[bytes]) -> None:
    """Hand on every line of the standard input; an empty line is the end."""
    while line := sys.stdin.buffer.readline():
        lines.put(line)
    lines.put(b"")


def _judge(worker: "psutil.Process", job: dict[str, Any], scheduler: str) -> None:
    """End the worker if the job exceeds a limit."""
    late, error = beyond(
        Limits(*job["limits"]), time.monotonic() - job["since"], worker
    )
    if error:
        worker.suspend()
        # If the scheduler is away, the job is tried again and fails in the end.
        with suppress(OSError):
            asyncio.run(
                _report(
                    scheduler, job["topic"], [job["name"], job["position"], late, error]
                )
            )
            time.sleep(TAKE_BACK_SECONDS)
        worker.kill()


async def _report(scheduler: str, topic: str, verdict: list[object]) -> None:
    from distributed import core, security

    keys = security.Security().get_connection_args("worker")  # type: ignore[no-untyped-call]
    async with core.rpc(scheduler, connection_args=keys) as remote:  # type: ignore[no-untyped-call]
        await asyncio.wait_for(
            remote.log_event(topic=topic, msg=verdict), REPORT_SECONDS
        )
