"""Trials that fail in worker processes, which import them from here."""

import os
import signal
import time
from pathlib import Path

import numpy as np

from sweep.design.jobs import Job
from sweep.trial.result import Result
from tests.faults.jobs import MEGABYTE, hang


def fails_at_first(folder: str, job: Job) -> Result:
    """At the first point replicate 0 grows in the first attempt; at the second
    replicate 1 raises in all.

    A job that grows runs twice in an attempt, the second time alone. The runs are
    counted in files below `folder`.
    """
    with (Path(folder) / job.trial_id).open("a") as runs:
        runs.write("x")
        runs.flush()
        number = runs.tell()
    first_point = job.settings["separation_weight"] == 0.5
    if first_point and job.replicate == 0 and number <= 2:
        grow()
    if not first_point and job.replicate == 1:
        raise ValueError("no luck")
    return Result(job, "diverged", 0.0)


def grow() -> None:
    """Take 100 MB every 0.1 s, 20 GB in all."""
    held = []
    for _ in range(200):
        held.append(np.ones(100 * MEGABYTE // 8))
        time.sleep(0.1)


def hangs_or_dies(job: Job) -> Result:
    """At the first point replicate 0 hangs within a call, and replicate 1 kills its
    worker.
    """
    if job.settings["separation_weight"] == 0.5 and job.replicate == 0:
        hang()
    if job.settings["separation_weight"] == 0.5 and job.replicate == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    return Result(job, "diverged", 0.0)
