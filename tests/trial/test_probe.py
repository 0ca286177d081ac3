"""A few short trials of code that is none of ours: they correct the estimate of a plan,
and a launch of code that cannot run ends before anything is stored.
"""

from dataclasses import replace
from pathlib import Path
from unittest import SkipTest

import pytest

import sweep
from kernels import caching
from kernels.metrics import METRICS
from kernels.models import MODELS
from sweep.campaigns.launching import launch
from sweep.campaigns.plan import plan_of
from sweep.design.code import is_built_in
from sweep.design.cost import trial_seconds
from sweep.design.jobs import Job
from sweep.design.plan import make_plan
from sweep.errors import SpecError
from sweep.own_code.reading import load_spec
from sweep.spec.study import parse_spec
from sweep.store.shares import Share
from sweep.tables.stored_study import StoredStudy
from sweep.testing import beforehand
from sweep.testing.subject import Subject
from sweep.trial import probe
from sweep.trial.result import Result
from sweep.workers.executors import Serial
from tests.other_packages import VORTEX
from tests.searches import TINY, edited, searched
from tests.studies import IMPOSSIBLE, NO_ROOM, SMALL, launched, relaunch

CROWDED = edited(
    SMALL,
    ("n: 12,", "n: 12, start_free: true,"),
    (
        "separation_weight: [0.5, 1]",
        "case: {zip: {n_obstacles: [1, 1, 0], obstacle_radius: [5000, 25, 25]}}",
    ),
)
"""Trials of the first point raise: they have no free place for a boid."""
SLOWER = 7.0
OWN = """
study: own
model: ./vortex.py
preset: standard
fixed: {n: 12, steps: 9}
replicates: 2
seed: 5
"""


@pytest.fixture
def foreign(monkeypatch: pytest.MonkeyPatch) -> None:
    """The model of the small study, as if another package had brought it."""
    monkeypatch.setitem(MODELS.origins, "nguyen2024", "others 1.0")


@pytest.fixture
def simulated(monkeypatch: pytest.MonkeyPatch) -> list[Job]:
    """The jobs that probes run. Each says that it took SLOWER times the estimate."""
    jobs, run = [], probe.simulate

    def simulate(job: Job) -> Result:
        jobs.append(job)
        result = run(job)
        taken = job.settings | {"steps": result.step}
        seconds = trial_seconds(job.model, job.catalogue, taken, job.record)
        return replace(result, seconds=SLOWER * seconds)

    monkeypatch.setattr(probe, "simulate", simulate)
    return jobs


@pytest.mark.usefixtures("foreign", "simulated")
def test_a_probe_corrects_the_estimate() -> None:
    study = parse_spec(SMALL)
    known, plan = make_plan(study, 2), sweep.plan(SMALL, workers=2)
    assert plan.cpu_seconds == pytest.approx(SLOWER * known.cpu_seconds)
    assert plan.wall_seconds == plan.cpu_seconds / 2
    assert plan.result_bytes == known.result_bytes
    assert plan.probe_steps == 3 * 9  # three trials, all steps of each
    assert "s, estimated from a probe of 27 steps\nwall" in plan.as_text()


