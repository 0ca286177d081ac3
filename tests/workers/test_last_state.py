"""A trial that goes on from the last state of a shorter one has the bits of one that
began at step 0; what is not a good one is not used.
"""

import json
import logging
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from random import Random
from typing import Any

import pytest

from kernels.models import MODELS
from sweep.design.design import expand
from sweep.design.jobs import Job, Jobs, LastState
from sweep.spec.study import parse_spec
from sweep.store.user_key import own_key
from sweep.trial import simulation
from sweep.trial.result import Result
from sweep.trial.simulation import Simulation, run
from sweep.workers import checkpoint, checkpoint_file, last_state
from sweep.workers.checkpoint import Checkpointed
from tests import builders, oscillators
from tests.cases import slow_but
from tests.studies import SMALL
from tests.trial.test_trial import flown, small
from tests.workers.test_checkpoint import (
    TRIAL,
    jobs_of,
    killed_after,
    named,
    numbers,
    step_of,
)

PLAIN = Checkpointed(run, None, math.inf)


@pytest.fixture(autouse=True)
def _short_calls(monkeypatch: pytest.MonkeyPatch) -> None:
    """Many kernel calls a trial, and a checkpoint after every one."""
    monkeypatch.setattr(simulation, "BOID_STEPS_A_CALL", 12 * 3)
    monkeypatch.setattr(checkpoint, "TIMES_LONGER", 0.0)
    last_state._say_once.cache_clear()


def keeping(a_job: Job) -> Job:
    return replace(a_job, record=replace(a_job.record, last_states=True))


def of_steps(a_job: Job, steps: int) -> Job:
    return replace(a_job, settings=a_job.settings | {"steps": steps})


def after(steps: int, a_job: Job, trial: Callable[[Job], Result] = PLAIN) -> Job:
    """The job, which goes on from the last state of its trial of so many steps."""
    earlier = trial(of_steps(a_job, steps))
    assert (earlier.status, earlier.step) == ("done", steps)
    return replace(a_job, earlier=LastState(a_job.trial_id, earlier.last_state))


def begun_at(a_job: Job, monkeypatch: pytest.MonkeyPatch) -> tuple[int, Result]:
    """The step at which a trial begins, and its result without its last state."""
    began, result_of = [], Simulation.result

    def noting(self: Simulation, *arguments: Any) -> Result:
        began.append(self.step)
        return result_of(self, *arguments)

    with monkeypatch.context() as patched:
        patched.setattr(Simulation, "result", noting)
        result = PLAIN(a_job)
    (step,) = began
    assert bool(result.last_state) == (result.status == "done")
    return step, replace(result, last_state=b"")


def check_goes_on(a_job: Job, steps: list[int], patch: pytest.MonkeyPatch) -> None:
    """A trial goes on from one that went on from one, and so on."""
    through = a_job
    for number, step in enumerate(steps):
        through = after(step, replace(a_job, earlier=through.earlier))
        began, result = begun_at(through, patch)
        assert began == step, number
        assert numbers(result) == numbers(run(a_job)), (a_job, step)


HERE = ["aziel_chen2025", "couzin2002", "strombom2014", "vasarhelyi2018"]
"""The models that go on from a last state among the fast tests; the others do so from
checkpoints, which hold the same: see test_checkpoint.
"""


