"""Jobs for the drive loop's tests, importable by worker processes."""

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from sweep.workers.runner import Failure, drive

LAST_RESORT = 240.0


def square(job: int) -> tuple[int, int]:
    return job, job * job


def square_or_die(job: int) -> tuple[int, int]:
    if job == 7:
        os.kill(os.getpid(), signal.SIGKILL)
    return square(job)


def die_once(job: tuple[int, str]) -> tuple[int, int]:
    """Kills the worker on job 5, unless the marker file says that it already has."""
    number, marker = job
    if number == 5 and not Path(marker).exists():
        Path(marker).touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return square(number)


def square_or_raise(job: int) -> tuple[int, int]:
    if job == 3:
        raise ValueError("three is not allowed")
    if job == 4:
        sys.exit("four leaves")
    return square(job)


def unpicklable_for_two(job: int) -> Any:
    return threading.Lock() if job == 2 else square(job)


def nap(seconds: float) -> float:
    time.sleep(seconds)
    return seconds


def thread_counts(_job: int) -> tuple[str | None, str | None]:
    return os.environ.get("NUMBA_NUM_THREADS"), os.environ.get("OMP_NUM_THREADS")


def break_at_start() -> None:
    raise RuntimeError("no such cache")


def run_all(jobs: Any, run: Any, executor: Any, **options: Any) -> list[Any]:
    """Everything that `drive` yields, flattened; a failed job is (job, Failure)."""
    batches = drive(
        jobs,
        run,
        executor=executor,
        failed=failed,
        **{"costs": a_millisecond} | options,
    )
    return [result for batch in batches for result in batch]


def failed(job: Any, error: str) -> tuple[Any, Failure]:
    return job, Failure(error)


def a_millisecond(jobs: Sequence[Any]) -> list[float]:
    return [0.001] * len(jobs)


def shortest_first(jobs: Sequence[float]) -> list[float]:
    return [1 / seconds for seconds in jobs]


def processes_below(parent: int) -> set[int]:
    """Ids of the live (not zombie) descendants of a process."""
    found: set[int] = set()
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, ppid = stat.read_text().rpartition(")")[2].split()[:2]
        except (FileNotFoundError, ProcessLookupError):
            continue
        if int(ppid) == parent and state != "Z":
            child = int(stat.parent.name)
            found |= {child} | processes_below(child)
    return found


@contextmanager
def started(command: Sequence[str], folder: Path) -> Iterator["subprocess.Popen[str]"]:
    """A running command in a session of its own, of which nothing is left at the end,
    whatever happens.

    It is killed after LAST_RESORT seconds, so that who waits for its words sees it end.
    """

    def kill() -> None:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)

    with subprocess.Popen(
        command,
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as process:
        resort = threading.Timer(LAST_RESORT, kill)
        resort.start()
        try:
            yield process
        finally:
            resort.cancel()
            kill()
