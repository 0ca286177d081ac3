"""No launch leaves a checkpoint that nobody asks for, or touches another share's."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import pytest

import sweep.campaigns.campaign as campaign_module
from sweep.campaigns.launching import launch
from sweep.spec.study import parse_spec
from sweep.store.shares import Share
from sweep.store.writer import Writer
from sweep.tables.cleaning import clean, find_waste
from sweep.tables.stored_study import StoredStudy
from sweep.workers import attempts
from sweep.workers.checkpoint_folder import Checkpoints
from sweep.workers.executors import Serial
from tests.commands import sweep
from tests.searches import TINY, searched
from tests.studies import IMPOSSIBLE, SMALL, launched, relaunch

SPEC = SMALL.replace("steps: 9", "steps: 3")
UNTIL = "replicates: {until: {metric: speed, half_width: 1.0e-9}, min: 3, max: 8}"
UNTIL = SPEC.replace("replicates: 3", UNTIL)
SEARCH = TINY.replace("steps: 9", "steps: 2").replace("every: 9", "every: 2")
SEARCH = SEARCH.replace("budget: 30", "budget: 8")
UNKNOWN = "f" * 24
Command = Callable[[Path], None]
R = TypeVar("R")
HALVES = [Share(1, 2), Share(2, 2)]
ENDINGS = ("state", "tried-1", "tried-2", "frames", "state-0123456789ab")


class EagerWriter(Writer[R]):
    """Stores a part of each result."""

    def __init__(self, *given: Any, **options: Any) -> None:
        super().__init__(*given, rows=1, **options)


class Killed(BaseException):
    """Stands for the end of the process: nobody handles it."""


def killed(*_: Any, **__: Any) -> None:
    raise Killed


def left_behind(folder: Path, *trials: str, endings: tuple[str, ...] = ENDINGS) -> Path:
    """The folder of checkpoints of a study; each file of these trials has ten bytes."""
    checkpoints = folder / "checkpoints"
    checkpoints.mkdir(exist_ok=True)
    for trial in trials:
        for ending in endings:
            (checkpoints / f"{trial}.{ending}").write_bytes(b"x" * 10)
    return checkpoints


def stored_trials(folder: Path) -> list[str]:
    study = StoredStudy(folder.name, folder.parent)
    return sorted(study.store.trial_ids())


def launch_again(results: Path) -> None:
    assert relaunch(SPEC, results).missing == 0


def clean_up(results: Path) -> None:
    study = StoredStudy("small", results)
    clean(study, find_waste(study))


@pytest.mark.parametrize("command", [launch_again, clean_up])
def test_a_complete_study_keeps_none(tmp_path: Path, command: Command) -> None:
    """Neither of what is stored nor of what has left the plan."""
    relaunch(SPEC, tmp_path)
    folder = tmp_path / "small"
    checkpoints = left_behind(folder, *stored_trials(folder)[:2], UNKNOWN)
    command(tmp_path)
    assert not checkpoints.exists()
    checkpoints = left_behind(folder)
    command(tmp_path)
    assert not checkpoints.exists()


def test_checkpoints_of_stored_trials_are_deleted_by_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A launch lists the folder at its beginning and its end, not once a part. A brief
    trial has no checkpoint, so nothing is looked for.
    """
    listed, looked = [], []
    discard, files = Checkpoints.discard, Checkpoints._files

    def listing(self: Checkpoints) -> Any:
        listed.append(self.folder)
        return files(self)

    def discarding(self: Checkpoints, trials: list[str]) -> None:
        looked.append(len(trials))
        discard(self, trials)

    monkeypatch.setattr(Checkpoints, "_files", listing)
    monkeypatch.setattr(Checkpoints, "discard", discarding)
    monkeypatch.setattr(attempts, "Writer", EagerWriter)
    relaunch(SPEC, tmp_path / "brief")
    assert (len(listed), looked) == (2, [])
    monkeypatch.setattr(attempts, "is_brief", lambda _job: False)
    relaunch(SPEC, tmp_path / "long")
    assert (len(listed), looked) == (4, [1] * 6)


def test_a_complete_search_keeps_none(tmp_path: Path) -> None:
    searched(SEARCH, tmp_path)
    folder = tmp_path / "tiny"
    checkpoints = left_behind(folder, *stored_trials(folder)[:2], UNKNOWN)
    assert not searched(SEARCH, tmp_path).statuses
    assert not checkpoints.exists()


