"""Launching: what runs, what is kept, and that nothing
but the spec decides the bits.
"""

import re
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import count, takewhile
from pathlib import Path
from types import FrameType

import numpy as np
import pandas as pd
import pytest

from sweep.campaigns.launching import launch
from sweep.campaigns.progress import Progress
from sweep.design.design import expand
from sweep.design.jobs import Job, Jobs
from sweep.errors import ChoiceError, StoreError
from sweep.spec.study import parse_spec
from sweep.store.lock import Lock
from sweep.tables.stored_study import StoredStudy
from sweep.trial.result import Result
from sweep.trial.simulation import run
from sweep.workers.executors import Loky, Serial
from tests import ROOT
from tests.commands import sweep
from tests.studies import COVERING, IMPOSSIBLE, SMALL, launched, relaunch

SOURCES = [*(ROOT / "sweep").rglob("*.py"), *(ROOT / "kernels").rglob("*.py")]
TIMING = ["seconds"]


def same(one: StoredStudy, other: StoredStudy) -> None:
    """Assert that two studies hold the same bits, wall times apart."""
    pd.testing.assert_frame_equal(
        one.trials.drop(columns=TIMING),
        other.trials.drop(columns=TIMING),
        check_exact=True,
    )
    pd.testing.assert_frame_equal(one.series, other.series, check_exact=True)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> StoredStudy:
    return launched(SMALL, tmp_path_factory.mktemp("whole"))


def test_two_workers_give_the_bits_of_one_process(
    whole: StoredStudy, tmp_path: Path
) -> None:
    engine = Loky(2)
    same(launched(SMALL, tmp_path, engine), whole)
    engine.stop()


def test_a_launch_from_coarse_to_fine_gives_the_same_bits(tmp_path: Path) -> None:
    spec = SMALL.replace("n: 12, ", "").replace(
        "separation_weight: [0.5, 1]", "n: [12, 40]"
    )
    plain = launched(spec, tmp_path / "longest first")
    coarse = launched(spec + "order: coarse\n", tmp_path / "coarse first")
    same(coarse, plain)
    ran = [one.store.read("trials", columns=["replicate"]) for one in (plain, coarse)]
    assert ran[0]["replicate"].to_pylist() == [0, 1, 2, 0, 1, 2]
    assert ran[1]["replicate"].to_pylist() == [0, 0, 1, 1, 2, 2]


def test_a_launch_again_runs_nothing(whole: StoredStudy) -> None:
    before = whole.trials
    progress = relaunch(SMALL, whole.store.folder.parent)
    assert progress.missing == 0
    pd.testing.assert_frame_equal(
        StoredStudy("small", whole.store.folder.parent).trials, before
    )


