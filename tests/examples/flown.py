"""Flights of the examples, as a spec beside their files describes them."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from sweep.design.design import expand
from sweep.design.jobs import Job, Jobs
from sweep.own_code.reading import study_of
from sweep.trial.result import Result
from sweep.trial.simulation import Simulation, run
from tests import ROOT

EXAMPLES = ROOT / "examples"


def job(
    model: str,
    preset: str,
    metrics: Sequence[str] = ("speed",),
    every: int = 1,
    seed: int = 1,
    folder: Path = EXAMPLES,
    **settings: Any,
) -> Job:
    """One trial of an example, or of its like in another folder, whose series are of
    these metrics, by name or file.
    """
    spec = {
        "study": "example",
        "model": f"./{model}.py",
        "preset": preset,
        "fixed": {"map": "empty"} | settings,
        "replicates": 1,
        "seed": seed,
        "record": {"series": list(metrics), "every": every},
    }
    study = study_of(spec, folder / "spec.yaml")
    return Jobs(study, expand(study))[0]


def flown(a_job: Job) -> Result:
    """The result of a trial that is done."""
    result = run(a_job)
    assert result.status == "done", result.error
    return result


def places(simulation: Simulation) -> np.ndarray:
    """x and y of all boids, shape (N, 2)."""
    return np.column_stack([simulation.flock.x, simulation.flock.y])
