"""A launch asks git about the code: git runs nothing that a repository names."""

import os
import subprocess
from pathlib import Path

import pytest

from sweep.store.repository import git_state, study_state

AUTHOR = ["-c", "user.name=a", "-c", "user.email=a@example.org"]


class Repository:
    """A repository with code that has changed, and a script that leaves a mark."""

    def __init__(self, root: Path) -> None:
        self.root, self.marks = root / "tree", root / "marks"
        self.script = root / "script"
        self.script.write_text(f"#!/bin/sh\necho run >> '{self.marks}'\n")
        self.script.chmod(0o755)
        for name in ("sweep/one.py", "kernels/two.py", "notes.txt"):
            (self.root / name).parent.mkdir(parents=True, exist_ok=True)
            (self.root / name).write_text("a = 1\n")
        self.git("init", "--quiet")
        self.commit(".")
        self.change()

    def commit(self, what: str) -> None:
        """Commit what is there."""
        self.git("add", what)
        self.git(*AUTHOR, "commit", "--quiet", "-m", "code", "--", what)

    def change(self) -> None:
        """Let git look at files, of which one is as it was."""
        for name in ("sweep/one.py", "kernels/two.py"):
            (self.root / name).write_text("a = 2\n")
        notes = self.root / "notes.txt"
        os.utime(notes, (0, notes.stat().st_mtime - 1000))

    def git(self, *arguments: str) -> None:
        command = ["git", "-C", str(self.root), *arguments]
        subprocess.run(command, check=True, capture_output=True)

    def set(self, name: str) -> None:
        """Let a setting name the script."""
        self.git("config", name, str(self.script))

    def attributes(self, text: str) -> None:
        (self.root / ".git" / "info" / "attributes").write_text(f"*.py {text}\n")

    def plainly(self) -> None:
        """What git does by itself must leave a mark, or there is no attack."""
        command, where = ["git", "diff", "HEAD"], {"cwd": self.root, "timeout": 60}
        subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, **where)
        assert self.marks.exists()
        self.marks.unlink()
        self.change()


@pytest.fixture
def repository(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Repository:
    """A repository that no setting of the machine or the user changes."""
    for name in [name for name in os.environ if name.startswith("GIT_")]:
        monkeypatch.delenv(name)
    monkeypatch.setenv("GIT_CONFIG_GLOBAL", os.devnull)
    monkeypatch.setenv("GIT_CONFIG_NOSYSTEM", "1")
    return Repository(tmp_path)


def monitor(repository: Repository) -> None:
    repository.set("core.fsmonitor")


def hook(repository: Repository) -> None:
    place = repository.root / ".git" / "hooks" / "post-index-change"
    place.parent.mkdir(exist_ok=True)
    place.symlink_to(repository.script)


def differ(repository: Repository) -> None:
    repository.set("diff.external")


def driver(repository: Repository) -> None:
    repository.set("diff.evil.command")
    repository.attributes("diff=evil")


def text(repository: Repository) -> None:
    repository.set("diff.evil.textconv")
    repository.attributes("diff=evil")


def clean(repository: Repository) -> None:
    repository.set("filter.evil.clean")
    repository.git("config", "filter.evil.required", "true")
    repository.attributes("filter=evil")


def process(repository: Repository) -> None:
    repository.set("filter.Evil.process")
    repository.attributes("filter=Evil")


def included(repository: Repository) -> None:
    settings = f'[filter "evil"]\nclean = {repository.script}\n'
    (repository.root / ".git" / "more").write_text(settings)
    repository.git("config", "include.path", "more")
    repository.attributes("filter=evil")


def submodule(repository: Repository) -> None:
    inner = repository.root / "sweep" / "inner"
    inner.mkdir()
    subprocess.run(["git", "init", "--quiet"], cwd=inner, check=True)
    more = [*AUTHOR, "commit", "--quiet", "--allow-empty", "-m", "inner"]
    subprocess.run(["git", *more], cwd=inner, check=True)
    repository.commit("sweep/inner")
    monitored = ["git", "config", "core.fsmonitor", str(repository.script)]
    subprocess.run(monitored, cwd=inner, check=True)


def promise(repository: Repository) -> None:
    """A partial clone fetches what it lacks, with a command that its settings name."""
    repository.set("remote.origin.uploadpack")
    for name, value in (
        ("remote.origin.url", str(repository.root)),
        ("remote.origin.promisor", "true"),
        ("extensions.partialClone", "origin"),
        ("core.repositoryFormatVersion", "1"),
    ):
        repository.git("config", name, value)
    blob = ["git", "rev-parse", "HEAD:sweep/one.py"]
    name = subprocess.check_output(blob, cwd=repository.root, text=True).strip()
    (repository.root / ".git" / "objects" / name[:2] / name[2:]).unlink()


ATTACKS = {
    one.__name__: one
    for one in (
        *(monitor, hook, differ, driver, text),
        *(clean, process, included, submodule, promise),
    )
}


@pytest.mark.parametrize("attack", ATTACKS)
def test_git_runs_nothing_that_a_repository_names(
    repository: Repository,
    attack: str,
) -> None:
    ATTACKS[attack](repository)
    repository.plainly()
    state = git_state(repository.root / "sweep")
    repository.change()
    spec = study_state(repository.root / "notes.txt", "a = 1\n")
    assert not repository.marks.exists()
    assert len(state["commit"]) == 40
    assert spec["commit"] == state["commit"]
    lacking = attack == "promise"
    assert ("+++ b/sweep/one.py\n@@ -1 +1 @@\n-a = 1\n" in state["diff"]) != lacking


def test_a_filter_that_no_option_can_name_ends_it(repository: Repository) -> None:
    repository.set("filter.ev=il.clean")
    repository.attributes("filter=ev=il")
    repository.plainly()
    assert git_state(repository.root / "sweep") == {}
    assert not repository.marks.exists()


def test_only_changes_of_the_code_are_kept(repository: Repository) -> None:
    """Whoever gets the results gets the diff: nothing else of the tree is in it."""
    (repository.root / "notes.txt").write_text("a secret\n")
    (repository.root / "sweep" / "one.py").write_bytes(b"a = '\xe9\x1b'\n")
    (repository.root / "sweep" / "two.py").write_text("")
    (repository.root / "more.txt").write_text("")
    state = git_state(repository.root / "sweep")
    assert "secret" not in state["diff"]
    assert "\n+a = '\N{REPLACEMENT CHARACTER}\x1b'\n" in state["diff"]
    assert list(state["untracked"]) == ["sweep/two.py"]
