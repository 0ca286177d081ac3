"""What a failure leaves, against series whose loss and recovery are known."""

import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sweep.analysis.failure_response import Recovery, recovery, resilience
from sweep.design.jobs import Job
from sweep.errors import ChoiceError
from sweep.methods.resilience import resilience_rows
from sweep.tables.stored_study import StoredStudy
from sweep.trial.result import Result, failed
from sweep.trial.simulation import run
from tests.commands import sweep
from tests.searches import replace_trials
from tests.studies import SMALL, launched, relaunch

TIMES = np.arange(0.0, 50.0, 0.5)
FAILED = SMALL.replace(
    "separation_weight: [0.5, 1]",
    "separation_weight: [0.5, 1]\n  failing_share: [0, 0.5]",
).replace("steps: 9", "steps: 40, failing_time: 8, failing_how: stop")


def dip(at: float, depth: float, rate: float, level: float = 2.0) -> np.ndarray:
    """A level that falls by a part `depth` and comes back as an exponential."""
    late = np.maximum(TIMES - at, 0.0)
    return level * (1.0 - depth * np.exp(-rate * late) * late.astype(bool))


@pytest.mark.parametrize("level", [2.0, -3.0])
@pytest.mark.parametrize("within", [0.05, 0.2])
def test_an_exponential_comes_back_when_its_solution_does(
    within: float, level: float
) -> None:
    """depth exp(-rate t) = within at t = log(depth / within) / rate: the first frame at
    or after that, up to the time between frames. What is kept is the mean of the sum.
    """
    whole = np.full(len(TIMES), level)
    found = recovery(TIMES, whole, dip(10.0, 0.6, 0.25, level), 10.0, within)
    exact = math.log(0.6 / within) / 0.25
    assert 0.0 <= found.time - exact < 0.5
    late = TIMES[TIMES > 10.0] - 10.0
    assert found.retained == pytest.approx(
        1 - 0.6 * np.exp(-0.25 * late).mean(), rel=1e-12
    )


def test_what_is_lost_for_good_has_no_time() -> None:
    whole = np.ones(len(TIMES))
    lost = recovery(TIMES, whole, np.where(TIMES > 10.0, 0.7, 1.0), 10.0, 0.1)
    assert lost.retained == pytest.approx(0.7, rel=1e-12)
    assert math.isnan(lost.time)


def test_what_was_never_left_is_reached_at_once() -> None:
    whole = np.ones(len(TIMES))
    assert recovery(TIMES, whole, whole, 10.0, 0.1) == (1.0, 0.0)


def test_a_level_that_is_left_again_is_reached_at_its_last_return() -> None:
    failing = np.ones(len(TIMES))
    failing[(TIMES > 10.0) & (TIMES < 12.0)] = 0.0
    failing[(TIMES > 20.0) & (TIMES < 21.0)] = 0.0
    assert recovery(TIMES, np.ones(len(TIMES)), failing, 10.0, 0.1).time == 11.0


@pytest.mark.parametrize(
    ("whole", "failing", "at"),
    [(0.0, 1.0, 10.0), (1.0, np.nan, 10.0), (np.nan, 1.0, 10.0), (1.0, 1.0, 50.0)],
)
def test_without_a_level_there_is_no_value(
    whole: float, failing: float, at: float
) -> None:
    series = (np.full(len(TIMES), value) for value in (whole, failing))
    assert np.isnan(recovery(TIMES, *series, at, 0.1)).all()


def test_pairs_that_do_not_come_back_count_and_unknown_ones_do_not() -> None:
    pairs = [Recovery(0.5, np.nan), Recovery(0.7, 4.0), Recovery(0.9, 6.0)]
    found = resilience([*pairs, Recovery(np.nan, np.nan)])
    assert found.retained.value == pytest.approx(0.7)
    assert found.retained.n == found.recovered.n == 3
    assert found.recovered.value == pytest.approx(2 / 3)
    assert found.time[0] == 5.0
    assert found.time.n == 2
    assert found.retained.low < 0.7 < found.retained.high
    assert 0.0 < found.recovered.low < found.recovered.high < 1.0


def test_trials_are_compared_with_those_of_their_replicate(tmp_path: Path) -> None:
    """By hand, from the stored series: a row a point with failures."""
    study = launched(FAILED, tmp_path)
    rows = resilience_rows(study, within=0.25)
    assert len(rows) == 2
    series = study.series.merge(study.trials, on="trial_id", suffixes=("", "_last"))
    late = series[series["frame"] * series["dt"] > 8.0]
    keys = ["separation_weight", "failing_share", "replicate"]
    means = late.groupby(keys)["speed"].mean().unstack("failing_share")
    kept = (means[0.5] / means[0.0]).groupby("separation_weight").mean()
    for row in rows.itertuples():
        assert row.failing_share == 0.5
        assert row.kept == pytest.approx(kept[row.separation_weight], rel=1e-12)
        assert (row.pairs, row.lack) == (3, 0)
    assert (rows["kept"] < 0.9).all(), "half of the boids stand"


def test_one_point_with_failures_has_one_row(tmp_path: Path) -> None:
    study = launched(FAILED, tmp_path).where(separation_weight=1)
    assert len(resilience_rows(study, "speed")) == 1


def test_a_trial_without_partner_takes_no_part(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fly(job: Job) -> Result:
        alone = job.replicate == 1 and not job.settings["failing_share"]
        return failed(job, "it rains") if alone else run(job)

    replace_trials(monkeypatch, fly)
    relaunch(FAILED + "on_error: record\n", tmp_path)
    rows = resilience_rows(StoredStudy("small", tmp_path))
    assert rows["pairs"].tolist() == [2, 2]
    assert rows["lack"].tolist() == [1, 1]


def test_points_with_and_without_failures_are_needed(tmp_path: Path) -> None:
    study = launched(FAILED, tmp_path)
    part = study.where(separation_weight=1, failing_share=0.5)
    with pytest.raises(ChoiceError, match="at all points some boids fail"):
        resilience_rows(part)
    with pytest.raises(ChoiceError, match="at all points no boid fails"):
        resilience_rows(study.where(failing_share=0))


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--metric", "sped"), 'unknown recorded series "sped"; did you mean "speed"'),
        (("--within", "1.5"), "within must be between 0 and 1, not 1.5"),
    ],
)
def test_what_cannot_be_is_refused(
    tmp_path: Path, arguments: tuple[str, ...], said: str
) -> None:
    launched(FAILED, tmp_path / "results")
    done = sweep(tmp_path, "resilience", "small", *arguments)
    assert said in done.stderr
    assert done.returncode == 2


def test_a_study_without_series_is_refused(tmp_path: Path) -> None:
    spec = FAILED.replace("record: {series: [speed], every: 2}", "record: {every: 2}")
    with pytest.raises(ChoiceError, match=r"record: \{series: \[...\]\}"):
        resilience_rows(launched(spec, tmp_path))


def test_the_table_has_numbers_of_all_rows(tmp_path: Path) -> None:
    study = launched(FAILED, tmp_path / "results")
    done = sweep(tmp_path, "resilience", "small", "--csv")
    (tmp_path / "rows.csv").write_text(done.stdout)
    read = pd.read_csv(tmp_path / "rows.csv")
    expected = resilience_rows(study)
    np.testing.assert_allclose(read["kept"], expected["kept"], rtol=1e-12)
