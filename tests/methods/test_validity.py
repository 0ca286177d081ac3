"""Whether conclusions hold with other numerics: known answers, and how often a word is
wrong.
"""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from sweep.campaigns.launching import launch
from sweep.design.jobs import Job
from sweep.errors import ChoiceError, StoreError
from sweep.loaded import LoadedStudy
from sweep.methods.robustness import AS_IT_IS, outcome_of
from sweep.methods.robustness.report import _notes
from sweep.own_code.reading import with_variants
from sweep.spec.study import parse_spec
from sweep.trial.result import Result
from sweep.workers.executors import Serial
from tests.cases import slow_but
from tests.methods.measured_validity import said_of, wrong_words
from tests.searches import done, replace_trials

STIFF = """
study: stiff
model: nanobot
fixed: {steps: 1}
sweep:
  cohesion_weight: [1, 0.5, 2.5]
  n: [10, 20]
replicates: 8
seed: 5
record: {metrics: [speed, turn_rate]}
validate: {dt: [1/2, 1/4], search: all_pairs, update: both}
"""
START, NOISE = 3.0, 0.01
ALL_PAIRS = STIFF.replace("dt: [1/2, 1/4], ", "").replace(", update: both", "")


def relaxing(job: Job) -> Result:
    """A made-up trial: a speed that relaxes towards 1, v' = -k (v - 1), by the explicit
    method of Euler with the step of the job. Beyond k dt = 2 the method is unstable.
    """
    rng = np.random.default_rng([int(job.point, 16), job.replicate])
    rate, step = float(job.settings["cohesion_weight"]), float(job.settings["dt"])
    factor = (1.0 - rate * step) ** int(job.settings["steps"])
    speed = abs(1.0 + (START - 1.0) * factor) + rng.normal(0.0, NOISE)
    return done(job, {"speed": speed, "turn_rate": rate + rng.normal(0.0, NOISE)})


def launched(spec: str, results: Path) -> LoadedStudy:
    """The study after a launch of it and of its variants."""
    first, *others = with_variants(parse_spec(spec))
    for study in (first, *others):
        launch(study, results, Serial())
    return LoadedStudy(first.name, results)


@pytest.fixture
def jobs(monkeypatch: pytest.MonkeyPatch) -> list[Job]:
    """The jobs that run, as they come."""
    return replace_trials(monkeypatch, relaxing)


@pytest.fixture(scope="module")
def stiff(tmp_path_factory: pytest.TempPathFactory) -> LoadedStudy:
    """The made-up study with its variants, launched once."""
    with pytest.MonkeyPatch.context() as monkeypatch:
        replace_trials(monkeypatch, relaxing)
        return launched(STIFF, tmp_path_factory.mktemp("stiff"))


def outcomes(rows: pd.DataFrame, **settings: Any) -> dict[str, str]:
    """By variant, of the conclusion with these values."""
    for name, value in settings.items():
        rows = rows[rows[name] == value]
    return dict(zip(rows["variant"], rows["outcome"], strict=True))


def exactly(rate: float, parts: int) -> float:
    """The speed of a trial without noise."""
    return abs(1.0 + (START - 1.0) * (1.0 - rate / parts) ** parts)


def test_a_sign_that_only_a_long_step_makes_turns(
    stiff: LoadedStudy,
) -> None:
    """With k = 2.5 the speed after a step of 1 is 2, and 1 with k = 1: higher. With
    half the step they are 1.1 and 1.5. With k = 0.5 against 1 it is higher with any.
    """
    assert [exactly(k, 1) for k in (1.0, 2.5)] == [1.0, 2.0]
    assert [exactly(k, 2) for k in (1.0, 2.5)] == [1.5, 1.125]
    found = stiff.validity()
    at = {"metric": "speed", "axis": "cohesion_weight", "n": 10}
    assert outcomes(found.rows, **at, cohesion_weight=2.5) == {
        AS_IT_IS: "",
        "dt-1of2": "turns",
        "dt-1of4": "turns",
        "all-pairs": "survives",
        "update-synchronous": "survives",
    }
    held = outcomes(found.rows, **at, cohesion_weight=0.5)
    assert {*held.values()} == {"", "survives"}
    rows = found.rows[(found.rows["metric"] == "speed") & (found.rows["n"] == 10)]
    for _, row in rows[rows["axis"] == "cohesion_weight"].iterrows():
        parts = {"dt-1of2": 2, "dt-1of4": 4}.get(row["variant"], 1)
        expected = exactly(row["cohesion_weight"], parts) - exactly(1.0, parts)
        assert row["difference"] == pytest.approx(expected, abs=5 * NOISE)
        assert row["low"] < expected < row["high"]


