"""The benchmarks: `python -m tests.bench`, or `make bench`. Every comparison is a
ratio within one run.

    kernels     aziel_chen2025 with coverage against a plain all-pairs loop of the same
                model, same bits
    outside     the same model as a file beside a spec, against the one in the package,
                same bits
    scaling     cost of a boid-step from N = 100 to 10,000 at constant density
    mesa        boid-steps a second against Mesa's own flocking example (skipped where
                Mesa is not installed)
    framework   wall time of many short trials, storing included, against the time spent
                inside trials
    study       measured pace of the gain study, and its wall time at that pace
    view        what being watched costs a run, and how many frames a page gets
    page        how many frames a browser draws of it

Name some of them to run only those.
"""

import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from statistics import median

import numpy as np
from numpy.typing import NDArray

from kernels.catalogue import Catalogue
from kernels.models import MODELS
from sweep.campaigns.launch import launch
from sweep.design.jobs import Job
from sweep.own_code.reading import named_model
from sweep.spec.study import RecordSpec, Streams, parse_spec
from sweep.tables.stored_study import StoredStudy
from sweep.trial.simulation import Simulation, run
from sweep.workers.executors import Loky
from tests import ROOT
from tests.bench.page import page
from tests.bench.plain import plain_run
from tests.bench.view import view

ROUNDS = 5
MODEL = "aziel_chen2025"
BEST = {
    "cafeteria": (0.21291127681588995, 0.003341501546500625, 0.0029965674079446836),
    "dense_cafeteria": (0.476524, 0.016595, 0.001169),
}


def job(
    map_name: str,
    n: int,
    steps: int,
    gains: tuple[float, float, float],
    **settings: float,
) -> Job:
    """A trial of aziel_chen2025 as run, with the metrics of the published study."""
    cohesion, alignment, separation = gains
    values = MODELS[MODEL].presets["as_run"] | {
        "map": map_name,
        "n": n,
        "steps": steps,
        "cohesion_weight": cohesion,
        "alignment_weight": alignment,
        "separation_weight": separation,
        **settings,
    }
    record = RecordSpec(MODELS[MODEL].metrics)
    return Job(
        "bench",
        "0" * 16,
        0,
        27,
        True,
        MODEL,
        "as_run",
        values,
        record,
        Streams(),
        None,
    )


def ours(one: Job) -> tuple[float, int]:
    """Seconds of a trial from its first step to its metrics,
    and the pixels it visited.
    """
    simulation = Simulation(one)
    began = time.perf_counter()
    simulation.result(began)
    return time.perf_counter() - began, int(simulation.flight.record.coverage.sums[0])


def plain(one: Job) -> tuple[float, int]:
    """The same for the plain loop."""
    simulation = Simulation(one)
    world, flock, coverage = (
        simulation.world,
        simulation.flock,
        simulation.flight.record.coverage,
    )
    obstacles = np.column_stack([world.obstacle_x, world.obstacle_y, world.half_width])
    weights = tuple(
        float(one.settings[f"{name}_weight"])
        for name in ("cohesion", "alignment", "separation")
    )
    visits = coverage.visits.reshape(coverage.rows, coverage.columns)
    arrays: list[NDArray[np.float64]] = [
        flock.x,
        flock.y,
        flock.vx,
        flock.vy,
        obstacles,
    ]
    began = time.perf_counter()
    visited = plain_run(*arrays, weights, visits, int(one.settings["steps"]))
    return time.perf_counter() - began, visited


def compare(one: Job) -> tuple[float, float, float]:
    """Nanoseconds a boid-step, ours and plain, and the median ratio of paired runs;
    both must visit the same.
    """
    ours(one), plain(one)
    pairs = [(ours(one), plain(one)) for _ in range(ROUNDS)]
    assert all(mine[1] == theirs[1] for mine, theirs in pairs), "the two loops differ"
    boid_steps = float(one.settings["n"]) * float(one.settings["steps"])
    mine, theirs = (
        median(pair[k][0] for pair in pairs) / boid_steps * 1e9 for k in (0, 1)
    )
    return mine, theirs, median(theirs[0] / mine[0] for mine, theirs in pairs)


def kernels() -> None:
    """Against the plain loop; at N = 1000 in an empty world ten times as large."""
    cases = [
        ("cafeteria, N=50", job("cafeteria", 50, 3600, BEST["cafeteria"])),
        ("cafeteria, N=100", job("cafeteria", 100, 3600, BEST["cafeteria"])),
        (
            "dense_cafeteria, N=50",
            job("dense_cafeteria", 50, 3600, BEST["dense_cafeteria"]),
        ),
        (
            "dense_cafeteria, N=100",
            job("dense_cafeteria", 100, 3600, BEST["dense_cafeteria"]),
        ),
        ("empty, N=100", job("empty", 100, 3600, BEST["cafeteria"])),
        ("empty, N=1000, same density", large(1000, 360)),
    ]
    print(f"{'kernels':36} {'ours ns':>8} {'plain ns':>8} {'ratio':>6}")
    for name, one in cases:
        mine, theirs, ratio = compare(one)
        print(f"{name:36} {mine:8.0f} {theirs:8.0f} {ratio:6.2f}")


def large(n: int, steps: int) -> Job:
    """N boids in an empty world at the density of 100 boids in 800 x 600."""
    scale = (n / 100) ** 0.5
    return job(
        "empty",
        n,
        steps,
        BEST["cafeteria"],
        width=round(800 * scale),
        height=round(600 * scale),
    )


