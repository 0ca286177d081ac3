"""vicsek1995 against programs that share no code with it, and the measures of its
claims.
"""

import csv
import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from experiments.vicsek1995 import figures
from experiments.vicsek1995.figures import BANDS, JUMP, PEAKS, PROGRAMS
from sweep.analysis import mean_estimate
from sweep.design.design import expand
from sweep.design.jobs import Jobs
from sweep.own_code.reading import study_of
from sweep.spec.strict_yaml import read_document
from sweep.trial.simulation import run
from tests import builders
from tests.cases import slow_but

with PROGRAMS.open(encoding="utf-8", newline="") as file:
    KNOWN = list(csv.DictReader(file))
SMALL = [known for known in KNOWN if int(known["n"]) <= 100]
"""The others take too long for a test: claims compare them."""
ORDER = "{moves_with}-{n}-{noise}"
FEW = [
    known
    for known in SMALL
    if ORDER.format_map(known) in ("new_heading-40-1", "old_heading-40-4")
]
"""Order and disorder, and both ways to move, of the smaller size."""
RUNS, STEPS, BURN_IN = 8, 4000, 1000


def order(preset: str, known: dict[str, str], steps: int, seed: int) -> np.ndarray:
    """The order after each step of a flight like that of a program."""
    numbers = ("width", "max_speed", "noise")
    same: dict[str, Any] = {name: float(known[name]) for name in numbers}
    same |= {name: known[name] for name in ("noise_type", "moves_with")}
    a_job = builders.job(
        "vicsek1995",
        preset,
        metrics=(),
        series=("polarization",),
        seed=seed,
        n=int(known["n"]),
        steps=steps,
        height=same["width"],
        start_speed=same["max_speed"],
        **same,
    )
    result = run(a_job)
    assert result.status == "done", result.error
    return result.series["polarization"]


@pytest.mark.parametrize(
    "known",
    slow_but(FEW, SMALL),
    ids=[ORDER.format_map(known) for known in SMALL],
)
def test_the_order_is_that_of_independent_programs(known: dict[str, str]) -> None:
    """The mean over 3000 steps of 8 runs, which tells it to 0.4 % at most.

    Student's t of 7 degrees of freedom is beyond 8 for one of 11,000 seeds, two-sided,
    and the error of the program counts as well. So one of these tests, fewer than 20,
    fails by chance for at most one of 500 choices of seeds; they are fixed.
    """
    flights = (order("as_written", known, STEPS, seed) for seed in range(RUNS))
    means = [flight[BURN_IN:].mean() for flight in flights]
    error = math.hypot(
        np.std(means, ddof=1) / math.sqrt(RUNS), float(known["order_se"])
    )
    assert abs(np.mean(means) - float(known["order"])) < 8 * error


def test_the_disorder_of_vectorial_noise_is_that_of_independent_programs() -> None:
    """N = 2048 at eta = 0.7, over 10 stretches of 100 steps, longer than the order
    lives there. Student's t of 9 degrees of freedom is beyond 7 for one of 15,000
    seeds, two-sided.
    """
    [known] = [one for one in KNOWN if float(one["noise"]) == 0.7]
    stretches = order("gregoire_chate2004", known, 1200, 1)[201:].reshape(10, 100)
    ours = stretches.mean(axis=1).std(ddof=1) / math.sqrt(10)
    error = math.hypot(ours, float(known["order_se"]))
    assert abs(stretches.mean() - float(known["order"])) < 7 * error


@pytest.mark.parametrize("name", ["coexistence", "scalar"])
def test_bands_are_shares_of_time_of_the_order(name: str) -> None:
    """100 in the frames whose order lies in the band, and 0 in the others."""
    path = PROGRAMS.with_name(f"{name}.yaml")
    spec = read_document(path).value
    spec["fixed"]["steps"], spec["replicates"] = 2000, 1
    bands = list(spec["record"]["derive"])
    spec["record"] |= {"series": ["polarization", *bands], "every": 1}
    study = study_of(spec, path)
    jobs = Jobs(study, expand(study))
    series = run(jobs[len(jobs) // 2]).series
    for band, (low, high) in zip(bands, pairwise(BANDS), strict=True):
        inside = (series["polarization"] >= low) & (series["polarization"] < high)
        np.testing.assert_array_equal(series[band], 100.0 * inside)
    assert series["middle"].any()


def test_a_comparison_of_sizes_begins_with_the_larger(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Orders are made up: that of the larger size varies more, keeps its phases less
    apart, and falls by more at the jump. So each difference has a known sign.
    """
    rng = np.random.default_rng(1)
    noisy = {size: rng.normal(0.0, 1.0, (8, 50)) for size in (*PEAKS, 256, 1024)}

    def counted(_studies: Any, spec: str, n: int, noise: float) -> np.ndarray:
        if spec == "scaling_vectorial":
            fall = 0.4 if n == 1024 else 0.1
            after = noise == JUMP[1]
            return 0.5 - fall * after + 0.01 * (1 + after) * noisy[n]
        return np.abs(0.5 + 0.0001 * n * noisy[n])

    monkeypatch.setattr(figures, "_counted", counted)
    larger = sorted(PEAKS)[-1]
    growth = figures.susceptibility_growth({}, larger)
    change = figures.binder_change({}, larger, PEAKS[larger])
    fall = figures.fall_growth({}, 1024)
    # The judge takes the second arm from the first.
    assert mean_estimate(*reversed(growth)).interval()[0] > 0.0
    assert mean_estimate(*reversed(change)).interval()[1] < 0.0
    assert mean_estimate(*reversed(fall)).interval()[0] > 0.0
