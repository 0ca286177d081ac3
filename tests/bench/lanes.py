"""Trials that fly together, against the same trials alone: processor time of both, in
turn, in one run. Before that they must have the same bits.
"""

import time
from collections.abc import Callable, Sequence
from statistics import median
from typing import Any

import numpy as np

from kernels.lanes.vectors import WIDTH
from sweep.design.jobs import Job
from sweep.trial.lanes import Trials
from sweep.trial.result import Result
from sweep.trial.simulation import run
from tests.bench.scale import FULL, Scale
from tests.builders import job

ROUNDS = 5


def lanes(scale: Scale = FULL) -> None:
    """Print for each case the cost of a boid-step together and alone."""
    rounds = scale.of(ROUNDS)
    print(f"{WIDTH} trials together, ns of processor time a boid-step, {rounds} rounds")
    worst = np.inf
    for text, model, about in _cases(scale):
        jobs = [job(model, replicate=k, **about) for k in range(WIDTH)]
        ways = Trials(together=True).several, lambda these: [run(one) for one in these]
        first, second = (way(jobs) for way in ways)
        assert list(map(_numbers, first)) == list(map(_numbers, second)), text
        pairs = [tuple(_seconds(way, jobs) for way in ways) for _ in range(rounds)]
        steps = WIDTH * int(about["n"]) * int(about["steps"])
        together, alone = (
            median(one) / steps * 1e9 for one in zip(*pairs, strict=True)
        )
        ratio = median(other / one for one, other in pairs)
        worst = min(worst, ratio)
        print(f"  {text:34} together {together:6.1f}  alone {alone:6.1f}  {ratio:.2f}")
    print(f"  the worst: {worst:.2f} times as fast")


def _cases(scale: Scale) -> list[tuple[str, str, dict[str, Any]]]:
    found = []
    for name in ("cafeteria", "dense_cafeteria", "narrow_corridor", "empty"):
        for n in (50, 100):
            about = {"map": name, "n": n, "steps": scale.of(1000)}
            found.append((f"aziel_chen2025, {name}, N={n}", "aziel_chen2025", about))
    others = {
        "nguyen2024": (100, {"map": "random_obstacles"}),
        "nanobot": (100, {"map": "empty"}),
        "patel2023": (100, {"map": "empty"}),
        "rustamani2024": (20, {"map": "arena_two_obstacles"}),
    }
    for model, (n, more) in others.items():
        about = {"n": n, "steps": scale.of(500), **more}
        found.append((f"{model}, N={n}", model, about))
    return found


def _seconds(way: Callable[[Sequence[Job]], list[Result]], jobs: list[Job]) -> float:
    began = time.process_time()
    way(jobs)
    return time.process_time() - began


def _numbers(result: Result) -> str:
    return repr((result.status, result.last, result.mean))