def outside() -> None:
    """A copy of the model beside a spec, against the one in the package."""
    cases = [
        ("cafeteria, N=100", job("cafeteria", 100, 3600, BEST["cafeteria"])),
        ("empty, N=1000, same density", large(1000, 360)),
    ]
    with tempfile.TemporaryDirectory() as folder:
        name, known = copied(Path(folder))
        for case, one in cases:
            ratio = compare_pairs(one, replace(one, model=name, known=known))
            print(f"outside, {case:27} {ratio:.2f} times the seconds of the inside")


def copied(folder: Path) -> tuple[str, Catalogue]:
    """The name of a copy of the model in a file of the folder, and what knows it."""
    source = (ROOT / "kernels" / "models" / f"{MODEL}.py").read_text()
    file = folder / "copied.py"
    file.write_text(source.replace(f'name="{MODEL}"', 'name="copied"'))
    return named_model(str(file))


def compare_pairs(inside: Job, copy: Job) -> float:
    """The median ratio of seconds, the copy's by the original's, of runs in turns; both
    must visit the same.
    """
    ours(inside), ours(copy)
    ratios = []
    for _ in range(4 * ROUNDS):
        mine, theirs = ours(inside), ours(copy)
        assert mine[1] == theirs[1], "the copy differs"
        ratios.append(theirs[0] / mine[0])
    return median(ratios)


def scaling() -> None:
    """Cost of a boid-step at constant density, relative to N = 100; the median of
    ROUNDS interleaved runs.
    """
    sizes = (100, 1000, 10_000)
    trials = {n: large(n, 36_000 // n + 40) for n in sizes}
    for one in trials.values():
        ours(one)
    times: dict[int, list[float]] = {n: [] for n in sizes}
    for _ in range(ROUNDS):
        for n, one in trials.items():
            times[n].append(ours(one)[0] / (n * float(one.settings["steps"])) * 1e9)
    for n in sizes:
        ratio = median(a / b for a, b in zip(times[n], times[100], strict=True))
        print(
            f"scaling, N={n:<26,} {median(times[n]):8.0f} ns, {ratio:.2f} times N=100"
        )


def mesa() -> None:
    """Boid-steps a second against Mesa's flocking example with its own settings, both
    at N = 100.
    """
    try:
        from mesa.examples.basic.boid_flockers.model import BoidFlockers
    except ImportError:
        print("mesa: not installed, skipped")
        return
    model = BoidFlockers(population_size=100)
    model.step()
    theirs, mine = [], []
    for _ in range(ROUNDS):
        began = time.perf_counter()
        for _ in range(20):
            model.step()
        theirs.append((time.perf_counter() - began) / 2000)
        mine.append(ours(job("cafeteria", 100, 3600, BEST["cafeteria"]))[0] / 360_000)
    ratio = median(a / b for a, b in zip(theirs, mine, strict=True))
    print(
        f"mesa: {median(theirs) * 1e6:.1f} us a boid-step, ours"
        f" {median(mine) * 1e9:.0f} ns, {ratio:.0f} times faster"
    )


SHORT = """
study: bench
model: aziel_chen2025
preset: as_run
fixed: {{map: cafeteria, n: 100, steps: 1500}}
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


def timed_launch(points: int, workers: int) -> tuple[float, float]:
    """Wall seconds of a launch into an empty store with warm workers, and the seconds
    spent inside its trials.
    """
    engine = Loky(workers)
    with tempfile.TemporaryDirectory() as folder:
        launch(
            parse_spec(SHORT.format(points=10 * workers)), Path(folder) / "warm", engine
        )
        began = time.perf_counter()
        launch(parse_spec(SHORT.format(points=points)), Path(folder), engine)
        wall = time.perf_counter() - began
        inside = float(StoredStudy("bench", folder).trials["seconds"].sum())
    engine.stop()
    return wall, inside


def framework() -> None:
    """Overhead on two workers, and what the second worker adds."""
    points = 10_000
    wall, inside = timed_launch(points, 2)
    print(
        f"framework: {points:,} trials of {inside / points * 1e3:.0f} ms on 2 workers:"
        f" {wall:.1f} s wall, ",
        end="",
    )
    print(f"{inside:.1f} s in trials, overhead {(2 * wall / inside - 1) * 100:.1f} %")
    rounds = [(timed_launch(600, 1)[0], timed_launch(600, 2)[0]) for _ in range(3)]
    ratio = median(one / two for one, two in rounds)
    print(f"framework: two workers are {ratio:.2f} times as fast as one")


def study() -> None:
    """The full 48,000 trials, extrapolated from 10 random gain vectors for each map and
    size.
    """
    rng = np.random.default_rng(0)
    total = 0.0
    for map_name in ("dense_cafeteria", "cafeteria", "narrow_corridor", "empty"):
        for n in (50, 100):
            gains = rng.uniform(0, [0.5, 0.1, 0.5], (10, 3))
            seconds = [
                run(job(map_name, n, 3600, tuple(one))).seconds
                for one in gains.tolist()
            ]
            total += 6000 * sum(seconds) / len(seconds)
            print(
                f"study: {map_name:16} N={n:<4}"
                f" {sum(seconds) / len(seconds) * 1e3:6.1f} ms a trial"
            )
    print(f"study: 48,000 trials take {total / 120:.1f} min on 2 cores at this pace")


ALL: dict[str, Callable[[], None]] = {
    "kernels": kernels,
    "outside": outside,
    "scaling": scaling,
    "mesa": mesa,
    "framework": framework,
    "study": study,
    "view": view,
    "page": page,
}

if __name__ == "__main__":
    for name in sys.argv[1:] or list(ALL):
        ALL[name]()
