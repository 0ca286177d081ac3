"""Stored trials of robots that differ in parameters of their model."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from sweep.design.jobs import Job
from sweep.tables.stored_study import StoredStudy
from sweep.trial.result import Result
from sweep.trial.simulation import run
from tests.searches import done, replace_trials
from tests.studies import SMALL, launched, relaunch

WITHOUT = SMALL.replace("sweep:\n  separation_weight: [0.5, 1]\n", "")
WITH = f"{WITHOUT}sweep: {{drag_spread: [0, 0.2]}}\n"


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Of a launch without a spread, and of one of the same study with it."""
    folder = tmp_path_factory.mktemp("spreads")
    before = launched(WITHOUT, folder)
    assert "drag_spread" not in before.trials
    progress = relaunch(WITH, folder)
    assert (progress.trials, progress.stored) == (6, 3)
    return folder


@pytest.mark.slow
def test_trials_without_a_spread_are_those_with_0(results: Path) -> None:
    study = StoredStudy("small", results)
    assert sorted(study.trials["drag_spread"]) == [0.0] * 3 + [0.2] * 3
    assert study.points["drag_spread"].tolist() == [0.0, 0.2]
    assert study.varied == ["drag_spread"]
    assert study.where("drag_spread=0").trials["speed"].size == 3


def drawn(job: Job) -> Result:
    """A made-up trial whose speed tells its random numbers and the spread."""
    own = np.random.default_rng([job.seed, job.replicate]).random()
    return done(job, {"speed": own + job.settings.get("drag_spread", 0.0)})


def check_same(study: StoredStudy, flown: Callable[[Job], Result]) -> None:
    """Assert that the job of each stored trial is the one that ran."""
    for row in study.trials.itertuples():
        job = study.job(study.trial(row.trial_id))
        assert job.settings.get("drag_spread", 0.0) == row.drag_spread
        assert job.point == row.point
        assert flown(job).last["speed"] == row.speed


def test_the_jobs_of_stored_trials_are_the_same_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    replace_trials(monkeypatch, drawn)
    launched(WITHOUT, tmp_path)
    progress = relaunch(WITH, tmp_path)
    assert (progress.trials, progress.stored) == (6, 3)
    check_same(StoredStudy("small", tmp_path), drawn)


@pytest.mark.slow
def test_stored_trials_run_again_with_the_same_robots(results: Path) -> None:
    check_same(StoredStudy("small", results), run)
