"""The key `threads`: when it is refused, what it costs, and that trials stay."""

import json
import logging
from pathlib import Path
from typing import Any

import pytest

from kernels.catalogue import BUILT_IN
from kernels.models import MODELS
from sweep.campaigns.plan import plan_of
from sweep.design.cost import job_seconds, study_cost, trial_seconds
from sweep.design.design import expand
from sweep.design.jobs import Jobs
from sweep.design.plan import make_plan
from sweep.errors import SpecError
from sweep.spec.study import RecordSpec, parse_spec
from sweep.workers import executors
from sweep.workers.executors import Serial, worker_count
from tests.specs import short
from tests.studies import COVERING, SMALL, launched

FLOCK = COVERING.replace("steps: 20,", "steps: 20, update: synchronous,")
SWEPT = COVERING.replace("sweep:", "sweep:\n  update: [synchronous, sequential]")
DERIVED = FLOCK.replace("update: synchronous, ", "") + (
    "derive: {update: \"'synchronous' if cohesion_weight < 0.15 else 'sequential'\"}\n"
)
SEARCHED = """
study: searched
model: nanobot
search:
  parameters: {separation_weight: {uniform: [0, 1]}}
  objectives: {speed: {maximize: mean}}
  budget: 48
  held_out: {candidates: 1, replicates: 2}
fixed: {n: 12, steps: 9, update: synchronous}
replicates: 2
threads: 2
"""


def refused(spec: str) -> str:
    """The message with which the design of `spec` is refused."""
    with pytest.raises(SpecError) as error:
        expand(parse_spec(spec))
    return str(error.value)


@pytest.mark.parametrize("line", ["threads: 0", "threads: 257", "threads: two"])
def test_it_is_a_number_of_cores(line: str) -> None:
    with pytest.raises(SpecError, match='"threads" must be a whole number from 1 to'):
        parse_spec(short(line))


def test_boids_that_wait_for_each_other_are_refused_with_the_line() -> None:
    said = refused(COVERING + "threads: 4\n")
    assert said.startswith(
        "spec.yaml:11: threads: 4 needs all boids updated at once: aziel_chen2025 does"
        " that with `update: synchronous`, and here are trials where update ="
        " sequential (preset as_run)"
    )


def test_a_model_that_draws_boid_after_boid_is_refused_with_the_line() -> None:
    for update in ("sequential", "synchronous"):
        spec = SMALL.replace("n: 12", f"n: 12, update: {update}")
        said = refused(spec + "threads: 2\n")
        assert said.startswith("spec.yaml:11: threads: 2 needs a model that updates")
        assert "nguyen2024 does not say that it does" in said


@pytest.mark.parametrize("spec", [SWEPT, DERIVED])
def test_one_point_is_enough_to_be_refused(spec: str) -> None:
    assert "where update = sequential" in refused(spec + "threads: 2\n")
    assert expand(parse_spec(spec + "threads: 1\n")).n_points >= 2


def test_one_thread_asks_for_nothing() -> None:
    for model in MODELS:
        expand(
            parse_spec(
                SMALL.replace("nguyen2024", model).replace(
                    "separation_weight: [0.5, 1]", "n_obstacles: [0, 1]"
                )
                + "threads: 1\n"
            )
        )


def test_trials_are_the_same_with_any_number_of_threads() -> None:
    ids = []
    for threads in (1, 2, 5):
        study = parse_spec(f"{FLOCK}threads: {threads}\n")
        jobs = Jobs(study, expand(study))
        assert jobs[0].threads == threads
        ids.append(jobs.ids().tolist())
    assert ids[0] == ids[1] == ids[2]


def test_a_trial_that_is_stored_serves_with_any_number_of_threads(
    tmp_path: Path,
) -> None:
    launched(FLOCK + "threads: 2\n", tmp_path, Serial())
    before = {path: path.read_bytes() for path in tmp_path.rglob("*.parquet")}
    stored = launched(FLOCK, tmp_path, Serial())
    assert stored.statuses() == {"done": 4}
    parts = {path for path in before if "parts" in path.parts}
    assert parts
    assert all(path.read_bytes() == before[path] for path in parts)


@pytest.mark.parametrize("record", ["covering", "flying"])
def test_threads_share_what_is_not_done_once(record: str) -> None:
    settings = MODELS["aziel_chen2025"].presets["as_written"] | {"n": 100}
    kept = RecordSpec(("coverage",) if record == "covering" else ("escapes",))

    def seconds(threads: int) -> float:
        return trial_seconds("aziel_chen2025", BUILT_IN, settings, kept, threads)

    alone, two, many = (seconds(threads) for threads in (1, 2, 1000))
    assert alone / 2 < two < alone
    assert many < two
    once = {"covering": 0.45, "flying": 0.1}[record]
    assert many / alone == pytest.approx(once, abs=0.15)


def test_a_plan_counts_the_cores_of_all_threads() -> None:
    study, threads = parse_spec(FLOCK), parse_spec(FLOCK + "threads: 2\n")
    design = expand(study)
    one, two = study_cost(study, design), study_cost(threads, design)
    assert one.seconds < two.seconds < 2 * one.seconds
    assert two.size_bytes == one.size_bytes
    plan = make_plan(threads, workers=3)
    assert plan.wall_seconds == plan.cpu_seconds / 6
    assert "with 3 workers of 2 threads each" in plan.as_text()
    assert json.loads(plan.as_json())["threads"] == 2
    assert "of 1 threads" not in make_plan(study, workers=3).as_text()
    jobs = Jobs(threads, design)
    assert job_seconds(jobs[:1])[0] == pytest.approx(two.seconds / 2 / len(jobs))


def test_a_search_is_planned_with_its_threads() -> None:
    plan: Any = plan_of(parse_spec(SEARCHED), 2)
    assert plan.threads == 2
    assert plan.wall_seconds == plan.cpu_seconds / 4
    assert "with 2 workers of 2 threads each" in plan.as_text()
    with pytest.raises(SpecError, match="threads: 2 needs all boids"):
        plan_of(parse_spec(SEARCHED.replace(", update: synchronous", "")), 2)


@pytest.mark.parametrize(
    ("asked", "threads", "workers", "shared"),
    [
        (0, 1, 8, False),
        (0, 2, 4, False),
        (0, 3, 2, False),
        (0, 9, 1, True),
        (2, 4, 2, False),
        (3, 4, 3, True),
        (30, 1, 30, False),
    ],
)
def test_there_are_as_many_workers_as_cores_have_room_for(
    asked: int,
    threads: int,
    workers: int,
    shared: bool,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    monkeypatch.setattr(executors, "core_count", lambda: 8)
    with caplog.at_level(logging.WARNING):
        assert worker_count(asked, threads) == workers
    said = f"workers: {workers}, each with {threads} threads, for the 8 cores"
    assert (said in caplog.text) == shared
