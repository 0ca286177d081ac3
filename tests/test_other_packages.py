"""Entries of packages that are installed beside us: found, used by every command and
worker, part of the ids, and refused in words where they cannot be used.
"""

import json
import os
import re
import subprocess
from pathlib import Path

import pandas as pd
import pytest

from tests import ROOT
from tests.commands import SWEEP, started_in_turn
from tests.oscillators import SPEC as SPEC_OF_CIRCLES
from tests.other_packages import FILES, OFFERED, RULES, install
from tests.patience import PATIENCE

SPEC = """
study: swirling
model: swirl
preset: standard
seed: 5
replicates: 2
fixed: {n: 12, steps: 30, map: pillar, start_draws: still}
sweep:
  both: {sample: evenly, points: 3, cohesion_weight: {uniform: [0.01, 0.02]},
         max_speed: {uniform: [2, 4]}}
record: {metrics: [rightwards, speed], series: [rightwards], every: 10}
"""


def said(
    folder: Path, *arguments: str, code: int = 0, **variables: str
) -> subprocess.CompletedProcess[str]:
    """A finished command, in a process that finds the packages below `folder`."""
    found = subprocess.run(
        [*SWEEP, *arguments],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(folder / "site-packages")} | variables,
        capture_output=True,
        text=True,
        timeout=PATIENCE,
    )
    assert found.returncode == code, found.stderr
    return found


