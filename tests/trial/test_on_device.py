"""Trials on a device have the bits that they have alone. The device is this processor:
it has the large arrays and the kernel of a GPU, and runs one trial after the other.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from kernels.device import batch
from kernels.device.batch import Batch, DeviceError, NoRoomError
from kernels.device.host import Host
from kernels.device.kernel import ASTRAY, N_MARKS, STATE, TAKE
from kernels.jit import jit
from kernels.models import MODELS
from sweep.design.jobs import Job
from sweep.spec.study import RecordSpec
from sweep.trial import on_device
from sweep.trial.on_device import DeviceTrials, flown
from sweep.trial.result import Result
from sweep.trial.simulation import Simulation, run
from tests.builders import exact_jobs, job
from tests.trial import test_all_layers
from tests.trial.test_lanes import numbers
from tests.trial.test_trial import OVERFLOWS

FAST = "vicsek1995"
"""Tests that are not slow compile this model alone."""
MEASURED = "polarization", "coverage", "escapes", "fissions"
"""Metrics that a device measures: of bodies, pixels, events and flocks."""


def some(count: int = 5, **changes: Any) -> list[Job]:
    """Jobs that differ in a weight, in their seeds and in their maps."""
    wanted = {"metrics": MEASURED, "series": MEASURED, "every": 3, "n": 12, "steps": 20}
    world = {"map": "random_obstacles", "n_obstacles": 3, "width": 6, "height": 5}
    sizes = {"obstacle_radius": 0.3, "obstacle_margin": 0.5, "pixel": 0.1}
    given = wanted | world | sizes | changes
    base = job(FAST, "as_run", **given)
    return [
        replace(
            base,
            settings=base.settings | {"noise": 0.1 * k},
            seed=base.seed + k,
            replicate=k,
        )
        for k in range(count)
    ]


def check(jobs: Sequence[Job], results: Sequence[Result]) -> None:
    for one, mine in zip(jobs, results, strict=True):
        assert numbers(mine) == numbers(run(one))
        assert mine.job is one


@pytest.mark.parametrize("trajectories", [False, True])
@pytest.mark.parametrize("heatmaps", [False, True])
def test_trials_have_their_bits(trajectories: bool, heatmaps: bool) -> None:
    """Measured there, or from frames that are brought back; with maps that differ."""
    jobs = some(heatmaps=heatmaps, trajectories=trajectories)
    results = flown(jobs, Host())
    check(jobs, results)
    assert {one.status for one in results} == {"done"}
    assert len({one.last["polarization"] for one in results}) == len(jobs)


@pytest.mark.parametrize(
    "model",
    [
        pytest.param(model, marks=() if model == FAST else pytest.mark.slow)
        for model in MODELS
    ],
)
def test_every_model_has_its_bits(model: str) -> None:
    """With all metrics, whose frames are brought back, and all layers of presets."""
    jobs = list(exact_jobs(model))
    check(jobs, DeviceTrials(Host).several(jobs))


def test_jobs_of_several_kinds_go_in_batches_of_one_kind(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Boids, steps and records may differ within what a worker is given."""
    made = []
    monkeypatch.setattr(Batch, "__init__", noted(made, Batch.__init__))
    kinds = [some(3), some(2, n=9), some(2, steps=8), some(2, every=2)]
    jobs = [one for kind in kinds for one in kind[::2]]
    jobs += [one for kind in kinds for one in kind[1::2]]
    check(jobs, DeviceTrials(Host).several(jobs))
    assert sorted(made) == [1, 1, 1, 1, 2, 2, 2, 3], "one asks how many fit"


def noted(made: list[int], usual: Any) -> Any:
    def begin(self: Batch, flights: Any, *others: Any) -> None:
        made.append(len(flights))
        usual(self, flights, *others)

    return begin


