"""`sweep rename` and `sweep rm`, as a user calls them."""

from pathlib import Path

import pytest

from tests.commands import sweep
from tests.studies import SMALL


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "small.yaml").write_text(SMALL)
    assert sweep(tmp_path, "launch", "small.yaml").returncode == 0
    return tmp_path


def test_after_a_renaming_it_is_said_what_to_write_into_the_spec(folder: Path) -> None:
    done = sweep(folder, "rename", "small", "other")
    assert (done.returncode, done.stdout) == (0, "results/other\n")
    assert done.stderr == (
        'the spec small.yaml has the study small: write "study: other" in the spec,'
        " or the next launch starts study small from the beginning\n"
    )
    (folder / "small.yaml").write_text(SMALL.replace("study: small", "study: other"))
    assert "nothing was missing" in sweep(folder, "launch", "small.yaml").stderr
    listed = sweep(folder, "table", "other", "--json").stdout
    assert "sweep view other " in listed
    assert "small" not in listed
    trial = next((folder / "results" / "other").glob("parts/*"))
    assert trial.is_dir()
    again = sweep(folder, "rename", "small", "third")
    assert again.returncode == 2
    assert again.stderr == (
        "results/small: no study has been launched here. Stored: other\n"
    )


def test_a_study_that_has_its_old_name_again_needs_no_word(folder: Path) -> None:
    sweep(folder, "rename", "small", "other")
    assert sweep(folder, "rename", "other", "small").stderr == ""


def test_a_study_is_removed_after_a_yes_alone(folder: Path) -> None:
    shown = sweep(folder, "rm", "small", "--dry-run")
    assert (shown.returncode, shown.stderr) == (0, "")
    assert (
        "study      small\nlocation   results/small\ngo         6 stored trials\n"
        in (shown.stdout)
    )
    refused = sweep(folder, "rm", "small")
    assert refused.returncode == 2
    assert refused.stderr.startswith("nothing was removed: there is no terminal")
    assert (folder / "results" / "small" / "plan.parquet").exists()
    (folder / "results" / "small" / "notes.txt").write_text("mine")
    done = sweep(folder, "rm", "small", "--yes")
    assert "freed      " in done.stdout
    assert done.stdout.endswith("stay       notes.txt, which no launch has written\n")
    assert [path.name for path in (folder / "results").rglob("*")] == [
        "small",
        "notes.txt",
    ]
    gone = sweep(folder, "rm", "small", "--yes")
    assert (gone.returncode, gone.stdout) == (2, "")
    assert (folder / "small.yaml").exists()
