"""Trials that a device flies, with devices that are none: what is stored is what
processors would have stored, whatever becomes of the device.
"""

import math
from collections import Counter
from collections.abc import Iterator
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kernels.device.host import Host
from sweep.campaigns.launching import check_flights, launch
from sweep.design.cost import trial_bytes
from sweep.design.design import expand
from sweep.design.jobs import Jobs
from sweep.errors import ChoiceError, WorkersError
from sweep.store.origin import device_said, machine_said, part_provenance
from sweep.store.parquet import stored_schema
from sweep.tables.stored_study import StoredStudy
from sweep.tables.trial_rows import by_origin
from sweep.trial import on_device
from sweep.trial.on_device import DeviceTrials
from sweep.workers import gpu
from sweep.workers.chunks import Batches
from sweep.workers.flying import NewTrials
from sweep.workers.runner import MAX_ATTEMPTS
from tests import devices
from tests.commands import sweep
from tests.devices import InThisProcess, InWorkers
from tests.faults.campaign import tables
from tests.searches import TINY
from tests.studies import IMPOSSIBLE, SMALL, launched, read

MANY = SMALL.replace("replicates: 3", "replicates: 10")
"""Twenty trials: five batches of four."""


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """What processors store."""
    return tables(launched(MANY, tmp_path_factory.mktemp("whole")).store.folder)


@pytest.fixture
def workers() -> Iterator[list[InWorkers]]:
    """Engines whose workers are ended at the end of a test."""
    made: list[InWorkers] = []
    yield made
    for engine in made:
        engine.stop()


def stored(folder: Path) -> dict[str, str]:
    return tables(folder / "small")


@pytest.mark.slow
def test_a_device_stores_what_processors_store(
    tmp_path: Path, whole: dict[str, str]
) -> None:
    """On the device that this machine is, with the layout and launch of a GPU."""
    launched(MANY, tmp_path, InThisProcess(device=DeviceTrials(Host)))
    assert stored(tmp_path) == whole


@pytest.mark.slow
def test_workers_share_a_device(
    tmp_path: Path, whole: dict[str, str], workers: list[InWorkers]
) -> None:
    workers.append(InWorkers(2))
    launched(MANY, tmp_path, workers[0])
    assert stored(tmp_path) == whole


@pytest.mark.slow
def test_a_killed_worker_loses_nothing(
    tmp_path: Path, whole: dict[str, str], workers: list[InWorkers]
) -> None:
    marker = tmp_path / "killed"
    workers.append(InWorkers(2, device=devices.KillsOnce(marker)))
    launched(MANY, tmp_path, workers[0])
    assert marker.exists()
    assert stored(tmp_path) == whole


@pytest.mark.slow
@pytest.mark.parametrize("kills", [False, True])
def test_a_trial_that_breaks_the_device_harms_no_other(
    tmp_path: Path, workers: list[InWorkers], kills: bool
) -> None:
    """Its process is lost with it, or cannot use the device any more."""
    spec = SMALL.replace("[0.5, 1]", "[0.5]").replace("replicates: 3", "replicates: 8")
    workers.append(InWorkers(2, device=devices.Breaks(5, kills=kills)))
    trials = launched(spec, tmp_path, workers[0]).trials
    assert list(trials["status"]) == ["done"] * 5 + ["failed"] + ["done"] * 2
    said = trials["error"][5]
    words = "worker process died" if kills else "an illegal address was met"
    assert words in said
    assert f"{MAX_ATTEMPTS} " in said


def test_the_trial_to_blame_is_found_by_halves(tmp_path: Path) -> None:
    """Of 16 in a batch, in four batches less and less large, and tried as often as any
    trial. Others fly once more at most for each.
    """
    spec = SMALL.replace("[0.5, 1]", "[0.5]").replace("replicates: 3", "replicates: 16")
    device = Sizes()
    trials = launched(spec, tmp_path, InThisProcess(device=device, at_once=16)).trials
    assert Counter(trials["status"]) == {"done": 15, "failed": 1}
    assert device.broken == [16, 8, 4, 2, *[1] * MAX_ATTEMPTS]
    assert sum(device.flown) == 15


class Sizes:
    """The sizes of batches with replicate 5, which break, and of others."""

    def __init__(self) -> None:
        self.broken: list[int] = []
        self.flown: list[int] = []

    def several(self, jobs: Any) -> Any:
        if devices.is_whole(jobs[0]):
            there = any(job.replicate == 5 for job in jobs)
            (self.broken if there else self.flown).append(len(jobs))
        return devices.Breaks(5).several(jobs)


