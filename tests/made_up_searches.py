"""Searches made up for the tests: tables as those of a search that has run, without any
trial.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from sweep.analysis import Distribution
from sweep.methods.search.objectives import Constraint, Objective, Statistic

MEAN = Statistic("mean")
GAIN = Objective("gain", True, MEAN)
RANGES = {"weight": {"uniform": [0.0, 1.0]}}


@dataclass(frozen=True)
class MadeUp:
    """What `sweep.methods.search.asked_trials.AskedTrials` has."""

    table: pd.DataFrame
    description: dict[str, Any]
    distributions: dict[str, Distribution]


def rows(
    run: str, phase: str, candidate: int, columns: dict[str, Any], *, batch: int = 0
) -> pd.DataFrame:
    """The rows of one candidate; each column but those of one value is (blocks,
    scenarios).
    """
    shaped = {name: np.asarray(values) for name, values in columns.items()}
    shape = next(values.shape for values in shaped.values() if values.ndim == 2)
    block, scenario = (index.ravel() for index in np.indices(shape))
    columns = {"status": "done"} | {
        name: np.broadcast_to(values, shape).ravel() for name, values in shaped.items()
    }
    ids = [
        f"{run}-{phase}-{candidate}-{b}-{s}"
        for b, s in zip(block, scenario, strict=True)
    ]
    where = {"run": run, "phase": phase, "candidate": candidate, "batch": batch}
    return pd.DataFrame(
        {**where, "block": block, "scenario": scenario, "trial_id": ids, **columns}
    )


def searched(
    *parts: pd.DataFrame,
    objectives: tuple[Objective, ...] = (GAIN,),
    constraints: tuple[Constraint, ...] = (),
    full: int = 4,
    **about: Any,
) -> MadeUp:
    """The search whose rows are `parts`, with candidates that get `full` blocks."""
    table = pd.concat(parts, ignore_index=True)
    known = {
        "parameters": ["weight"],
        "ranges": RANGES,
        "objectives": [one.as_json() for one in objectives],
        "constraints": [one.as_json() for one in constraints],
        "references": [],
        "budget": 10_000,
        "sampler": "tpe",
        "rejected": {},
        "finished": True,
        "repetitions": 0,
        "blocks": dict.fromkeys(table["run"].unique(), full),
    }
    distributions = {one.column: one.distribution for one in objectives}
    return MadeUp(table, known | about, distributions)
