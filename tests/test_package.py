"""The package as installed: versions, the guard on its sibling, provenance."""

import pickle
import re
import sys
import tomllib
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pandas as pd
import pytest
from ruamel.yaml import YAML

import sweep
from sweep.errors import (
    ChoiceError,
    SpecError,
    StoreError,
    UnreadableError,
    UserError,
)
from sweep.methods.search.asked_trials import read_asked
from sweep.store.repository import git_state
from sweep.text import installing
from sweep.trial.compiled import OurKernels, check_kernels
from tests import ROOT
from tests.commands import python, run_trials_here
from tests.studies import IMPOSSIBLE, SMALL, launched


def test_one_version_everywhere() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))[
        "project"
    ]
    assert project["version"] == sweep.__version__
    assert f"version: {sweep.__version__}" in (ROOT / "CITATION.cff").read_text(
        encoding="utf-8"
    )


@pytest.fixture
def with_others(tmp_path: Path) -> Path:
    """A folder with another package `kernels`, which cannot be imported."""
    (tmp_path / "kernels").mkdir()
    (tmp_path / "kernels" / "__init__.py").write_text(
        "import huggingface_hub_that_is_not_there", encoding="utf-8"
    )
    return tmp_path


def test_our_kernels_are_found_though_others_stand_first(with_others: Path) -> None:
    said = python("import sweep, kernels; print(kernels.__file__)", with_others)
    assert Path(said.strip()) == ROOT / "kernels" / "__init__.py"


def test_other_kernels_that_are_imported_already_are_refused() -> None:
    other = ModuleType("kernels")
    for file in (None, "/elsewhere/kernels/__init__.py"):
        other.__file__ = file
        with pytest.raises(ImportError, match="import sweep first, or use a separate"):
            check_kernels(other)
    check_kernels(None)
    check_kernels(sys.modules["kernels"])


def test_kernels_that_are_gone_are_said_with_the_way_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A folder of that name without files would be a package, too."""
    monkeypatch.setattr("sweep.trial.compiled.PACKAGE", tmp_path / "sweep")
    for _ in range(2):
        with pytest.raises(ImportError, match="force-reinstall --no-deps boidsweep"):
            OurKernels().find_spec("kernels")
        (tmp_path / "kernels").mkdir(exist_ok=True)
    assert OurKernels().find_spec("numpy") is None


def test_code_outside_a_repository_has_no_git_state(tmp_path: Path) -> None:
    assert git_state(tmp_path) == {}


def test_constraints_pin_exactly_and_name_no_address() -> None:
    lines = (ROOT / "constraints.txt").read_text(encoding="utf-8").split()
    assert lines
    assert all(
        line.count("==") == 1 and "/" not in line and "@" not in line for line in lines
    )


def test_the_public_functions_are_on_one_screen() -> None:
    own = {
        name
        for name, one in vars(sweep).items()
        if getattr(one, "__module__", "") == "sweep"
    }
    public = {name for name in own if not name.startswith("_")}
    assert public | {"errors", "__version__"} == set(sweep.__all__)
    assert isinstance(sweep.errors.StoreError("gone"), sweep.errors.UserError)


@pytest.mark.parametrize(
    ("error", "text"),
    [
        (ChoiceError("needs two", "gains", "pareto"), "study gains: pareto needs two"),
        (StoreError("no trial is stored", "gains"), "study gains: no trial is stored"),
        (UnreadableError("part", "no column n", "run it"), "part: no column n; run it"),
        (SpecError("spec.yaml:3: what is it?"), "spec.yaml:3: what is it?"),
    ],
)
def test_an_error_says_the_same_wherever_it_was_raised(
    error: UserError, text: str
) -> None:
    """Workers send theirs to the coordinator."""
    again = pickle.loads(pickle.dumps(error))
    assert (str(error), str(again)) == (text, text)
    assert vars(again) == vars(error)


def test_an_extra_is_installed_by_its_name() -> None:
    assert installing("view") == 'pip install "boidsweep[view]"'


@pytest.mark.slow
def test_a_page_without_its_extra_says_what_to_install(tmp_path: Path) -> None:
    """In a fresh process, which has not imported the server of pages yet."""
    code = f"""
import sys
from pathlib import Path
from tests.commands import sweep
sys.modules["uvicorn"] = None
for command in ("view", "show"):
    ended = sweep(Path({str(tmp_path)!r}), command)
    print(ended.returncode, ended.stderr.splitlines())
