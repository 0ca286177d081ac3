"""What a launch costs besides its trials, in processor time: on a busy machine the wall
time of trials grows, and hides it.

All that the coordinator and the workers do counts, from the spec to the last part, but
for what the workers do within chunks: between the first and the last trial of one.
"""

import os
import tempfile
import time
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

import numpy as np
import psutil

from sweep.campaigns.launching import launch
from sweep.spec.study import parse_spec
from sweep.workers import worker
from sweep.workers.executors import Loky
from tests.bench.scale import FULL, Scale

POINTS, FEW, STEPS, WORKERS, ROUNDS = 10_000, 600, 1500, 2, 3
SPEC = """
study: bench
model: aziel_chen2025
preset: as_run
fixed: {{map: cafeteria, n: 100, steps: {steps}}}
sweep:
  gains:
    sample: random
    points: {points}
    cohesion_weight: {{uniform: [0, 0.5]}}
    alignment_weight: {{uniform: [0, 0.1]}}
    separation_weight: {{uniform: [0, 0.5]}}
replicates: 1
seed: 1
"""


class Cost(NamedTuple):
    """Seconds of a launch: `wall`, and of processor time those of the `coordinator`, of
    all `workers`, and of these the seconds in `chunks`.
    """

    wall: float
    coordinator: float
    workers: float
    chunks: float

    @property
    def besides(self) -> float:
        """Processor seconds of the launch besides its chunks."""
        return self.coordinator + self.workers - self.chunks


def launched(points: int, steps: int, workers: int) -> Cost:
    """The cost of a launch of so many trials into an empty store, by warm workers."""
    with tempfile.TemporaryDirectory() as folder:
        engine = Loky(workers, partial(_meter_chunks, folder))
        warm = parse_spec(SPEC.format(points=10 * workers, steps=steps))
        launch(warm, Path(folder) / "warm", engine)
        study = parse_spec(SPEC.format(points=points, steps=steps))
        before = time.perf_counter(), time.process_time(), *_of_workers(Path(folder))
        launch(study, Path(folder), engine)
        after = time.perf_counter(), time.process_time(), *_of_workers(Path(folder))
        engine.stop()
    return Cost(*(now - then for now, then in zip(after, before, strict=True)))


def _of_workers(folder: Path) -> tuple[float, float]:
    """The processor seconds of the workers so far, and of these those in chunks."""
    files = list(folder.glob("*.meter"))
    times = [psutil.Process(int(file.stem)).cpu_times() for file in files]
    chunks = [float(np.fromfile(file)[0]) for file in files]
    return sum(one.user + one.system for one in times), sum(chunks)


def _meter_chunks(folder: str) -> None:
    """In a worker, write down the processor time of each chunk."""
    meter = np.memmap(Path(folder) / f"{os.getpid()}.meter", float, "w+", shape=1)
    run_chunk = worker.run_chunk

    def metered(*arguments: Any, **named: Any) -> Any:
        began = time.thread_time()
        try:
            return run_chunk(*arguments, **named)
        finally:
            meter[0] += time.thread_time() - began

    setattr(worker, "run_chunk", metered)  # noqa: B010


def framework(scale: Scale = FULL) -> None:
    """The cost of a launch over that of its trials of some 30 ms, and what the second
    worker adds, which only a machine that has nothing else to do can show.
    """
    points, few, steps = map(scale.of, (POINTS, FEW, STEPS))
    cost = launched(points, steps, WORKERS)
    print(
        f"framework: {points:,} trials of {cost.chunks / points * 1e3:.1f} ms on"
        f" {WORKERS} workers: processor time {cost.chunks:.1f} s in chunks and"
        f" {cost.besides:.2f} s besides ({cost.coordinator:.2f} s in the coordinator),"
        f" overhead {cost.besides / cost.chunks * 100:.2f} %; {cost.wall:.1f} s wall"
    )
    rounds = [
        [launched(few, steps, workers).wall for workers in (1, 2)]
        for _ in range(scale.of(ROUNDS))
    ]
    ratio = median(one / two for one, two in rounds)
    print(f"framework: two workers are {ratio:.2f} times as fast as one")
