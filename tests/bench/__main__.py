"""The benchmarks: `python -m tests.bench`, or `make bench`. Every comparison is a
ratio within one run.

    kernels     aziel_chen2025 with coverage against a plain all-pairs loop of the same
                model, same bits
    outside     the same model as a file beside a spec, against the one in the package,
                same bits
    flocks      cost and memory of a boid-step from N = 100 to 1,000,000 at constant
                density
    mesa        boid-steps a second against Mesa's own flocking example (skipped where
                Mesa is not installed)
    cpp         the built-in models against the same in C++, written by hand, same bits
                (skipped where there is no compiler or no AVX-512)
    framework   processor time of a launch of many short trials, storing included,
                against that of its trials
    first       what the first trial of a process costs, and each later one besides its
                steps
    study       a launch of a twentieth of the gain study, and the time of all of it
    ranks       rank correlations of a sample, against ranking each resample anew
    calibrate   error of a posterior by the number of simulations, against pyABC
                (skipped where it is not installed)
    lanes       trials that fly together, against the same trials alone
    versions    launches of this checkout against those of earlier revisions
    robots      what the senses and motors of boids cost, and what plans say of them
    view        what being watched costs a run, and how many frames a page gets
    page        how many frames a browser draws of it
    explorer    the first picture of a study of a million trials, against reading it
    device      trials on a GPU against those on processors, in less than ten minutes
                (skipped where there is none)

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
from sweep.design.jobs import Job
from sweep.own_code.reading import named_model
from sweep.trial.simulation import Simulation
from tests import ROOT
from tests.bench.calibrate import calibrate
from tests.bench.cases import BEST, MODEL, covering, large
from tests.bench.cpp import cpp
from tests.bench.device import device
from tests.bench.explorer import explorer
from tests.bench.first import first
from tests.bench.flocks import flocks
from tests.bench.framework import framework
from tests.bench.lanes import lanes
from tests.bench.mesa import mesa
from tests.bench.page import page
from tests.bench.plain import plain_run
from tests.bench.ranks import ranks
from tests.bench.robots import robots
from tests.bench.scale import FULL, Scale
from tests.bench.study import study
from tests.bench.versions import versions
from tests.bench.view import view

ROUNDS = 5


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


def compare(one: Job, rounds: int) -> tuple[float, float, float]:
    """Nanoseconds a boid-step, ours and plain, and the median ratio of paired runs;
    both must visit the same.
    """
    ours(one), plain(one)
    pairs = [(ours(one), plain(one)) for _ in range(rounds)]
    assert all(mine[1] == theirs[1] for mine, theirs in pairs), "the two loops differ"
    boid_steps = float(one.settings["n"]) * float(one.settings["steps"])
    mine, theirs = (
        median(pair[k][0] for pair in pairs) / boid_steps * 1e9 for k in (0, 1)
    )
    return mine, theirs, median(theirs[0] / mine[0] for mine, theirs in pairs)


def kernels(scale: Scale = FULL) -> None:
    """Against the plain loop; at N = 1000 in an empty world ten times as large."""
    steps, fewer = scale.of(3600), scale.of(360)
    cases = [
        ("cafeteria, N=50", covering("cafeteria", 50, steps, BEST["cafeteria"])),
        ("cafeteria, N=100", covering("cafeteria", 100, steps, BEST["cafeteria"])),
        (
            "dense_cafeteria, N=50",
            covering("dense_cafeteria", 50, steps, BEST["dense_cafeteria"]),
        ),
        (
            "dense_cafeteria, N=100",
            covering("dense_cafeteria", 100, steps, BEST["dense_cafeteria"]),
        ),
        ("empty, N=100", covering("empty", 100, steps, BEST["cafeteria"])),
        ("empty, N=1000, same density", large(1000, fewer)),
    ]
    print(f"{'kernels':36} {'ours ns':>8} {'plain ns':>8} {'ratio':>6}")
    for name, one in cases:
        mine, theirs, ratio = compare(one, scale.of(ROUNDS))
        print(f"{name:36} {mine:8.0f} {theirs:8.0f} {ratio:6.2f}")


def outside(scale: Scale = FULL) -> None:
    """A copy of the model beside a spec, against the one in the package."""
    steps, fewer = scale.of(3600), scale.of(360)
    cases = [
        ("cafeteria, N=100", covering("cafeteria", 100, steps, BEST["cafeteria"])),
        ("empty, N=1000, same density", large(1000, fewer)),
    ]
    with tempfile.TemporaryDirectory() as folder:
        name, known = copied(Path(folder))
        for case, one in cases:
            copy = replace(one, model=name, catalogue=known)
            ratio = compare_pairs(one, copy, scale.of(4 * ROUNDS))
            print(f"outside, {case:27} {ratio:.2f} times the seconds of the inside")


def copied(folder: Path) -> tuple[str, Catalogue]:
    """The name of a copy of the model in a file of the folder, and what knows it."""
    source = (ROOT / "kernels" / "models" / f"{MODEL}.py").read_text()
    file = folder / "copied.py"
    file.write_text(source.replace(f'name="{MODEL}"', 'name="copied"'))
    return named_model(str(file))


def compare_pairs(inside: Job, copy: Job, rounds: int) -> float:
    """The median ratio of seconds, the copy's by the original's, of runs in turns; both
    must visit the same.
    """
    ours(inside), ours(copy)
    ratios = []
    for _ in range(rounds):
        mine, theirs = ours(inside), ours(copy)
        assert mine[1] == theirs[1], "the copy differs"
        ratios.append(theirs[0] / mine[0])
    return median(ratios)


ALL: dict[str, Callable[..., object]] = {
    "kernels": kernels,
    "outside": outside,
    "flocks": flocks,
    "mesa": mesa,
    "cpp": cpp,
    "framework": framework,
    "first": first,
    "study": study,
    "ranks": ranks,
    "calibrate": calibrate,
    "lanes": lanes,
    "versions": versions,
    "robots": robots,
    "view": view,
    "page": page,
    "explorer": explorer,
    "device": device,
}

if __name__ == "__main__":
    for name in sys.argv[1:] or list(ALL):
        ALL[name]()