def said_in_turn(
    folder: Path, *commands: tuple[str, ...], code: int = 0
) -> list[subprocess.CompletedProcess[str]]:
    """The finished commands, all of them in one process that finds the packages."""
    found = started_in_turn(folder, folder / "site-packages", *commands)
    assert [one.returncode for one in found] == [code] * len(commands), found
    return found


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the package, a spec, and the study launched in a worker."""
    here = tmp_path_factory.mktemp("swirling")
    install(here, OFFERED, FILES)
    (here / "spec.yaml").write_text(SPEC)
    assert "6 done" in said(here, "launch", "spec.yaml", "--workers", "1").stderr
    return here


def trials(folder: Path) -> pd.DataFrame:
    parts = (folder / "results" / "swirling" / "parts").glob("*/trials.parquet")
    return pd.concat([pd.read_parquet(part) for part in parts])


NAMES = {"models": "swirl", "metrics": "rightwards", "maps": "pillar"}


def test_commands_take_them_as_they_take_ours(folder: Path) -> None:
    trial = trials(folder)["trial_id"].iloc[0]
    said = said_in_turn(
        folder,
        *((command,) for command in NAMES),
        ("models", "swirl"),
        ("schema",),
        ("table", "swirling"),
        ("verify", "swirling", "--fraction", "1"),
        ("replay", "swirling", trial),
        ("plot", "swirling", "nothing", "scatter"),
        ("plan", "spec.yaml"),
    )
    *listed, model, schema, table, verified, replayed, drawn, planned = [
        one.stdout for one in said
    ]
    for name, lines in zip(NAMES.values(), listed, strict=True):
        assert name in lines
        assert "(swirling 1.0)" in lines
    assert "at rest" in " ".join(re.split(r"[\s│]+", model))
    assert '"swirl"' in schema
    assert "rightwards" in table
    assert "6 of 6" in verified
    assert "identical to the stored values" in replayed
    assert "nothing.png" in drawn
    assert len(drawn.splitlines()) > 1
    assert ", estimated from a probe of 90 steps\n" in planned
    assert trials(folder)["rightwards"].notna().all()


@pytest.mark.slow
def test_an_edit_of_what_they_use_runs_their_trials_again(tmp_path: Path) -> None:
    """And numba compiles it again, though the rule and the model that calls it stand in
    two files.
    """
    install(tmp_path, OFFERED, FILES)
    (tmp_path / "spec.yaml").write_text(SPEC.replace(", start_draws: still", ""))
    said(tmp_path, "launch", "spec.yaml")
    first = trials(tmp_path)
    comment = RULES.replace('"""As the rule', '"""Like the rule')
    install(tmp_path, OFFERED, FILES | {"rules.py": comment})
    assert "nothing was missing" in said(tmp_path, "launch", "spec.yaml").stderr
    install(tmp_path, OFFERED, FILES | {"rules.py": RULES.replace("1.0", "-1.0", 1)})
    changed = said(tmp_path, "diff", "spec.yaml").stdout
    assert "the code has changed (model swirl standard)" in changed
    assert "6 new trials" in said(tmp_path, "launch", "spec.yaml").stderr
    every = trials(tmp_path)
    again = every[~every["trial_id"].isin(first["trial_id"])]
    assert sorted(again["point"]) == sorted(first["point"])
    assert set(again["speed"]) != set(first["speed"])


@pytest.mark.slow
def test_a_rule_that_cannot_be_compiled_is_one_sentence_before_any_work(
    tmp_path: Path,
) -> None:
    wrong = RULES.replace("SIGN * y", "near.nothing")
    install(tmp_path, OFFERED, FILES | {"rules.py": wrong})
    (tmp_path / "spec.yaml").write_text(SPEC)
    sentence = "spec.yaml:3: no trial can be run: "
    commands = ("plan", "spec.yaml"), ("launch", "spec.yaml")
    for found in said_in_turn(tmp_path, *commands, code=2):
        *_, last = found.stderr.splitlines()
        assert last.startswith(sentence)
        assert "rules.py" in last
        assert "nothing" in last
    assert not list(tmp_path.glob("results/**/*.parquet"))


@pytest.mark.slow
def test_a_study_of_a_package_that_is_gone_is_read_and_not_run(folder: Path) -> None:
    bare, trial = {"PYTHONPATH": ""}, trials(folder)["trial_id"].iloc[0]
    for command in (["table", "swirling", "--json"], ["status", "swirling"]):
        there = said(folder, *command).stdout
        assert there
        assert said(folder, *command, **bare).stdout == there
    for command in (["plan", "spec.yaml"], ["replay", "swirling", trial]):
        found = said(folder, *command, code=2, **bare)
        assert 'unknown model "swirl"' in found.stderr.splitlines()[0]
    found = said(folder, "verify", "swirling", code=2, **bare)
    assert "model swirl standard" in found.stderr


BROKEN = {
    "one of ours": (
        {"boidsweep.models": {"nguyen2024": "swirling.model:MODEL"}},
        "models",
        "nguyen2024 cannot be used: swirling 1.0 offers it too, and it is one of ours",
    ),
    "not there": (
        {"boidsweep.models": {"swirl": "swirling.nowhere:MODEL"}},
        "models",
        "swirl cannot be used: swirling 1.0 has it in swirling.nowhere:MODEL:"
        " ModuleNotFoundError: No module named 'swirling.nowhere'",
    ),
    "another kind": (
        {"boidsweep.metrics": {"swirl": "swirling.model:MODEL"}},
        "metrics",
        "swirl cannot be used: swirling 1.0 has in swirling.model:MODEL no Metric but a"
        " Model",
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", BROKEN)
def test_what_cannot_be_used_is_said_and_harms_no_other(
    name: str, tmp_path: Path
) -> None:
    offered, command, sentence = BROKEN[name]
    install(tmp_path, offered, FILES)
    found = said(tmp_path, command)
    assert found.stderr == sentence + "\n"
    assert found.stdout == said(tmp_path, command, PYTHONPATH="").stdout
    (tmp_path / "spec.yaml").write_text(SPEC)
    if sentence.startswith("swirl cannot be used: swirling 1.0 has it"):
        refused = said(tmp_path, "plan", "spec.yaml", code=2).stderr
        assert 'spec.yaml:3: model "swirl' in refused
        assert "cannot be used: swirling 1.0" in refused


OSCILLATORS = (ROOT / "tests" / "oscillators.py").read_text()
CIRCLES = {
    "boidsweep.models": {"oscillators": "swirling.model:MODEL"},
    "boidsweep.metrics": {"order": "swirling.model:ORDER"},
}


@pytest.mark.slow
def test_a_model_with_state_and_kinds_runs_in_workers(tmp_path: Path) -> None:
    install(tmp_path, CIRCLES, {"__init__.py": "", "model.py": OSCILLATORS})
    (tmp_path / "spec.yaml").write_text(SPEC_OF_CIRCLES)
    assert "4 done" in said(tmp_path, "launch", "spec.yaml", "--workers", "2").stderr
    verified = said(tmp_path, "verify", "circles", "--fraction", "1").stdout
    assert "4 of 4 bitwise identical" in verified
    assert f"{4 * 6 * (1 + 7 * 12):,} values of trajectories" in verified
    parts = (tmp_path / "results" / "circles" / "parts").glob("*/trajectories.parquet")
    flights = pd.concat([pd.read_parquet(part) for part in parts])
    assert list(flights)[6:] == ["phase", "frequency", "kind"]
    assert all(kind.tolist() == [0] * 3 + [1] * 9 for kind in flights["kind"])
    # Both points begin with the same flocks.
    assert len({phase.tobytes() for phase in flights["phase"]}) == 4 * 6 - 2


def test_what_is_refused_is_said_with_its_packages(tmp_path: Path) -> None:
    """A state that is a column already, and one name that two packages offer."""
    model = OSCILLATORS.replace('"phase": About', '"vy": About')
    install(tmp_path, CIRCLES, {"__init__.py": "", "model.py": model})
    for package in ("eddies", "whirls"):
        offered = {"boidsweep.models": {"swirl": f"{package}:MODEL"}}
        install(tmp_path, offered, {"__init__.py": ""}, name=package)
    (tmp_path / "spec.yaml").write_text(SPEC_OF_CIRCLES)
    commands = ("models",), ("plan", "spec.yaml")
    listed, planned = started_in_turn(tmp_path, tmp_path / "site-packages", *commands)
    assert (listed.returncode, planned.returncode) == (0, 2)
    why = 'no state can be called "vy": tables have a column of that name'
    place = "oscillators cannot be used: swirling 1.0 has it in swirling.model:MODEL: "
    assert place + why in listed.stderr
    packages = "eddies 1.0, whirls 1.0"
    said = f"swirl cannot be used: several packages offer it: {packages}"
    assert said in listed.stderr
    assert why in planned.stderr
    assert len(planned.stderr.splitlines()) == 1


def test_a_folder_of_the_path_that_is_none_of_packages_is_not_asked(
    tmp_path: Path,
) -> None:
    """Else whoever leaves two files beside a spec could have them run. Nor is the
    folder in which one stands.
    """
    here = install(tmp_path, OFFERED, FILES).rename(tmp_path / "anywhere")
    trap = tmp_path / "ran"
    (here / "swirling" / "__init__.py").write_text(f"open({str(trap)!r}, 'w')")
    found = said(here, "models", PYTHONPATH=str(here))
    assert "swirl" not in found.stdout
    assert not trap.exists()


@pytest.mark.slow
def test_a_package_is_not_imported_for_a_study_that_does_without(
    tmp_path: Path,
) -> None:
    files = FILES | {"model.py": "raise RuntimeError('imported')"}
    install(tmp_path, {"boidsweep.models": OFFERED["boidsweep.models"]}, files)
    text = SPEC.replace("swirl\n", "nguyen2024\n").replace("standard", "as_run")
    text = text.replace(", map: pillar", "")
    for word in (", start_draws: still", "rightwards, "):
        text = text.replace(word, "")
    text = text.replace("[rightwards]", "[speed]").replace("evenly", "random")
    text = text.replace("max_speed: {uniform: [2, 4]}", "drag: {uniform: [0, 0.1]}")
    (tmp_path / "spec.yaml").write_text(text.replace("[0.01, 0.02]", "[1, 2]"))
    assert "6 done" in said(tmp_path, "launch", "spec.yaml").stderr
    plan = json.loads(said(tmp_path, "status", "swirling", "--json").stdout)
    assert plan["study"] == "swirling"
