"""What the authors of aziel_chen2025 stored, beside its specs: what follows from it,
and how ours is compared with it.
"""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from scipy.stats import spearmanr

from sweep.design.design import expand
from sweep.own_code.reading import load_spec
from sweep.published.published_code import run_code
from sweep.trial.simulation import Simulation
from tests import builders

FOLDER = Path(__file__).parents[2] / "experiments" / "aziel_chen2025"
GAINS = ["cohesion_weight", "alignment_weight", "separation_weight"]
SEEDS = ["seed_27", "seed_729", "seed_4913"]
A_STAMP = 13
"""Pixels that a boid visits in a step."""


def table(name: str) -> pd.DataFrame:
    return pd.read_csv(FOLDER / f"authors_{name}.csv")


@pytest.mark.parametrize("spec", ["visit_steps", "wall_clock"])
def test_steps_follow_from_mean_visits(spec: str) -> None:
    """But in the corridor, which boids leave."""
    points = pd.DataFrame(expand(load_spec(FOLDER / f"{spec}.yaml")).columns)
    mean = table("visits").groupby(["map", "n"])["mean_visits"].mean()
    known = points[points["map"] != "narrow_corridor"]
    assert len(known) == 6
    for name, n, steps in zip(known["map"], known["n"], known["steps"], strict=True):
        a_job = builders.job("aziel_chen2025", n=n, steps=1, map=name)
        pixels = Simulation(a_job).flight.record.coverage.traversable
        assert steps == round(mean[name, n] * pixels / (A_STAMP * n))


def test_rows_that_are_flown_again_are_in_the_tables() -> None:
    search, rows = table("search"), table("rows")
    key = ["map", "n", *GAINS]
    assert (search.groupby(["map", "n"]).size() == 2000).all()
    assert (rows.groupby(["map", "n"]).size() == 100).all()
    assert len(rows.merge(search, on=key)) == len(rows)
    quick = table("rows_quick")
    assert len(quick.merge(rows, on=[*key, "steps"])) == len(quick) < len(rows) / 4


def compared(shift: float) -> dict[str, Any]:
    """What the functions of the figures say of rows whose coverage is theirs, but for
    noise, and more by `shift`.
    """
    theirs = table("search").query("map == 'empty' and n == 50").head(30)
    trials = pd.concat(
        theirs[GAINS].assign(coverage_total=theirs[seed], status="done")
        for seed in SEEDS
    )
    noise = np.random.default_rng(1).normal(shift, 2.0, len(trials))
    trials["coverage_total"] += noise
    flown = SimpleNamespace(where=lambda **_settings: SimpleNamespace(trials=trials))
    code = run_code(FOLDER / "figures.py")
    found = {
        name: code[name]({"authors_rows": flown}, map="empty", n=50)
        for name in ("rows_bias", "rows_square", "rows_rank")
    }
    ours = trials.groupby(GAINS)["coverage_total"].mean()
    means = theirs.set_index(GAINS)[SEEDS].mean(axis=1)
    return found | {"off": ours - means, "rank": spearmanr(ours, means[ours.index])[0]}


@pytest.mark.parametrize("shift", [0.0, 3.0])
def test_ours_is_compared_with_theirs_row_by_row(shift: float) -> None:
    found = compared(shift)
    assert sorted(found["rows_bias"]) == pytest.approx(sorted(found["off"]))
    assert found["rows_bias"].mean() == pytest.approx(shift, abs=1.0)
    assert found["rows_square"].mean() == pytest.approx((found["off"] ** 2).mean())
    assert found["rows_rank"].mean() == pytest.approx(found["rank"])
