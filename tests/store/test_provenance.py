"""Where results come from is written down, cheaply and the same each time."""

import json
import os
import subprocess
from importlib.metadata import version
from pathlib import Path

import pytest

from sweep.cli.listing import status_text
from sweep.spec.study import parse_spec
from sweep.store import provenance
from sweep.store import repository as asking
from sweep.store.provenance import installed, machine
from sweep.store.repository import BUILT_FROM, built_from, git_state, study_state
from tests.studies import SMALL, launched

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
        subprocess.run(["git", *command], cwd=tmp_path, **QUIET)
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
    monkeypatch.setattr(asking, "MOST_DIFF", 20)
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


def test_a_spec_is_of_its_own_repository(repository: Path) -> None:
    """Which is told its commit, and nothing else."""
    spec = repository / "sweep" / "spec.yaml"
    spec.write_text(SMALL, encoding="utf-8")
    state = study_state(spec, SMALL)
    commit = git_state(repository / "sweep")["commit"]
    assert state == {"commit": commit, "path": "sweep/spec.yaml", "modified": True}
    author = ["-c", "user.name=a", "-c", "user.email=a@example.org"]
    for command in (["add", "."], [*author, "commit", "-m", "second"]):
        subprocess.run(["git", *command], cwd=repository, **QUIET)
    state = study_state(spec, SMALL)
    assert state["commit"] != commit
    assert not state["modified"]
    (repository / "kernels" / "two.py").write_text("a = 2\n", encoding="utf-8")
    assert study_state(spec, SMALL) == state  # it is not below the spec's folder
    (repository / "sweep" / "one.py").write_text("a = 2\n", encoding="utf-8")
    assert study_state(spec, SMALL) == state | {"modified": True}
    assert study_state(spec, SMALL + "#") == {}  # the text is from elsewhere
    assert study_state(repository / "none.yaml", SMALL) == {}


def test_a_spec_outside_a_repository_has_no_commit(tmp_path: Path) -> None:
    (tmp_path / "spec.yaml").write_text(SMALL, encoding="utf-8")
    assert study_state(tmp_path / "spec.yaml", SMALL) == {}


def test_what_a_wheel_was_built_from_is_read_as_it_was_written(tmp_path: Path) -> None:
    assert built_from(tmp_path) == {}
    (tmp_path / BUILT_FROM).write_text('{"commit": "1"}', encoding="utf-8")
    assert built_from(tmp_path) == {"commit": "1"}
    for broken in ("[]", "{", ""):
        (tmp_path / BUILT_FROM).write_text(broken, encoding="utf-8")
        assert built_from(tmp_path) == {}


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
    one, other = (
        provenance.launch_provenance(study),
        provenance.launch_provenance(study),
    )
    assert json.dumps(one) == json.dumps(other)
    assert (one["spec"], one["cores"], machine()["cores"]) == (
        SMALL,
        os.cpu_count(),
        os.cpu_count(),
    )
    assert len(json.dumps(one | {"git": {}})) < 10_000


def test_status_names_the_commit_of_the_spec(repository: Path) -> None:
    spec = repository / "spec.yaml"
    spec.write_text(SMALL, encoding="utf-8")
    study = launched(spec, repository / "results")
    about = study.provenance["study_git"]
    assert (about["path"], about["modified"]) == ("spec.yaml", True)
    said = f"spec      spec.yaml of commit {about['commit']} (modified)"
    assert said in status_text(study).splitlines()
