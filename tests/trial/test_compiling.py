"""That something will be compiled is said before: in a plan, and where trials run."""

import logging
from collections.abc import Iterator, Sequence

import pytest
from numba import typeof

from kernels.caching import NOT_KEPT, _classes, is_kept
from kernels.layers import LAYERS, _named_tuples
from kernels.models import MODELS
from kernels.moving import Motion
from kernels.recording import Record
from kernels.robots.motors import Motors
from kernels.robots.senses import Senses
from kernels.robots.wind import Wind
from kernels.state import Corners, Flock, World
from kernels.workspace import Workspace
from sweep.campaigns import plan as planning
from sweep.campaigns.plan import plan_of
from sweep.design.design import expand
from sweep.design.jobs import Job, Jobs
from sweep.trial import simulation
from sweep.trial.compiled import NOTHING_IS_KEPT
from sweep.trial.simulation import Simulation, compiling_seconds, layers_of, warm
from sweep.web import compiling as web_compiling
from sweep.web.state import begin
from sweep.workers import worker
from sweep.workers.fingerprint import fingerprint
from tests.commands import python
from tests.studies import OWN_SMALL, SMALL, read


def test_it_is_said_before_a_model_is_compiled_and_not_afterwards(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    study = read(SMALL)
    job = Jobs(study, expand(study))[0]
    warm(job)
    assert compiling_seconds(job) == 0.0
    caplog.clear()
    warm(job)
    assert caplog.messages == []
    monkeypatch.setattr(simulation, "is_compiled_for", lambda *_: False)
    with caplog.at_level(logging.WARNING, "sweep"):
        warm(job)
    said = f"compiling {job.model}, about 15 s on an idle core, once"
    assert caplog.messages == [said]


def test_it_is_said_once_where_nothing_can_be_kept(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """And no process says that it compiles: each does."""
    study = read(SMALL)
    job = Jobs(study, expand(study))[0]
    warm(job)
    caplog.clear()
    monkeypatch.setenv(NOTHING_IS_KEPT, "")
    monkeypatch.delenv(NOTHING_IS_KEPT)
    monkeypatch.setitem(NOT_KEPT, "/full", "No space left on device")
    for _ in range(2):
        assert not warm(job).has_failed
    [said] = caplog.messages
    assert said.startswith(
        "/full: compiled kernels cannot be stored (No space left on device), so each"
    )
    monkeypatch.setattr(simulation, "is_compiled_for", lambda *_: False)
    warm(job)
    assert caplog.messages == [said]


def test_what_no_process_can_keep_is_compiled_before_the_clock_of_a_trial_runs(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    study, ran = read(SMALL), list[str]()
    job = Jobs(study, expand(study))[0]

    class Seat:
        def noting(self, jobs: Sequence[Job]) -> Iterator[Job]:
            ran.append("noted")
            yield from jobs

    monkeypatch.setattr("sweep.trial.warm", lambda _job: ran.append("compiled"))
    monkeypatch.setattr(worker, "_compiled", set())
    monkeypatch.setenv(NOTHING_IS_KEPT, "1")
    for _ in range(2):
        worker.run_chunk(lambda one: one, [job, job], Seat(), fingerprint())  # type: ignore[arg-type]
    assert ran == ["compiled", "noted", "noted"]
    monkeypatch.delenv(NOTHING_IS_KEPT)
    monkeypatch.setattr(worker, "_compiled", set())
    worker.run_chunk(lambda one: one, [job], Seat(), fingerprint())  # type: ignore[arg-type]
    assert ran == ["compiled", *["noted"] * 3]


def test_it_is_said_too_where_an_own_model_is_tried_and_where_one_is_shown(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """Both compile before a launch, or the page, would say so."""
    monkeypatch.setattr(simulation, "is_compiled_for", lambda *_: False)
    plan_of(read(OWN_SMALL), 2)
    assert {one.split(",")[0] for one in caplog.messages} == {"compiling drawn"}
    caplog.clear()
    monkeypatch.setattr(web_compiling, "PREPARED", set())
    web_compiling.prepare(begin("nguyen2024", "as_run").job, ())
    assert [one.split(",")[0] for one in caplog.messages] == ["compiling nguyen2024"]


def test_a_plan_has_the_time_where_the_model_is_not_compiled(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    study = read(SMALL)
    warm(Jobs(study, expand(study))[0])
    assert "to compile the model" not in plan_of(study, 2).as_text()
    monkeypatch.setattr(planning, "compiling_seconds", lambda _job: 15.0)
    plan = plan_of(study, 2)
    assert plan.compiling_seconds == 15.0
    assert "workers, and once about 15.0 s to compile the model" in plan.as_text()


GIVEN = {
    "sensing_delay: 1": {Senses},
    "motor_lag: 1": {Motors},
    "motor_noise: 1, radio_range: 100": {Senses, Motors},
    "failing_share: 0.5, failing_time: 1": {Motors},
    "failing_share: 0.5, failing_time: 1, failing_how: blind": {Senses},
    "failing_share: 0.01, failing_time: 1": set(),
    "gust: 1": {Wind},
    "map: hall": {Corners},
    "map: hall, obstacle_speed: 1, wind_x: 1": {Corners, Motion, Wind},
}
HALL = """\
maps:
  hall:
    size: [300, 200]
    shapes: [{polygon: {vertices: [[60, 50], [90, 60], [70, 90]]}}]
"""


@pytest.mark.parametrize("given", GIVEN)
def test_the_layers_of_a_trial_are_those_that_its_flight_has(given: str) -> None:
    """Of 12 boids a hundredth are none."""
    text = SMALL.replace("n: 12", f"n: 12, {given}")
    study = read(text.replace("map: empty, ", "") + HALL if "map" in given else text)
    job = Jobs(study, expand(study))[0]
    assert layers_of(job) == GIVEN[given]
    work = Simulation(job).flight.work
    world = Simulation(job).flight.world
    parts = work.near.senses, work.robots.motors, work.robots.wind, work.motion
    made = {type(one) for one in (*parts, world.corners)} - {type(None)}
    assert made == GIVEN[given]


def classes_of(job: Job) -> set[type]:
    """The classes of the arguments of a kernel, which are checked against those that
    are known before there is a flight.
    """
    model = job.catalogue.models[job.model]
    flight = Simulation(job).flight
    given = flight.flock, flight.world, flight.params, flight.work, flight.record
    classes = set(_classes(map(typeof, given)))
    named = Flock, World, model.params, Workspace, Record
    absent = LAYERS.keys() - (layers_of(job) or set())
    assert set(_named_tuples(named, absent)) == classes
    return classes


def test_robots_are_another_kernel_which_is_known_not_to_be_compiled() -> None:
    """A kernel is kept under the very classes that its arguments have. That of a wind
    is compiled for other tests too.
    """
    study = read(SMALL.replace("n: 12", "n: 12, wind_x: 1"))
    job = Jobs(study, expand(study))[0]
    warm(job)
    assert compiling_seconds(job) == 0.0
    model = job.catalogue.models[job.model]
    classes = classes_of(job)
    assert is_kept(model.advance, classes)
    assert not is_kept(model.advance, classes | {Job})


@pytest.mark.parametrize("given", ["motor_lag: 1", "motor_lag: 1, sensing_delay: 1"])
def test_the_classes_of_a_kernel_are_known_without_a_flight(given: str) -> None:
    study = read(SMALL.replace("n: 12", f"n: 12, {given}"))
    classes = classes_of(Jobs(study, expand(study))[0])
    assert Motors in classes
    assert (Senses in classes) == ("sensing" in given)


def test_a_plan_has_the_time_of_each_kernel_that_its_trials_need(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Ideal boids, those with motors, those with senses, and those with both; and
    obstacles at rest and moving.
    """
    monkeypatch.setattr(simulation, "is_compiled_for", lambda *_: False)
    ablation = "ablate: {lag: {motor_lag: 2}, noise: {position_noise: 1}}"
    text = SMALL.replace("separation_weight: [0.5, 1]", f"robots: {{{ablation}}}")
    assert plan_of(read(SMALL), 2).compiling_seconds == 15.0
    assert plan_of(read(text), 2).compiling_seconds == 60.0
    moving = SMALL.replace("separation_weight: [0.5, 1]", "obstacle_speed: [0, 1, 2]")
    moving = moving.replace("map: empty, ", "").replace("n: 12", "n: 12, map: hall")
    assert plan_of(read(moving + HALL), 2).compiling_seconds == 30.0


CODE = """
from kernels.caching import is_kept
from kernels.catalogue import BUILT_IN
from kernels.models import MODELS
from kernels.moving import Motion
print([is_kept(model.advance) for model in MODELS.values()])
"""


def test_an_empty_cache_keeps_no_model(tmp_path: object) -> None:
    kept = python(CODE, NUMBA_CACHE_DIR=str(tmp_path), NUMBA_DISABLE_JIT="0")
    assert kept.strip() == str([False] * len(list(MODELS)))
