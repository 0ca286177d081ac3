"""The examples in docstrings of the Python interface run, and print what they show."""

import doctest
import inspect
import math
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import pytest

import sweep
from docs.building.api import MODULES, public
from sweep.published import create
from tests.commands import run_trials_here

FIRST = """\
study: my/first
model: nguyen2024
fixed: {n: 30, steps: 100}
sweep: {separation_weight: [0.5, 1, 2]}
replicates: 10
record: {metrics: [speed, polarization], series: [speed, polarization]}
"""
MAP = """\
study: my/map
model: aziel_chen2025
fixed: {n: 20, steps: 60, map: cafeteria}
sweep: {cohesion_weight: [0.01, 0.02]}
replicates: 3
record: {metrics: [coverage, speed], every: 10, heatmaps: true, trajectories: true}
"""
METHODS = [
    """\
study: my/edge
model: vicsek1995
fixed: {n: 20, width: 4, height: 4, steps: 60}
sweep: {noise: [1, 3, 5]}
replicates: 6
refine: {metric: polarization, at: 0.5, axes: [noise], until: 0.5, budget: 60}
record: {metrics: [polarization]}
""",
    """\
study: my/loop
model: vicsek1995
fixed: {n: 12, width: 4, height: 4}
sweep: {noise: {values: [0.5, 2, 4], continue: both, hold: 20}}
replicates: 3
record: {metrics: [polarization]}
""",
    """\
study: my/sizes
model: vicsek1995
fixed: {steps: 200}
sizes: {n: [16, 64]}
sweep: {noise: [2, 3, 4, 5]}
replicates: 4
record: {series: [polarization], every: 2}
""",
    """\
study: my/steps
model: dorsogna2006
fixed: {n: 8, steps: 40}
sweep: {propulsion: [1, 2]}
replicates: 4
validate: {dt: [1/2], search: all_pairs}
record: {metrics: [speed]}
""",
    """\
study: my/weights
model: nguyen2024
fixed: {n: 12, steps: 60}
sweep:
  weights:
    sample: lhs
    points: 32
    separation_weight: {uniform: [0, 2]}
    cohesion_weight: {uniform: [0, 2]}
replicates: 1
record: {metrics: [speed]}
""",
    """\
study: my/gains
model: nguyen2024
fixed: {n: 8, steps: 20}
search:
  parameters:
    cohesion_weight: {uniform: [0, 1]}
    separation_weight: {uniform: [0, 2]}
  objectives: {speed: {minimize: mean}}
  sampler: qmc
  budget: 16
  batch: 8
  held_out: {candidates: 2, replicates: 4}
  references: {usual: {cohesion_weight: 0.5, separation_weight: 1}}
replicates: 2
record: {metrics: [speed]}
""",
    """\
study: my/until
model: nguyen2024
fixed: {n: 8, steps: 20}
sweep: {separation_weight: [0.5, 2]}
replicates: {until: {half_width: {speed: 0.3}}, min: 10, max: 30}
record: {metrics: [speed]}
""",
    """\
study: my/ablation
model: nguyen2024
preset: as_run
fixed: {n: 8, steps: 20, n_obstacles: 2, packet_loss: 0.2}
sweep:
  real:
    ablate:
      slow: {motor_lag: 2}
      late: {sensing_delay: 3, sensing_period: 2}
replicates: 4
record: {metrics: [speed]}
""",
    """
study: my/profiles
model: vicsek1995
fixed: {n: 20, steps: 20}
replicates: 2
record: {metrics: [polarization], profiles: [pair_distribution]}
""",
    """\
study: my/fit
model: nguyen2024
fixed: {n: 8, steps: 20}
sweep:
  prior: {sample: random, points: 100, separation_weight: {uniform: [0, 2]}}
replicates: 2
calibrate: {to: "my/first:separation_weight=1", summaries: [speed], population: 50,
  generations: 1}
record: {metrics: [speed]}
""",
    """\
study: my/wide_fit
model: nguyen2024
fixed: {n: 8, steps: 20}
sweep:
  prior: {sample: random, points: 100, separation_weight: {uniform: [0, 5]}}
replicates: 2
calibrate: {to: "my/first:separation_weight=1", summaries: [speed], population: 50,
  generations: 1}
record: {metrics: [speed]}
""",
]
"""Specs of small studies for the methods of `LoadedStudy`, one for each method."""
UNSTATED = 'source="not stated"', 'source=""'
"""The source in a new file of a metric, and a source that breaks a promise."""
SERVE = {"sweep.show", "sweep.view"}
"""Functions that start a server and a browser."""
OPTIONS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
PARSER = doctest.DocTestParser()


@pytest.fixture
def folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A folder with the specs, the stored studies and the code of the examples."""
    folder = tmp_path_factory.mktemp("examples")
    (folder / "spec.yaml").write_text(FIRST, encoding="utf-8")
    (folder / "map.yaml").write_text(MAP, encoding="utf-8")
    create("model", "vortex", folder)
    (metric,) = create("metric", "mine", folder)
    metric.write_text(metric.read_text().replace(*UNSTATED), encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        run_trials_here(patch)
        for spec in ("spec.yaml", "map.yaml", *METHODS):
            sweep.run(spec)
        yield folder


def docstrings(entry: Any) -> Iterator[tuple[str, str]]:
    """The docstring of a function, or those of a class and its members, by name."""
    yield "", inspect.getdoc(entry) or ""
    if inspect.isclass(entry):
        for base in entry.__mro__:
            if base.__module__.startswith("sweep"):
                for member, value in vars(base).items():
                    if not member.startswith("_"):
                        yield f".{member}", inspect.getdoc(value) or ""


def examples(module: ModuleType) -> Iterator[doctest.DocTest]:
    """The docstrings of a module that have examples."""
    known = {"math": math, "np": np, "pd": pd, "plt": plt, "sweep": sweep}
    for name, entry in public(module).items():
        for member, text in docstrings(entry):
            full = f"{module.__name__}.{name}{member}"
            found = PARSER.get_doctest(text, vars(module) | known, full, None, None)
            if found.examples and full not in SERVE:
                yield found


def test_every_public_function_has_an_example() -> None:
    without = [
        f"{module.__name__}.{name}"
        for module in MODULES
        for name, entry in public(module).items()
        if inspect.isfunction(entry) and ">>> " not in (inspect.getdoc(entry) or "")
    ]
    assert without == []


FIGURES = [module for module in MODULES if module.__name__ == "sweep.figures"]
OTHERS = [module for module in MODULES if module not in FIGURES]


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize(
    ("modules", "least"),
    [
        pytest.param(OTHERS, 100, id="all but figures"),
        # To draw takes half of the time, and tests/figures draws all of it.
        pytest.param(FIGURES, 10, id="figures", marks=pytest.mark.slow),
    ],
)
def test_examples_print_what_they_show(modules: list[ModuleType], least: int) -> None:
    runner = doctest.DocTestRunner(optionflags=OPTIONS)
    wrong: list[str] = []
    count = 0
    for module in modules:
        for one in examples(module):
            count += 1
            runner.run(one, out=wrong.append)
            plt.close("all")
    assert "".join(wrong) == ""
    assert count > least  # else the pattern of examples has become one that finds none
