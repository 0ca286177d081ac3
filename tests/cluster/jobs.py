"""Jobs for clusters, importable by worker processes."""

import os
import signal
import time
from pathlib import Path
from typing import NamedTuple

from tests.patience import PATIENCE


class Staged(NamedTuple):
    """A job that notes in `folder` which process runs it, and waits until its stage is
    allowed.
    """

    number: int
    stage: int
    folder: str


def staged(job: Staged) -> int:
    """The number of the job; its file is named by number and process."""
    folder = Path(job.folder)
    (folder / f"began-{job.stage}-{job.number}-{os.getpid()}").touch()
    deadline = time.monotonic() + PATIENCE
    while job.stage > 0 and not (folder / f"allowed-{job.stage}").exists():
        if time.monotonic() > deadline:
            raise TimeoutError("the stage was never allowed")
        time.sleep(0.02)
    return job.number


def processes(folder: Path, stage: int) -> set[int]:
    """The processes that have begun jobs of a stage."""
    return {
        int(path.name.rpartition("-")[2]) for path in folder.glob(f"began-{stage}-*")
    }


def square_or_die(job: int) -> tuple[int, int]:
    """Job 7 kills its worker when others have had the time to queue there."""
    if job == 7:
        time.sleep(0.5)
        os.kill(os.getpid(), signal.SIGKILL)
    return job, job * job
