"""What there is: the studies in a folder, and the columns of one."""

import json
from pathlib import Path

import pytest

import sweep as package
from tests.commands import sweep
from tests.studies import SMALL, launched


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with two studies, one of them in the folder of a group, and something
    that is none.
    """
    folder = tmp_path_factory.mktemp("overview")
    results = folder / "results"
    launched(SMALL, results)
    launched(SMALL.replace("study: ", "study: group/"), results)
    (results / "damaged").mkdir()
    (results / "damaged" / "plan.parquet").write_bytes(b"no parquet")
    return folder


def test_studies_are_listed_with_how_far_they_are(folder: Path) -> None:
    done = sweep(folder, "list", "--json")
    damaged, group, small = json.loads(done.stdout)
    assert "damaged/plan.parquet" in damaged["error"]
    assert group["study"] == f"group/{small['study']}"
    assert (small["trials"], small["done"], small["missing"]) == (6, 6, 0)
    assert isinstance(small["trials"], int)
    assert damaged["trials"] is None
    assert (small["model"], small["error"]) == ("nguyen2024", "")
    text = sweep(folder, "list").stdout
    assert "not_done" in text
    assert small["study"] in text


def test_every_column_is_listed_with_its_unit_and_meaning(folder: Path) -> None:
    name = json.loads(sweep(folder, "list", "--json").stdout)[-1]["study"]
    study = package.load(name, folder / "results")
    rows = json.loads(sweep(folder, "columns", name, "--json").stdout)
    trials = [row["column"] for row in rows if row["table"] == "trials"]
    assert trials == list(study.trials)
    units = {row["column"]: row["unit"] for row in rows if row["unit"]}
    assert study.units == {one: units[one] for one in study.units}
    speed = next(row for row in rows if row["column"] == "speed")
    assert (speed["type"], speed["unit"]) == ("double", "px/step")
    assert speed["text"] == "mean speed, at the last frame"
    assert "mean speed, at the last frame" in sweep(folder, "columns", name).stdout


def test_the_version_is_said(tmp_path: Path) -> None:
    assert sweep(tmp_path, "--version").stdout == f"boidsweep {package.__version__}\n"
