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
SERVE = {"sweep.show", "sweep.view"}
"""Functions that start a server and a browser."""
OPTIONS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
ENTRIES = [
    (module, name, entry)
    for module in MODULES
    for name, entry in public(module).items()
    if f"{module.__name__}.{name}" not in SERVE
]
NAMES = [f"{module.__name__}.{name}" for module, name, _ in ENTRIES]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A folder with the specs and the stored studies of the examples."""
    folder = tmp_path_factory.mktemp("examples")
    (folder / "spec.yaml").write_text(FIRST, encoding="utf-8")
    (folder / "map.yaml").write_text(MAP, encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        run_trials_here(patch)
        for spec in ("spec.yaml", "map.yaml"):
            sweep.run(spec)
        yield folder


def examples(module: ModuleType, name: str, entry: Any) -> list[doctest.DocTest]:
    """Return the examples of a function, or of a class and its methods."""
    names = vars(module) | {
        "math": math,
        "np": np,
        "pd": pd,
        "plt": plt,
        "sweep": sweep,
    }
    finder = doctest.DocTestFinder(exclude_empty=True)
    found = finder.find(entry, name, module=False, globs=names)
    return [one for one in found if one.examples]


@pytest.mark.parametrize(("module", "name", "entry"), ENTRIES, ids=NAMES)
@pytest.mark.usefixtures("folder")
def test_a_public_entry_has_an_example_that_runs(
    module: ModuleType, name: str, entry: Any
) -> None:
    found = examples(module, name, entry)
    assert found or not inspect.isfunction(entry)
    runner = doctest.DocTestRunner(optionflags=OPTIONS)
    wrong: list[str] = []
    for one in found:
        runner.run(one, out=wrong.append, clear_globs=False)
    plt.close("all")
    assert "".join(wrong) == ""
