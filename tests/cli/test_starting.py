"""`sweep init`, and `sweep reproduce` without a folder of experiments."""

import json
import re
from contextlib import chdir
from dataclasses import replace
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest
from jsonschema import Draft7Validator

from kernels.models import MODELS
from sweep.design.plan import make_plan
from sweep.methods.search.plan import make_search_plan
from sweep.own_code.reading import load_spec
from sweep.published import model_studies
from sweep.published.model_studies import (
    FEWEST_TRIALS,
    MOST_TRIALS,
    begin_with_model,
)
from sweep.published.starting import begin, built_in_specs
from sweep.spec.schema import json_schema
from sweep.spec.strict_yaml import read_document
from tests import ROOT
from tests.cases import slow_but
from tests.commands import sweep
from tests.publications import experiments

TABLE = "nanobot/one_at_a_time"
ONE_A_MODEL = {name.partition("/")[0]: name for name in built_in_specs()}


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_all_specs_of_the_experiments_are_built_in() -> None:
    files = set(ROOT.glob("experiments/*/*.yaml"))
    published = set(ROOT.glob("experiments/*/published.yaml"))
    assert published
    assert set(built_in_specs().values()) == files - published


def test_without_a_study_all_are_listed(tmp_path: Path) -> None:
    done = sweep(tmp_path, "init")
    rows = [line.split("│") for line in done.stdout.splitlines() if "│" in line]
    listed = {row[1].strip(): [cell.strip() for cell in row[2:-1]] for row in rows}
    assert listed.keys() - {""} == built_in_specs().keys()
    model, trials, time, text = listed["nguyen2024/separation"]
    assert (model, trials) == ("nguyen2024", "2,000")
    assert time.endswith((" s", " min"))
    assert text.startswith("Figure 2 of nguyen2024: the separation weight is swept")
    assert listed["aziel_chen2025/search_cafeteria"][1] == "at most 840"
    assert names(tmp_path) == []


@pytest.mark.parametrize("name", slow_but(ONE_A_MODEL.values(), built_in_specs()))
def test_each_is_planned_from_an_empty_folder_as_the_built_in_one(
    name: str, tmp_path: Path
) -> None:
    with chdir(tmp_path):
        path = begin(name).path
        own, built_in = load_spec(path), load_spec(built_in_specs()[name])
        plan = (
            make_search_plan
            if own.strategy_section and not own.has_design
            else make_plan
        )
        assert own.name == f"my/{path.stem}"
        assert replace(plan(own, 2), study=built_in.name) == plan(built_in, 2)
    first, *lines = own.text.splitlines()
    before = built_in.text.splitlines()
    assert [line for line in lines if line not in before] == [f"study: {own.name}"]
    assert len(lines) == len(before)
    schema = urlsplit(first.removeprefix("# yaml-language-server: $schema="))
    assert schema.scheme == "file"
    found = json.loads(Path(unquote(schema.path)).read_text(encoding="utf-8"))
    assert found == json_schema()
    Draft7Validator(found).validate(read_document(tmp_path / path).value)


def test_where_the_cache_cannot_be_written_a_spec_leads_to_no_schema(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "file"))
    with chdir(tmp_path):
        first, *_ = begin("nguyen2024/quickstart").path.read_text().splitlines()
    assert "$schema" not in first


def test_no_study_of_ones_own_is_called_as_a_built_in_one() -> None:
    used = {load_spec(path).name for path in built_in_specs().values()}
    assert not {name for name in used if name.startswith("my/")}


def test_the_next_commands_are_said(tmp_path: Path) -> None:
    done = sweep(tmp_path, "init", "aziel_chen2025/search_cafeteria", "wide.yaml")
    assert done.stderr.splitlines() == [
        "wide.yaml: study my/wide, from aziel_chen2025/search_cafeteria",
        "  sweep plan wide.yaml",
        "  sweep search wide.yaml",
    ]
    (tmp_path / "a folder").mkdir()
    done = sweep(tmp_path, "init", "nguyen2024/cohesion", "a folder/fast.yml")
    assert done.stderr.endswith("  sweep launch 'a folder/fast.yml'\n")
    assert sweep(tmp_path, "plan", "a folder/fast.yml").returncode == 0


def test_no_file_is_replaced_without_force(tmp_path: Path) -> None:
    spec = tmp_path / "cohesion.yaml"
    spec.write_text("mine")
    done = sweep(tmp_path, "init", "nguyen2024/cohesion")
    assert done.returncode == 2
    assert done.stderr == "cohesion.yaml: exists already; --force replaces it\n"
    done = sweep(tmp_path, "init", "cohesion.yaml", "--model", "nanobot")
    assert done.stderr == "cohesion.yaml: exists already; --force replaces it\n"
    assert spec.read_text() == "mine"
    assert sweep(tmp_path, "init", "nguyen2024/cohesion", "--force").returncode == 0
    assert "study: my/cohesion\n" in spec.read_text()


def test_tables_that_a_spec_names_are_copied(tmp_path: Path) -> None:
    built_in = built_in_specs()[TABLE].with_suffix(".csv").read_bytes()
    table = tmp_path / "one_at_a_time.csv"
    table.write_text("mine")
    done = sweep(tmp_path, "init", TABLE)
    assert done.stderr == "one_at_a_time.csv: exists already; --force replaces it\n"
    assert (names(tmp_path), table.read_text()) == ([table.name], "mine")
    done = sweep(tmp_path, "init", TABLE, "--force")
    assert done.stderr.startswith("one_at_a_time.yaml, one_at_a_time.csv: study my/one")
    assert table.read_bytes() == built_in
    done = sweep(tmp_path, "init", TABLE, "again.yaml")  # the table is there already
    assert done.stderr.startswith("again.yaml: study my/again, from nanobot/one_at_a")


