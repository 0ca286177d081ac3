"""A study is registered before its first trial, and compared afterwards."""

import json
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest

from sweep.campaigns.plan import plan_of
from sweep.errors import ChoiceError, OutputError, SpecError
from sweep.own_code.reading import load_spec
from sweep.sharing.registration import (
    Registration,
    check_registration,
    read_registration,
    register,
)
from sweep.spec.strict_yaml import read_document
from sweep.tables.stored_study import StoredStudy
from tests.commands import sweep
from tests.searches import TINY
from tests.studies import SMALL, launched

CLAIM = "The speed falls with the separation weight."
LONG_AGO = datetime(2020, 1, 2, 3, 4, 5, tzinfo=UTC)


def registered(folder: Path, text: str = SMALL, **options: Any) -> Registration:
    """A registration of a study that is stored nowhere."""
    spec = folder / "spec.yaml"
    spec.write_text(text, encoding="utf-8", newline="")
    study = load_spec(spec)
    options = {"path": folder / "registered.yaml", "time": LONG_AGO} | options
    return register(study, plan_of(study, 1), folder / "results", **options)


def differing(done: Registration) -> list[str]:
    return [fact.subject for fact in done.facts if fact.agrees is False]


def changed(done: Registration, before: str, after: str) -> Path:
    text = done.path.read_text(encoding="utf-8")
    assert before in text
    done.path.write_text(text.replace(before, after), encoding="utf-8")
    return done.path


def test_a_study_that_ran_as_registered_agrees(tmp_path: Path) -> None:
    done = registered(tmp_path, claims=[CLAIM, "Two  spaces\nand lines."])
    assert (done.study, done.time, done.agrees) == ("small", LONG_AGO, None)
    assert done.claims == (CLAIM, "Two spaces and lines.")
    assert done == read_registration(done.path)
    assert done.facts[0].registered == "6"
    checked = check_registration(done.path, launched(SMALL, tmp_path / "results"))
    assert checked.agrees
    assert [fact.subject for fact in checked.facts if fact.agrees] == [
        *("name", "first", "spec", "code", "versions", "design", "trials"),
    ]
    assert checked.sha256 == done.sha256


@pytest.mark.parametrize(
    ("text", "subjects"),
    [
        (SMALL.replace("replicates: 3", "replicates: 4"), ["spec", "design", "trials"]),
        (SMALL.replace("[0.5, 1]", "[0.5, 2]"), ["spec", "design"]),
        (SMALL.replace("seed: 5", "seed: 6"), ["spec"]),
        (SMALL.replace("study: small", "study: small  # a comment"), []),
    ],
)
def test_a_change_of_the_spec_is_named(
    tmp_path: Path, text: str, subjects: list[str]
) -> None:
    done = registered(tmp_path)
    checked = check_registration(done.path, launched(text, tmp_path / "results"))
    assert differing(checked) == subjects
    assert checked.agrees == (not subjects)
    spec = checked.facts[2].stored
    assert ("changed keys: " in str(spec)) == bool(subjects)


def test_results_that_are_older_than_the_registration_are_named(
    tmp_path: Path,
) -> None:
    """They were stored under another folder meanwhile."""
    study = launched(SMALL, tmp_path / "elsewhere")
    done = registered(tmp_path, time=datetime.now(UTC) + timedelta(days=1))
    assert differing(check_registration(done.path, study)) == ["first"]


def test_other_code_and_versions_are_named(tmp_path: Path) -> None:
    study = launched(SMALL, tmp_path / "results")
    done = registered(tmp_path / "results")
    root = read_document(done.path).value
    now = root["versions"]["numpy"]
    root["code"]["metrics"]["speed"] = "abc"
    root["versions"]["numpy"] = "1.0.0"
    done.path.write_text(json.dumps(root), encoding="utf-8")  # JSON is YAML too
    checked = check_registration(done.path, study)
    assert differing(checked) == ["code", "versions"]
    assert checked.facts[3].stored == "metric speed"
    assert checked.facts[4].stored == f"numpy 1.0.0 -> {now}"


def test_another_map_of_equal_name_is_named(tmp_path: Path) -> None:
    disc = "{disc: {x: 400, y: 300, radius: 50}}"
    shapes = f"maps: {{lab: {{size: [800, 600], shapes: [{disc}]}}}}\n"
    spec = SMALL.replace("fixed: {", "fixed: {map: lab, ") + shapes
    study = launched(spec, tmp_path / "results")
    done = registered(tmp_path / "results", spec)
    assert check_registration(done.path, study).agrees
    root = read_document(done.path).value
    root["maps"]["lab"] = "0" * 32
    done.path.write_text(json.dumps(root), encoding="utf-8")
    assert differing(check_registration(done.path, study)) == ["maps"]


def test_missing_trials_and_trials_of_another_version_are_named(
    tmp_path: Path,
) -> None:
    results = tmp_path / "results"
    done = registered(tmp_path)
    launched(SMALL.replace("[0.5, 1]", "[0.5, 2]"), results)
    study = launched(SMALL, results)
    checked = check_registration(done.path, study)
    assert differing(checked) == ["trials"]
    assert "3 of another version of the spec" in str(checked.facts[-1].stored)
    for part in study.store.current_parts():
        study.store.discard(part)
    again = check_registration(done.path, StoredStudy("small", results))
    assert differing(again) == ["first", "trials"]
    assert again.facts[-1].stored == "6 missing"


