"""couzin2002 against programs that share no code with it, and the measures of its
claims.
"""

import csv
import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from experiments.couzin2002 import figures
from experiments.couzin2002.figures import (
    PROGRAMS,
    loosely_parallel,
    memory_area,
    momentum,
    order,
)
from sweep.trial.simulation import run
from tests import builders
from tests.cases import slow_but

with PROGRAMS.open(encoding="utf-8", newline="") as file:
    KNOWN = list(csv.DictReader(file))
FLIGHTS, STEPS, LATE = 4, 5000, 4000
START = {
    "start_margin": 0,
    "start_center_x": 10,
    "start_center_y": 10,
    "start_radius": 5,
}
SURE = [
    known
    for known in KNOWN
    if (known["zone_sums"], known["orientation_width"])
    in (("plain_sums", "0.5"), ("plain_sums", "12"), ("unit_vectors", "1"))
]
"""Where one state alone comes about; four flights tell nothing of the others."""


def test_there_is_something_to_compare() -> None:
    assert len(SURE) == 3


@pytest.mark.parametrize(
    "known",
    slow_but([one for one in SURE if one["orientation_width"] != "12"], SURE),
    ids=["{zone_sums}-{orientation_width}".format_map(one) for one in SURE],
)
def test_states_are_those_of_independent_programs(known: dict[str, str]) -> None:
    """Means over the last fifth of four flights, at the start of the programs. Their 16
    flights tell the spread of one, s; the mean of four differs from theirs by
    s sqrt(1/4 + 1/16). At 5 such errors, two-sided, one of the six fails by chance for
    one of 10,000 choices of seeds, allowing for the uncertainty of s (Student's t of 15
    degrees of freedom); they are fixed.
    """
    names = ("polarization", "angular_momentum")
    width, zone_sums = float(known["orientation_width"]), known["zone_sums"]
    setting: dict[str, Any] = START | {"zone_sums": zone_sums}
    means = []
    for seed in range(FLIGHTS):
        a_job = builders.job(
            "couzin2002",
            orientation_width=width,
            metrics=(),
            series=names,
            every=10,
            steps=STEPS,
            seed=seed,
            **setting,
        )
        series = run(a_job).series
        means.append([series[name][LATE // 10 + 1 :].mean() for name in names])
    for ours, name in zip(np.mean(means, axis=0), names, strict=True):
        spread = float(known[f"{name}_se"]) * math.sqrt(int(known["runs"]))
        error = spread * math.sqrt(1 / FLIGHTS + 1 / int(known["runs"]))
        assert abs(ours - float(known[name])) < 5 * error


class Made:
    """A study of two trials and five frames each; the last fifth is the last frame."""

    trials = pd.DataFrame(
        {
            "trial_id": ["a", "b"],
            "zone_sums": "plain_sums",
            "orientation_width": 5.0,
            "replicate": [0, 1],
        }
    )
    series = pd.DataFrame(
        {
            "trial_id": ["a"] * 5 + ["b"] * 5,
            "frame": [0, 20, 40, 60, 100] * 2,
            "polarization": [0, 0, 0, 0, 0.9, 0, 0, 0, 0, 0.99],
            "angular_momentum": [1, 1, 1, 1, 0.1, 1, 1, 1, 1, 0.2],
            "largest_flock_share": 100.0,
        }
    )


def test_measures_are_of_the_last_fifth() -> None:
    made: Any = {"states": Made}
    assert order(made, "plain_sums", 5.0).tolist() == [0.9, 0.99]
    assert momentum(made, "plain_sums", 5.0).tolist() == [0.1, 0.2]
    assert order(made, "unit_vectors", 5.0).size == 0
    assert loosely_parallel(made, "plain_sums", 5.0).tolist() == [100.0, 0.0]


def test_the_memory_is_down_less_up_by_chain(monkeypatch: pytest.MonkeyPatch) -> None:
    up, down = np.zeros((2, 3)), np.array([[1.0, 1.0, 1.0], [0.0, 2.0, 0.0]])
    loop = SimpleNamespace(values=np.array([2.0, 3.0, 5.0]), up=up, down=down)
    monkeypatch.setattr(figures, "find_loops", lambda *_, **__: [loop])
    made: Any = {"memory": None}
    assert memory_area(made).tolist() == [3.0, 3.0]