@pytest.mark.usefixtures("foreign", "simulated")
def test_a_probe_corrects_the_estimate_of_a_search(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    found = plan_of(parse_spec(TINY), 1)
    monkeypatch.undo()
    known = plan_of(parse_spec(TINY), 1)
    assert found.cpu_seconds == pytest.approx(SLOWER * known.cpu_seconds)
    assert ", estimated from a probe of 9 steps\n" in found.as_text()
    assert "probe of" not in known.as_text()


@pytest.mark.usefixtures("foreign")
def test_a_probe_of_a_long_study_is_short(simulated: list[Job]) -> None:
    long = SMALL.replace("n: 12, steps: 9", "n: 400, steps: 1000000")
    plan = plan_of(parse_spec(long), 1)
    timed = [job for job in simulated if job.settings["steps"] != 1]
    assert len(simulated) == 2 * len(timed) == 6
    estimates = [
        trial_seconds(job.model, job.catalogue, job.settings, job.record)
        for job in timed
    ]
    assert all(0.05 < one < 0.15 for one in estimates)
    assert all(job.time_limit == probe.MOST_SECONDS for job in timed)
    assert 3 < plan.probe_steps < 20_000
    assert plan.trials == 6


def test_code_of_ours_is_known_and_not_probed(simulated: list[Job]) -> None:
    for spec in (SMALL, TINY):
        plan = plan_of(parse_spec(spec), 1)
        assert plan.probe_steps == 0
        assert "probe" not in plan.as_text()
    assert simulated == []


@pytest.mark.parametrize("spec", [SMALL, TINY])
def test_a_metric_of_others_is_probed_too(
    spec: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert is_built_in(parse_spec(spec))
    monkeypatch.setitem(METRICS.origins, parse_spec(spec).record.metrics[0], "x 1.0")
    assert not is_built_in(parse_spec(spec))


@pytest.mark.usefixtures("foreign")
def test_code_that_cannot_run_is_said_with_its_line_before_any_work(
    tmp_path: Path,
) -> None:
    sentence = "^spec.yaml:3: no trial can be run: [A-Z][A-Za-z]*Error: .*free"
    study = parse_spec(IMPOSSIBLE)
    with pytest.raises(SpecError, match=sentence):
        plan_of(study, 1)
    for share in (None, Share(1, 2), Share(2, 2)):
        with pytest.raises(SpecError, match=sentence):
            launch(study, tmp_path, Serial(), share=share)
    with pytest.raises(SpecError, match=sentence):
        searched(TINY.replace("n: 12,", NO_ROOM), tmp_path)
    assert not list(tmp_path.glob("**/*.parquet"))


@pytest.mark.usefixtures("foreign")
def test_a_launch_of_code_that_cannot_run_hides_nothing_that_is_stored(
    tmp_path: Path,
) -> None:
    stored = launched(SMALL, tmp_path).trials
    with pytest.raises(SpecError):
        relaunch(IMPOSSIBLE, tmp_path)
    again = StoredStudy("small", tmp_path).trials
    assert again["trial_id"].tolist() == stored["trial_id"].tolist()


@pytest.mark.usefixtures("foreign")
def test_a_trial_that_fails_for_its_settings_is_a_row_like_any_other(
    tmp_path: Path,
) -> None:
    assert plan_of(parse_spec(CROWDED), 1).probe_steps == 2 * 9
    study = launched(CROWDED, tmp_path)
    assert study.statuses() == {"done": 6, "failed": 3}


def test_a_model_in_a_file_beside_the_spec_is_probed(tmp_path: Path) -> None:
    (tmp_path / "vortex.py").write_text(VORTEX)
    spec = tmp_path / "spec.yaml"
    spec.write_text(OWN)
    assert not is_built_in(load_spec(spec))
    assert sweep.plan(spec).probe_steps == 2 * 9
    wrong = VORTEX.replace("range2 = ", "range2 + ")
    (tmp_path / "vortex.py").write_text(wrong)
    with pytest.raises(SpecError, match=r"^spec.yaml:3: vortex.py, line \d+, .*range2"):
        sweep.run(spec, tmp_path / "results")
    assert not list(tmp_path.glob("results/**/*.parquet"))


BLIND = ("return Sight(params.perception_range)", "return Sight(20.0)")
"""It sees farther than it says: the grid finds others than all pairs."""
UNPUBLISHED = ("publish(flock, others, work)", "pass")


def test_a_launch_ends_before_any_work_where_a_promise_is_broken(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each time, and whatever another promise leaves out. What promises notice is
    tested in tests/testing/test_promises.py.
    """
    given = {name: function.__name__ for name, function in beforehand.TRIED.items()}
    assert given == {"calls": "calls", "grid": "grid", "reach": "reach"}

    def leaving(_about: object) -> None:
        raise SkipTest

    def breaking(about: Subject) -> None:
        raise AssertionError(f"{about.model.name} sees farther than it says")

    # That these promises of vortex are kept may be noted already, with its kernels.
    monkeypatch.setattr(beforehand, "check_once", lambda _code, check: check())
    monkeypatch.setattr(beforehand, "TRIED", {"calls": leaving, "grid": breaking})
    (tmp_path / "vortex.py").write_text(VORTEX)
    (tmp_path / "own.yaml").write_text(OWN)
    said = (
        "^own.yaml:3: no trial runs, because the model does not meet a requirement: "
        '"grid" of sweep check: vortex sees farther than it says$'
    )
    for _ in range(2):
        with pytest.raises(SpecError, match=said):
            launch(load_spec(tmp_path / "own.yaml"), tmp_path / "results", Serial())
    assert not list(tmp_path.glob("**/*.parquet"))


@pytest.mark.slow  # it compiles other models
@pytest.mark.parametrize(
    ("edit", "said"),
    [
        (BLIND, r'"grid" of sweep check: .*vortex\.py, line \d+: .*sight must declare'),
        (
            UNPUBLISHED,
            r'"calls" of sweep check: .*vortex\.py, line \d+: .*call publish\(',
        ),
    ],
)
def test_a_launch_of_a_model_that_breaks_a_promise_ends_before_any_work(
    edit: tuple[str, str], said: str, tmp_path: Path
) -> None:
    assert VORTEX.count(edit[0]) == 1
    (tmp_path / "vortex.py").write_text(VORTEX.replace(*edit))
    (tmp_path / "own.yaml").write_text(OWN)
    sentence = (
        "^own.yaml:3: no trial runs, because the model does not meet a requirement: "
    )
    for _ in range(2):
        with pytest.raises(SpecError, match=sentence + said):
            launch(load_spec(tmp_path / "own.yaml"), tmp_path, Serial())
    assert not list(tmp_path.glob("**/*.parquet"))


def test_promises_are_tried_once_for_the_same_code_of_a_model_that_is_not_built_in(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tried = list[str]()
    kept_in = tmp_path / "kernels"
    monkeypatch.setattr(caching, "FOLDER", kept_in)
    monkeypatch.setattr(
        beforehand, "TRIED", {"calls": lambda about: tried.append(about.model.name)}
    )
    (tmp_path / "vortex.py").write_text(VORTEX)
    (tmp_path / "own.yaml").write_text(OWN)
    study = load_spec(tmp_path / "own.yaml")
    beforehand.check_promises(study)
    beforehand.check_promises(study)
    assert tried == ["vortex"]
    (tmp_path / "vortex.py").write_text(VORTEX.replace(*BLIND))
    beforehand.check_promises(load_spec(tmp_path / "own.yaml"))
    assert tried == ["vortex"] * 2
    assert len(list(kept_in.glob("*.promises"))) == 2
    beforehand.check_promises(parse_spec(SMALL))
    assert tried == ["vortex"] * 2


def test_what_a_model_raises_in_small_worlds_of_the_check_ends_no_launch(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def raising(_about: object) -> None:
        raise ValueError("this model wants 1000 boids")

    monkeypatch.setattr(caching, "FOLDER", tmp_path / "kernels")
    monkeypatch.setattr(beforehand, "TRIED", {"calls": raising})
    (tmp_path / "vortex.py").write_text(VORTEX)
    (tmp_path / "own.yaml").write_text(OWN)
    beforehand.check_promises(load_spec(tmp_path / "own.yaml"))
    assert not list(tmp_path.glob("kernels/*.promises"))
