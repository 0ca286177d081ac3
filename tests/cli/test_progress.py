"""The progress of a launch where nobody looks at a terminal."""

from collections import Counter

import pytest

from sweep.campaigns.progress import Progress
from sweep.cli import progress as shown
from sweep.cli.progress import ProgressBar


class Clock:
    """The seconds that a test says."""

    now = 0.0

    def monotonic(self) -> float:
        return self.now


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    made = Clock()
    monkeypatch.setattr(shown, "time", made)
    return made


def test_a_pipe_gets_the_rate_and_the_time_that_is_left(
    clock: Clock, capsys: pytest.CaptureFixture[str]
) -> None:
    """A line every ten seconds at most. The time before the first results is none of
    trials: kernels are compiled, and workers start.
    """
    progress = Progress(points=1, most=1000, trials=1000, stored=100)
    with ProgressBar("small") as bar:
        for now, new in ((0, 0), (30, 50), (31, 60), (45, 80), (60, 900)):
            clock.now, progress.statuses = now, Counter({"done": new} if new else {})
            bar.show(progress)
    assert capsys.readouterr().err.splitlines() == [
        "small: 1,000 trials, 100 of them stored already",
        "small: 150 of 1,000 trials",
        "small: 180 of 1,000 trials, 2.0 trials/s, about 6.8 min left",
        "small: 1,000 of 1,000 trials, 28.3 trials/s",
    ]


def test_one_trial_is_one(clock: Clock, capsys: pytest.CaptureFixture[str]) -> None:
    progress = Progress(points=1, most=1, trials=1, apart=1)
    with ProgressBar("small") as bar:
        bar.show(progress)
        progress.statuses["done"] += 1
        clock.now = 20
        bar.show(progress)
    said = [*capsys.readouterr().err.splitlines(), bar.summary(progress, "results")]
    assert said == [
        "small: 1 trial, 0 of them stored already",
        "small: 1 stored trial of another version of the spec or of the code: kept,"
        " but not in the tables",
        "small: 1 of 1 trial",
        "small: 1 new trial (1 done) in 20.0 s; 1 trial in results",
    ]


def test_trials_that_go_on_are_counted_with_their_steps(
    capsys: pytest.CaptureFixture[str],
) -> None:
    progress = Progress(points=1, most=2, trials=2, continued=2, steps_saved=4000)
    with ProgressBar("small") as bar:
        bar.show(progress)
    assert capsys.readouterr().err.splitlines() == [
        "small: 2 trials, 0 of them stored already",
        "small: from last states of shorter trials: 2 trials, 4,000 steps less to run",
    ]
