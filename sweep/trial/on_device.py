"""Batches of trials on a device, thousands at once.

The results are bitwise identical to results of a processor.

Trials of a batch share the model, number of boids, steps, record and world; drawn
obstacles may differ. All other values, such as parameters of the model, may differ. A
trial that cannot begin, or that a model handles wrongly, runs again on the processor,
which reports the error. If the device fails, DeviceError is raised: this process cannot
use the device any more, and the caller sends the trials to another process. So all
trials that a store attributes to a device ran there.
"""

import time
from collections import defaultdict
from collections.abc import Callable, Hashable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from psutil import virtual_memory

from kernels.device.batch import (
    FRAMES_THERE,
    Batch,
    Device,
    DeviceError,
    KeptFrames,
    NoRoomError,
    form,
)
from kernels.device.image import MemoryImage, image_of
from kernels.device.kernel import ASTRAY, LOST, Kernel
from kernels.device.layout import leaves_of
from kernels.flight import Calls, calls_of, check_calls
from kernels.generator import Stream, go_on, stream_of
from kernels.jit import allocates
from kernels.metrics import Metric
from sweep.design import Job
from sweep.text import installing
from sweep.trial.result import Result, failed
from sweep.trial.scenery import is_drawn
from sweep.trial.simulation import Simulation, metrics_of, run
from sweep.trial.state import Taken

if TYPE_CHECKING:
    from kernels.device.gpu import Gpu
    from kernels.device.wasm import Module
    from kernels.device.wasmtime_host import Wasm

MOST_ON_DEVICE = 8192
"""Largest number of trials in a batch.

An H100 has room for about 33,000 threads, and workers take turns. The best number has
not been measured on a GPU.
"""
SHARE = 0.4
"""Fraction of the free memory of the device that a batch may use."""
SHARE_HERE = 1 / 32
"""Fraction of the free memory of this machine, which all workers share.

During its preparation a trial needs about as much memory here as on the device.
"""


@cache
def gpu() -> "Gpu":
    """Return the GPU of this process.

    Raises DeviceError if there is no GPU, and ModuleNotFoundError without the extra
    `gpu`.
    """
    from kernels.device.gpu import Gpu

    return Gpu()


@cache
def wasm() -> "Wasm":
    """Return the device of this process that runs WebAssembly.

    Raises ModuleNotFoundError without the extra `wasm`.
    """
    from kernels.device.wasmtime_host import Wasm

    return Wasm()


@dataclass(frozen=True)
class DeviceTrials:
    """Function that runs trials on a device.

    Attributes
    ----------
    device : callable
        Returns the device of this process; must allow pickling.
    """

    device: Callable[[], Device]

    def __call__(self, job: Job) -> Result:
        """Return the result of a job."""
        [result] = self.several([job])
        return result

    def several(self, jobs: Sequence[Job]) -> list[Result]:
        """Return the results of jobs, in their order."""
        device = self.device()
        results = dict[int, Result]()
        for places in _groups(jobs):
            together = [jobs[place] for place in places]
            results |= zip(places, flown(together, device), strict=True)
        return [results[place] for place in range(len(jobs))]


def problem() -> str:
    """Return the reason why trials cannot run on a GPU here; "" if they can."""
    try:
        gpu()
    except ModuleNotFoundError as error:
        return f"a GPU needs {error.name}, which is not installed: {installing('gpu')}"
    except DeviceError as error:
        return str(error)
    return ""


def refusal_of(job: Job) -> str:
    """Return the reason why a trial cannot run on a GPU; "" if it can.

    A trial that compiles to different results cannot run. Where the extra `gpu` is not
    installed, nothing is compiled.
    """
    return _refusal(job, _refused_by_gpu if find_spec("numba_cuda") else _accepted)


def refusal_of_wasm(job: Job) -> str:
    """Return the reason why a trial cannot run as WebAssembly; "" if it can."""
    return _refusal(job, _refused_by_wasm)


def _refusal(job: Job, of_kernel: Callable[[Kernel], str]) -> str:
    """Return the reason why a trial cannot run on a device; "" if it can.

    `of_kernel` returns the reason why a compiled kernel would have different results.
    """
    reasons = []
    if job.time_limit is not None:
        reasons.append("a time limit: a device cannot check the time")
    if job.record.last_states:
        reasons.append("last states of trials: a device does not store them")
    if job.catalogue.models[job.model].events:
        reasons.append("a recording, which a device does not play")
    if reasons:
        return "; ".join(reasons)
    try:
        kernel = kernel_of(job)
    except Exception:  # it cannot begin anywhere: the trial reports the error
        return ""
    try:
        return of_kernel(kernel)
    except DeviceError as error:
        return str(error)


def _accepted(_kernel: Kernel) -> str:
    return ""


def _refused_by_gpu(kernel: Kernel) -> str:
    from kernels.device.assembly import assembled
    from kernels.device.ptx import CAPABILITY, ptx_of

    try:
        capability = gpu().capability
    except DeviceError:
        capability = CAPABILITY
    compiled = ptx_of(kernel, capability)
    if not compiled.refusal:
        assembled(compiled.text, capability)
    return compiled.refusal