@pytest.mark.parametrize("stop_after", [0, 3])
def test_an_interrupted_launch_keeps_what_is_done_and_goes_on_to_the_same_bits(
    whole: StoredStudy, tmp_path: Path, stop_after: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch:
        patch.setattr("sweep.workers.flying.run", interrupting_after(stop_after))
        with pytest.raises(KeyboardInterrupt):
            relaunch(SMALL, tmp_path)
    progress = relaunch(SMALL, tmp_path)
    assert stop_after < progress.stored < 6
    same(StoredStudy("small", tmp_path), whole)


def interrupting_after(trials: int) -> Callable[[Job], Result]:
    """A `run` during which, after `trials` trials, Ctrl-C is pressed once."""
    calls = count()

    def interrupting(job: Job) -> Result:
        if next(calls) == trials:
            signal.raise_signal(signal.SIGINT)
        return run(job)

    return interrupting


@pytest.mark.parametrize(
    ("first", "then"),
    [("replicates: 3", "replicates: 2"), ("[0.5, 1]", "[1]"), ("[0.5, 1]", "[1, 0.5]")],
    ids=["more replicates", "more values", "another order"],
)
def test_an_extended_study_has_the_bits_of_the_whole_one(
    whole: StoredStudy, tmp_path: Path, first: str, then: str
) -> None:
    stored = relaunch(SMALL.replace(first, then), tmp_path).trials
    assert relaunch(SMALL, tmp_path).stored == stored
    same(StoredStudy("small", tmp_path), whole)


def test_trials_that_left_the_spec_stay_stored_and_out_of_the_tables(
    tmp_path: Path,
) -> None:
    relaunch(SMALL, tmp_path)
    progress = relaunch(SMALL.replace("[0.5, 1]", "[0.5]"), tmp_path)
    study = StoredStudy("small", tmp_path)
    assert (progress.missing, progress.apart, study.apart()) == (0, 3, 3)
    assert len(study.trials) == 3
    assert set(study.series["trial_id"]) == set(study.trials["trial_id"])


@pytest.mark.parametrize("changed", ["steps: 9", "every: 2", "seed: 5"])
def test_a_spec_of_another_meaning_is_recorded_apart(
    tmp_path: Path, changed: str
) -> None:
    relaunch(SMALL, tmp_path)
    progress = relaunch(SMALL.replace(changed, changed[:-1] + "7"), tmp_path)
    assert (progress.stored, progress.apart) == (0, 6)


def test_other_kernels_are_recorded_apart(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    relaunch(SMALL, tmp_path)
    monkeypatch.setattr("kernels.identity._flight_stamp", lambda: "other code")
    progress = relaunch(SMALL, tmp_path)
    assert (progress.stored, progress.apart) == (0, 6)


def test_a_raising_trial_is_a_row_with_its_error_and_its_replay(tmp_path: Path) -> None:
    progress = relaunch(IMPOSSIBLE, tmp_path)
    trials = StoredStudy("small", tmp_path).trials
    assert progress.troubled == 6
    assert set(trials["status"]) == {"failed"}
    assert trials["error"].str.contains("no free place for a boid").all()
    assert list(trials["replay"]) == [
        f"sweep replay small {trial}" for trial in trials["trial_id"]
    ]
    assert trials["speed"].isna().all()


def test_failed_trials_run_again_only_when_asked(tmp_path: Path) -> None:
    relaunch(IMPOSSIBLE, tmp_path)
    assert relaunch(IMPOSSIBLE, tmp_path).missing == 0
    assert relaunch(IMPOSSIBLE, tmp_path, retry=True).missing == 6
    assert len(StoredStudy("small", tmp_path).trials) == 6


def test_progress_is_reported_from_the_start_to_the_end(tmp_path: Path) -> None:
    seen: list[int] = []
    launch(
        parse_spec(SMALL),
        tmp_path,
        Serial(),
        report=lambda progress: seen.append(progress.statuses.total()),
    )
    assert seen[0] == 0
    assert seen == sorted(seen)
    assert seen[-1] == 6


def test_a_launch_whose_study_was_taken_over_stops(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As after its machine has slept. What it has stored is there."""
    taken: list[Lock] = []
    enter = Lock.__enter__

    def entered(lock: Lock) -> Lock:
        taken.append(lock)
        return enter(lock)

    def lose(progress: Progress) -> None:
        taken[0].lost = progress.statuses.total() >= 2

    monkeypatch.setattr(Lock, "__enter__", entered)
    with pytest.raises(StoreError, match="another launch has taken this study over"):
        launch(parse_spec(SMALL), tmp_path, Serial(), report=lose)
    assert 2 <= len(StoredStudy("small", tmp_path).trials) < 6


def test_heatmaps_hold_the_visits_that_coverage_counts(tmp_path: Path) -> None:
    study = launched(COVERING, tmp_path)
    trials = study.trials.set_index("trial_id")
    assert list(study.heatmaps["trial_id"]) == list(trials.index)
    for _, row in study.heatmaps.iterrows():
        visits = row["visits"]
        assert visits.shape == (600, 800)
        share = 100 * (visits > 0).sum() / (visits >= 0).sum()
        assert share == trials.loc[row["trial_id"], "coverage"]


FLOWN = SMALL.replace("every: 2", "every: 2, trajectories: true").replace(
    "separation_weight: [0.5, 1]", "n: [12, 5]"
)
FLOWN = FLOWN.replace("n: 12, ", "")


def test_trajectories_are_stored_by_frame_and_read_by_trial(tmp_path: Path) -> None:
    study = launched(FLOWN, tmp_path)
    frames = study.trajectories
    assert list(frames.columns) == ["trial_id", "frame", "x", "y", "vx", "vy"]
    assert list(frames["frame"]) == [0, 2, 4, 6, 8, 9] * 6
    assert [len(x) for x in frames["x"]] == [12] * 18 + [5] * 18
    parsed = parse_spec(FLOWN)
    for job in Jobs(parsed, expand(parsed)):
        steps, flight = study.trajectory(job.trial_id)
        result = run(job)
        assert steps.tolist() == [0, 2, 4, 6, 8, 9]
        assert flight.tobytes() == result.trajectory.tobytes()
        rows = frames[frames["trial_id"] == job.trial_id]
        assert (np.stack(rows["vy"].tolist()) == result.trajectory[:, 3]).all()


def test_trajectories_are_asked_for(tmp_path: Path) -> None:
    study = launched(SMALL, tmp_path)
    assert study.trajectories.empty
    with pytest.raises(
        ChoiceError, match=r"no trajectory of trial \w+ is stored; record: {"
    ):
        study.trajectory(study.trials["trial_id"][0])
    with pytest.raises(ChoiceError, match='unknown trial "nope"'):
        study.trajectory("nope")


def test_an_interrupted_launch_with_trajectories_goes_on_to_the_same_bits(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch:
        patch.setattr("sweep.workers.flying.run", interrupting_after(3))
        with pytest.raises(KeyboardInterrupt):
            relaunch(FLOWN, tmp_path / "resumed")
    relaunch(FLOWN, tmp_path / "resumed")
    resumed, whole = (
        StoredStudy("small", tmp_path / "resumed"),
        launched(FLOWN, tmp_path / "whole"),
    )
    same(resumed, whole)
    pd.testing.assert_frame_equal(
        resumed.trajectories, whole.trajectories, check_exact=True
    )


def test_a_row_says_all_that_made_it(tmp_path: Path) -> None:
    study = launched(COVERING, tmp_path)
    row = study.trials.iloc[1]
    assert (row["model"], row["preset"], row["seed"], row["replicate"]) == (
        "aziel_chen2025",
        "as_run",
        729,
        1,
    )
    assert (row["map"], row["fov"], row["separation_range"]) == (
        "cafeteria",
        150.0,
        20.0,
    )
    assert study.spec == COVERING
    assert len(study.provenance["kernels_sha"]) == 64
    assert study.provenance["versions"]["numba"]
    assert study.units["coverage"] == "%"


def test_the_mean_is_over_the_last_half(tmp_path: Path) -> None:
    study = launched(COVERING, tmp_path)
    late = (
        study.series[study.series["frame"] > 10]
        .groupby("trial_id", sort=False)["coverage"]
        .mean()
    )
    pd.testing.assert_series_equal(
        study.trials.set_index("trial_id")["coverage_mean"],
        late,
        check_names=False,
        rtol=1e-14,
    )


LIFE = re.compile(r"`((?:sweep|kernels)/[\w/]+\.py)`")


def test_a_trial_passes_the_modules_that_developing_names_in_that_order(
    tmp_path: Path,
) -> None:
    """From the command to a stored part, with an engine that works in this process."""
    text = (ROOT / "DEVELOPING.md").read_text(encoding="utf-8")
    life = text.partition("## The life of a trial")[2].partition("Afterwards")[0]
    named = LIFE.findall(life)
    assert named[0] == "sweep/cli/running.py"
    assert len(named) > 15
    (tmp_path / "spec.yaml").write_text(SMALL)
    with modules_entered() as entered:
        assert sweep(tmp_path, "launch", "spec.yaml").returncode == 0
    left = iter(entered)
    assert list(takewhile(lambda name: name in left, named)) == named


@contextmanager
def modules_entered() -> Iterator[list[str]]:
    """Inside, the files of the project whose functions are called, as they follow each
    other.
    """
    entered: list[str] = []
    names = {str(path): path.relative_to(ROOT).as_posix() for path in SOURCES}

    def note(frame: FrameType, event: str, _argument: object) -> None:
        name = names.get(frame.f_code.co_filename)
        called = event == "call" and frame.f_code.co_name != "<module>"
        if name and called and entered[-1:] != [name]:
            entered.append(name)

    before = sys.getprofile()
    sys.setprofile(note)
    try:
        yield entered
    finally:
        sys.setprofile(before)
