"""Studies whose grid is refined where a mean crosses a level."""

from collections.abc import Mapping
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sweep.campaigns.launching import check_launches, launch
from sweep.campaigns.plan import plan_of
from sweep.campaigns.progress import Progress
from sweep.design.design import expand
from sweep.design.jobs import Job
from sweep.errors import ChoiceError, SpecError
from sweep.loaded import LoadedStudy
from sweep.spec.study import parse_spec
from sweep.store.shares import Share
from sweep.tables.spec_difference import compare
from sweep.trial.result import Result, failed
from sweep.workers.executors import Serial
from tests.cases import slow_but
from tests.commands import sweep
from tests.searches import done, replace_trials
from tests.studies import SMALL

EDGE, NOISE = 0.2, 0.01
LINE = SMALL.replace("[0.5, 1]", "{linspace: [0, 1, 3]}") + (
    "refine: {metric: speed, at: 2, axes: [separation_weight], until: 0.02,"
    " max: 12, budget: 300}\n"
)
PLANE = (
    LINE.replace("sweep:", "sweep:\n  cohesion_weight: {logspace: [0.01, 1, 3]}")
    .replace("axes: [", "axes: [cohesion_weight, ")
    .replace("0.02", "0.2")
)


def edge_at(settings: Mapping[str, Any]) -> float:
    """Where the mean speed of a made-up trial is 2."""
    return EDGE + 0.2 * float(settings["cohesion_weight"])


def beyond(job: Job) -> Result:
    """A trial whose speed is how far its setting lies beyond the edge, with noise."""
    rng = np.random.default_rng([int(job.point, 16), job.replicate])
    far = float(job.settings["separation_weight"]) - edge_at(job.settings)
    return done(job, {"speed": 2.0 + 5.0 * far + rng.normal(0.0, NOISE)})


def launched(spec: str, results: Path) -> LoadedStudy:
    """The study after a launch."""
    study = parse_spec(spec)
    launch(study, results, Serial())
    return LoadedStudy(study.name, results)


@pytest.fixture
def jobs(monkeypatch: pytest.MonkeyPatch) -> list[Job]:
    """The jobs that run, as they come."""
    return replace_trials(monkeypatch, beyond)


@pytest.fixture(scope="module")
def refined_line(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[Job]]:
    """The results of a launch of a line, and the jobs that it ran."""
    results = tmp_path_factory.mktemp("line")
    with pytest.MonkeyPatch.context() as patch:
        ran = replace_trials(patch, beyond)
        launched(LINE, results)
    return results, ran


STEEP = LINE.replace("at: 2", "at: steepest").replace("until: 0.02", "until: 0.1")


def bent(job: Job) -> Result:
    """A trial whose speed rises as a sigmoid about the edge, with little noise."""
    rng = np.random.default_rng([int(job.point, 16), job.replicate])
    far = float(job.settings["separation_weight"]) - edge_at(job.settings)
    mean = 2.0 + np.tanh(8.0 * far)
    return done(job, {"speed": mean + rng.normal(0.0, 0.002)})


