"""A small process next to a worker of a dask cluster, which keeps the limits of jobs.

A thread of the worker could not do this, as a job may hang and hold Python's lock. The
worker writes a line to the warden for each job that it begins. The warden looks at the
job many times a second. When the job is beyond a limit, it freezes the worker, tells
the scheduler, so that whoever sent the chunk can take it back, and kills the worker.
dask's nanny, if there is one, starts another. The warden ends with the worker, whose
end closes the pipe.
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
    """Watch the jobs of the worker `process`, which it writes to our input.

    A job beyond a limit is reported to the scheduler at that address.
    """
    import psutil

    worker = psutil.Process(process)
    job = None
    lines = SimpleQueue[bytes]()
    threading.Thread(target=_read, args=(lines,), daemon=True).start()
    while True:
        # Not by `select`, which knows no pipes on Windows.
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
    """Hand on every line of our input; the empty one is its end."""
    while line := sys.stdin.buffer.readline():
        lines.put(line)
    lines.put(b"")


def _judge(worker: "psutil.Process", job: dict[str, Any], scheduler: str) -> None:
    """End the worker if its job is beyond a limit."""
    late, error = beyond(
        Limits(*job["limits"]), time.monotonic() - job["since"], worker
    )
    if error:
        worker.suspend()
        # If the scheduler is away, the job is tried again and convicted in the end.
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
