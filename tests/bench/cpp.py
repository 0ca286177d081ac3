"""Our trials against the same trials in C++, see tests/bench/reference. Before they are
timed they must have left the same bits.

What is measured is processor time of the thread, on one core, from the first step to
the end of the last; ours has the metrics too. Ours and theirs fly in turn, and the
ratio is the median of those of the pairs: it suffers little where the machine is busy.
"""

import tempfile
import time
from collections.abc import Callable, Iterator
from ctypes import CDLL
from pathlib import Path
from statistics import median

import numpy as np

from sweep import __version__
from sweep.design.jobs import Job
from sweep.store.provenance import cpu_name
from sweep.trial.simulation import Simulation
from tests.bench.cases import BEST, CLUMPED, covering, large
from tests.bench.reference.binding import PIXELS, Start, fly
from tests.bench.reference.compiling import (
    FLAGS,
    CannotCompileError,
    found,
    library,
    version,
)
from tests.bench.scale import FULL, Scale
from tests.bench.timing import alone, one_core, together
from tests.builders import job

ROUNDS = 5
PER_NS = 1e9
CASE = 40


OURS: dict[str, Callable[[Job], float]] = {"ours": alone, "eight": together}
"""Ways to fly a trial of ours, by their column in the table: seconds a trial."""


def cpp(scale: Scale = FULL) -> None:
    """Print a table of all cases, in Markdown, and the worst ratio last."""
    with tempfile.TemporaryDirectory() as folder, one_core():
        libraries = {}
        for compiler in found():
            try:
                libraries[version(compiler)] = library(compiler, Path(folder))
            except CannotCompileError as error:
                print(f"cpp: {compiler} cannot compile the reference, skipped: {error}")
        if libraries:
            _table(libraries, scale)
        elif not found():
            print("cpp: neither g++ nor clang++ is installed, skipped")


def _table(libraries: dict[str, CDLL], scale: Scale) -> None:
    rounds = scale.of(ROUNDS)
    print(f"boidsweep {__version__} on {cpu_name()}; {' '.join(FLAGS)}.")
    print(f"Nanoseconds of processor time a boid-step, medians of {rounds} rounds, and")
    print("how many times as fast as C++ ours is.\n")
    heads = [*OURS, *libraries, *(f"{way} : C++" for way in OURS)]
    widths = [max(7, len(head)) for head in heads]
    _print_row("case", heads, widths)
    _print_row("-" * CASE, ["-" * (width - 1) + ":" for width in widths], widths)
    measured: list[tuple[str, list[float]]] = []
    for name, one in cases(scale):
        times, ratios = _measured(one, libraries, rounds)
        measured.append((name, ratios))
        values = [f"{ns:.1f}" for ns in times] + [f"{ratio:.2f}" for ratio in ratios]
        _print_row(name, values, widths)
    print()
    for k, way in enumerate(OURS):
        ratio, name = min((ratios[k], name) for name, ratios in measured)
        print(f"The worst, {way}: {ratio:.2f} times as fast as C++, {name}.")


def _print_row(first: str, cells: list[str], widths: list[int]) -> None:
    padded = [f"{cell:>{width}}" for cell, width in zip(cells, widths, strict=True)]
    print(f"| {first:{CASE}} | {' | '.join(padded)} |", flush=True)


def _measured(
    one: Job, libraries: dict[str, CDLL], rounds: int
) -> tuple[list[float], list[float]]:
    """Nanoseconds a boid-step of each way of ours and of each library, and the ratios
    of ours: how many times as fast as the fastest library.
    """
    for built in libraries.values():
        compare_bits(one, built)
    found = [
        [way(one) for way in OURS.values()]
        + [fly(built, Start(Simulation(one)))[0] for built in libraries.values()]
        for _ in range(rounds)
    ]
    boid_steps = float(one.settings["n"]) * float(one.settings["steps"])
    times = [
        median(column) / boid_steps * PER_NS for column in zip(*found, strict=True)
    ]
    fastest = len(OURS) + int(np.argmin(times[len(OURS) :]))
    ratios = [median(row[fastest] / row[k] for row in found) for k in range(len(OURS))]
    return times, ratios


def compare_bits(one: Job, built: CDLL) -> None:
    """Raises AssertionError where a trial leaves other bits in C++."""
    simulation = Simulation(one)
    start = Start(simulation)
    end = fly(built, start)[1]
    assert simulation.result(time.perf_counter()).status == "done"
    record = simulation.flight.record
    assert np.array_equal(np.stack(simulation.flock[:4]), end.flock), "flocks differ"
    assert np.array_equal(record.watch.events, end.events), "events differ"
    if start.covering == PIXELS:
        assert record.coverage.sums[0] == end.sums[0], "visited pixels differ"
    else:
        assert np.array_equal(record.coverage.sums, end.sums), "sums of visits differ"
        assert np.array_equal(simulation.visits.ravel(), end.visits), "visits differ"


def cases(scale: Scale = FULL) -> Iterator[tuple[str, Job]]:
    """The trials that are compared, by name."""
    usual = scale.of(3600)
    both = ("coverage", "coverage_cv")
    best = BEST["cafeteria"]
    for name in ("cafeteria", "dense_cafeteria", "empty", "narrow_corridor"):
        for n in (50, 100):
            weights = BEST.get(name, best)
            yield f"{name}, N={n}", covering(name, n, usual, weights, both)
    yield "cafeteria, N=100, clumped", covering("cafeteria", 100, usual, CLUMPED, both)
    pixels = covering("cafeteria", 100, usual, best, ("coverage",))
    yield "cafeteria, N=100, coverage alone", pixels
    yield "cafeteria, N=100, events too", covering("cafeteria", 100, usual, best)
    for n, steps in ((10**3, 200), (10**4, 40), (10**5, 10), (10**6, 3)):
        size, few = scale.boids(n), scale.of(steps)
        yield (
            f"empty, N={size:,}, events alone",
            large(size, few, ("escapes", "collisions")),
        )
    for model, n, steps, name in (
        ("nguyen2024", 200, 500, "random_obstacles"),
        ("nanobot", 100, 1000, "empty"),
        ("patel2023", 10, 5000, "random_obstacles"),
        ("patel2023", 100, 500, "random_obstacles"),
        ("rustamani2024", 10, 2000, "arena"),
        ("rustamani2024", 50, 600, "arena_two_obstacles"),
    ):
        about = {"n": n, "steps": scale.of(steps), "map": name}
        yield (
            f"{model}, {name}, N={n}",
            job(model, metrics=("speed",), seed=27, **about),
        )
