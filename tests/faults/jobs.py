"""Jobs that hang, fill the memory or die at a bad moment, importable by worker
processes.

Workers are started again and again: so what only one of these jobs needs is imported by
it alone.
"""

import ctypes
import os
import signal
import time
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sweep.design.jobs import Job
    from sweep.trial.result import Result

MEGABYTE = 2**20
HELD: list[bytes] = []


def square(job: int) -> tuple[int, int]:
    return job, job * job


def hang(_job: object = None) -> None:
    """Within one call, and without letting any other thread run: this way into C keeps
    Python's lock.
    """
    ctypes.PyDLL(None).pause()


def square_or_hang(job: int) -> tuple[int, int]:
    if job == 7:
        hang()
    while job == 11:
        time.sleep(0.01)
    return square(job)


def square_or_grow(job: int) -> tuple[int, int]:
    """Job 5 takes 100 MB every 0.1 s, 20 GB in all."""
    held = []
    for _ in range(200 if job == 5 else 0):
        held.append(b"x" * (100 * MEGABYTE))
        time.sleep(0.1)
    return square(job)


def square_and_leave(job: int) -> tuple[int, int]:
    """Every job leaves 150 MB behind, none needs more."""
    HELD.append(b"x" * (150 * MEGABYTE))
    time.sleep(0.2)
    return square(job)


def die_while_sending(job: tuple[int, str]) -> int:
    """The first try of job 3 returns 3 MB, and is killed when a third is sent."""
    number, marker = job
    if number == 3 and not Path(marker).exists():
        Path(marker).touch()
        Connection._send = _send_a_third  # type: ignore[attr-defined]
        return bytes(3_000_000)  # type: ignore[return-value]
    return number


def _send_a_third(connection: Any, content: Any) -> None:
    """In place of what sends bytes to another process: of many, die on the way."""
    many = len(content) > 1_000_000
    left = memoryview(content)[: len(content) // 3 if many else None]
    while left:
        left = left[os.write(connection.fileno(), left) :]
    if many:
        os.kill(os.getpid(), signal.SIGKILL)


def trial_or_hang(job: "Job") -> "Result":
    """The first replicate of the first point hangs; the others are over at once."""
    from sweep.trial.result import Result

    if job.settings["separation_weight"] == 0.5 and job.replicate == 0:
        hang()
    return Result(job, "diverged", 0.0)


def run_or_die(marker: str, job: "Job") -> "Result":
    """The second replicate of each point kills its worker, unless the marker says that
    one has died.
    """
    from sweep.trial.simulation import run

    if job.replicate == 1 and not Path(marker).exists():
        Path(marker).touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return run(job)


def nap(seconds: float) -> float:
    """A nap; a long one is announced on stdout."""
    if seconds > 1:
        os.write(1, b"long\n")
    time.sleep(seconds)
    return seconds


def nap_or_hang(seconds: float) -> float:
    """A short nap; a long one is a hang, and announced on stdout."""
    if seconds > 1:
        os.write(1, b"long\n")
        hang()
    return nap(seconds)
