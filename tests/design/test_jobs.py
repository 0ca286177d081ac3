"""The ids and random streams of trials depend on what the trials are, and on nothing
else.
"""

import json
import os
import subprocess
import sys
from hashlib import sha256

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kernels import identity
from kernels.catalogue import BUILT_IN
from sweep.design.design import expand
from sweep.design.jobs import Job, Jobs, literal_seed, point_id, stream
from sweep.spec.settings import preset_settings
from sweep.spec.study import Study, parse_spec
from tests.specs import GAINS, SEPARATION

BASE = {"study": "a", "model": "nguyen2024", "preset": "as_run", "seed": 5}


def study_of(**keys: object) -> Study:
    return parse_spec(BASE | ({} if "seeds" in keys else {"replicates": 2}) | keys)


def jobs_of(study: Study) -> Jobs:
    return Jobs(study, expand(study))


def words(job: Job) -> dict[str, list[int]]:
    return {
        name: stream(job, name).generate_state(4).tolist()
        for name in ("start", "world", "noise")
    }


def ids(**keys: object) -> set[str]:
    return set(jobs_of(study_of(**keys)).table()["trial_id"].to_pylist())


def test_jobs_go_point_by_point() -> None:
    jobs = jobs_of(study_of(sweep={"n": [1, 2]}))
    assert len(jobs) == 4
    assert [(job.settings["n"], job.replicate) for job in jobs] == [
        (1, 0),
        (1, 1),
        (2, 0),
        (2, 1),
    ]
    assert jobs[-1] == jobs[3]
    assert jobs[1:3] == [jobs[1], jobs[2]]
    with pytest.raises(IndexError):
        jobs[4]


