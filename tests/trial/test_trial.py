"""A trial from its job to its result: every ending, and the same bits wherever and
whenever it runs.
"""

import math
import os
import subprocess
import sys
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from kernels import flight
from kernels.metrics import METRICS
from kernels.models import MODELS
from sweep.spec.study import Streams
from sweep.trial import simulation
from sweep.trial.result import Result, failed
from sweep.trial.simulation import Simulation, run
from tests import ROOT, builders
from tests.interpreter import interpreted

OVERFLOWS = {
    "nguyen2024": {"displacement_factor": 1e300, "separation_weight": 1e20},
    "aziel_chen2025": {
        "max_acceleration": 1e308,
        "max_speed": 1e308,
        "cohesion_weight": 1e308,
        "dt": 1e10,
    },
    "patel2023": {"dt": 1e308},
    "vicsek1995": {"max_speed": 1e150, "dt": 1e200},
    "nanobot": {"dt": 1e308},
    "dorsogna2006": {"dt": 1e308, "repulsion_strength": 1e308},
    "cucker_smale2007": {"dt": 1e308},
    "couzin2002": {"max_speed": 1e150, "dt": 1e200},
    "strombom2014": {"dog_speed": 1e150, "dt": 1e200},
    "vasarhelyi2018": {"dt": 1e308, "motor_noise": 1e308},
    "rustamani2024": (
        dict.fromkeys(("max_acceleration", "max_speed", "acceleration_pool"), math.inf)
        | {"cohesion_weight": 1e308}
    ),
}


def small(model: str, **changes: Any) -> builders.Job:
    """A short trial with coverage, escapes and a series, on a random map."""
    settings = {"n": 12, "steps": 20, "map": "random_obstacles", "n_obstacles": 2}
    settings |= (
        builders.scaled(
            model,
            width=240,
            height=180,
            obstacle_margin=40,
            obstacle_radius=12,
            pixel=1,
        )
        | changes
    )
    return builders.job(
        model,
        metrics=builders.every_metric(model),
        series=("speed", "coverage"),
        heatmaps=True,
        **settings,
    )


@pytest.mark.parametrize("model", MODELS)
def test_a_result_has_every_metric_every_frame_and_the_heatmap(model: str) -> None:
    result, metrics = run(small(model, every=6)), [*builders.every_metric(model)]
    assert (result.status, result.step, result.error) == ("done", 20, "")
    assert list(result.last) == list(result.mean) == metrics
    assert result.frames.tolist() == [0, 6, 12, 18, 20]
    assert {name: len(values) for name, values in result.series.items()} == {
        "speed": 5,
        "coverage": 5,
    }
    assert result.heatmap.shape == (180, 240)
    assert result.seconds > 0.0


def test_what_is_not_asked_for_is_not_given() -> None:
    result = run(builders.job(n=5, steps=4, metrics=("speed",)))
    assert (list(result.last), result.frames, result.series, result.heatmap) == (
        ["speed"],
        None,
        {},
        None,
    )


def flown(a_job: builders.Job) -> builders.Job:
    """The job that records its trajectory too."""
    return replace(a_job, record=replace(a_job.record, trajectories=True))


@pytest.mark.parametrize("model", MODELS)
def test_a_trajectory_holds_every_boid_in_every_recorded_frame(model: str) -> None:
    a_job = builders.job(model, n=12, steps=20, every=6, metrics=("coverage",))
    result, simulation = run(flown(a_job)), Simulation(a_job)
    states = [builders.state(simulation.flock).copy()]
    for steps in (6, 6, 6, 2):
        simulation.advance(steps)
        states.append(builders.state(simulation.flock).copy())
    assert result.frames.tolist() == [0, 6, 12, 18, 20]
    assert (result.trajectory == np.stack(states)).all()
    assert run(a_job).trajectory is None