def test_a_device_that_dies_ends_the_launch_and_the_same_command_goes_on(
    tmp_path: Path, whole: dict[str, str]
) -> None:
    device = devices.Dies(after=2)
    why = "no worker process can be given a job: a GPU gave no results: RuntimeError"
    with pytest.raises(WorkersError, match=f"^{why}: the driver does not answer$"):
        launched(MANY, tmp_path, InThisProcess(device=device))
    assert len(StoredStudy("small", tmp_path).trials) == 8
    launched(MANY, tmp_path, InThisProcess())
    assert stored(tmp_path) == whole


def test_ctrl_c_keeps_what_has_flown(tmp_path: Path, whole: dict[str, str]) -> None:
    with pytest.raises(KeyboardInterrupt):
        launched(MANY, tmp_path, InThisProcess(device=devices.Interrupted(after=2)))
    kept = len(StoredStudy("small", tmp_path).trials)
    assert 8 <= kept < 20
    launched(MANY, tmp_path, InThisProcess())
    assert stored(tmp_path) == whole


def test_half_on_processors_and_half_on_a_device_is_one_study(
    tmp_path: Path, whole: dict[str, str]
) -> None:
    device = devices.Dies(after=2)
    with pytest.raises(WorkersError):
        launched(MANY, tmp_path, InThisProcess(device=device))
    study = launched(MANY, tmp_path)
    assert stored(tmp_path) == whole
    ids = [job.trial_id for batch in device.batches for job in batch]
    found = by_origin(study.store, [*study.store.trial_ids()])
    assert [("device" in about, len(own)) for about, own in found] == [
        (True, 8),
        (False, 12),
    ]
    assert set(found[0][1]) == set(ids)


def test_a_part_says_which_device_has_flown_it(tmp_path: Path) -> None:
    study = launched(SMALL, tmp_path, InThisProcess())
    [part] = study.store.current_parts()
    file = part / "trials.parquet"
    about = part_provenance(stored_schema(file), file)
    assert about["device"] == devices.ABOUT
    said = "Test GPU 9 (CUDA 13.0, numba-cuda 0.30.4, NVVM 13.5)"
    assert device_said(about) == said
    assert device_said({"device": {"name": "Test GPU 9"}}) == "Test GPU 9"
    assert machine_said(about).startswith(f"{device_said(about)}, {about['cpu']}")
    assert device_said({name: about[name] for name in about if name != "device"}) == ""


def test_all_reasons_are_said_at_once_and_nothing_is_written(tmp_path: Path) -> None:
    refused = SMALL + "memory_limit: 1 GiB\n"

    def refusal(job: Any) -> str:
        return "it is too heavy" if job.settings["separation_weight"] == 1 else ""

    engine = InThisProcess(refusal=refusal)
    with pytest.raises(ChoiceError) as raised:
        launched(refused, tmp_path, engine)
    first, *reasons = str(raised.value).splitlines()
    assert first == "study small: trials cannot run on a GPU:"
    point = list(Jobs(read(refused), expand(read(refused))))[3].point
    assert reasons == [
        "  memory_limit: the memory of one trial of a batch is not known",
        f"  it is too heavy (3 of 6 trials, for example at point {point})",
    ]
    assert not list((tmp_path / "small").glob("*.parquet"))
    other = refused.replace("study: small", "study: other")
    with pytest.raises(ChoiceError) as both:
        check_flights([read(refused), read(other)], engine)
    assert [line for line in str(both.value).splitlines() if "study" in line] == [
        first,
        first.replace("small", "other"),
    ]


def test_a_search_is_checked_by_trials_like_those_that_it_asks_for() -> None:
    """The condition rejects the preset, and no candidate."""
    search = TINY.replace("fixed: {n: 12, steps: 9}", "fixed: {steps: 9}").replace(
        "parameters:", "parameters:\n    n: {integers: [10, 20]}"
    )
    study = read(search.replace("usual: {", "usual: {n: 10, ") + "require: [n <= 20]\n")
    assert study.preset_settings["n"] > 20
    engine = InThisProcess(refusal=lambda _job: "it is too heavy")
    with pytest.raises(ChoiceError, match="it is too heavy"):
        check_flights([study], engine)


def test_a_trial_that_cannot_begin_is_not_refused_and_says_why_itself(
    tmp_path: Path,
) -> None:
    device = DeviceTrials(Host)
    engine = InThisProcess(device=device, refusal=on_device.refusal_of)
    trials = launched(IMPOSSIBLE, tmp_path, engine).trials
    assert set(trials["status"]) == {"failed"}
    assert trials["error"].str.startswith("Traceback").all()


