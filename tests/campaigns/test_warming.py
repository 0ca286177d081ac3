"""`sweep warm`: what trials need is compiled ahead, and no more than that."""

import os
import re
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from kernels.metrics import METRICS
from kernels.models import MODELS
from sweep.campaigns import warming
from sweep.campaigns.warming import warm_model, warm_study
from sweep.design.jobs import Job
from sweep.errors import SpecError
from sweep.own_code.reading import study_of
from sweep.spec.recorded import lacks_boids
from sweep.spec.study import parse_spec
from sweep.trial.result import Result
from tests.commands import SWEEP, sweep
from tests.patience import PATIENCE
from tests.searches import TINY
from tests.studies import IMPOSSIBLE, SMALL


@pytest.fixture
def warmed(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[Job]]:
    """The trials that are tried; none is run."""
    jobs: list[Job] = []

    def note(job: Job) -> Result:
        jobs.append(job)
        return Result(job, "done", 0.0)

    monkeypatch.setattr(warming, "warm", note)
    monkeypatch.setattr(warming, "warm_together", lambda _jobs: True)
    return jobs


@pytest.mark.parametrize(
    ("changes", "count"),
    [({}, 2), ({"replicates": 3}, 0), ({"memory_limit": "4 GB"}, 0), ({"n": 900}, 0)],
)
def test_of_trials_that_may_fly_together_eight_alike_are_tried(
    changes: dict[str, Any],
    count: int,
    warmed: list[Job],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    tried: list[list[Job]] = []
    monkeypatch.setattr(warming, "warm_together", tried.append)
    fixed = {"n": changes.get("n", 20), "steps": 5}
    spec = {"study": "a", "model": "nguyen2024", "replicates": 8, "fixed": fixed}
    spec["sweep"] = {"map": ["empty", "random_obstacles"]}
    more = {name: value for name, value in changes.items() if name != "n"}
    warm_study(study_of(spec | more))
    assert len(warmed) == 2
    assert [len(jobs) for jobs in tried] == [8] * count


def test_of_a_study_one_trial_of_each_map_and_start_is_tried(
    warmed: list[Job],
) -> None:
    spec = SMALL.replace(
        "separation_weight: [0.5, 1]",
        "separation_weight: [0.5, 1]\n  map: [empty, random_obstacles]",
    )
    warm_study(parse_spec(spec))
    assert [job.settings["map"] for job in warmed] == ["empty", "random_obstacles"]
    assert {job.record.metrics for job in warmed} == {parse_spec(spec).record.metrics}


@pytest.mark.parametrize(
    "axis",
    [
        {"sensing_delay": [0, 3]},
        {"motor_lag": [0, 3]},
        {"failing_share": [0, 0.5]},
        {"wind_x": [0, 1]},
        {"max_speed_spread": [0, 0.2]},
        {"obstacle_speed": [0, 1]},
        {"next_goals": [[], [[10, 20]]]},
    ],
)
def test_a_trial_is_tried_with_each_layer_and_one_without(
    axis: dict[str, Any], warmed: list[Job]
) -> None:
    """Not one for each value: those of one layer run the same code."""
    ((name, (without, with_it)),) = axis.items()
    values = [without, with_it, *([] if name == "next_goals" else [2 * with_it])]
    spec = {"study": "a", "model": "aziel_chen2025", "replicates": 2}
    record = {"record": {"metrics": ["speed"]}}
    warm_study(study_of(spec | record | {"sweep": {name: values}}))
    tried = [job.settings.get(name, 0) for job in warmed]
    assert len(tried) == 2
    assert [bool(one) for one in tried] == [False, True]


def test_of_a_search_its_scenarios_are_tried(warmed: list[Job]) -> None:
    warm_study(parse_spec(TINY))
    assert len(warmed) == 1


@pytest.mark.parametrize("model", ["nguyen2024", "nanobot"])
def test_of_a_model_each_preset_is_tried_with_all_metrics(
    model: str, warmed: list[Job]
) -> None:
    warm_model(model)
    assert len(warmed) == len(MODELS[model].presets)
    for job in warmed:
        assert job.model == model
        left_out = METRICS.keys() - set(job.record.metrics)
        assert set(MODELS[model].metrics) <= set(job.record.metrics)
        for name in left_out:
            metric = METRICS[name]
            assert (
                metric.potential or metric.demands or lacks_boids(MODELS[model], metric)
            )


def test_what_cannot_be_run_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(SpecError, match=r"no trial can be run: .*no free place"):
        warm_study(parse_spec(IMPOSSIBLE))
    done = sweep(tmp_path, "warm", "nanobo")
    assert (done.returncode, done.stdout) == (2, "")
    assert 'did you mean "nanobot"' in done.stderr
    done = sweep(tmp_path, "warm", "--no-code", "./a.py")
    assert (done.returncode, "no code may run" in done.stderr) == (2, True)


@pytest.mark.slow
def test_the_command_says_how_long_it_took_and_where_it_is(
    warmed: list[Job], tmp_path: Path
) -> None:
    (tmp_path / "a.yaml").write_text(SMALL, encoding="utf-8")
    one, two, folder = sweep(tmp_path, "warm", "nanobot", "a.yaml").stdout.splitlines()
    assert re.fullmatch(r"nanobot: ready after \d+\.\d s", one)
    assert re.fullmatch(r"a\.yaml: ready after \d+\.\d s", two)
    assert folder.startswith("compiled code is in /")
    warmed.clear()
    assert len(sweep(tmp_path, "warm").stdout.splitlines()) == len(list(MODELS)) + 1
    assert {job.model for job in warmed} == set(MODELS)


@pytest.mark.slow
def test_a_launch_finds_all_that_it_needs_and_nothing_of_other_models(
    tmp_path: Path,
) -> None:
    cache = tmp_path / "cache"
    (tmp_path / "a.yaml").write_text(SMALL, encoding="utf-8")
    environment = os.environ | {"NUMBA_CACHE_DIR": str(cache)}

    def kept(*command: str) -> set[str]:
        done = subprocess.run(
            [*SWEEP, *command],
            cwd=tmp_path,
            env=environment,
            capture_output=True,
            text=True,
            timeout=PATIENCE,
        )
        assert done.returncode == 0, done.stderr
        assert ("compiling" in done.stderr) == (command[0] == "warm")
        return {path.name for path in cache.rglob("*.nb[ic]")}

    warm = kept("warm", "a.yaml")
    modules = {name.partition(".")[0] for name in warm}
    assert "nguyen2024" in modules
    assert not modules & (set(MODELS) - {"nguyen2024"})
    assert kept("launch", "a.yaml", "--workers", "1") == warm
