"""Processor time of trials, on one core, and of commands."""

import os
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from sweep.design.jobs import Job
from sweep.trial.lanes import AT_ONCE, fly, groups
from sweep.trial.result import Result
from sweep.trial.simulation import Simulation


@contextmanager
def one_core() -> Iterator[None]:
    """Inside, this thread stays on one core, where the system can do that."""
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    cores = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {max(cores)})
    try:
        yield
    finally:
        os.sched_setaffinity(0, cores)


def alone(one: Job) -> float:
    """Seconds of processor time of a trial of ours, from its first step to its metrics.
    Raises RuntimeError where it is not done.
    """
    simulation = Simulation(one)
    began = time.thread_time()
    result = simulation.result(time.perf_counter())
    seconds = time.thread_time() - began
    _check_done(result)
    return seconds


def together(one: Job) -> float:
    """The same of each of eight trials that fly together, from other starts; of one
    that flies alone where they would not.
    """
    jobs = [replace(one, seed=one.seed + k, replicate=k) for k in range(AT_ONCE)]
    if len(list(groups(jobs))) > 1:
        return alone(one)
    simulations = list(map(Simulation, jobs))
    began = time.thread_time()
    results = fly(simulations, time.perf_counter())
    seconds = time.thread_time() - began
    for result in results:
        _check_done(result)
    return seconds / AT_ONCE


def of_command(*words: str, folder: Path, settings: Mapping[str, str]) -> float | None:
    """Seconds of processor time of a command `sweep`, of all its processes; None where
    it fails. `settings` are added to the environment.
    """
    with (folder / "printed").open("w") as printed:
        process = subprocess.Popen(
            [sys.executable, "-c", "from sweep.cli import main; main()", *words],
            cwd=folder,
            env=os.environ | settings,
            stdout=printed,
            stderr=subprocess.STDOUT,
        )
        _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    return None if process.returncode else usage.ru_utime + usage.ru_stime


def _check_done(result: Result) -> None:
    if result.status != "done":
        raise RuntimeError(f"a trial of {result.job.model} is {result.status}")
