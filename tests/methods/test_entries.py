"""A method is one entry: its reports are commands, and reports of a loaded study."""

import json
from pathlib import Path

import pytest

import sweep
from sweep.cli.app import app
from sweep.errors import ChoiceError
from sweep.method import methods
from tests.commands import started_in_turn
from tests.other_packages import install
from tests.studies import SMALL, launched

COUNTING = '''"""How many trials there are, and whether they are many."""

from typing import Annotated

import typer

from sweep.method import Method


def count(
    study,
    many: Annotated[int, typer.Option(help="So many trials are many.")] = 100,
):
    """How many trials a study has."""
    import pandas as pd

    from sweep.tables.reports import Report, TextTable

    trials = len(study.trials)
    rows = pd.DataFrame({"study": [study.name], "trials": [trials]})
    table = TextTable(["study", "trials"], [[study.name, str(trials)]])
    verdict = "many" if trials >= many else "few"
    return Report(rows, {"trials": trials, "verdict": verdict}, [table, verdict])


def studies(results):
    """How many studies a folder has."""
    import pandas as pd

    from sweep.tables.reports import Report

    names = sorted(path.name for path in results.iterdir())
    return Report(pd.DataFrame({"name": names}), names, names)


METHOD = Method(reports=(count,), reports_of_results=(studies,))
'''
BROKEN = "import nowhere_to_be_found"


def test_a_method_of_a_package_is_a_command(tmp_path: Path) -> None:
    launched(SMALL, tmp_path / "results")
    offered = {"counting": "counting.method:METHOD", "broken": "counting.broken:METHOD"}
    files = {"__init__.py": "", "method.py": COUNTING, "broken.py": BROKEN}
    packages = install(tmp_path, {"boidsweep.methods": offered}, files, name="counting")
    text, as_json, csv, latex, restricted, of_results, helped = started_in_turn(
        tmp_path,
        packages,
        ("count", "small"),
        ("count", "small", "--many", "3", "--json"),
        ("count", "small", "--csv"),
        ("count", "small", "--latex"),
        ("count", "small", "--where", "separation_weight=1", "--json"),
        ("studies", "--json"),
        ("count", "--help"),
    )
    assert text.stdout.splitlines()[-1] == "few"
    assert json.loads(as_json.stdout) == {"trials": 6, "verdict": "many"}
    assert csv.stdout == "study,trials\nsmall,6\n"
    assert "small & 6" in latex.stdout
    assert json.loads(restricted.stdout)["trials"] == 3
    assert json.loads(of_results.stdout) == ["small"]
    assert "How many trials a study has." in helped.stdout
    assert "So many trials are many." in helped.stdout
    why = "broken cannot be used: counting 1.0 has it in counting.broken"
    assert why in text.stderr


def test_every_report_is_a_command() -> None:
    names = [
        make.__name__
        for method in methods().values()
        for make in (*method.reports, *method.reports_of_results)
    ]
    assert len(names) >= 7
    commands = [
        one.callback.__name__ for one in app.registered_commands if one.callback
    ]
    assert sorted(set(names) & set(commands)) == sorted(names)


def test_a_loaded_study_has_the_reports_of_its_commands(tmp_path: Path) -> None:
    launched(SMALL, tmp_path)
    study = sweep.load("small", tmp_path)
    with pytest.raises(ChoiceError, match="continue: both"):
        study.report("hysteresis", metric=["speed"], over="half")
    with pytest.raises(ChoiceError, match='unknown report "hysteresys"; did you mean'):
        study.report("hysteresys")


@pytest.mark.parametrize("name", list(methods()))
def test_each_name_of_the_face_of_a_method_is_there(name: str) -> None:
    face = __import__(f"sweep.methods.{name}", fromlist=["__all__"])
    assert face.__all__
    assert all(getattr(face, one) is not None for one in face.__all__)