@given(
    costs=st.lists(st.floats(0, 1e12), max_size=300),
    at_once=st.integers(1, 40),
    workers=st.integers(1, 9),
    in_order=st.booleans(),
)
def test_batches_are_as_few_as_can_be_and_of_about_one_size(
    costs: list[float], at_once: int, workers: int, in_order: bool
) -> None:
    batches, dealt = Batches(costs, in_order=in_order, at_once=at_once), []
    while indices := batches.take(workers):
        dealt.append(indices)
        batches.observe(indices, 1.0)
    assert len(dealt) == math.ceil(len(costs) / at_once)
    sizes = [len(indices) for indices in dealt]
    assert not sizes or (max(sizes) <= at_once and max(sizes) - min(sizes) <= 1)
    order = list(chain.from_iterable(dealt))
    if in_order:
        assert order == list(range(len(costs)))
    else:
        assert sorted(order) == list(range(len(costs)))
        assert [costs[index] for index in order] == sorted(costs, reverse=True)
    for indices in dealt:
        parts = batches.split(indices)
        assert [*chain.from_iterable(parts)] == indices
        assert len(parts) == min(2, len(indices))


def test_results_that_are_large_come_in_smaller_batches(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    study = read(SMALL.replace("every: 2", "every: 2, trajectories: true"))
    jobs = list(Jobs(study, expand(study)))
    size = trial_bytes(jobs[0].settings, jobs[0].record)
    monkeypatch.setattr("sweep.workers.on_device.MOST_BYTES", 2.5 * size)
    flying = devices.on_device(devices.OfProcessors())
    sent = flying.sent(NewTrials(study, jobs, np.ones(len(jobs)), 2, None))
    assert len(sent.deal(np.ones(len(jobs))).take(2)) == 2
    assert len(flying.sent_again(jobs[:1]).deal([1.0]).take(2)) == 1
    monkeypatch.setattr("sweep.workers.on_device.MOST_BYTES", 0.1 * size)
    assert len(flying.sent_again(jobs).deal([1.0] * 6).take(2)) == 1


@pytest.mark.parametrize(
    ("asked", "cores", "workers"), [(0, 1, 2), (0, 8, 8), (0, 64, 16), (3, 1, 3)]
)
def test_workers_are_as_many_as_cores_within_bounds(
    asked: int, cores: int, workers: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(gpu, "core_count", lambda: cores)
    assert gpu.gpu_workers(asked) == workers


def started(tmp_path: Path, *options: str) -> Any:
    (tmp_path / "spec.yaml").write_text(SMALL)
    return sweep(tmp_path, "launch", "spec.yaml", "--executor", "cuda", *options)


def test_the_command_flies_a_study_on_a_device(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with devices.there(monkeypatch):
        monkeypatch.setattr(gpu, "Cuda", InThisProcess)
        done = started(tmp_path, "--json")
    assert (done.returncode, '"new": {"done": 6}' in done.stdout) == (0, True)


def test_without_a_gpu_the_command_ends_before_any_work(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with devices.there(monkeypatch, problem="no GPU is seen"):
        done = started(tmp_path)
        assert (done.returncode, done.stderr) == (
            2,
            "--executor cuda: no GPU is seen\n",
        )
        hidden = "CUDA_VISIBLE_DEVICES is empty, which hides every GPU"
        monkeypatch.setenv("CUDA_VISIBLE_DEVICES", "")
        assert hidden in started(tmp_path).stderr
        done = started(tmp_path, "--address", "tcp://host:1")
        assert done.stderr == (
            "--address: only a dask cluster has one; give --executor dask\n"
        )
        monkeypatch.setattr("sweep.workers.engines.find_spec", lambda _name: None)
        missing = '--executor cuda: needs numba-cuda: pip install "boidsweep[gpu]"\n'
        assert started(tmp_path).stderr == missing
    assert not (tmp_path / "results").exists()


def test_a_gpu_is_named_with_its_driver(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("numba_cuda", reason="the extra `gpu` is not installed")
    monkeypatch.setattr("sweep.trial.gpu", OfOneName)
    gpu.this_gpu.cache_clear()
    try:
        found = gpu.this_gpu()
    finally:
        gpu.this_gpu.cache_clear()
    assert (found["name"], found["driver"]) == ("Test GPU 9", "12.8")
    assert found.keys() == devices.ABOUT.keys()


class OfOneName:
    """A GPU that says what it is, as CUDA counts versions."""

    name, driver = "Test GPU 9", 12080

    def __init__(self) -> None:
        self.versions = {name: devices.ABOUT[name] for name in ("numba_cuda", "nvvm")}


def test_a_study_that_grows_flies_on_a_device(tmp_path: Path) -> None:
    """Each round is looked at, and sent, as it is asked for."""
    growing = SMALL.replace(
        "replicates: 3",
        "replicates: {until: {metric: speed, half_width: 0.01}, min: 3, max: 6}",
    )
    study = read(growing)
    launch(study, tmp_path, InThisProcess())
    one, other = tmp_path, tmp_path / "processors"
    launched(growing, other)
    assert tables(one / "small") == tables(other / "small")
