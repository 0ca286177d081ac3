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


def prepared(here: Path) -> Path:
    """A folder with the package and a spec."""
    install(here, {}, INSTALLED)
    (here / "spec.yaml").write_text(SPEC)
    return here


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the package, a spec, and the study launched by two workers."""
    here = prepared(tmp_path_factory.mktemp("named"))
    assert "4 done" in said(here, "launch", "spec.yaml", "--workers", "2")
    return here


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


@pytest.mark.slow
def test_stored_trials_are_read_verified_and_run_again(folder: Path) -> None:
    assert "rightwards" in said(folder, "table", "named")
    verified = said(folder, "verify", "named", "--fraction", "1")
    assert "4 of 4 bitwise identical" in verified
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
    assert "the trials need the code of swirling 1.0, which differs from" in refused
    changed = said(here, "diff", "spec.yaml")
    assert "the code has changed (model swirl standard)" in changed


WRONG = {
    "swirlin.model:MODEL": (
        'swirlin.model: unknown installed package "swirlin"; did you mean "swirling"?'
    ),
    "swirling.modle:MODEL": "swirling.modle: ModuleNotFoundError: No module named",
    "swirling.model:MODLE": 'swirling.model: MODLE is no Model; the file has "MODEL"',
    "json:MODEL": 'json: unknown installed package "json"',
    "turning.model:MODEL": 'turning.model: unknown installed package "turning"',
}


def test_modules_run_where_they_are_named_and_may(tmp_path: Path) -> None:
    """What cannot be named is an error with its line; so is a package that lies in the
    folder in which one stands.
    """
    folder = prepared(tmp_path)
    shutil.copytree(folder / "site-packages" / "swirling", folder / "turning")
    files = [f"wrong-{number}.yaml" for number in range(len(WRONG))]
    for file, model in zip(files, WRONG, strict=True):
        (folder / file).write_text(SPEC.replace("swirling.model:MODEL", model))
    without, plan, *wrong, launched, table = started_in_turn(
        folder,
        folder / "site-packages",
        ("plan", "spec.yaml", "--no-code"),
        ("plan", "spec.yaml"),
        *(("plan", file) for file in files),
        ("launch", "spec.yaml"),
        ("table", "named"),
    )
    runs = 'the spec runs code from "swirling.model:MODEL"'
    assert without.stderr == f"spec.yaml:3: {runs}; no code may run\n"
    assert without.returncode == 2
    assert "\nruns code  swirling.model, swirling.tables\n" in plan.stdout
    for file, words, refused in zip(files, WRONG.values(), wrong, strict=True):
        assert refused.returncode == 2
        assert f"{file}:3: {words}" in refused.stderr
    assert "4 done" in launched.stderr
    assert "rightwards" in table.stdout