def _refused_by_wasm(kernel: Kernel) -> str:
    from kernels.device.wasm import module_of

    return module_of(kernel).refusal


def kernel_of(job: Job) -> Kernel:
    """Return the kernel that runs such a trial on a device.

    Raises the error of a trial that cannot begin.
    """
    return _batch([_begun(job)]).kernel


class DeviceStart(NamedTuple):
    """A trial on a device before the first step.

    Attributes
    ----------
    image : MemoryImage
        Memory of the device.
    bodies : tuple of int
        First elements of x, y, vx and vy in the array `numbers` of the memory.
    numbers : str
        Name of that array.
    steps : array (F,)
        Steps of the frames so far.
    values : array (number of metrics, F)
        Metrics of the frames so far.
    rows : dict of int
        Elements of the array "numbers" of the memory, by the parameter of the model.
    """

    image: MemoryImage
    bodies: tuple[int, ...]
    numbers: str
    steps: NDArray[np.int64]
    values: NDArray[np.float64]
    rows: dict[str, int]


def device_start(job: Job) -> DeviceStart:
    """Return a trial on a device before the first step.

    Raises the error of a trial that cannot begin.
    """
    begun = _begun(job)
    batch = _batch([begun])
    taken = begun.simulation.taken[0]
    places = [batch.layout.first_of(place) for place in range(4)]
    flight = begun.simulation.flight
    first = len([*leaves_of((flight.flock, flight.world))])
    rows = batch.layout.number_rows
    return DeviceStart(
        image_of(batch),
        tuple(first for _, first in places),
        numbers=places[0][0],
        steps=taken.steps,
        values=taken.values,
        rows={
            name: rows[first + k]
            for k, name in enumerate(flight.params._fields)
            if first + k in rows
        },
    )


def changes_only(job: Job, start: DeviceStart, parameter: str, value: float) -> bool:
    """Return whether another value of a parameter changes one number of memory alone.

    Parameters
    ----------
    job : Job
    start : DeviceStart
        The job before the first step.
    parameter : str
        Name in `start.rows`.
    value : float
        Another value of the parameter.
    """
    changed = replace(job, settings=job.settings | {parameter: value})
    try:
        after = device_start(changed).image
    except Exception:  # such a trial cannot begin
        return False
    before = start.image
    if before._replace(pieces=()) != after._replace(pieces=()):
        return False
    place = list(before.kernel.arrays).index("numbers")
    numbers = np.frombuffer(before.content(place)).copy()
    numbers[start.rows[parameter]] = value
    return numbers.tobytes() == after.content(place) and all(
        before.content(k) == after.content(k)
        for k in range(len(before.rooms))
        if k != place
    )


def wasm_module(job: Job) -> "Module":
    """Return the WebAssembly that runs such a trial, as for `device_start`.

    Raises the error of a trial that cannot begin, and NoModuleError if the kernel
    cannot be compiled.
    """
    from kernels.device.wasm import module_of

    return module_of(kernel_of(job))


def not_on_device(job: Job) -> list[str]:
    """Return the names of the metrics that no device measures."""
    names = job.record.metrics
    metrics = metrics_of(job, names)
    pairs = zip(names, metrics, strict=True)
    return [name for name, metric in pairs if not is_there(metric)]


def _groups(jobs: Sequence[Job]) -> Iterator[list[int]]:
    """Yield the indices of jobs that may run together."""
    alike = defaultdict[Any, list[int]](list)
    for place, job in enumerate(jobs):
        size = (job.settings["n"], job.settings["steps"])
        alike[id(job.catalogue), job.model, job.record, size].append(place)
    yield from alike.values()


@dataclass
class _Prepared:
    """Simulation with its first frame.

    Attributes
    ----------
    simulation : Simulation
    stream : Stream
        Random numbers of the simulation.
    called : Calls
        Counts of the calls of its model so far.
    """

    simulation: Simulation
    stream: Stream
    called: Calls

    @property
    def shared(self) -> bool:
        """True if no part of the scenery is random: trials share the scenery."""
        flight = self.simulation.flight
        moves = flight.scenery.velocities is not None
        return not (is_drawn(self.simulation.job) or moves or flight.work.robots.rows)

    @property
    def kind(self) -> Hashable:
        """Key that the trials of a batch share."""
        flight = self.simulation.flight
        scenery = id(flight.scenery) if self.shared else None
        return form(flight, self.stream), scenery


def flown(jobs: Sequence[Job], device: Device) -> list[Result]:
    """Return the results of jobs that share model, boids, steps and record."""
    results: list[Result] = []
    while len(results) < len(jobs):
        left = jobs[len(results) :]
        batch = left[: _fitting(left[0], device)]
        began = time.perf_counter()
        landed = _landed([_prepared(job) for job in batch], device)
        seconds = (time.perf_counter() - began) / len(batch)
        results += [
            _result(job, outcome, seconds)
            for job, outcome in zip(batch, landed, strict=True)
        ]
    return results


