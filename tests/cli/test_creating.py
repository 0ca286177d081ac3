"""`sweep new`: code of one's own, begun as a copy of an example."""

import ast
import csv
import json
import subprocess
import sys
from pathlib import Path
from runpy import run_path

import pytest

from kernels.catalogue import BUILT_IN
from sweep.published.creating import TEMPLATES, create
from sweep.spec.built_in import EXAMPLES
from tests.commands import sweep

MODEL = ["test_eddy.py", "eddy.py", "eddy.yaml"]
AWKWARD = ("frames", "values", "settings", "search", "x1", "vortex", "n" * 60)
"""Names that the examples use themselves, for something else or as their own."""


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_a_model_comes_with_a_study_and_tests(tmp_path: Path) -> None:
    done = sweep(tmp_path, "new", "model", "eddy")
    assert (done.returncode, done.stdout) == (0, "")
    assert done.stderr.splitlines() == [
        "eddy.py, eddy.yaml, test_eddy.py",
        "  sweep check eddy.py",
        "  sweep launch eddy.yaml",
        "  sweep view eddy.yaml",
    ]
    assert names(tmp_path) == sorted(MODEL)
    spec = (tmp_path / "eddy.yaml").read_text()
    assert spec.startswith("# yaml-language-server: $schema=file:///")
    assert "\nstudy: my/eddy\nmodel: ./eddy.py\n" in spec
    assert "vortex" not in "".join(path.read_text() for path in tmp_path.iterdir())


def test_its_study_is_planned_as_it_stands(tmp_path: Path) -> None:
    create("model", "eddy", tmp_path)
    done = sweep(tmp_path, "plan", "eddy.yaml", "--json")
    plan = json.loads(done.stdout)
    assert (plan["points"], plan["trials"]) == (4, 32)
    assert plan["varied"] == ["swirl_weight"]


@pytest.mark.slow
def test_its_study_is_launched_as_it_stands(tmp_path: Path) -> None:
    create("model", "eddy", tmp_path)
    done = sweep(tmp_path, "launch", "eddy.yaml")
    assert "32 new trials (32 done)" in done.stderr
    table = sweep(tmp_path, "table", "my/eddy", "--csv").stdout.splitlines()
    radius = [float(row["flock_radius"]) for row in csv.DictReader(table)]
    assert radius == sorted(radius)
    assert len(radius) == 4


@pytest.mark.slow
def test_its_tests_pass_as_they_stand(tmp_path: Path) -> None:
    *_, tests = create("model", "eddy", tmp_path)
    command = [sys.executable, "-m", "pytest", "-q", "-W", "error", tests.name]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout
    assert "passed" in done.stdout


def test_a_model_is_short_and_has_two_rules(tmp_path: Path) -> None:
    code, *_ = create("model", "eddy", tmp_path)
    text = code.read_text()
    assert 60 <= len(text.splitlines()) <= 115
    assert max(map(len, text.splitlines())) <= 88
    model = run_path(str(code))["MODEL"]
    assert model.name == "eddy"
    assert [rule.name for rule in model.rules] == ["cohesion", "swirl"]


@pytest.mark.parametrize("name", AWKWARD)
@pytest.mark.parametrize("kind", TEMPLATES)
def test_a_copy_differs_by_its_name_alone(kind: str, name: str, tmp_path: Path) -> None:
    """And that in texts alone: no function, argument or import has got another name."""
    template = TEMPLATES[kind]
    for path, file in zip(create(kind, name, tmp_path), template.files, strict=True):
        before, after = (EXAMPLES / file).read_text(), path.read_text()
        if path.suffix == ".py":
            assert without_texts(after) == without_texts(before)
        assert after.count(name) >= before.count(template.name) > 0
        assert template.name == name or template.name not in after


def without_texts(code: str) -> str:
    """The tree of some code, in which all texts are equal."""
    tree = ast.parse(code)
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            node.value = ""
    return ast.dump(tree)


@pytest.mark.parametrize("kind", ["metric", "map", "start"])
def test_the_others_are_one_file(kind: str, tmp_path: Path) -> None:
    done = sweep(tmp_path, "new", kind, "eddy")
    assert (done.returncode, done.stderr) == (0, "eddy.py\n")
    assert names(tmp_path) == ["eddy.py"]
    module = run_path(str(tmp_path / "eddy.py"))
    assert list(module[f"{kind.upper()}S"]) == ["eddy"]


def test_no_file_is_replaced_and_all_that_are_there_are_named(tmp_path: Path) -> None:
    (tmp_path / "test_eddy.py").write_text("mine")
    (tmp_path / "eddy.yaml").symlink_to(tmp_path / "nowhere")
    done = sweep(tmp_path, "new", "model", "eddy")
    assert done.returncode == 2
    assert done.stderr == (
        "eddy.yaml, test_eddy.py: exists already, and no file is replaced; use another"
        " name or --folder\n"
    )
    assert names(tmp_path) == ["eddy.yaml", "test_eddy.py"]
    assert (tmp_path / "test_eddy.py").read_text() == "mine"
    (tmp_path / "other").mkdir()
    assert sweep(tmp_path, "new", "model", "eddy", "--folder", "other").returncode == 0
    assert names(tmp_path / "other") == sorted(MODEL)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("modle", "eddy"), 'unknown kind of code "modle"; did you mean "model"?'),
        (("model", "a-b"), 'but no word of expressions; did you mean "a_b"?'),
        (("model", "Eddy"), 'did you mean "eddy"?'),
        (("model", "2d"), 'did you mean "my_2d"?'),
        (("model", "class"), 'did you mean "my_class"?'),
        (("model", "../eddy"), 'did you mean "my____eddy"?'),
        (("model", "wirbelstärke"), 'did you mean "wirbelst_rke"?'),
        (("model", "n" * 61), f'did you mean "{"n" * 60}"?'),
        (("metric", "seed"), 'of that name; did you mean "my_seed"?'),
        (("metric", "gain_mean"), "tables have a column of that name\n"),
        (
            ("model", "nguyen2024"),
            'the model "nguyen2024" is built in: give the custom',
        ),
        (("metric", "speed"), 'speed.py: the metric "speed" is built in'),
        (("metric", "width"), 'there is a parameter "width" already'),
        (("map", "maze"), 'the map "maze" is built in'),
        (("model", "random"), "would hide the module random, which is installed"),
        (("model", "sys"), "would hide the module sys, which is installed"),
        (("model", "numpy"), "would hide the module numpy, which is installed"),
        (("model", "kernels"), "would hide the module kernels, which is installed"),
        (("model", "parts"), "the name parts is reserved for results"),
        (("model", "eddy", "--folder", "no"), "no: there is no such folder"),
    ],
)
def test_what_is_wrong_is_one_line_and_nothing_is_written(
    arguments: tuple[str, ...], message: str, tmp_path: Path
) -> None:
    done = sweep(tmp_path, "new", *arguments)
    assert done.returncode == 2
    assert message in done.stderr
    assert done.stderr.count("\n") == 1
    assert names(tmp_path) == []


def test_a_name_of_another_package_is_said_with_its_owner(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(BUILT_IN.models, "eddy", BUILT_IN.models["nguyen2024"])
    monkeypatch.setitem(BUILT_IN.models.origins, "eddy", "swirling 1.0")
    done = sweep(tmp_path, "new", "model", "eddy")
    assert done.stderr == (
        'eddy.py: the model "eddy" is of swirling 1.0: give the custom model another'
        " name\n"
    )
