"""One trial on several cores, against the same trial on one: wall time of both, in
turn, in short stretches. Before that they must have the same bits.
"""

import os
import time
from dataclasses import replace
from statistics import median

import numpy as np

from sweep.design.jobs import Job
from sweep.spec.study import RecordSpec
from sweep.trial.simulation import Simulation
from tests.bench.flocks import large
from tests.bench.scale import FULL, Scale

SIZES, THREADS = (1_000, 10_000, 100_000), 2
STRETCHES, BOID_STEPS = 200, 40_000
"""So many of some milliseconds each: what others do on the machine makes some of them
longer, and none shorter.
"""


def threads(scale: Scale = FULL) -> None:
    """Print for each size what a boid-step costs with one thread and with several: in
    the fastest stretches, and the median of the ratios of one stretch to the next.
    """
    print(
        f"{THREADS} threads, on {os.cpu_count()} cores; load {os.getloadavg()[0]:.1f}"
    )
    print(f"{'':22} {'1, ns':>6} {f'{THREADS}, ns':>6} {'ratio':>6} {'median':>7}")
    for n in map(scale.boids, SIZES):
        for text, metric in (("", "escapes"), (", coverage", "coverage")):
            record = RecordSpec((metric,), every=10**9)
            one = replace(large(n, "synchronous"), record=record)
            compare(f"N={n:,}{text}", one, scale)


def compare(case: str, job: Job, scale: Scale) -> None:
    """Print the line of a trial."""
    n = int(job.settings["n"])
    steps = max(1, scale.of(BOID_STEPS) // n)
    ways = [Simulation(replace(job, threads=count)) for count in (1, THREADS)]
    for one in ways:
        one.take_frames()
    stretches = range(scale.of(STRETCHES))
    taken = np.array([[_seconds(one, steps) for one in ways] for _ in stretches])
    for mine, other in zip(ways[0].flock, ways[1].flock, strict=True):
        assert np.array_equal(mine, other), case
    alone, divided = taken[1:].min(axis=0) / (n * steps) * 1e9
    usual = median(taken[1:, 0] / taken[1:, 1])
    ratio = alone / divided
    print(f"{case:22} {alone:6.1f} {divided:6.1f} {ratio:6.2f} {usual:7.2f}")


def _seconds(simulation: Simulation, steps: int) -> float:
    began = time.perf_counter()
    assert simulation.advance(steps)
    return time.perf_counter() - began