def test_conclusions_are_differences_to_the_first_point_along_each_axis(
    stiff: LoadedStudy,
) -> None:
    found = stiff.validity("speed")
    table = found.conclusions
    assert table[["axis", "cohesion_weight", "n", "against", "outcome"]].to_numpy(
        object
    ).tolist() == [
        ["cohesion_weight", 0.5, 10, "cohesion_weight = 1", "survives"],
        ["cohesion_weight", 2.5, 10, "cohesion_weight = 1", "turns"],
        ["cohesion_weight", 0.5, 20, "cohesion_weight = 1", "survives"],
        ["cohesion_weight", 2.5, 20, "cohesion_weight = 1", "turns"],
        ["n", 1.0, 20, "n = 10", "not decided"],
        ["n", 0.5, 20, "n = 10", "not decided"],
        ["n", 2.5, 20, "n = 10", "not decided"],
    ]


def test_trials_of_all_pairs_are_the_same_trials(
    stiff: LoadedStudy, tmp_path: Path, jobs: list[Job]
) -> None:
    """With the same bits they are no further occasion to err: intervals are as wide."""
    found = stiff.validity("speed")
    assert found.bits == {"all-pairs": (48, 48)}
    alone = STIFF.replace("search: all_pairs, ", "").replace("dt: [1/2, 1/4], ", "")
    both = alone.replace("update", "search: all_pairs, update")
    one, two = (launched(spec, tmp_path).validity("speed") for spec in (alone, both))
    assert {job.all_pairs for job in jobs} == {False, True}
    rows = two.rows[two.rows["variant"] != "all-pairs"].reset_index(drop=True)
    pd.testing.assert_frame_equal(rows, one.rows)


