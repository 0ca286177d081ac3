"""Launches that a page asks for: what it is told before, what is written, and what
runs.
"""

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from sweep.errors import ChoiceError, SpecError, UserError
from sweep.store.lock import Lock
from sweep.store.places import place_of
from sweep.tables.stored_study import StoredStudy
from sweep.web import launching
from sweep.web.launching import Launcher, proposed, spec_like, stored_spec
from tests.commands import sweep
from tests.patience import PATIENCE
from tests.searches import TINY
from tests.studies import IMPOSSIBLE, OWN_SMALL, SMALL, launched, same

MORE = SMALL.replace("replicates: 3", "replicates: 4")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with a spec, and with its results."""
    (tmp_path / "spec.yaml").write_text(SMALL)
    launched(SMALL, tmp_path / "results")
    return tmp_path


@pytest.fixture
def launcher(folder: Path) -> Iterator[Launcher]:
    launcher = Launcher(folder / "spec.yaml", folder / "results", ["--workers", "1"])
    yield launcher
    assert launcher.leave() == ""


def ended(launcher: Launcher) -> int:
    """The exit code of what was started, once it has ended."""
    assert launcher.started
    return launcher.started.process.wait(PATIENCE)


def test_a_proposal_says_what_sweep_diff_says(launcher: Launcher) -> None:
    found = launcher.proposed(MORE)
    assert (found.to_run, found.why_not) == (2, "")
    assert found.lines == (
        "@@ -5,6 +5,6 @@\n fixed: {n: 12, steps: 9}\n sweep:\n"
        "   separation_weight: [0.5, 1]\n-replicates: 3\n+replicates: 4\n seed: 5\n"
        " record: {series: [speed], every: 2}"
    )
    launcher.file.write_text(MORE)
    words = [str(launcher.file), "--results", str(launcher.results)]
    assert sweep(launcher.file.parent, "diff", *words).stdout == found.difference + "\n"
    assert found.command == " ".join(["sweep launch", *words, "--workers 1"])


def test_a_launch_writes_the_file_and_gives_the_bits_of_the_command(
    launcher: Launcher, folder: Path
) -> None:
    state = launcher.launch(MORE, launcher.proposed(MORE).digest)
    assert state["started"]["code"] is None
    assert launcher.file.read_text() == MORE
    with pytest.raises(ChoiceError, match="still running"):
        launcher.launch(SMALL, launcher.proposed(SMALL).digest)
    assert launcher.file.read_text() == MORE
    assert ended(launcher) == 0
    assert launcher.state()["started"] | {"process": 0} == {
        "study": "small",
        "process": 0,
        "code": 0,
        "said": "",
    }
    assert same(launched(MORE, folder / "here"), stored(launcher))


def stored(launcher: Launcher) -> StoredStudy:
    return StoredStudy("small", launcher.results)


@pytest.mark.slow
def test_what_a_launch_says_of_its_failure_is_told(launcher: Launcher) -> None:
    impossible = IMPOSSIBLE.replace("seed: 5", "seed: 5\non_error: stop")
    launcher.launch(impossible, launcher.proposed(impossible).digest)
    assert ended(launcher) != 0
    assert "failed" in launcher.state()["started"]["said"]


@pytest.mark.parametrize("code", [0, 3])
def test_the_end_of_what_a_process_said_is_told_where_it_failed(
    launcher: Launcher, monkeypatch: pytest.MonkeyPatch, code: int
) -> None:
    """Of a process that is no sweep, and starts at once."""
    ending = (
        f"import sys; print('first\\nit failed', file=sys.stderr); sys.exit({code})"
    )
    monkeypatch.setattr(launching, "LAST_CHARACTERS", len("it failed\n"))
    monkeypatch.setattr(launching, "PROCESS", [sys.executable, "-S", "-c", ending])
    launcher.launch(SMALL, launcher.proposed(SMALL).digest)
    assert ended(launcher) == code
    started = launcher.state()["started"]
    assert started["code"] == code
    assert started["said"] == ("it failed" if code else "")


def test_a_launch_goes_on_without_the_page_until_it_is_stopped(
    launcher: Launcher,
) -> None:
    long = SMALL.replace("steps: 9", "steps: 20000000")
    assert launcher.stop()["started"] is None
    launcher.launch(long, launcher.proposed(long).digest)
    assert launcher.started
    process = launcher.started.process
    assert f"continues as process {process.pid};" in launcher.leave()
    launcher.stop()
    assert ended(launcher) != 0


def test_a_file_that_was_changed_meanwhile_stays(launcher: Launcher) -> None:
    seen = launcher.proposed(MORE).digest
    launcher.file.write_text(edited := SMALL + "# a note\n")
    with pytest.raises(ChoiceError, match="has changed since this page has read"):
        launcher.launch(MORE, seen)
    assert launcher.file.read_text() == edited
    assert launcher.started is None


def test_a_study_that_is_being_launched_is_not_launched(launcher: Launcher) -> None:
    place = launcher.results / "small"
    with Lock(place_of(place, launcher.results)):
        found = launcher.proposed(MORE)
        assert found.why_not.startswith("The study is being launched by ")
        with pytest.raises(ChoiceError, match="The study is being launched"):
            launcher.launch(MORE, found.digest)
    assert launcher.file.read_text() == SMALL


def test_a_new_study_in_a_new_file(folder: Path) -> None:
    launcher = Launcher(folder / "new.yaml", folder / "results")
    text = SMALL.replace("study: small", "study: view/new")
    found = launcher.proposed(text)
    assert found.difference == "new study  view/new, 6 trials to run"
    assert (found.digest, found.to_run, found.why_not) == ("", 6, "")
    assert found.lines.count("\n+") == len(text.splitlines())
    (folder / "new.yaml").write_text("somebody has been faster")
    with pytest.raises(UserError):
        launcher.launch(text, found.digest)
    assert (folder / "new.yaml").read_text() == "somebody has been faster"


def test_a_page_launches_no_search(launcher: Launcher) -> None:
    search = TINY.replace("study: tiny", "study: small")
    with pytest.raises(SpecError, match='run "sweep search" for "search"'):
        launcher.proposed(search)


def test_a_file_that_cannot_be_is_said_at_once(folder: Path) -> None:
    (folder / "link.yaml").symlink_to(folder / "spec.yaml")
    with pytest.raises(ChoiceError, match="is a link"):
        Launcher(folder / "link.yaml", folder / "results")
    with pytest.raises(ChoiceError, match="there is no folder"):
        Launcher(folder / "lacking" / "spec.yaml", folder / "results")
    (folder / "bad.yaml").write_text(SMALL.replace("steps: 9", "stepps: 9"))
    with pytest.raises(SpecError, match=r'bad\.yaml:5: .*did you mean "steps"'):
        Launcher(folder / "bad.yaml", folder / "results")
    (folder / "two.yaml").write_text(f"{SMALL}---\n{MORE}")
    with pytest.raises(SpecError, match=r"two\.yaml"):
        Launcher(folder / "two.yaml", folder / "results")


def test_a_stored_spec_with_code_is_not_read_without_its_file(tmp_path: Path) -> None:
    with pytest.raises(ChoiceError, match="the stored spec names custom code"):
        stored_spec(launched(OWN_SMALL, tmp_path))


def test_a_page_that_may_not_launch_is_told_the_same(folder: Path) -> None:
    stored = StoredStudy("small", folder / "results")
    study = spec_like(stored_spec(stored), MORE)
    found = proposed(study, stored.spec, folder / "results")
    assert "trials     2 added, 6 kept, 0 dropped" in found.difference
    assert found.why_not.startswith("This page only reads")
    assert found.command == f"sweep launch spec.yaml --results {folder / 'results'}"