def test_trials_gather_where_the_mean_changes_most(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    jobs = replace_trials(monkeypatch, bent)
    study = launched(STEEP, tmp_path)
    found = study.boundary()
    assert found.crossings is not None
    (row,) = found.crossings.to_dict("records")
    edge = edge_at(jobs[0].settings)
    assert row["low"] < edge < row["high"]
    assert row["estimate"] == pytest.approx(edge, abs=0.2)
    assert (row["direction"], row["resolved"]) == ("up", True)
    assert {*found.cells["state"]} == {"outside", "boundary"}
    plan = plan_of(parse_spec(STEEP), 1)
    assert "where the mean of speed changes most" in plan.as_text()
    again = len(jobs)
    assert launched(STEEP, tmp_path).boundary().crossings.equals(found.crossings)
    assert len(jobs) == again


def test_what_trials_cannot_tell_of_a_slope_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def flat(job: Job) -> Result:
        rng = np.random.default_rng([int(job.point, 16), job.replicate])
        return done(job, {"speed": 2.0 + rng.normal(0.0, 0.1)})

    replace_trials(monkeypatch, flat)
    found = launched(STEEP, tmp_path).boundary()
    assert found.crossings is not None
    assert found.crossings["direction"].tolist() == ["unknown"]
    assert found.crossings["resolved"].tolist() == [False]
    assert {*found.cells["why"]} == {
        "the mean changes most at several values, or changes too little to tell"
    }


def test_trials_gather_where_the_mean_crosses(
    refined_line: tuple[Path, list[Job]],
) -> None:
    results, jobs = refined_line
    found = LoadedStudy("small", results).boundary()
    assert found.crossings is not None
    (row,) = found.crossings.to_dict("records")
    edge = edge_at(jobs[0].settings)
    assert row["low"] < edge < row["high"]
    assert row["low"] < row["estimate"] < row["high"]
    assert row["direction"] == "up"
    assert row["resolved"]
    points = [job.settings["separation_weight"] for job in jobs]
    near = [abs(float(point) - edge) < 0.1 for point in points]
    assert sum(near) > len(jobs) / 2
    assert len(jobs) < 300
    assert {0.0, 0.5, 1.0, 0.25, 0.375} <= set(points)


def test_a_second_launch_runs_nothing(
    refined_line: tuple[Path, list[Job]], jobs: list[Job]
) -> None:
    results, _ = refined_line
    first = LoadedStudy("small", results).plan
    assert launched(LINE, results).plan.equals(first)
    assert jobs == []


@pytest.mark.parametrize(
    ("shape", "stop"),
    slow_but([("line", 9)], [*product(("line", "plane"), (0, 9, 20))]),
)
def test_an_interrupted_launch_comes_to_the_same(
    tmp_path: Path, jobs: list[Job], shape: str, stop: int
) -> None:
    spec = {"line": LINE, "plane": PLANE}[shape]
    whole = launched(spec, tmp_path / "whole")

    def report(progress: Progress) -> None:
        if progress.statuses.total() > stop:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        launch(parse_spec(spec), tmp_path / "1", Serial(), report=report)
    del jobs[:]
    again = launched(spec, tmp_path / "1")
    assert again.plan.equals(whole.plan)
    assert len(jobs) < whole.plan.num_rows
    assert again.boundary().rows.equals(whole.boundary().rows)


def test_an_interrupted_study_says_what_is_missing(
    tmp_path: Path, jobs: list[Job]
) -> None:
    def report(progress: Progress) -> None:
        if progress.statuses.total() > 10:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        launch(parse_spec(PLANE), tmp_path, Serial(), report=report)
    assert 10 < len(jobs) < 27
    cells = LoadedStudy("small", tmp_path).boundary().cells
    left = cells[cells["state"] == "unresolved"]
    assert set(left["why"]) == {"trials are missing"}


def test_trials_of_a_plain_sweep_are_not_run_again(
    tmp_path: Path, jobs: list[Job]
) -> None:
    plain = LINE[: LINE.index("refine:")]
    launched(plain, tmp_path)
    assert len(jobs) == 9
    launched(LINE.replace("until: 0.02", "until: 0.2"), tmp_path)
    assert len(jobs) > 9
    assert len({job.trial_id for job in jobs}) == len(jobs)


def test_points_that_a_condition_leaves_out_are_never_asked_for(
    tmp_path: Path, jobs: list[Job]
) -> None:
    spec = PLANE + "require: [separation_weight + cohesion_weight < 1.2]\n"
    found = launched(spec, tmp_path).boundary()
    assert all(
        job.settings["separation_weight"] + job.settings["cohesion_weight"] < 1.2
        for job in jobs
    )
    assert "boundary" in set(found.cells["state"])


def test_other_settings_are_groups(tmp_path: Path, jobs: list[Job]) -> None:
    spec = PLANE.replace("axes: [cohesion_weight, ", "axes: [")
    found = launched(spec, tmp_path).boundary()
    assert found.settings == ["cohesion_weight"]
    assert found.crossings is not None
    assert len(found.crossings) == 3
    for _, row in found.crossings.iterrows():
        assert row["low"] <= edge_at(row) <= row["high"]
    part = LoadedStudy("small", tmp_path).where(cohesion_weight=0.1).boundary()
    assert part.crossings is not None
    assert len(part.crossings) == 1
    assert jobs


@pytest.mark.parametrize(
    ("axis", "found"),
    [
        ("borders: [torus, bounded]", {("torus", True), ("bounded", False)}),
        ("it: {ablate: as_written}", {("torus", False), ("open", False)}),
        (
            "borders: {values: [torus, open], when: drag > 1}",
            {("torus", False)},
        ),
    ],
)
def test_further_points_have_the_torus_of_the_first(
    axis: str, found: set[tuple[str, bool]], tmp_path: Path, jobs: list[Job]
) -> None:
    first = 3 * len(found)
    coarse = LINE.replace("until: 0.02", "until: 0.3")
    launched(coarse.replace("sweep:", f"sweep:\n  {axis}"), tmp_path)
    seen = [(one.settings["borders"], one.settings["minimum_image"]) for one in jobs]
    assert {*seen} == found
    assert len({job.point for job in jobs}) > first


def test_the_cells_of_two_axes_hold_the_boundary(
    tmp_path: Path, jobs: list[Job]
) -> None:
    found = launched(PLANE, tmp_path).boundary()
    assert found.crossings is None
    assert set(found.cells["state"]) == {"above", "below", "boundary"}
    for _, cell in found.cells.iterrows():
        ends = [
            edge_at({"cohesion_weight": cell[f"cohesion_weight_{end}"]})
            for end in ("low", "high")
        ]
        low, high = cell["separation_weight_low"], cell["separation_weight_high"]
        crossed = low < max(ends) and high > min(ends)
        assert crossed <= (cell["state"] == "boundary"), cell
    assert found.rows["state"].eq("boundary").all()
    assert jobs


def test_a_small_budget_leaves_cells_unresolved(
    tmp_path: Path, jobs: list[Job]
) -> None:
    found = launched(PLANE.replace("budget: 300", "budget: 60"), tmp_path).boundary()
    left = found.cells[found.cells["state"] == "unresolved"]
    assert set(left["why"]) == {"the budget is spent"}
    assert 45 < len(jobs) <= 60


def test_failed_trials_are_no_values(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def run(job: Job) -> Result:
        last = job.settings["separation_weight"] == 1
        return failed(job, "no") if last else beyond(job)

    replace_trials(monkeypatch, run)
    coarse = LINE.replace("until: 0.02", "until: 0.2")
    found = launched(coarse, tmp_path).boundary()
    assert found.points["values"].iloc[-1] == 0
    assert found.cells["state"].iloc[-1] == "unresolved"
    assert found.cells["why"].iloc[-1] == "points have fewer than two values"
    assert found.crossings is not None
    assert len(found.crossings) == 1


def test_a_budget_that_the_first_points_exceed_is_refused() -> None:
    message = (
        "a budget of 8 trials is too small for the first points: 3 points with"
        " 3 trials each need at least 9"
    )
    with pytest.raises(SpecError, match=message):
        check_launches([parse_spec(LINE.replace("budget: 300", "budget: 8"))])
    with pytest.raises(SpecError, match=message):  # as `sweep plan` says
        expand(parse_spec(LINE.replace("budget: 300", "budget: 8")))


def test_the_budget_limits_a_study_and_not_the_most_trials_of_each_point() -> None:
    study = parse_spec(LINE.replace("max: 12", "max: 20000000"))
    assert study.most_trials(expand(study).n_points) == 300


def test_shares_are_refused() -> None:
    with pytest.raises(SpecError, match="cannot be launched in shards"):
        check_launches([parse_spec(LINE)], Share(1, 2))


def test_a_plan_says_what_it_can_come_to() -> None:
    plan = plan_of(parse_spec(PLANE), 2)
    text = plan.as_text()
    assert "points     at first 9 over cohesion_weight, separation_weight" in text
    assert (
        "trials     27 to 300 (3 to 12 per point; cells are halved up to 2 times where"
        " the mean of speed crosses 2)" in text
    )


def test_a_difference_says_which_trials_are_counted(
    refined_line: tuple[Path, list[Job]],
) -> None:
    results, _ = refined_line
    stored = LoadedStudy("small", results)
    text = compare(stored, parse_spec(LINE), results).as_text()
    assert (
        "the first trials are counted; the rule adds trials where the mean of speed"
        in text
    )
    assert "stored     9 of the planned trials, 0 to run" in text


def test_a_fixed_grid_has_no_boundary(tmp_path: Path, jobs: list[Job]) -> None:
    study = launched(SMALL, tmp_path)
    with pytest.raises(ChoiceError, match='the spec has no "refine", so'):
        study.boundary()
    assert jobs


def test_noise_that_max_trials_cannot_beat_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def run(job: Job) -> Result:
        rng = np.random.default_rng([int(job.point, 16), job.replicate])
        return done(job, {"speed": 2.0 + rng.normal(0.0, 1.0)})

    replace_trials(monkeypatch, run)
    found = launched(LINE, tmp_path).boundary()
    assert found.crossings is not None
    assert found.crossings.empty
    why = "max trials do not tell on which side the points are"
    assert set(found.cells["why"]) == {why}


NOWHERE = "no crossing of {} found on this grid: "
HIGH = LINE.replace("linspace: [0, ", "linspace: [0.5, ")
GROUPS = PLANE.replace("axes: [cohesion_weight, ", "axes: [")


@pytest.mark.parametrize(
    ("spec", "at", "said"),
    [
        (LINE, "7", [NOWHERE.format(7) + "all 3 points are below"]),
        (HIGH, "1", [NOWHERE.format(1) + "all 3 points are above"]),
        (PLANE, "7", [NOWHERE.format(7) + "all 9 points are below"]),
        (
            GROUPS,
            "5.5",
            [
                "where cohesion_weight = 1, "
                + NOWHERE.format(5.5)
                + "all 3 points are below"
            ],
        ),
        (GROUPS, "2", []),
    ],
)
def test_where_no_crossing_is_known_a_sentence_says_where_points_lie(
    tmp_path: Path, jobs: list[Job], spec: str, at: str, said: list[str]
) -> None:
    launched(spec.replace("at: 2", f"at: {at}"), tmp_path / "results")
    shown = sweep(tmp_path, "boundary", "small").stdout
    text = " ".join(shown.split())
    assert text.count("no crossing of") == len(said)
    assert all(one in text for one in said)
    assert ("─" in shown) == (at not in ("7", "1"))
    assert jobs


def test_points_on_no_side_are_counted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The mean of one point is the level itself."""

    def at_the_level(job: Job) -> Result:
        rng = np.random.default_rng([int(job.point, 16), job.replicate])
        far = abs(float(job.settings["separation_weight"]) - 0.5)
        return done(job, {"speed": 2.0 + far + rng.normal(0.0, NOISE)})

    replace_trials(monkeypatch, at_the_level)
    spec = LINE.replace("until: 0.02", "until: 0.5")
    launched(spec, tmp_path / "results")
    text = " ".join(sweep(tmp_path, "boundary", "small").stdout.split())
    sides = "2 points above, 1 point on an unknown side"
    assert NOWHERE.format(2) + sides in text
