"""Modules of installed packages that a spec names, `swirling.model:MODEL`: no entry
point is needed.
"""

import json
import os
import shutil
import subprocess
from pathlib import Path

import pytest

from sweep.own_code.catalogue import OwnCatalogue, OwnCode
from sweep.own_code.entries import nothing
from sweep.own_code.installed import Installed
from sweep.own_code.sources import Sources
from tests.commands import SWEEP, started_in_turn
from tests.other_packages import FILES, RULES, install
from tests.patience import PATIENCE

SPEC = """
study: named
model: swirling.model:MODEL
preset: standard
seed: 5
replicates: 2
fixed: {n: 12, steps: 30, map: "swirling.tables:pillar"}
sweep: {cohesion_weight: [0.01, 0.02]}
record: {metrics: ["swirling.tables:rightwards", speed], every: 10}
"""
TABLES = """from swirling.entries import MAP, METRIC

METRICS, MAPS = {"rightwards": METRIC}, {"pillar": MAP}
"""
INSTALLED = FILES | {"tables.py": TABLES}


def said(folder: Path, *arguments: str, code: int = 0) -> str:
    """What a command prints, in a process that finds the packages below `folder`."""
    found = subprocess.run(
        [*SWEEP, *arguments],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(folder / "site-packages")},
        capture_output=True,
        text=True,
        timeout=PATIENCE,
    )
    assert found.returncode == code, found.stderr
    return found.stdout + found.stderr


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the package, a spec, and the study launched by two workers."""
    here = tmp_path_factory.mktemp("named")
    install(here, {}, INSTALLED)
    (here / "spec.yaml").write_text(SPEC)
    assert "4 done" in said(here, "launch", "spec.yaml", "--workers", "2")
    return here


def test_a_plan_says_which_modules_run(folder: Path) -> None:
    planned = said(folder, "plan", "spec.yaml")
    listed = "swirling.model, swirling.tables"
    assert f"\nruns code  {listed}\n" in planned


def test_a_module_and_a_file_from_elsewhere_are_written_as_a_spec_names_them() -> None:
    code = OwnCode(
        Sources((("mine.py", ""), ("ring.csv", ""))),
        (("swirling.model", "MODEL"), ("mine.py", None), ("ring.csv", None)),
        (Installed("swirling", "swirling 1.0", "0"),),
        "../shared",
    )
    origins = {
        ("models", "swirl"): "swirling.model",
        ("metrics", "haste"): "mine.py",
        ("starts", "ring"): "ring.csv",
    }
    known = OwnCatalogue(code, nothing(), origins)
    assert known.written("models", "swirl") == "swirling.model:MODEL"
    assert known.written("metrics", "haste") == "../shared/mine.py:haste"
    assert known.written("starts", "ring") == "../shared/ring.csv"
    assert known.runs == ("mine.py", "swirling.model")


def test_nothing_is_imported_without_a_word(folder: Path) -> None:
    refused = said(folder, "plan", "spec.yaml", "--no-code", code=2)
    runs = 'this spec runs code from "swirling.model:MODEL"'
    assert refused == f"spec.yaml:3: {runs}; no code may run\n"


@pytest.mark.slow
def test_stored_trials_are_read_verified_and_run_again(folder: Path) -> None:
    assert "rightwards" in said(folder, "table", "named")
    assert "4 of 4 the same" in said(folder, "verify", "named", "--fraction", "1")
    assert "swirl_weight" in said(folder, "models", "swirling.model:MODEL")
    schema = json.loads(said(folder, "schema", "--spec", "spec.yaml"))
    assert "swirling.model:MODEL" in json.dumps(schema)


@pytest.mark.slow
def test_tables_need_no_package(folder: Path, tmp_path: Path) -> None:
    results = str(folder / "results")
    assert "rightwards" in said(tmp_path, "table", "named", "--results", results)
    refused = said(tmp_path, "verify", "named", "--results", results, code=2)
    assert 'swirling.model: unknown installed package "swirling"' in refused


@pytest.mark.slow
def test_a_package_with_other_code_does_not_run_stored_trials(
    folder: Path, tmp_path: Path
) -> None:
    here = tmp_path / "edited"
    shutil.copytree(folder, here)
    comment = RULES.replace('"""As the rule', '"""Like the rule')
    install(here, {}, INSTALLED | {"rules.py": comment})
    assert "nothing was missing" in said(here, "launch", "spec.yaml")
    other = RULES.replace("SIGN = 1.0", "SIGN = -1.0")
    install(here, {}, INSTALLED | {"rules.py": other})
    refused = said(here, "verify", "named", code=2)
    assert (
        "the code of swirling 1.0, by which the trials are computed, is not" in refused
    )
    changed = said(here, "diff", "spec.yaml")
    assert "the code has changed (model swirl standard)" in changed


WRONG = {
    "swirlin.model:MODEL": (
        'swirlin.model: unknown installed package "swirlin"; did you mean "swirling"?'
    ),
    "swirling.modle:MODEL": "swirling.modle: ModuleNotFoundError: No module named",
    "swirling.model:MODLE": 'swirling.model: MODLE is no Model; it has "MODEL"',
    "json:MODEL": 'json: unknown installed package "json"',
}


def test_what_cannot_be_named_is_an_error_with_its_line(folder: Path) -> None:
    files = [f"wrong-{number}.yaml" for number in range(len(WRONG))]
    for file, model in zip(files, WRONG, strict=True):
        (folder / file).write_text(SPEC.replace("swirling.model:MODEL", model))
    plans = [("plan", file) for file in files]
    found = started_in_turn(folder, folder / "site-packages", *plans)
    for file, words, plan in zip(files, WRONG.values(), found, strict=True):
        assert plan.returncode == 2
        assert f"{file}:3: {words}" in plan.stderr


def test_the_folder_in_which_one_stands_is_no_package(tmp_path: Path) -> None:
    package = install(tmp_path, {}, INSTALLED) / "swirling"
    package.rename(tmp_path / "turning")
    (tmp_path / "spec.yaml").write_text(SPEC.replace("swirling", "turning"))
    refused = said(tmp_path, "plan", "spec.yaml", code=2)
    assert 'unknown installed package "turning"' in refused