@pytest.mark.parametrize(
    ("model", "preset"),
    slow_but(
        [(name, next(iter(model.presets))) for name, model in MODELS.items()],
        [(name, preset) for name, model in MODELS.items() for preset in model.presets],
    ),
)
def test_a_study_of_any_model_explains_itself_and_takes_some_seconds(
    model: str, preset: str, tmp_path: Path
) -> None:
    """With two workers; what it takes to start them comes on top."""
    with chdir(tmp_path):
        begun = begin_with_model(model, Path("mine.yaml"), preset)
        study = load_spec(begun.path)
    assert (study.name, study.model, study.preset) == ("my/mine", model, preset)
    plan = make_plan(study, workers=2)
    assert (plan.points, study.axes[0].columns.keys()) == (3, set(plan.varied))
    assert 0 < plan.wall_seconds <= 8
    assert plan.trials_per_point >= FEWEST_TRIALS
    assert study.record.series
    lines = study.text.splitlines()
    keys = [number for number, line in enumerate(lines) if line and "#" not in line]
    assert len(keys) == 13
    for number in keys:
        comment, key = lines[number - 1], lines[number]
        depth = len(key) - len(key.lstrip())
        assert comment[depth:].startswith("# "), key
        assert len(comment) > depth + 4


@pytest.mark.parametrize(("seconds", "fewer_steps"), [(1.5, False), (0.3, True)])
def test_where_trials_are_slow_there_are_fewer_and_then_shorter_ones(
    seconds: float, fewer_steps: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(model_studies, "CPU_SECONDS", seconds)
    study = load_spec(begin_with_model("nguyen2024", tmp_path / "a.yaml").path)
    plan = make_plan(study, workers=1)
    assert 0.5 * seconds < plan.cpu_seconds < 1.2 * seconds
    assert FEWEST_TRIALS <= plan.trials_per_point < MOST_TRIALS
    usual = MODELS["nguyen2024"].presets["as_run"]["steps"]
    assert (int(study.fixed["steps"]) < usual) == fewer_steps


def test_a_study_of_an_own_model_is_begun_beside_it_and_runs(tmp_path: Path) -> None:
    assert sweep(tmp_path, "new", "model", "eddy").returncode == 0
    (tmp_path / "eddy.yaml").unlink()
    done = sweep(tmp_path, "init", "--model", "./eddy.py")
    assert (done.returncode, done.stderr.splitlines()[0]) == (
        0,
        "eddy.yaml: study my/eddy, from ./eddy.py",
    )
    spec = tmp_path / "eddy.yaml"
    text = spec.read_text(encoding="utf-8")
    assert "model: ./eddy.py\n" in text
    spec.write_text(re.sub("(replicates|steps): .*", r"\1: 2", text), encoding="utf-8")
    assert "6 new trials (6 done)" in sweep(tmp_path, "launch", "eddy.yaml").stderr
    (tmp_path / "below").mkdir()
    done = sweep(tmp_path, "init", "below/a.yaml", "--model", "./eddy.py")
    assert done.returncode == 2
    assert "--code-from" in done.stderr
    assert not list((tmp_path / "below").iterdir())


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("nguyen2024/seperation",), 'did you mean "nguyen2024/separation"?'),
        (("separation",), 'did you mean "nguyen2024/separation"?'),
        (("nguyen2024/cohesion", "a b.yaml"), 'a b.yaml: study "my/a b" is not'),
        (("a b.yaml", "--model", "nanobot"), 'a b.yaml: study "my/a b" is not'),
        (("nanobot/rules", "--model", "nanobot"), "STUDY and --model exclude each"),
        (("nguyen2024/cohesion", "no/a.yaml"), "no/a.yaml: there is no folder no"),
        (("nguyen2024/cohesion", "a.txt"), 'a.txt: unknown kind of file ".txt"'),
        (("a.yaml",), 'unknown built-in study (see `sweep init`) "a.yaml"'),
        (("a.yaml",), "; a new file alone needs --model MODEL"),
        (("a.yaml", "--model", "nguyen"), 'did you mean "nguyen2024"?'),
        (("--model", "nanobot", "--preset", "as_rum"), 'did you mean "as_run"?'),
        (("a.yaml", "--preset", "as_run"), "--preset: needs --model"),
        (("nanobot/rules", "a.yaml", "--model", "nanobot"), "only a file, a.yaml"),
        (("a.txt", "--model", "nanobot"), 'a.txt: unknown kind of file ".txt"'),
        (("--model", "./none.py"), "none.py"),
    ],
)
def test_what_is_wrong_is_one_line_and_nothing_is_written(
    arguments: tuple[str, ...], message: str, tmp_path: Path
) -> None:
    done = sweep(tmp_path, "init", *arguments)
    assert done.returncode == 2
    assert message in done.stderr
    assert done.stderr.count("\n") == 1
    assert names(tmp_path) == []


def test_reproduce_takes_the_built_in_studies_where_the_folder_has_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    built_in, here = experiments(tmp_path / "package"), tmp_path / "here"
    monkeypatch.setattr("sweep.spec.EXPERIMENTS", built_in)
    (here / "experiments" / "mine").mkdir(parents=True)
    done = sweep(here, "reproduce", "--scale", "quick")
    assert done.returncode == 0, done.stderr
    first, *others = done.stderr.splitlines()
    assert first == (
        "no folder in experiments has a published.yaml: the built-in studies are"
        " reproduced, into results"
    )
    assert not any("this runs code" in line for line in others)
    assert (here / "results" / "quick" / "tiny" / "small").is_dir()
    assert names(built_in.parent) == ["experiments"]
