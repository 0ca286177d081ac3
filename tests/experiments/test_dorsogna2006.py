"""dorsogna2006 against programs that share no code with it, and the measure of its
claims.
"""

import csv
import math
from typing import Any

import numpy as np
import pandas as pd
import pytest

from experiments.dorsogna2006.figures import PROGRAMS, area_growth, pull
from sweep.trial.simulation import Simulation, run
from tests import builders

with PROGRAMS.open(encoding="utf-8", newline="") as file:
    KNOWN = list(csv.DictReader(file))
NAMES = ("flock_radius", "speed", "dispersion", "angular_momentum")


def known(constants: str, n: int, start: str) -> list[dict[str, float]]:
    """What the programs found, a row a seed."""
    rows = [
        row
        for row in KNOWN
        if (row["constants"], int(row["n"]), row["start"]) == (constants, n, start)
    ]
    numbers = ("mean_radius", "sd_radius", "mean_speed", "rotation")
    return [{name: float(row[name]) for name in numbers} for row in rows]


def test_random_boxes_end_as_those_of_independent_programs() -> None:
    """Radii of single flights differ by 1e-5 relative there, and speeds by 3e-7. Time
    is shorter here, which leaves 2e-5 of the way.
    """
    theirs = known("A", 40, "random box")
    a_job = builders.job(
        "dorsogna2006", dt=0.02, steps=20_000, seed=5, series=NAMES, every=1000
    )
    last = {name: values[-1] for name, values in run(a_job).series.items()}
    radius = np.mean([row["mean_radius"] for row in theirs])
    speed = np.mean([row["mean_speed"] for row in theirs])
    assert last["flock_radius"] == pytest.approx(radius, rel=1e-4)
    assert last["speed"] == pytest.approx(speed, rel=1e-4)


def test_a_mill_of_one_sense_is_that_of_independent_programs() -> None:
    """N = 100 from a box in which all turn one way, as there. Between their seeds the
    radius differs by 3e-4 relative and the speed by 3e-4; ours are means over a third
    of their time.
    """
    theirs = known("B", 100, "box, all turning")
    a_job: Any = builders.job(
        "dorsogna2006", "mill", metrics=(), series=NAMES, dt=0.02, steps=8000, every=10
    )
    simulation = Simulation(a_job)
    x, y = np.random.default_rng(1).uniform(-2, 2, (2, 100))
    share = math.sqrt(3.2) / np.hypot(x, y)
    builders.place(simulation, 10 + x, 10 + y, -y * share, x * share)
    series = simulation.result(began=0.0).series
    late = {name: values[500:].mean() for name, values in series.items()}
    for ours, name in (("flock_radius", "mean_radius"), ("speed", "mean_speed")):
        mean = np.mean([row[name] for row in theirs])
        assert late[ours] == pytest.approx(mean, rel=5e-3)
    assert late["angular_momentum"] > 0.99


def test_the_pull_of_a_ring_is_that_of_its_boids() -> None:
    """The figure draws it, and the sum over pairs is written here otherwise."""
    constants = {
        "attraction_strength": 1.0,
        "attraction_length": 1.0,
        "repulsion_strength": 0.5,
        "repulsion_length": 0.5,
    }
    place = 0.7 * np.exp(2j * np.pi * np.arange(9) / 9)
    way = place[1:] - place[0]
    r = np.abs(way)
    force = ((np.exp(-r) - np.exp(-2 * r)) * way / r).sum()
    assert pull(9, np.array([0.7]), constants) == pytest.approx([-force.real])


def test_the_growth_of_the_area_is_a_power_of_the_number() -> None:
    """1 where the radius doubles with four times as many boids, 0 where it stays."""

    class Made:
        trials = pd.DataFrame(
            {
                "repulsion_strength": 2.8,
                "repulsion_length": 0.5,
                "n": [50, 200, 50, 200, 50],
                "replicate": [0, 0, 1, 1, 2],
                "flock_radius": [1.0, 2.0, 3.0, 3.0, 1.0],
            }
        )

    made: Any = {"stability": Made}
    assert area_growth(made, 2.8, 0.5)[:2] == pytest.approx([1.0, 0.0])