Landed = tuple[Simulation, int] | Result | None
"""Outcome of a trial on a device.

A pair has a simulation after the last step, and the status of its run. A Result belongs
to a trial that did not run. None means that the trial must run alone.
"""


def _result(job: Job, landed: Landed, seconds: float) -> Result:
    if isinstance(landed, Result):
        return landed
    if landed is not None:
        simulation, state = landed
        with suppress(Exception):  # the trial runs alone, which reports the error
            return simulation.summary("diverged" if state == LOST else "done", seconds)
    return _alone(job)


def _alone(job: Job) -> Result:
    """Return the result of a trial that fails on a processor too.

    Raises DeviceError if the trial succeeds there: then the device is wrong.
    """
    result = run(job)
    if not result.has_failed:
        raise DeviceError(f"trial {job.trial_id} fails there, but not on a processor")
    return result


def _fitting(job: Job, device: Device) -> int:
    """Return the number of such trials that fit into memory, at least 1."""
    prepared = _prepared(job)
    if prepared is None:
        return 1
    room = int(
        min(SHARE * device.free_bytes(), SHARE_HERE * virtual_memory().available)
    )
    return max(1, min(MOST_ON_DEVICE, room // _batch([prepared]).bytes))


def _prepared(job: Job) -> _Prepared | None:
    """Return a job at its start; None if it cannot begin."""
    try:
        return _begun(job)
    except Exception:  # the trial runs alone, which reports the error
        return None


def _begun(job: Job) -> _Prepared:
    simulation = Simulation(job, together=True, frames=FRAMES_THERE)
    simulation.taken.append(simulation.take_frames())
    with simulation.noise.lent() as rng:
        stream = stream_of(rng)
    return _Prepared(simulation, stream, calls_of(simulation.flight))


def _landed(prepared: Sequence[_Prepared | None], device: Device) -> list[Landed]:
    """Return the outcomes of trials, in their order."""
    landed: list[Landed] = [None] * len(prepared)
    alike = defaultdict[Any, list[int]](list)
    for place, trial in enumerate(prepared):
        if trial is not None:
            alike[trial.kind].append(place)
    for places in alike.values():
        together = [trial for place in places if (trial := prepared[place])]
        for place, outcome in zip(places, _flown(together, device), strict=True):
            landed[place] = outcome
    return landed


def _flown(prepared: Sequence[_Prepared], device: Device) -> Sequence[Landed]:
    """Return the outcomes of trials of one form.

    If the device has too little memory, the trials run in halves.
    """
    try:
        return _fly(prepared, device)
    except NoRoomError:
        half = len(prepared) // 2
        if not half:
            needed = f"one trial, which needs {_batch(prepared).bytes:,} bytes"
            reason = f"{device.name} has too little memory for {needed}"
            return [failed(prepared[0].simulation.job, reason)]
        return [*_flown(prepared[:half], device), *_flown(prepared[half:], device)]


def _fly(prepared: Sequence[_Prepared], device: Device) -> list[Landed]:
    batch = _batch(prepared)
    record = prepared[0].simulation.job.record
    lost = set[int]()
    for frames in batch.fly(device, maps=record.heatmaps):
        for place, trial in enumerate(prepared):
            try:
                taken = (
                    _taken(frames[place], trial.simulation)
                    if frames
                    else trial.simulation.take_frames()
                )
            except Exception:  # the trial runs alone, which reports the error
                lost.add(place)
            else:
                trial.simulation.taken.append(taken)
    return [
        None if place in lost else _ended(trial, int(state))
        for place, (trial, state) in enumerate(zip(prepared, batch.states, strict=True))
    ]


def _taken(frames: KeptFrames, simulation: Simulation) -> Taken:
    """Return frames that were measured on a device, without boids."""
    count = len(frames.steps)
    bodies = np.zeros((count, 4, 0))
    state = np.zeros((count, len(simulation.flight.work.state), 0))
    return Taken(frames.steps, frames.values, bodies, state)


def _ended(trial: _Prepared, state: int) -> Landed:
    """Return the outcome of a trial; None if its model missed a call in some step."""
    simulation = trial.simulation
    with simulation.noise.lent() as rng:
        go_on(rng, trial.stream)
    try:
        check_calls(simulation.flight, trial.called)
    except RuntimeError:
        return None
    return None if state == ASTRAY else (simulation, state)


def _batch(prepared: Sequence[_Prepared]) -> Batch:
    job = prepared[0].simulation.job
    flights = [trial.simulation.flight for trial in prepared]
    metrics = metrics_of(job, job.record.metrics)
    on_device = not job.record.looks and all(map(is_there, metrics))
    streams = [trial.stream for trial in prepared]
    return Batch(flights, streams, metrics if on_device else None, prepared[0].shared)


def is_there(metric: Metric) -> bool:
    """Return whether a metric is measured on a device.

    Metrics of a part of the flock, and metrics that allocate memory, are measured on
    processors.
    """
    return not metric.part and not allocates(metric.measure)
