"""Studies with sampled axes and made-up results, without a kernel: what a metric is at
each point is given.
"""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
from numpy.random import Generator, default_rng

from kernels.catalogue import BUILT_IN
from sweep.campaigns.design_plan import plan_table
from sweep.design.design import expand
from sweep.design.jobs import Jobs
from sweep.spec.study import parse_spec
from sweep.store.origin import PROVENANCE
from sweep.store.store import Store
from sweep.tables.stored_study import StoredStudy
from tests.specs import short

SETTINGS = ("separation_weight", "alignment_weight", "cohesion_weight")
VARIANCE = 7.0**2 / 8 + 0.1 * np.pi**4 / 5 + 0.1**2 * np.pi**8 / 18 + 0.5
"""Of the Ishigami function with a = 7 and b = 0.1, as in Saltelli et al. (2008, Global
Sensitivity Analysis, 4.2).
"""

FIRST = np.array([0.5 * (1 + 0.1 * np.pi**4 / 5) ** 2, 7.0**2 / 8, 0.0]) / VARIANCE
PAIR = 8 * 0.1**2 * np.pi**8 / 225 / VARIANCE
"""S2 of the first and the third setting, the only pair that interacts."""

TOTAL = FIRST + np.array([PAIR, 0.0, PAIR])

Noise = Callable[[Generator, tuple[int, int]], np.ndarray]


def ishigami(settings: pd.DataFrame) -> np.ndarray:
    """Of FIELDS from 0 to 1, which stand for -pi to pi."""
    one, two, three = (np.pi * (2 * settings[name].to_numpy() - 1) for name in SETTINGS)
    return np.sin(one) + 7 * np.sin(two) ** 2 + 0.1 * three**4 * np.sin(one)


def axis(sample: str, points: int, **options: object) -> str:
    """The axis `joint` over FIELDS, each uniform from 0 to 1, as a line of a spec."""
    words = {"sample": sample, "points": points, **options}
    words |= dict.fromkeys(SETTINGS, "{uniform: [0, 1]}")
    inside = ", ".join(f"{name}: {value}" for name, value in words.items())
    return f"joint: {{{inside}}}"


class MadeUp(StoredStudy):
    """A study with this plan and these trials, stored nowhere."""

    units = {"speed": "px/step"}  # noqa: RUF012
    distributions = {"speed": "normal"}  # noqa: RUF012
    known = BUILT_IN

    def __init__(self, plan: pa.Table, speed: np.ndarray) -> None:
        self.name, self.plan = "made_up", plan
        self.store = Store(Path("made_up"))
        self.provenance = json.loads(plan.schema.metadata[PROVENANCE])
        self.trials = plan.to_pandas().assign(status="done", speed=speed)


def axes_of(sweep: str) -> str:
    """The value of `sweep:`; a list of designs stays as it is."""
    return sweep if sweep.startswith("[") else f"{{{sweep}}}"


def study_of(
    sweep: str,
    function: Callable[[pd.DataFrame], np.ndarray] = ishigami,
    noise: Noise | None = None,
    *,
    replicates: int = 2,
    seed: int = 1,
) -> MadeUp:
    """A study, all of whose trials are done: its `speed` is `function` of the settings
    and noise (points, replicates).

    `seed` is that of the noise and of the spec.
    """
    text = short(f"sweep: {axes_of(sweep)}").replace(
        "replicates: 2", f"replicates: {replicates}"
    )
    spec = parse_spec(text.replace("seed: 1", f"seed: {seed}"))
    design = expand(spec)
    values = np.repeat(
        function(pd.DataFrame(design.columns))[:, None], replicates, axis=1
    )
    if noise:
        values = values + noise(default_rng(seed), values.shape)
    return MadeUp(plan_table(Jobs(spec, design), {}), values.ravel())
