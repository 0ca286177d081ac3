"""Where results come from is written down, cheaply and the same each time."""

import json
import os
import subprocess
from importlib.metadata import version
from pathlib import Path

import pytest

from sweep.spec.study import parse_spec
from sweep.store import provenance
from sweep.store.provenance import git_state, installed, machine
from tests.studies import SMALL

QUIET = {"capture_output": True, "check": True}


@pytest.fixture
def repository(tmp_path: Path) -> Path:
    """A repository with committed code in `sweep` and `kernels`, and a file that git
    ignores.
    """
    for name in ("sweep/one.py", "kernels/two.py", ".gitignore"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(
            "*.pyc\n" if name == ".gitignore" else "a = 1\n", encoding="utf-8"
        )
    (tmp_path / "sweep" / "one.pyc").touch()
    author = ["-c", "user.name=a", "-c", "user.email=a@example.org"]
    for command in (["init"], ["add", "."], [*author, "commit", "-m", "first"]):
        subprocess.run(["git", *command], cwd=tmp_path, **QUIET)  # type: ignore[call-overload]
    return tmp_path


def test_a_clean_tree_is_its_commit(repository: Path) -> None:
    state = git_state(repository / "sweep")
    assert len(state.pop("commit")) == 40
    assert state == {"diff": "", "cut": 0, "untracked": {}}


def test_changed_and_untracked_files_are_written_down(
    repository: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (repository / "kernels" / "two.py").write_text("a = 2\n", encoding="utf-8")
    (repository / "kernels" / "neu é.py").write_text("", encoding="utf-8")
    (repository / "notes.txt").touch()
    state = git_state(repository / "sweep")
    assert "\n-a = 1\n+a = 2\n" in state["diff"]
    nothing = "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855"
    assert (state["cut"], state["untracked"]) == (0, {"kernels/neu é.py": nothing})
    monkeypatch.setattr(provenance, "MOST_DIFF", 20)
    short = git_state(repository / "sweep")
    assert (short["diff"], short["cut"]) == (
        state["diff"][:20],
        len(state["diff"]) - 20,
    )


def test_code_that_lies_in_a_repository_but_is_not_kept_in_it_has_no_git_state(
    repository: Path,
) -> None:
    """As an environment's packages do."""
    (repository / "environment").mkdir()
    (repository / "environment" / "one.pyc").touch()
    assert git_state(repository / "environment") == {}


def test_the_lock_names_what_is_installed() -> None:
    lock = installed()
    assert f"numpy=={version('numpy')}" in lock
    assert list(lock) == sorted(set(lock))
    assert all(line.count("==") == 1 for line in lock)


def test_provenance_is_json_the_same_each_time_and_small() -> None:
    """It is part of every file of a study; the spec and the diff, which come on top,
    are as large as they are.
    """
    study = parse_spec(SMALL)
    one, other = provenance.provenance(study), provenance.provenance(study)
    assert json.dumps(one) == json.dumps(other)
    assert (one["spec"], one["cores"], machine()["cores"]) == (
        SMALL,
        os.cpu_count(),
        os.cpu_count(),
    )
    assert len(json.dumps(one | {"git": {}})) < 10_000