@pytest.mark.parametrize("model", slow_but(HERE, MODELS))
def test_a_longer_trial_goes_on_from_any_step_to_the_same_bits(
    model: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Metrics, series, visits and trajectories; where is drawn, also after the middle,
    and between the frames.
    """
    random = Random(model)
    for number, a_job in enumerate(map(named, jobs_of(model))):
        wanted = keeping(flown(a_job) if number % 2 else a_job)
        last = int(a_job.settings["steps"])
        steps = sorted(random.sample(range(1, last), 2))
        monkeypatch.setattr(simulation, "BOID_STEPS_A_CALL", 12 * random.randint(1, 9))
        check_goes_on(wanted, steps, monkeypatch)


@pytest.mark.parametrize("every", [1, 3, 7, 50])
@pytest.mark.parametrize("step", [1, 6, 7, 10, 11, 19])
def test_no_frame_of_the_shorter_trial_stays_that_the_longer_one_has_not(
    every: int, step: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its last frame is none of the longer one's, unless it is on time."""
    wanted = keeping(flown(named(small("aziel_chen2025", every=every))))
    check_goes_on(wanted, [step], monkeypatch)


def test_derived_metrics_and_heatmaps_go_on_too(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    derive = 'derive: {gain: "polarization / speed", loss: "log(gain * start_speed)"}'
    record = f"{{series: [speed, loss, coverage], heatmaps: true, {derive}"
    study = parse_spec(SMALL.replace("{series: [speed]", record))
    for a_job in Jobs(study, expand(study))[:2]:
        check_goes_on(keeping(a_job), [3, 8], monkeypatch)


@pytest.mark.slow
@pytest.mark.parametrize("update", builders.UPDATES)
def test_the_state_of_boids_goes_on_too(
    update: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    with builders.entered(oscillators.MODEL, order=oscillators.ORDER):
        a_job = builders.job("oscillators", series=("order",), update=update)
        check_goes_on(keeping(flown(named(a_job))), [1, 4, 13], monkeypatch)


def plain_job(**changes: Any) -> Job:
    """A trial with noise, of twenty steps."""
    return keeping(named(small("aziel_chen2025", **changes)))


def test_a_trial_that_was_killed_goes_on_from_its_own_checkpoint(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Which has the frames of the shorter trial too."""
    a_job = flown(plain_job())
    killed_after(2, after(9, a_job), tmp_path, monkeypatch)
    assert step_of(tmp_path) == 15
    result = Checkpointed(run, tmp_path, 1e9)(after(9, a_job))
    assert numbers(replace(result, last_state=b"")) == numbers(run(a_job))


def test_the_seconds_and_the_time_limit_are_those_of_both(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def long(a_job: Job) -> Result:
        with monkeypatch.context() as patched:
            patched.setattr(
                last_state,
                "Saved",
                lambda state, _took, *rest: checkpoint_file.Saved(state, 5000.0, *rest),
            )
            return PLAIN(a_job)

    a_job = after(9, plain_job(), long)
    for trial in (PLAIN, Checkpointed(run, tmp_path, 1e9)):
        assert 5000.0 < trial(a_job).seconds < 6000.0
    assert PLAIN(replace(a_job, time_limit=4000.0)).status == "timeout"


def test_a_trial_that_does_not_end_keeps_nothing_and_results_carry_nothing() -> None:
    late = PLAIN(replace(plain_job(), time_limit=0.0))
    assert (late.status, late.last_state) == ("timeout", b"")
    assert PLAIN(after(9, plain_job())).job.earlier is None


def test_a_last_state_that_is_too_large_is_not_kept(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(last_state, "MOST_BYTES", 1000)
    with caplog.at_level(logging.WARNING, "sweep"):
        result = PLAIN(plain_job())
    assert (result.status, result.last_state) == ("done", b"")
    assert "has more than 1,000 bytes, and is not stored" in caplog.text


def flipped(content: bytes) -> bytes:
    changed = bytearray(content)
    changed[Random(len(content)).randrange(len(content))] ^= 1
    return bytes(changed)


def as_a_checkpoint(content: bytes) -> bytes:
    """The file of the state of a checkpoint that is in it."""
    _, header, inner = content.split(b"\n", 2)
    return inner[: json.loads(header)["state_bytes"]]


BAD: dict[str, tuple[Callable[[bytes], bytes], str]] = {
    "empty": (lambda _: b"", "is not a checkpoint, or is damaged"),
    "damaged": (flipped, "is damaged, or was written by another user"),
    "cut": (lambda content: content[:-9], "is damaged, or was written by another"),
    "of a stranger": (
        lambda content: checkpoint_file.sealed(
            checkpoint_file.unsealed(content, own_key()), bytes(32)
        ),
        "is damaged, or was written by another user",
    ),
    "a checkpoint": (as_a_checkpoint, "belongs to a trial that begins in another way"),
}


@pytest.mark.parametrize("bad", BAD)
def test_a_last_state_that_is_not_good_is_not_used_and_that_is_said_once(
    bad: str, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    spoil, why = BAD[bad]
    a_job = after(9, plain_job())
    assert a_job.earlier is not None
    spoilt = LastState(TRIAL, spoil(a_job.earlier.content))
    with caplog.at_level(logging.WARNING, "sweep"):
        for _ in range(2):
            step, result = begun_at(replace(a_job, earlier=spoilt), monkeypatch)
            assert step == 0
            assert numbers(result) == numbers(run(plain_job()))
    (record,) = caplog.records
    assert why in record.message
    assert "affected trials begin at step 0" in record.message


def test_the_last_state_of_other_libraries_is_not_used(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    with monkeypatch.context() as patched:
        patched.setattr(last_state, "libraries", lambda: '{"numpy": "0.0.0"}')
        a_job = after(9, plain_job())
    with caplog.at_level(logging.WARNING, "sweep"):
        assert begun_at(a_job, monkeypatch)[0] == 0
    assert "was written by other code: numpy" in caplog.text


def test_the_last_state_of_another_processor_is_not_used(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    with monkeypatch.context() as patched:
        patched.setattr(checkpoint_file, "_machine", lambda: ["another"])
        a_job = after(9, plain_job())
    with caplog.at_level(logging.WARNING, "sweep"):
        assert begun_at(a_job, monkeypatch)[0] == 0
    assert "was written on another kind of machine" in caplog.text


@pytest.mark.parametrize(
    "changes",
    [
        {"seed": 2},
        {"replicate": 1},
        {"start_radius": 30},
        {"n_obstacles": 3, "map": "random_obstacles"},
        {"pixel": 2},
    ],
)
def test_a_trial_that_begins_in_another_way_does_not_go_on(
    changes: dict[str, Any],
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    """Whatever a table says: flock, scenery, pixels and noise must be the same."""
    earlier = after(9, plain_job()).earlier
    a_job = replace(plain_job(**changes), earlier=earlier)
    with caplog.at_level(logging.WARNING, "sweep"):
        step, result = begun_at(a_job, monkeypatch)
    assert step == 0
    assert numbers(result) == numbers(run(replace(a_job, earlier=None)))
    assert "belongs to a trial that begins in another way" in caplog.text
