"""Processor time of trials, on one core."""

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

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


def _check_done(result: Result) -> None:
    if result.status != "done":
        raise RuntimeError(f"a trial of {result.job.model} is {result.status}")
