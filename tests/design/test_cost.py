"""The cost model: what it must get right is the order of trials, and sums."""

import json

import numpy as np
import pytest

from kernels.catalogue import BUILT_IN
from kernels.models import MODELS
from kernels.settings import COMMON, Actuation, Breakdowns
from sweep.design.cost import (
    job_seconds,
    point_seconds,
    study_cost,
    trial_bytes,
    trial_seconds,
)
from sweep.design.design import expand
from sweep.design.jobs import Jobs, SomeJobs
from sweep.design.plan import about, duration, make_plan, size
from sweep.spec.settings import Value
from sweep.spec.study import RecordSpec, parse_spec
from tests import builders
from tests.studies import COVERING, SMALL


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("setting", ["n", "steps"])
def test_larger_trials_cost_more(model: str, setting: str) -> None:
    preset, record = MODELS[model].presets["as_run"], RecordSpec(MODELS[model].metrics)
    larger = preset | {setting: 10 * preset[setting]}
    assert trial_seconds(model, BUILT_IN, larger, record) > 5 * trial_seconds(
        model, BUILT_IN, preset, record
    )


LAYERS: tuple[dict[str, Value], ...] = (
    {"sensing_delay": 2.0},
    {"position_noise": 1.0},
    {"position_noise": 1.0, "own_noise": "independent"},
    {"packet_loss": 0.1},
    {"occlusion": "obstacles"},
    {"occlusion": "boids", "body_radius": 1.0},
    {"occlusion": "both", "body_radius": 1.0},
    {"motor_lag": 1.0},
    {"motor_noise": 1.0},
    {"failing_share": 0.1, "failing_time": 1.0},
    {"failing_share": 0.1, "failing_time": 1.0, "failing_how": "blind"},
)


@pytest.mark.parametrize("model", MODELS)
def test_every_layer_of_robots_costs_time(model: str) -> None:
    """And all together cost more than any of them."""
    about, record = MODELS[model], RecordSpec(MODELS[model].metrics)
    motors = {name: COMMON[name] for name in (*Actuation._fields, *Breakdowns._fields)}
    ideal = about.presets["as_run"] | builders.IDEAL | motors
    costs = [
        trial_seconds(model, BUILT_IN, ideal | layer, record) for layer in ({}, *LAYERS)
    ]
    every: dict[str, Value] = {}
    for layer in LAYERS:
        every |= layer
    assert min(costs[1:]) > costs[0]
    assert trial_seconds(model, BUILT_IN, ideal | every, record) > max(costs)


def test_metrics_and_frames_cost_time_and_space() -> None:
    settings = MODELS["nguyen2024"].presets["as_run"]
    rare = RecordSpec(("speed",), ("speed",), every=100)
    often = RecordSpec(("speed", "flock_count"), ("speed", "flock_count"))
    assert trial_seconds("nguyen2024", BUILT_IN, settings, often) > trial_seconds(
        "nguyen2024", BUILT_IN, settings, rare
    )
    assert trial_bytes(settings, often) > 20 * trial_bytes(settings, rare)
    flown = RecordSpec(("speed",), every=100, trajectories=True)
    assert trial_bytes(settings, flown) > 200 * 4 * 6 * 5


def test_a_metric_of_cubic_time_is_known_to_be_slow() -> None:
    settings = MODELS["nguyen2024"].presets["as_run"]
    record = RecordSpec(("algebraic_connectivity",), ("algebraic_connectivity",))
    small, large = (
        trial_seconds("nguyen2024", BUILT_IN, settings | {"n": n}, record)
        for n in (1_000, 10_000)
    )
    assert large > 900 * small


def test_a_study_costs_the_sum_of_its_trials() -> None:
    study = parse_spec(
        SMALL.replace("separation_weight: [0.5, 1]", "n: [10, 1000]").replace(
            "n: 12, ", ""
        )
    )
    design = expand(study)
    each = [
        trial_seconds(study.model, BUILT_IN, design.settings(point), study.record)
        for point in range(2)
    ]
    assert study_cost(study, design)[0] == pytest.approx(3 * sum(each))


@pytest.mark.parametrize(
    "axes",
    [
        "n: [10, 1000]",
        "cohesion_range: [20, 400], update: [sequential, synchronous]",
        "drag: [0, 0.1]",
        "occlusion: [none, boids, obstacles], body_radius: [1, 2, 3]",
        "position_noise: [0, 2], own_noise: [none, independent]",
        "failing_how: [stop, blind], failing_share: [0.1, 0.2]",
    ],
)
def test_the_estimate_of_every_point_is_that_of_its_settings(axes: str) -> None:
    study = parse_spec(
        SMALL.replace(
            "separation_weight: [0.5, 1]", f"gain: {{zip: {{{axes}}}}}"
        ).replace("n: 12, ", "")
    )
    design = expand(study)
    each = [
        trial_seconds(study.model, BUILT_IN, design.settings(point), study.record)
        for point in range(design.n_points)
    ]
    assert point_seconds(study, design).tolist() == each


def test_a_plan_says_what_is_rejected_and_how_long_it_takes() -> None:
    spec = COVERING + 'require: ["cohesion_weight < 0.15"]\n'
    plan = make_plan(parse_spec(spec), workers=2)
    assert plan.rejected[0].count == 1
    assert plan.wall_seconds == plan.cpu_seconds / 2
    assert 'rejected   1 points by "cohesion_weight < 0.15"' in plan.as_text()
    assert json.loads(plan.as_json())["trials"] == 2


def test_words_for_times_and_sizes() -> None:
    assert [duration(seconds) for seconds in (0.04, 59, 600, 7200, 1e6)] == [
        "0.0 s",
        "59.0 s",
        "10.0 min",
        "2.0 h",
        "11.6 days",
    ]
    assert [size(count) for count in (12, 1500, 2.5e9)] == ["12 B", "1.5 kB", "2.5 GB"]


def test_an_estimate_of_less_than_a_tenth_of_a_second_has_no_digits() -> None:
    assert [about(seconds) for seconds in (0.0, 0.09, 0.1, 90)] == [
        "less than 0.1 s",
        "less than 0.1 s",
        "about 0.1 s",
        "about 1.5 min",
    ]
    assert about(0.01, "at most ") == "less than 0.1 s"
    assert about(3, "at most ") == "at most about 3.0 s"
    said = make_plan(parse_spec(SMALL), workers=2).as_text()
    assert "CPU time   less than 0.1 s\nwall time  less than 0.1 s with 2" in said


def test_a_world_that_is_drawn_costs_by_its_obstacles() -> None:
    """100,000 of them took 0.26 to 0.37 s a trial, and so much is estimated."""
    many = SMALL.replace("n: 12", "n: 12, n_obstacles: 100000, start_free: true")
    spec = parse_spec(many.replace("n: 12", "n: 12, map: random_obstacles"))
    without = parse_spec(many.replace("n: 12", "n: 12, map: empty"))
    drawn, empty = (make_plan(study, 1).cpu_seconds for study in (spec, without))
    assert 0.2 < (drawn - empty) / 6 < 0.4


def test_jobs_of_a_study_cost_what_each_of_them_does() -> None:
    study = parse_spec(
        SMALL.replace("separation_weight: [0.5, 1]", "n: [10, 1000]").replace(
            "n: 12, ", ""
        )
    )
    jobs = SomeJobs(Jobs(study, expand(study)), np.array([5, 0, 1]))
    assert job_seconds(jobs).tolist() == job_seconds(list(jobs)).tolist()
    assert job_seconds(jobs)[0] > job_seconds(jobs)[1]
