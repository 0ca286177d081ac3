"""What the planned trials of a document could notice, from a pilot."""

from pathlib import Path

import pytest

from sweep.cli.progress import ProgressBar
from sweep.published.foresight import outlook_lines, outlooks
from sweep.published.judging import judged, stored_studies
from sweep.published.publications import read_all
from sweep.published.running import run_studies
from sweep.workers.executors import Serial
from tests.commands import sweep
from tests.publications import PUBLISHED, experiments

NARROW = PUBLISHED.replace("margin: 0.2", "margin: 0.001")


def test_planned_trials_are_judged_by_the_few_that_are_there(tmp_path: Path) -> None:
    """Nothing is known at first. 3 trials of the quick scale tell what all 8 could
    notice, and once these are there, they tell it themselves.
    """
    results = tmp_path / "results"
    folder = experiments(tmp_path)
    (full,), (quick,) = (read_all(folder, quick=few) for few in (False, True))
    [nothing] = outlooks(full, quick, results)
    assert nothing.foreseen is None
    assert list(outlook_lines("tiny", [nothing]))[1:] == [
        "  no pilot trials: start-speed"
    ]
    run_studies(quick.studies.values(), results, Serial(), ProgressBar)
    [pilot] = outlooks(full, quick, results)
    assert pilot.foreseen
    assert pilot.foreseen.trials == 8
    few = judged(quick, stored_studies(quick, results))[0][0].verdict
    assert few.noticeable
    assert pilot.foreseen.noticeable < few.noticeable
    run_studies(full.studies.values(), results, Serial(), ProgressBar)
    [whole] = outlooks(full, quick, results)
    verdict = judged(full, stored_studies(full, results))[0][0].verdict
    assert whole.foreseen
    assert whole.foreseen.trials == 8
    assert whole.foreseen.noticeable == verdict.noticeable
    assert whole.foreseen.weak is verdict.weak is False


def test_the_command_marks_what_is_weak_and_runs_nothing(tmp_path: Path) -> None:
    experiments(tmp_path, NARROW)
    assert (
        sweep(tmp_path, "reproduce", "--workers", "1", "--scale", "quick").returncode
        == 0
    )
    before = sorted(path for path in (tmp_path / "results").rglob("*"))
    done = sweep(tmp_path, "reproduce", "--plan")
    assert done.returncode == 0, done.stderr
    first, second = done.stdout.splitlines()
    assert first == (
        "tiny: 1 of 1 claims are weak: the planned trials cannot confirm these claims"
    )
    assert second.startswith("  weak  start-speed: 8 trials detect 0.0")
    assert ", the margin is 0.0015; " in second
    assert sorted(path for path in (tmp_path / "results").rglob("*")) == before


@pytest.mark.parametrize("scale", ["quick", "mutants"])
def test_a_plan_is_of_the_full_scale(tmp_path: Path, scale: str) -> None:
    experiments(tmp_path)
    wrong = sweep(tmp_path, "reproduce", "--plan", "--scale", scale)
    assert (wrong.returncode, wrong.stdout) == (2, "")
    assert f"--plan needs --scale full, not {scale}" in wrong.stderr