"""
    view, show = python(code).splitlines()
    for said in (view, show):
        assert said.startswith("2 ")
        assert "needs uvicorn, which is not installed" in said
        assert installing("view") in said


@pytest.fixture
def in_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """Starting a worker takes longer than these trials."""
    run_trials_here(monkeypatch)


def test_run_in_two_workers_gives_the_bits_of_a_launch_in_one_process(
    tmp_path: Path,
) -> None:
    same = launched(SMALL, tmp_path / "launched").trials
    study = sweep.run(SMALL, tmp_path, workers=2)
    pd.testing.assert_frame_equal(
        study.trials.drop(columns="seconds"), same.drop(columns="seconds")
    )


@pytest.mark.usefixtures("in_process")
def test_run_takes_a_text_a_mapping_or_a_file_and_returns_what_a_launch_stores(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    whole = launched(SMALL, tmp_path / "launched")
    file = tmp_path / "small.yaml"
    file.write_text(SMALL, encoding="utf-8")
    for number, spec in enumerate(
        (SMALL, YAML(typ="safe").load(SMALL), file, str(file))
    ):
        study = sweep.run(spec, results=tmp_path / str(number))
        pd.testing.assert_frame_equal(
            study.trials.drop(columns="seconds"), whole.trials.drop(columns="seconds")
        )
    assert capfd.readouterr() == ("", "")


@pytest.mark.usefixtures("in_process")
def test_numbers_of_numpy_and_pandas_are_numbers_of_a_spec(tmp_path: Path) -> None:
    plain = YAML(typ="safe").load(SMALL)
    plain["record"]["trajectories"] = True
    whole = sweep.run(plain, tmp_path / "plain")
    given = plain | {
        "fixed": {"n": np.int64(12), np.str_("steps"): np.array(9)},
        "sweep": {"separation_weight": np.linspace(0.5, 1, 2)},
        "replicates": np.uint8(3),
        "seed": pd.Series([5]).iloc[0],
        "record": {
            "series": np.array(["speed"]),
            "every": np.float64(2.0).astype(int),
            "trajectories": np.True_,
        },
    }
    study = sweep.run(given, tmp_path / "numpy")
    read = YAML(typ="safe").load
    assert read(study.spec) == read(whole.spec)
    assert study.plan["trial_id"].equals(whole.plan["trial_id"])
    column = {"separation_weight": pd.Series([0.5, 1.0])}
    assert sweep.plan(plain | {"sweep": column}).points == 2
    assert sweep.plan(plain | {"sweep": {"n_obstacles": range(3)}}).points == 3


WRONG = [
    ({"sweep": {"n": [12, 3 + 4j]}}, "sweep.n[1]: a spec has only dicts"),
    ({"fixed": {"n": {12}}}, "fixed.n: a spec has only dicts"),
    ({"fixed": {4: 12}}, "fixed: a spec has only dicts with string keys"),
    ({"seed": np.datetime64("2020-01-01")}, "seed: a spec has only dicts"),
]


def test_a_mapping_within_itself_is_nested_too_deeply() -> None:
    whole = YAML(typ="safe").load(SMALL)
    whole["fixed"] = {"n": [whole]}
    with pytest.raises(
        TypeError, match=r"^spec \(mapping\), fixed\.n\[0\].*too deeply"
    ):
        sweep.plan(whole)


@pytest.mark.parametrize(("change", "said"), WRONG)
def test_what_no_spec_holds_is_said_with_its_key(
    change: dict[str, Any], said: str
) -> None:
    whole = YAML(typ="safe").load(SMALL) | change
    with pytest.raises(TypeError, match=re.escape(f"spec (mapping), {said}")):
        sweep.plan(whole)


MISTAKEN = [
    ({"model": "nguyen"}, ', model: unknown model "nguyen"; did you mean'),
    ({"fixed": {"n": -1, "steps": 9}}, ", fixed.n: "),
    ({"fixed": {"n": np.uint64(2**63)}}, ", fixed.n: 9223372036854775808 is too large"),
    ({"sweep": {"n": np.array([4, 0])}}, ", sweep.n[1]: "),
    ({"sweeps": {}}, ', sweeps: unknown key "sweeps"; did you mean "sweep"?'),
    ({"replicates": 0, "model": None}, ", model: "),
    ({"model": "./lost.py"}, ', model: there is no file "lost.py"'),
]


def test_what_a_mapping_lacks_is_said_without_a_line() -> None:
    whole = YAML(typ="safe").load(SMALL)
    del whole["model"]
    with pytest.raises(SpecError, match=r'^spec \(mapping\): missing key "model"'):
        sweep.plan(whole)


@pytest.mark.parametrize(("change", "said"), MISTAKEN)
def test_mistakes_of_a_mapping_are_said_with_their_keys(
    change: dict[str, Any], said: str
) -> None:
    whole = YAML(typ="safe").load(SMALL) | change
    with pytest.raises(SpecError) as error:
        sweep.plan(whole)
    assert str(error.value).startswith(f"spec (mapping){said}")
    assert "spec.yaml" not in str(error.value)


@pytest.mark.usefixtures("in_process")
def test_run_again_with_more_replicates_runs_only_those(tmp_path: Path) -> None:
    first = sweep.run(SMALL, tmp_path).trials
    second = sweep.run(SMALL.replace("replicates: 3", "replicates: 4"), tmp_path).trials
    kept = second[second["replicate"] < 3].reset_index(drop=True)
    pd.testing.assert_frame_equal(kept, first)  # their wall times too
    assert len(second) == 8


@pytest.mark.usefixtures("in_process")
def test_run_warns_of_trials_that_did_not_come_to_their_end(tmp_path: Path) -> None:
    with pytest.warns(UserWarning, match="study small: 6 failed, of 6 trials"):
        assert sweep.run(IMPOSSIBLE, tmp_path).statuses() == {"failed": 6}


def test_run_says_what_is_wrong_before_any_work(tmp_path: Path) -> None:
    with pytest.raises(
        SpecError,
        match=r'spec.yaml:3: unknown model "nguyen"; did you mean "nguyen2024"',
    ):
        sweep.run(SMALL.replace("model: nguyen2024", "model: nguyen"), tmp_path)
    with pytest.raises(SpecError, match=r"small.yml: no such file"):
        sweep.run("small.yml", tmp_path)
    with pytest.raises(ValueError, match="workers: -1; allowed: 0"):
        sweep.run(SMALL, tmp_path, workers=-1)
    assert not list(tmp_path.iterdir())


@pytest.mark.usefixtures("in_process")
def test_run_of_a_search_searches(tmp_path: Path) -> None:
    section = (
        "search:\n  parameters: {separation_weight: {uniform: [0.5, 2]}}\n  objectives:"
        " {speed: {maximize: mean}}\n  budget: 12\n  batch: 3\n  held_out: {candidates:"
        " 2, replicates: 2}\n"
    )
    study = sweep.run(
        SMALL.replace("sweep:\n  separation_weight: [0.5, 1]\n", section), tmp_path
    )
    asked = read_asked(study)
    assert asked.description["finished"]
    assert set(asked.table["phase"]) == {"search", "held_out"}


@pytest.mark.usefixtures("in_process")
def test_a_plan_and_a_comparison_are_those_of_the_commands(tmp_path: Path) -> None:
    planned = sweep.plan(SMALL)
    study = sweep.run(SMALL, str(tmp_path), workers=1)
    assert planned.trials == study.plan.num_rows
    assert "points     2 over separation_weight" in planned.as_text()
    found = sweep.compare(
        "small:separation_weight=0.5",
        "small:separation_weight=1",
        ["speed"],
        results=str(tmp_path),
    )
    (row,) = found.rows.to_dict("records")
    means = study.trials.groupby("separation_weight")["speed"].mean()
    assert row["difference"] == pytest.approx(means[1.0] - means[0.5])
    with pytest.raises(sweep.errors.ChoiceError, match='did you mean "speed"'):
        sweep.compare("small", "small", "sped", results=str(tmp_path))


@pytest.mark.parametrize("given", [3, None, Path("small"), ["small"]], ids=repr)
def test_what_is_no_text_is_no_name_of_a_study(given: Any, tmp_path: Path) -> None:
    with pytest.raises(sweep.errors.ChoiceError) as error:
        sweep.load(given, tmp_path)
    wanted = f"study {given} is not allowed; allowed: names of folders below the"
    assert str(error.value).startswith(wanted)


def installs(target: str, makefile: str) -> str:
    """What pip is asked for by a target of the Makefile, and by those that it needs."""
    rule = re.search(rf"^{re.escape(target)}: (.*?)$((?:\n\t.*)*)", makefile, re.M)
    if rule is None:
        return ""
    needed = rule[1].partition("#")[0].split()
    asked = re.findall(r"^\t\$\(UV\) (.*)", rule[2], re.M)
    found = [*(installs(one, makefile) for one in needed), *asked]
    return " ".join(filter(None, found))


def test_make_quickstart_installs_no_tools_of_developers() -> None:
    """And `make test` adds them to the same environment, whichever comes first."""
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    for target in ("quickstart", "reproduce-figures"):
        assert installs(target, makefile) == "--editable '.[sensitivity,view]'"
    for target in ("test", "check", "notebooks", "documents"):
        assert "--group dev" in installs(target, makefile)
        assert installs("quickstart", makefile) in installs(target, makefile)