@pytest.mark.parametrize("drawn", ["random_obstacles", "cafeteria"])
def test_one_kernel_serves_all_batches_of_a_study(drawn: str) -> None:
    """So it is compiled once: whatever trials a batch has, its text is the same."""
    ranges = [
        replace(one, settings=one.settings | {"interaction_range": 0.5 + k})
        for k, one in enumerate(some(4, map=drawn))
    ]
    jobs = [*some(5, map=drawn), *ranges, *some(2, map=drawn, n=9)]
    ready = [on_device._begun(one) for one in jobs]
    batches = [ready[:1], ready[1:2], ready[:2], ready[:5], ready[:-2], ready[-2:]]
    alike = [[one for one in batch if one.kind == batch[0].kind] for batch in batches]
    kernels = [on_device._batch(batch).kernel for batch in alike]
    assert len({(one.text, one.stamp) for one in kernels}) == 1
    assert kernels[0].text == on_device.kernel_of(jobs[3]).text
    assert [len(one) for one in alike][:4] == [1, 1, 2, 5]


@pytest.mark.slow
def test_wide_maps_have_the_visits_of_narrow_ones(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A pixel of 16 bits holds fewer visits: it is taken where there cannot be more."""
    jobs = some(3, heatmaps=True)
    assert on_device.kernel_of(jobs[0]).maps == "i2"
    monkeypatch.setattr(batch, "NARROW", batch.WIDE)
    assert on_device.kernel_of(jobs[0]).maps == "i4"
    check(jobs, flown(jobs, Host()))


def test_more_boid_steps_than_a_narrow_map_holds_have_a_wide_one() -> None:
    kernels = [on_device.kernel_of(some(1, steps=steps)[0]) for steps in (2730, 2731)]
    assert [one.maps for one in kernels] == ["i2", "i4"]


class Small(Host):
    """A device with room for so many bytes, which counts its calls."""

    def __init__(self, memory: int) -> None:
        super().__init__(memory)
        self.counts = list[int]()

    def free_bytes(self) -> int:
        return 2**40  # it says more than it has, as where another process takes it

    def take(self, size: int, kind: Any) -> Any:
        room = np.empty(size, kind)
        if self._held + room.nbytes > self.memory:
            raise NoRoomError
        self._held += room.nbytes
        return room

    def call(self, program: Any, numbers: Any, rooms: Any, count: int) -> None:
        if numbers[0] == TAKE:
            self.counts.append(count)
        super().call(program, numbers, rooms, count)


def bytes_of(jobs: Sequence[Job]) -> int:
    return on_device._batch([on_device._begun(one) for one in jobs]).bytes


@pytest.mark.slow
def test_too_little_memory_means_smaller_batches() -> None:
    jobs = some(5)
    device = Small(bytes_of(jobs[:2]) + 100)
    check(jobs, flown(jobs, device))
    assert max(device.counts) == 2
    assert device._held == 0


def test_batches_are_as_large_as_the_memory_that_is_free() -> None:
    jobs = some(5)
    room = int(3.5 * bytes_of(jobs[:1]) / on_device.SHARE)
    device = Small(room)
    device.free_bytes = lambda: room  # type: ignore[method-assign]
    check(jobs, flown(jobs, device))
    assert device.counts[0] == 3


def test_a_trial_that_fits_nowhere_fails_with_what_it_needs() -> None:
    jobs = some(2)
    results = flown(jobs, Small(1000))
    assert [one.status for one in results] == ["failed"] * 2
    for one, mine in zip(jobs, results, strict=True):
        assert f"which needs {bytes_of([one]):,} bytes" in mine.error


class Failing(Host):
    """A device that fails at its call of this number."""

    def __init__(self, at: int) -> None:
        super().__init__()
        self.at, self.calls = at, 0

    def call(self, *given: Any) -> None:
        self.calls += 1
        if self.calls == self.at:
            raise DeviceError("an illegal address")
        super().call(*given)


@pytest.mark.parametrize("at", [1, 2, 3])
def test_a_device_that_fails_is_named_by_an_error(at: int) -> None:
    """At the beginning, while it flies, and at the end. Its memory is given back."""
    device = Failing(at)
    with pytest.raises(DeviceError, match="an illegal address"):
        flown(some(3), device)
    assert device._held == 0


def test_a_trial_that_cannot_begin_harms_no_other() -> None:
    """It fails with the words that it has alone, but for its traceback."""
    jobs = some(3)
    lost = replace(jobs[1], settings=jobs[1].settings | {"map": "none"})
    results = flown([jobs[0], lost, jobs[2]], Host())
    check([jobs[0], jobs[2]], [results[0], results[2]])
    assert results[1].status == run(lost).status == "failed"
    assert results[1].error.splitlines()[-1] == run(lost).error.splitlines()[-1]


class Strays(Host):
    """A device whose flights end in a state in which none ends alone."""

    def bring(self, room: Any, array: Any, first: int = 0) -> None:
        super().bring(room, array, first)
        if array.shape == (N_MARKS, 3):
            array[STATE] = ASTRAY


def test_a_device_that_takes_other_steps_is_named_by_an_error() -> None:
    """No result of a processor takes the place of what it should have given."""
    with pytest.raises(DeviceError, match="fails there, but not on a processor"):
        flown(some(3), Strays())


def test_a_trial_that_cannot_be_summed_up_harms_no_other(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """What fails after the flight fails alone, too, and the trial says why."""
    jobs, usual = some(3), Simulation.summary

    def summary(self: Simulation, *given: Any) -> Result:
        if self.job.seed == jobs[1].seed:
            raise ArithmeticError("no sum")
        return usual(self, *given)

    monkeypatch.setattr(Simulation, "summary", summary)
    results = flown(jobs, Host())
    assert [one.status for one in results] == ["done", "failed", "done"]
    assert "no sum" in results[1].error


@pytest.mark.slow
@pytest.mark.parametrize("at", [0, 4])
def test_values_that_a_metric_leaves_are_none(at: int) -> None:
    """As on a processor, and not what was in the memory of a device before."""
    jobs = some(2)
    known = jobs[0].catalogue
    skips = known.metrics["speed"]._replace(measure=(nothing, every_second)[at > 0])
    metrics = {**known.metrics, "speed": skips}
    own = replace(known, metrics=metrics)
    record = replace(jobs[0].record, metrics=("speed",), series=("speed",))
    given = [replace(one, catalogue=own, record=record) for one in jobs]
    check(given, flown(given, Filled()))


@jit
def nothing(_frames: Any, _filled: int, _ground: Any, _seen: Any, _values: Any) -> None:
    """A metric without values."""


@jit
def every_second(
    _frames: Any, filled: int, _ground: Any, _seen: Any, values: Any
) -> None:
    """A metric with some values."""
    for f in range(0, filled, 2):
        values[f] = 1.0


class Filled(Host):
    """A device whose memory is full of what was there before."""

    def take(self, size: int, kind: Any) -> Any:
        room = super().take(size, kind)
        room.view(np.uint8)[...] = 77
        return room


def test_a_trial_that_diverges_harms_no_other() -> None:
    """It has the frames that it has alone, up to where its numbers were lost."""
    jobs = some(3)
    lost = replace(jobs[1], settings=jobs[1].settings | OVERFLOWS[FAST])
    together = [jobs[0], lost, jobs[2]]
    results = flown(together, Host())
    check(together, results)
    assert [one.status for one in results] == ["done", "diverged", "done"]


def test_what_the_clock_ends_or_keeps_its_last_state_is_refused() -> None:
    base = some(1)[0]
    asked = replace(
        base,
        time_limit=3.0,
        record=replace(base.record, last_states=True),
    )
    assert isinstance(asked.record, RecordSpec)
    said = on_device.refusal_of(asked)
    for words in ("a time limit", "last states"):
        assert words in said


@pytest.mark.slow
@pytest.mark.parametrize("model", MODELS)
def test_every_layer_has_its_bits(model: str) -> None:
    """Senses, motors, wind, goals in turn, and obstacles that move, of any shape."""
    base = test_all_layers.a_job(model)
    jobs = [replace(base, seed=base.seed + k) for k in range(3)]
    check(jobs, flown(jobs, Host()))
