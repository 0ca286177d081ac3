"""Jobs that hang, fill the memory or die at a bad moment, importable by worker processes."""

import os
import re
import signal
import threading
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from sweep.jobs import Job
from sweep.result import Result

MEGABYTE = 2**20
HELD: list[np.ndarray] = []


def square(job: int) -> tuple[int, int]:
    return job, job * job


def hang(_job: object = None) -> None:
    """Within one call, and without letting any other thread run: hopeless backtracking."""
    re.match("(a+)+b", "a" * 60)


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
        held.append(np.ones(100 * MEGABYTE // 8))
        time.sleep(0.1)
    return square(job)


def square_and_leave(job: int) -> tuple[int, int]:
    """Every job leaves 150 MB behind, none needs more."""
    HELD.append(np.ones(150 * MEGABYTE // 8))
    time.sleep(0.2)
    return square(job)


def die_while_sending(job: tuple[int, str]) -> int:
    """The first try of job 3 returns 200 MB, and is killed by `kill_in_the_middle`, which finds its process id."""
    number, marker = job
    if number == 3 and not Path(marker).exists():
        Path(marker).write_text(str(os.getpid()))
        return bytes(200_000_000)  # type: ignore[return-value]
    return number


def received() -> int:
    """Bytes that this process has read so far."""
    return int(Path("/proc/self/io").read_text().split()[1])


def kill_in_the_middle(marker: Path) -> Callable[[], bool]:
    """Kill, from another thread, the sender when 3 MB of its result are here; whether that was in the middle."""
    state = {"killed": 0}

    def await_and_kill() -> None:
        while not (marker.exists() and marker.read_text()):
            time.sleep(0.001)
        before = received()
        while received() < before + 3_000_000:
            time.sleep(0.0002)
        os.kill(int(marker.read_text()), signal.SIGKILL)
        time.sleep(0.5)
        state["killed"] = received() - before

    thread = threading.Thread(target=await_and_kill, daemon=True)
    thread.start()

    def in_the_middle() -> bool:
        thread.join()
        return 0 < state["killed"] < 200_000_000

    return in_the_middle


def trial_or_hang(job: Job) -> Result:
    """The first replicate of each point hangs; the others are over at once."""
    if job.replicate == 0:
        hang()
    return Result(job, "diverged", 0.0)


def nap_or_hang(seconds: float) -> float:
    """A short nap; a long one is a hang."""
    if seconds > 1:
        hang()
    time.sleep(seconds)
    return seconds