@pytest.mark.parametrize("spec", [SEPARATION, GAINS])
def test_table_agrees_with_jobs(spec: str) -> None:
    jobs = jobs_of(parse_spec(spec))
    table = jobs.table()
    assert len(table) == len(jobs)
    rows = table.to_pylist()
    for index in range(0, len(jobs), len(jobs) // 97):
        job = jobs[index]
        assert rows[index] == {name: getattr(job, name) for name in table.column_names}
        defaults = jobs.study.preset_settings
        assert job.point == point_id(job.model, job.preset, job.settings, defaults)
    assert len({row["trial_id"] for row in rows}) == len(jobs)


def test_point_id_is_the_hash_of_what_differs_from_the_preset() -> None:
    defaults = preset_settings("nguyen2024", "as_run", BUILT_IN)
    settings = defaults | {
        "n": 50,
        "obstacle_range": float("inf"),
        "map": "empty",
    }
    content = json.dumps(
        [
            "nguyen2024",
            "as_run",
            {"map": "empty", "n": 50, "obstacle_range": float("inf")},
        ],
        separators=(",", ":"),
    )
    assert (
        point_id("nguyen2024", "as_run", settings, defaults)
        == sha256(content.encode()).hexdigest()[:16]
    )


VALUE = {
    "n": st.integers(1, 10**6),
    "drag": st.floats(0, 1),
    "obstacle_range": st.sampled_from([0.0, float("inf")]),
}


@settings(deadline=None, max_examples=40)
@given(st.fixed_dictionaries(VALUE), st.fixed_dictionaries(VALUE))
def test_points_have_the_same_id_only_if_they_are_the_same(
    one: dict[str, float], other: dict[str, float]
) -> None:
    def identify(values: dict[str, float]) -> str:
        return jobs_of(
            study_of(
                sweep={"j": {"zip": {name: [value] for name, value in values.items()}}}
            )
        ).points[0]

    assert (identify(one) == identify(other)) == (one == other)


def test_whole_and_decimal_numbers_are_the_same_trials() -> None:
    assert ids(sweep={"drag": [0, 1], "n": [2]}) == ids(
        sweep={"drag": [0.0, 1.0], "n": [2.0]}
    )


def test_a_longer_study_keeps_its_trials() -> None:
    old = ids(sweep={"n": [1, 2]})
    assert old < ids(sweep={"n": [3, 2, 1]})
    assert old < ids(sweep={"n": [1, 2]}, replicates=5)
    assert old < ids(sweep={"drag": [0.5, 0.1], "n": [1, 2]})
    assert old == ids(sweep={"n": [2, 1]})
    assert old == ids(fixed={"drag": 0.1}, sweep={"n": [1, 2]}, time_limit=5)
    assert old == ids(
        sweep={"j": {"zip": {"n": [1, 2]}}}, require=["n < 3"], study="another"
    )


def test_ids_are_the_same_however_many_points_are_made_at_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    whole = jobs_of(parse_spec(GAINS)).table()
    monkeypatch.setattr("sweep.design.jobs.BLOCK", 7)
    assert jobs_of(parse_spec(GAINS)).table().equals(whole)


def test_listed_seeds_may_be_reordered_and_extended() -> None:
    old = jobs_of(study_of(seeds=[27, 729]))
    new = jobs_of(study_of(seeds=[729, 4913, 27]))
    assert set(old.table()["trial_id"].to_pylist()) < set(
        new.table()["trial_id"].to_pylist()
    )
    assert words(old[0]) == words(new[2])
    assert (old[0].seed, old[0].literal, old[1].replicate) == (27, True, 1)


@pytest.mark.parametrize(
    "keys",
    [
        {"seed": 6},
        {"seeds": [5]},
        {"preset": "as_written"},
        {"fixed": {"drag": 0.2}},
        {"streams": {"noise": "common"}},
        {"record": {"every": 2}},
        {"record": {"heatmaps": True}},
        {"record": {"trajectories": True}},
        {"record": {"series": ["speed"]}},
        {"record": {"metrics": ["speed"]}},
    ],
    ids=str,
)
def test_what_could_change_a_number_makes_other_trials(keys: dict[str, object]) -> None:
    assert not ids() & ids(**keys)


@pytest.mark.parametrize("kind", ["_flight_stamp", "_model_stamp", "_metric_stamp"])
def test_other_code_makes_other_trials_of_the_same_points(
    kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    one = jobs_of(study_of())
    monkeypatch.setattr(identity, kind, lambda *_: "other")
    other = jobs_of(study_of())
    assert one.points == other.points
    assert not set(one.table()["trial_id"].to_pylist()) & set(
        other.table()["trial_id"].to_pylist()
    )


@pytest.mark.parametrize(
    ("kind", "setting", "values"),
    [
        ("_map_stamp", "map", ["empty", "random_obstacles"]),
        ("_start_stamp", "start_draws", ["numpy", "python_random"]),
    ],
)
def test_another_map_or_start_makes_other_trials_with_it_alone(
    kind: str, setting: str, values: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    study, stamp = study_of(sweep={setting: values}), getattr(identity, kind)
    before = jobs_of(study).table().to_pandas()
    entries = {"map": BUILT_IN.maps, "start_draws": BUILT_IN.starts}
    changed = entries[setting][values[0]]
    monkeypatch.setattr(
        identity, kind, lambda one: "other" if one is changed else stamp(one)
    )
    after = jobs_of(study).table().to_pandas()
    assert before["point"].equals(after["point"])
    same = before["trial_id"] == after["trial_id"]
    assert same.tolist() == [False, False, True, True]
    assert [job.trial_id for job in jobs_of(study)] == after["trial_id"].tolist()


def test_the_hash_of_a_trial_spelled_out() -> None:
    study = study_of(record={"metrics": ["speed"]})
    kept = {"heatmaps": False, "trajectories": False}
    record = {"metrics": ["speed"], "series": [], "every": 1} | kept
    streams = {"start": "common", "world": "common", "noise": "independent"}
    code = identity.code_of(
        BUILT_IN,
        [("nguyen2024", study.preset)],
        ["speed"],
        ["random_obstacles"],
        ["numpy"],
    )
    scene = [*code.maps.values(), *code.starts.values()]
    stamps = [code.flight, code.models, code.metrics, *scene]
    content = (
        json.dumps([*stamps, streams, record], sort_keys=True)
        + f" {jobs_of(study).points[0]} 5 replicate 0"
    )
    assert jobs_of(study)[0].trial_id == sha256(content.encode()).hexdigest()[:24]


def test_order_of_metrics_does_not_matter() -> None:
    assert ids(record={"metrics": ["speed", "polarization"]}) == ids(
        record={"metrics": ["polarization", "speed"]}
    )


def test_common_streams_are_shared_by_points_and_independent_ones_not() -> None:
    first, again, other, _ = map(words, jobs_of(study_of(sweep={"n": [1, 2]})))
    assert first["start"] == other["start"]
    assert first["world"] == other["world"]
    assert first["noise"] != other["noise"]
    assert all(first[name] != again[name] for name in first)


def test_no_two_streams_are_the_same() -> None:
    independent = dict.fromkeys(("start", "world", "noise"), "independent")
    jobs = jobs_of(
        study_of(sweep={"n": list(range(1, 31))}, replicates=30, streams=independent)
    )
    seen = {tuple(state) for job in jobs for state in words(job).values()}
    assert len(seen) == 3 * len(jobs)


def test_streams_do_not_depend_on_other_points_or_replicates() -> None:
    few = {job.trial_id: words(job) for job in jobs_of(study_of(sweep={"n": [1, 2]}))}
    many = {
        job.trial_id: words(job)
        for job in jobs_of(
            study_of(sweep={"drag": [0.3, 0.1], "n": [9, 2, 1]}, replicates=4)
        )
    }
    assert few.items() <= many.items()


def test_literal_seed_is_the_listed_one_where_the_stream_is_common() -> None:
    listed = jobs_of(study_of(seeds=[27, 729]))
    assert [literal_seed(job, "start") for job in listed] == [27, 729]
    assert literal_seed(listed[0], "noise") not in (27, 729)
    counted = jobs_of(study_of(replicates=50))
    drawn = {literal_seed(job, "start") for job in counted}
    assert len(drawn) == 50
    assert all(0 <= seed < 2**64 for seed in drawn)


def test_ids_are_the_same_in_another_process() -> None:
    code = (
        "from sweep.design.design import expand\nfrom sweep.design.jobs import Jobs,"
        " stream\nfrom sweep.spec.study import parse_spec\nstudy ="
        f" parse_spec({SEPARATION!r})\njob = Jobs(study,"
        " expand(study))[-1]\nprint(job.trial_id, job.point, stream(job,"
        " 'noise').generate_state(1)[0])"
    )
    run = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=True,
        env=os.environ | {"PYTHONHASHSEED": "7"},
    )
    job = jobs_of(parse_spec(SEPARATION))[-1]
    assert run.stdout.split() == [
        job.trial_id,
        job.point,
        str(stream(job, "noise").generate_state(1)[0]),
    ]
