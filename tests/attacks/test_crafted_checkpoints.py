"""A checkpoint that a stranger has made up, whatever it says, is not gone on from."""

import logging
import os
import stat
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from sweep.design.design import expand
from sweep.design.jobs import Job, Jobs
from sweep.spec.study import parse_spec
from sweep.store import user_key
from sweep.store.store import Store
from sweep.store.user_key import own_key
from sweep.trial import simulation
from sweep.trial.simulation import Simulation, run
from sweep.trial.state import State
from sweep.workers import checkpoint
from sweep.workers.checkpoint import Checkpointed
from sweep.workers.checkpoint_file import Saved, write_state
from tests.studies import SMALL, relaunch
from tests.trial.test_trial import small
from tests.workers.test_checkpoint import TRIAL, named, numbers

STRANGER = bytes(range(32))
FORGED = "is damaged, or was written by another user, or on a machine with another key"


@pytest.fixture(autouse=True)
def _short_calls(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(simulation, "BOID_STEPS_A_CALL", 12 * 3)
    monkeypatch.setattr(checkpoint, "TIMES_LONGER", 0.0)


def filled(name: str, value: Any) -> Callable[[State], State]:
    """The state with one of its arrays filled with a value, or with some."""

    def spoil(state: State) -> State:
        array = state.arrays[name].copy()
        array[...] = value
        return state._replace(arrays=state.arrays | {name: array})

    return spoil


def _advanced(a_job: Job) -> Simulation:
    simulation = Simulation(a_job)
    simulation.advance(3)
    simulation.take_frames()
    return simulation


LIES: dict[str, Callable[[State], State]] = {
    "the truth": lambda state: state,
    "boids elsewhere": filled("flock.x", 1.0),
    "boids far outside": filled("flock.x", 1e300),
    "order beyond": filled("record.watch.order", 2**32 - 1),
    "flock beyond": filled("record.watch.flock_before", 2**62),
    "flock before": filled("record.watch.flock_before", -1),
    "order twice": filled("record.watch.order", 0),
    "neighbours beyond": filled("work.near.boid", 2**32 - 1),
    "frames beyond": filled("record.progress", (3, 2**40)),
    "frames before": filled("record.progress", (3, -(2**40))),
    "step beyond": filled("record.progress", (2**62, 0)),
    "step before": filled("record.progress", (-5, 0)),
    "collisions": filled("record.watch.events", 2**62),
    "truths that are none": filled("record.watch.outside", True),
    "in step for ever": filled("record.watch.in_step", 2**62),
    "another generator": lambda state: state._replace(
        generator={"bit_generator": "MT19937"}
    ),
}


@pytest.mark.parametrize("lie", LIES)
def test_a_sealed_checkpoint_of_a_stranger_is_refused_in_a_sentence(
    lie: str, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """It is complete, of this very code, machine and trial, and well sealed, but with
    another key.
    """
    a_job = named(small("nguyen2024"))
    saved = Saved(LIES[lie](_advanced(a_job).state()), seconds=1.0)
    write_state(tmp_path / f"{TRIAL}.state", TRIAL, saved, STRANGER)
    (tmp_path / f"{TRIAL}.frames").touch()
    with caplog.at_level(logging.WARNING, "sweep"):
        result = Checkpointed(run, tmp_path, 1e9)(a_job)
    [record] = caplog.records
    assert record.getMessage().endswith(f"{FORGED}; the trial restarts at step 0")
    assert numbers(result) == numbers(run(a_job))
    assert list(tmp_path.iterdir()) == []


def test_with_the_stranger_s_key_it_would_have_been_believed(tmp_path: Path) -> None:
    """So that the test above shows the key at work, and not something else that is
    wrong with the file.
    """
    a_job, found = named(small("nguyen2024")), []
    for lie in ("the truth", "boids elsewhere"):
        state = LIES[lie](_advanced(a_job).state())
        write_state(tmp_path / f"{TRIAL}.state", TRIAL, Saved(state, 1.0), STRANGER)
        (tmp_path / f"{TRIAL}.frames").touch()
        found.append(numbers(Checkpointed(run, tmp_path, 1e9, STRANGER)(a_job)))
        (tmp_path / f"{TRIAL}.frames").unlink()
        (tmp_path / f"{TRIAL}.tried-1").unlink(missing_ok=True)
        (tmp_path / f"{TRIAL}.state").unlink(missing_ok=True)
    truth, lied = found
    assert truth["last"] == numbers(run(a_job))["last"]
    assert lied["last"] != truth["last"]


@pytest.mark.slow
def test_a_launch_in_a_stranger_s_folder_is_undisturbed(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """Every trial has a checkpoint of the stranger's, in which all boids stand in one
    place.
    """
    folder, study = tmp_path / "theirs" / "small" / "checkpoints", parse_spec(SMALL)
    folder.mkdir(parents=True)
    jobs = Jobs(study, expand(study))
    for a_job in jobs:
        saved = Saved(filled("flock.x", 1.0)(_advanced(a_job).state()), 1.0)
        write_state(folder / f"{a_job.trial_id}.state", a_job.trial_id, saved, STRANGER)
    relaunch(SMALL, tmp_path / "mine")
    with caplog.at_level(logging.WARNING, "sweep"):
        relaunch(SMALL, tmp_path / "theirs")
    assert caplog.text.count(FORGED) == len(jobs)
    mine, theirs = (
        Store(tmp_path / who / "small").read("trials") for who in ("mine", "theirs")
    )
    same = [name for name in mine.column_names if name != "seconds"]
    assert theirs.sort_by("trial_id").select(same) == mine.sort_by("trial_id").select(
        same
    )


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Where the key of a user is, who has none yet."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    own_key.cache_clear()
    yield tmp_path / "state" / "boidsweep" / "checkpoint.key"
    own_key.cache_clear()


def test_a_key_is_made_once_and_only_its_user_can_read_it(place: Path) -> None:
    key = own_key()
    own_key.cache_clear()
    assert own_key() == key == place.read_bytes()
    assert len(key) == 32
    assert stat.S_IMODE(place.stat().st_mode) == 0o600
    assert stat.S_IMODE(place.parent.stat().st_mode) == 0o700
    assert list(place.parent.iterdir()) == [place]


def test_two_launches_at_once_have_one_key(place: Path) -> None:
    """The second to make one finds that of the first in its place."""
    first = user_key._made(place)
    assert user_key._made(place) == first == own_key()


SPOILT: dict[str, Callable[[Path], object]] = {
    "others can read it": lambda path: path.chmod(0o644),
    "others can write it": lambda path: path.chmod(0o620),
    "short": lambda path: path.write_bytes(b"short"),
    "empty": lambda path: path.write_bytes(b""),
    "a link": lambda path: path.symlink_to(path.rename(path.with_name("elsewhere"))),
    "a pipe": lambda path: (path.unlink(), os.mkfifo(path)),
    "a folder": lambda path: (path.unlink(), path.mkdir()),
}


@pytest.mark.parametrize("what", SPOILT)
def test_a_key_that_others_may_know_is_not_used(
    what: str, place: Path, caplog: pytest.LogCaptureFixture
) -> None:
    before = own_key()
    own_key.cache_clear()
    SPOILT[what](place)
    with caplog.at_level(logging.WARNING, "sweep"):
        key = own_key()
    assert len(key) == 32
    assert key != before
    [record] = caplog.records
    assert str(place) in record.getMessage()
    assert (
        "later launches cannot resume from checkpoints of this launch"
        in record.getMessage()
    )


def test_without_a_home_the_key_is_that_of_the_process(
    place: Path, caplog: pytest.LogCaptureFixture
) -> None:
    place.parent.parent.write_text("no folder")
    with caplog.at_level(logging.WARNING, "sweep"):
        assert own_key() == own_key()
    assert len(caplog.records) == 1


def test_the_key_is_shown_nowhere(tmp_path: Path) -> None:
    assert repr(STRANGER) not in repr(Checkpointed(run, tmp_path, 1.0, STRANGER))