@pytest.mark.parametrize("model", MODELS)
def test_bits_do_not_depend_on_whether_the_trajectory_is_recorded(
    model: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    a_job = small(model, every=3)
    whole = run(flown(a_job)).trajectory
    assert builders.bits(flown(a_job)) == builders.bits(a_job)
    monkeypatch.setattr(simulation, "BOID_STEPS_A_CALL", 1)
    monkeypatch.setattr(flight, "FRAME_BYTES", 1)
    assert (run(flown(a_job)).trajectory == whole).all()


def test_a_trajectory_ends_where_its_trial_does(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    diverged = run(flown(small("nguyen2024", steps=400, **OVERFLOWS["nguyen2024"])))
    assert diverged.status == "diverged"
    assert diverged.trajectory.shape == (diverged.step, 4, 12)
    assert np.isfinite(diverged.trajectory).all()
    monkeypatch.setattr(simulation, "BOID_STEPS_A_CALL", 60)
    late = run(flown(replace(small("nguyen2024", steps=1000), time_limit=1e-9)))
    assert (late.status, late.trajectory.shape) == ("timeout", (6, 4, 12))


def without_numbers(result: Result) -> bool:
    return (result.last, result.mean, result.heatmap) == ({}, {}, None)


@pytest.mark.parametrize("update", builders.UPDATES)
@pytest.mark.parametrize("borders", builders.BORDERS)
@pytest.mark.parametrize("model", MODELS)
def test_a_trial_that_overflows_ends_as_diverged_without_numbers(
    model: str, update: str, borders: dict[str, Any]
) -> None:
    result = run(small(model, update=update, steps=400, **borders, **OVERFLOWS[model]))
    assert result.status == "diverged", result.error
    assert 0 < result.step < 400
    assert result.error.endswith(f"after step {result.step}")
    assert without_numbers(result)
    assert all(np.isfinite(values).all() for values in result.series.values())
    assert result.frames.tolist() == list(range(result.step))


def overflowing() -> list[builders.Job]:
    """A job of each model and update that diverges."""
    return [
        small(model, update=update, steps=400, **OVERFLOWS[model])
        for model in MODELS
        for update in builders.UPDATES
    ]


def test_the_interpreter_diverges_at_the_same_step() -> None:
    """Without compilation NumPy warns of an overflow: here it is the point, and
    ignored.
    """
    compiled = [(result.status, result.step) for result in map(run, overflowing())]
    code = (
        "import warnings\n"
        "from tests.trial import test_trial as t\n"
        "warnings.simplefilter('ignore', RuntimeWarning)\n"
        "for job in t.overflowing(): result = t.run(job);"
        " print(result.status, result.step, result.error)"
    )
    lines = interpreted(code).splitlines()
    wanted = [f"{status} {step} " for status, step in compiled]
    assert [
        line[: len(start)] for start, line in zip(wanted, lines, strict=True)
    ] == wanted
    assert {status for status, _ in compiled} == {"diverged"}


def in_another_process(code: str) -> str:
    """What `code` prints in a new process that finds the tests' helpers."""
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-c", code]
    finished = subprocess.run(
        command, env=environment, capture_output=True, text=True, check=False
    )
    assert finished.returncode == 0, finished.stderr
    return finished.stdout


def test_a_trial_that_starts_with_a_boid_at_infinity_diverges_in_step_1() -> None:
    for bad in (math.inf, math.nan):
        simulation = Simulation(builders.job(n=9, steps=5))
        simulation.flock.vx[3] = bad
        assert not simulation.advance(5)
        assert simulation.step == 1


@pytest.mark.parametrize("model", MODELS)
def test_a_trial_past_its_time_limit_ends_as_timeout_with_the_step(
    model: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(simulation, "BOID_STEPS_A_CALL", 60)
    result = run(replace(small(model, steps=1000), time_limit=1e-9))
    assert (result.status, result.step) == ("timeout", 5)
    assert "after step 5" in result.error
    assert without_numbers(result)


@pytest.mark.parametrize("model", MODELS)
def test_a_trial_that_is_finished_when_its_time_is_up_is_done(model: str) -> None:
    assert run(replace(small(model), time_limit=1e-9)).status == "done"


def test_an_exception_is_a_result_with_the_traceback(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def broken(*_: Any) -> None:
        raise RuntimeError("the metric of this test is broken")

    monkeypatch.setitem(METRICS, "speed", METRICS["speed"]._replace(measure=broken))
    result = run(small("nguyen2024"))
    assert result.status == "failed"
    assert "Traceback" in result.error
    assert "the metric of this test is broken" in result.error
    assert without_numbers(result)


def test_a_job_that_never_returned_is_a_failed_result() -> None:
    a_job = small("nguyen2024")
    assert failed(a_job, "killed") == Result(a_job, "failed", 0.0, error="killed")


@pytest.mark.parametrize("model", MODELS)
def test_a_job_gives_the_same_bits_again_and_after_other_jobs(model: str) -> None:
    """On a map that is kept between trials, with its coverage, as well as on one that
    is drawn anew.
    """
    others = [small(name, seed=5, n=30) for name in MODELS]
    kept = {"px": "cafeteria", "m": "maze"}.get(MODELS[model].length, "empty")
    for settings in ({}, {"map": kept} | builders.map_size(model, kept)):
        a_job = small(model, **settings)
        first = builders.bits(a_job)
        others.append(small(model, seed=7, footprint_radius=9, **settings))
        for other in others:
            run(other)
        assert builders.bits(a_job) == first


@pytest.mark.slow
def test_jobs_give_the_same_bits_in_another_process() -> None:
    """The fast test of it compares a speed of each: tests/trial/test_first_trial.py."""
    code = (
        "from tests.trial import test_trial as t\nfor model in t.MODELS:"
        " print(t.builders.bits(t.small(model)))"
    )
    assert in_another_process(code).split() == [
        builders.bits(small(model)) for model in MODELS
    ]


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("boid_steps", [1, 12 * 7, 10**9])
def test_bits_do_not_depend_on_how_many_steps_a_call_takes(
    model: str, boid_steps: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = builders.bits(small(model, steps=60))
    monkeypatch.setattr(simulation, "BOID_STEPS_A_CALL", boid_steps)
    monkeypatch.setattr(flight, "FRAME_BYTES", boid_steps)
    assert builders.bits(small(model, steps=60)) == whole


def speeds(a_job: builders.Job) -> list[float]:
    return run(a_job).series["speed"].tolist()


@pytest.mark.parametrize("model", MODELS)
def test_a_longer_trial_begins_as_the_shorter_one(model: str) -> None:
    """With common noise, as the number of steps is part of the point."""
    streams = Streams(noise="common")
    short, long = (
        speeds(replace(small(model, steps=steps), streams=streams)) for steps in (9, 20)
    )
    assert long[:10] == short


@pytest.mark.parametrize("model", MODELS)
def test_recording_does_not_change_the_flight(model: str) -> None:
    plain = builders.job(model, n=12, steps=20, metrics=("speed",))
    recorded = builders.job(
        model,
        n=12,
        steps=20,
        metrics=builders.every_metric(model),
        series=("speed",),
        heatmaps=True,
    )
    assert run(plain).last["speed"] == run(recorded).last["speed"]


def test_seeds_and_replicates_differ_and_points_share_their_start() -> None:
    first, other_seed, other_replicate = (
        speeds(small("nguyen2024", **which))
        for which in ({}, {"seed": 2}, {"replicate": 1})
    )
    assert len({tuple(trial) for trial in (first, other_seed, other_replicate)}) == 3
    elsewhere = speeds(small("nguyen2024", separation_weight=3))
    assert elsewhere[0] == first[0]
    assert elsewhere[1:] != first[1:]


@pytest.mark.parametrize(("model", "preset", "name"), builders.PRESETS_ON_MAPS)
def test_every_preset_runs_on_every_map(model: str, preset: str, name: str) -> None:
    result = run(
        builders.job(
            model, preset, map=name, **builders.map_size(model, name), n=10, steps=5
        )
    )
    assert result.status == "done", result.error
    assert set(result.last) == set(MODELS[model].metrics)