def test_a_share_deletes_its_own_alone(tmp_path: Path) -> None:
    """Those of another share stay, though their trials are stored or in no plan."""
    relaunch(SPEC, tmp_path)
    folder = tmp_path / "small"
    trials = [*stored_trials(folder), UNKNOWN, "0" * 24]
    ours, theirs = ({one for one in trials if half.has([one])[0]} for half in HALVES)
    assert len(ours) > 1
    assert len(theirs) > 1
    checkpoints = left_behind(folder, *trials)
    launch(parse_spec(SPEC), tmp_path, Serial(), share=HALVES[0])
    assert Checkpoints(checkpoints).trials() == theirs
    assert len(list(checkpoints.iterdir())) == len(theirs) * len(ENDINGS)
    launch(parse_spec(SPEC), tmp_path, Serial(), share=HALVES[1])
    assert not checkpoints.exists()


def test_what_will_run_keeps_its_checkpoint_less_what_was_never_finished(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With --retry also a trial that is stored as failed."""
    relaunch(IMPOSSIBLE, tmp_path)
    folder = tmp_path / "small"
    checkpoints = left_behind(folder, *stored_trials(folder), UNKNOWN)
    monkeypatch.setattr(campaign_module, "run_jobs", killed)
    with pytest.raises(Killed):
        relaunch(IMPOSSIBLE, tmp_path, retry=True)
    assert sorted(path.name for path in checkpoints.iterdir()) == sorted(
        f"{trial}.{ending}" for trial in stored_trials(folder) for ending in ENDINGS[:4]
    )


def test_where_the_plan_grows_only_what_is_stored_goes_before_the_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A later look may ask for a trial that no plan lists yet; `gc` knows no better."""
    launched(UNTIL.replace("max: 8", "max: 4"), tmp_path)
    folder = tmp_path / "small"
    stored = stored_trials(folder)
    checkpoints = left_behind(folder, stored[0], UNKNOWN)
    with monkeypatch.context() as patched:
        patched.setattr(campaign_module, "run_jobs", killed)
        with pytest.raises(Killed):
            relaunch(UNTIL, tmp_path)
    assert Checkpoints(checkpoints).trials() == {UNKNOWN}
    left_behind(folder, stored[0])
    clean_up(tmp_path)
    assert Checkpoints(checkpoints).trials() == {UNKNOWN}
    relaunch(UNTIL, tmp_path)
    assert not checkpoints.exists()


def test_a_search_keeps_what_it_may_ask_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    searched(SEARCH, tmp_path)
    folder = tmp_path / "tiny"
    stored = stored_trials(folder)
    checkpoints = left_behind(folder, stored[0], UNKNOWN)
    longer = SEARCH.replace("budget: 8", "budget: 16")
    with monkeypatch.context() as patched:
        patched.setattr(campaign_module, "run_jobs", killed)
        with pytest.raises(Killed):
            searched(longer, tmp_path)
    assert Checkpoints(checkpoints).trials() == {UNKNOWN}
    assert searched(longer, tmp_path).statuses
    assert not checkpoints.exists()


def test_what_is_no_checkpoint_is_left_alone(tmp_path: Path) -> None:
    relaunch(SPEC, tmp_path)
    trial = stored_trials(tmp_path / "small")[0]
    checkpoints = left_behind(tmp_path / "small", trial)
    others = ["notes.txt", f"{trial}.txt", f"{trial}.state.bak", f"{trial[1:]}.state"]
    for name in others:
        (checkpoints / name).touch()
    (checkpoints / f"{UNKNOWN}.state").mkdir()
    relaunch(SPEC, tmp_path)
    left = {path.name for path in checkpoints.iterdir()}
    assert left == {*others, f"{UNKNOWN}.state"}


def test_gc_says_what_goes_and_how_much_it_freed(tmp_path: Path) -> None:
    study = launched(SPEC, tmp_path / "results")
    left_behind(study.store.folder, *stored_trials(study.store.folder)[:2], UNKNOWN)
    text = "3 checkpoints of trials that are stored or no longer needed"
    dry = sweep(tmp_path, "gc", "small", "--dry-run")
    assert text in dry.stdout
    assert (study.store.folder / "checkpoints").exists()
    done = sweep(tmp_path, "gc", "small")
    assert text in done.stdout
    assert "nothing" not in done.stdout
    assert done.stdout.endswith("freed      150 B\n")
    assert "go         nothing" in sweep(tmp_path, "gc", "small").stdout