def test_other_bits_are_said_and_judged(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def lost(job: Job) -> Result:
        """The search among all pairs misses somebody in one trial of ten boids."""
        result = relaxing(job)
        wrong = job.all_pairs and job.settings["n"] == 10 and job.replicate == 0
        return done(job, dict.fromkeys(result.last, 9.0)) if wrong else result

    replace_trials(monkeypatch, lost)
    found = launched(ALL_PAIRS, tmp_path).validity("speed")
    assert found.bits == {"all-pairs": (48, 45)}
    rows = found.rows.set_index("variant")["difference"]
    assert not np.array_equal(rows["all-pairs"], rows[AS_IT_IS])


def test_a_metric_of_one_step_is_not_judged_with_another(
    stiff: LoadedStudy,
) -> None:
    found = stiff.validity()
    at = {"metric": "turn_rate", "axis": "cohesion_weight", "n": 10}
    assert outcomes(found.rows, **at, cohesion_weight=2.5) == {
        AS_IT_IS: "",
        "dt-1of2": "not judged",
        "dt-1of4": "not judged",
        "all-pairs": "survives",
        "update-synchronous": "survives",
    }
    note = "-: not judged, because the time step changes the meaning of: "
    (said,) = (line for line in _notes(found) if line.startswith(note))
    assert "turn_rate" in said
    assert not any(line.startswith(note) for line in _notes(stiff.validity("speed")))


def test_adding_the_section_runs_what_is_new_alone(
    tmp_path: Path, jobs: list[Job]
) -> None:
    plain = STIFF[: STIFF.index("validate")]
    launch(parse_spec(plain), tmp_path, Serial())
    ids = {job.trial_id for job in jobs}
    jobs.clear()
    study = launched(ALL_PAIRS, tmp_path)
    assert {*study.trials["trial_id"]} == ids
    assert [job.all_pairs for job in jobs] == [True] * len(ids)
    jobs.clear()
    launched(ALL_PAIRS, tmp_path)
    assert jobs == []


def test_some_points_are_a_family_of_their_own(
    stiff: LoadedStudy,
) -> None:
    few = stiff.where(n=20).validity("speed", confidence=0.9)
    assert few.conclusions["cohesion_weight"].tolist() == [0.5, 2.5]
    assert few.settings == ["cohesion_weight", "n"]
    whole = stiff.validity("speed").rows
    merged = few.rows.merge(
        whole, on=["axis", "cohesion_weight", "n", "against", "variant"]
    )
    assert (merged["difference_x"] == merged["difference_y"]).all()
    assert (merged["high_x"] < merged["high_y"]).all()


@pytest.mark.usefixtures("jobs")
def test_what_cannot_be_judged_is_refused(tmp_path: Path) -> None:
    plain = STIFF[: STIFF.index("validate")].replace("y: stiff", "y: plain")
    launch(parse_spec(plain), tmp_path, Serial())
    with pytest.raises(ChoiceError, match='the spec has no "validate"'):
        LoadedStudy("plain", tmp_path).validity()
    launch(parse_spec(ALL_PAIRS), tmp_path, Serial())
    first = LoadedStudy("stiff", tmp_path)
    with pytest.raises(StoreError, match="the variant with all pairs is not stored:"):
        first.validity()
    study = launched(ALL_PAIRS, tmp_path)
    with pytest.raises(ChoiceError, match='unknown metric "sped"'):
        study.validity("sped")
    with pytest.raises(ChoiceError, match="confidence: 95; allowed"):
        study.validity(confidence=95)
    with pytest.raises(ChoiceError, match="no two points differ along one axis"):
        study.where(n=10, cohesion_weight=1).validity()
    launch(parse_spec(ALL_PAIRS.replace("0.5, 2.5]", "0.5, 2]")), tmp_path, Serial())
    with pytest.raises(StoreError, match="stiff/all-pairs has different points"):
        LoadedStudy("stiff", tmp_path).validity()


def test_missing_trials_are_counted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As of a variant that was interrupted."""

    def stopped(job: Job) -> Result:
        if job.all_pairs and job.replicate == 7:
            raise KeyboardInterrupt
        return relaxing(job)

    replace_trials(monkeypatch, stopped)
    with pytest.raises(KeyboardInterrupt):
        launched(ALL_PAIRS, tmp_path)
    missing = LoadedStudy("stiff", tmp_path).validity("speed").missing
    assert missing["stiff"] == 0
    assert missing["stiff/all-pairs"] > 0


@pytest.mark.parametrize("effect", slow_but([0.0], [0.0, 1.0]))
def test_a_word_is_rarely_wrong(effect: float) -> None:
    """In at most 5 % of studies: more than 16 of 100 have a chance of 1e-5 (binomial).
    What is measured of more of them is in docs/decisions.
    """
    assert wrong_words(effect, studies=100) <= 16


def test_a_large_effect_is_decided() -> None:
    words = said_of([4.0, 4.0, -4.0], studies=40)
    assert sum(row == ["survives", "turns"] for row in words) >= 36


def test_outcomes_follow_from_both_verdicts() -> None:
    shown = "no difference shown"
    assert outcome_of("higher", "higher") == "survives"
    assert outcome_of("lower", "lower") == "survives"
    assert outcome_of("lower", "higher") == "turns"
    for pair in (
        (shown, "higher"),
        ("lower", shown),
        ("too few distinct values", "lower"),
    ):
        assert outcome_of(*pair) == "not decided"