def test_a_design_that_results_decide_has_a_largest_number(tmp_path: Path) -> None:
    done = registered(tmp_path, TINY)
    root = read_document(done.path).value
    assert root["plan"]["at_most"]
    assert root["plan"]["design_sha256"] == ""
    assert done.facts[0].registered.startswith("at most ")


@pytest.mark.parametrize(
    "text",
    [
        SMALL,
        f"{SMALL}\n\n",
        SMALL.rstrip("\n"),
        f"# ü, a tab\tand spaces  \n{SMALL}",
        SMALL.replace("\n", "\r\n"),
        f"   # indented\n{SMALL}",
    ],
)
def test_the_spec_is_kept_sign_by_sign(tmp_path: Path, text: str) -> None:
    done = registered(tmp_path, text)
    kept = read_document(done.path).value["spec"]
    study = load_spec(tmp_path / "spec.yaml")
    assert kept == study.text
    assert done.path.read_text(encoding="utf-8").count("spec: ") == 1


def test_a_registration_is_never_replaced(tmp_path: Path) -> None:
    done = registered(tmp_path)
    before = done.path.read_bytes()
    with pytest.raises(OutputError, match=r"registered\.yaml: exists already, and a"):
        registered(tmp_path, claims=[CLAIM])
    target = tmp_path / "target.yaml"
    link = tmp_path / "link.yaml"
    link.symlink_to(target)
    with pytest.raises(OutputError, match=r"link\.yaml: exists already"):
        registered(tmp_path, path=link)
    assert done.path.read_bytes() == before
    assert not target.exists()


def test_a_study_with_trials_is_not_registered(tmp_path: Path) -> None:
    launched(SMALL, tmp_path / "results")
    with pytest.raises(ChoiceError, match="6 trials are stored already; register befo"):
        registered(tmp_path)
    assert not (tmp_path / "registered.yaml").exists()


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"claims": ["", CLAIM]}, "a claim is empty"),
        ({"claims": ["bad \udcff"]}, "must be text in UTF-8"),
        ({"path": Path("registered.json")}, "a registration is a YAML file"),
        ({"path": Path("nowhere/registered.yaml")}, "there is no folder nowhere"),
    ],
)
def test_a_wrong_choice_is_an_error_before_a_file_is_written(
    tmp_path: Path, options: dict[str, Any], said: str
) -> None:
    with pytest.raises((ChoiceError, OutputError, SpecError), match=said):
        registered(tmp_path, **options)
    assert {path.name for path in tmp_path.iterdir()} == {"spec.yaml"}


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        ("format: 1", "format: 2", "is no registration; allowed: a file with format"),
        ("replicates: 3", "replicates: 4", "the spec was changed after"),
        ("claims:", "claim:", "was changed: its keys are not"),
        ("\nstudy: small\n", "\nstudy: other\n", "is not the study of"),
        ("flight:", "flights:", "was changed: its keys are not"),
        ("'2020-01-02T03:04:05+00:00'", "yesterday", "must be a time, such as"),
    ],
)
def test_a_changed_file_is_an_error_with_its_line(
    tmp_path: Path, before: str, after: str, said: str
) -> None:
    path = changed(registered(tmp_path), before, after)
    with pytest.raises(SpecError, match=rf"registered\.yaml:\d+: .*{said}"):
        read_registration(path)


def test_the_command_registers_and_checks(tmp_path: Path) -> None:
    (tmp_path / "small.yaml").write_text(SMALL, encoding="utf-8")
    done = sweep(tmp_path, "register", "small.yaml", "--claim", CLAIM)
    assert done.returncode == 0, done.stderr
    assert done.stderr == "small-registration.yaml\n"
    assert f"claim      {CLAIM}" in done.stdout
    assert "trials     6" in done.stdout
    assert sweep(tmp_path, "launch", "small.yaml", "--quiet").returncode == 0
    check = ("register", "small", "--check", "small-registration.yaml")
    assert "trials     agrees" in sweep(tmp_path, *check).stdout
    facts = json.loads(sweep(tmp_path, *check, "--json").stdout)
    assert facts["agrees"] is True
    more = SMALL.replace("replicates: 3", "replicates: 4")
    (tmp_path / "small.yaml").write_text(more, encoding="utf-8")
    assert sweep(tmp_path, "launch", "small.yaml", "--quiet").returncode == 0
    again = sweep(tmp_path, *check)
    assert again.returncode == 1
    assert "spec       differs: changed keys: replicates" in again.stdout
    both = sweep(tmp_path, *check, "--claim", CLAIM)
    assert both.returncode == 2
    assert "leave out --claim, --to, --no-code and" in both.stderr
    check = ("register", "small", "--check", "none.yaml")
    assert "none.yaml: no such file" in sweep(tmp_path, *check).stderr
