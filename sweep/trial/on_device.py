"""Trials that fly on a device, thousands at once. Each has the bits that it has on a
processor.

Trials fly together if they have the same model, boids, steps, record and world but for
obstacles that are drawn. Whatever else they differ in, each has numbers of its own, as
parameters of the model. What cannot begin, and what a model does
wrong, is flown once more on the processor, which says why. Where the device fails, that
is raised as DeviceError: this process can use it no more, and whoever has sent the
trials sends them to another one. So what a store says of a device has flown there.
"""

import time
from collections import defaultdict
from collections.abc import Hashable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

import numpy as np
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
from kernels.device.host import Host
from kernels.device.kernel import ASTRAY, LOST, Kernel
from kernels.flight import Calls, calls_of, check_calls
from kernels.generator import Stream, go_on, stream_of
from kernels.jit import allocates
from kernels.metrics import Metric
from sweep.design.jobs import Job
from sweep.text import installing
from sweep.trial.result import Result, failed
from sweep.trial.scenery import is_drawn
from sweep.trial.simulation import Simulation, metrics_of, run
from sweep.trial.state import Taken

if TYPE_CHECKING:
    from kernels.device.gpu import Gpu

AT_ONCE = 8192
"""So many trials fly together at most. An H100 has room for some 33,000 of such
threads, and workers take turns on it; what is best, no GPU has said yet.
"""
SHARE, SHARE_HERE = 0.4, 1 / 32
"""Of the memory that is free there, and of that of this machine, which all workers
share: a trial needs about as much here while it is prepared.
"""


@dataclass(frozen=True)
class DeviceTrials:
    """Runs trials on the GPU of this machine; if they are `simulated`, on a device that
    is its processor.
    """

    simulated: bool = False

    def __call__(self, job: Job) -> Result:
        [result] = self.several([job])
        return result

    def several(self, jobs: Sequence[Job]) -> list[Result]:
        """The results of `jobs`, in their order."""
        device = _host() if self.simulated else gpu()
        results = dict[int, Result]()
        for places in _groups(jobs):
            together = [jobs[place] for place in places]
            results |= zip(places, flown(together, device), strict=True)
        return [results[place] for place in range(len(jobs))]


def _host() -> Device:
    return Host()


@cache
def gpu() -> "Gpu":
    """The GPU of this process. Raises DeviceError where there is none, and
    ModuleNotFoundError without the extra `gpu`.
    """
    from kernels.device.gpu import Gpu

    return Gpu()


def problem() -> str:
    """Why trials cannot fly on a GPU here; "" where they can."""
    try:
        gpu()
    except ModuleNotFoundError as error:
        return f"a GPU needs {error.name}, which is not installed: {installing('gpu')}"
    except DeviceError as error:
        return str(error)
    return ""


def refusal_of(job: Job) -> str:
    """Why a trial cannot fly on a GPU; "" where it can."""
    asked = {
        "a time limit: the clock is not looked at there": job.time_limit is not None,
        "last states of trials: they are not kept there": job.record.last_states,
    }
    reasons = [words for words, there in asked.items() if there]
    if not reasons and (found := _refused(job)):
        reasons.append(found)
    return "; ".join(reasons)


def _refused(job: Job) -> str:
    """Why what a trial is compiled to would have other bits there."""
    if find_spec("numba_cuda") is None:
        return ""
    from kernels.device.assembly import assembled
    from kernels.device.ptx import CAPABILITY, ptx_of

    try:
        kernel = kernel_of(job)
    except Exception:  # it cannot begin anywhere: the trial itself says why
        return ""
    try:
        capability = gpu().capability
    except DeviceError:
        capability = CAPABILITY
    try:
        compiled = ptx_of(kernel, capability)
        if not compiled.refusal:
            assembled(compiled.text, capability)
    except DeviceError as error:
        return str(error)
    return compiled.refusal


def kernel_of(job: Job) -> Kernel:
    """The kernel with which a device flies a trial like this one; an error where it
    cannot begin is raised.
    """
    return _batch([_begun(job)]).kernel


def _groups(jobs: Sequence[Job]) -> Iterator[list[int]]:
    """The places of jobs that may fly together."""
    alike = defaultdict[Any, list[int]](list)
    for place, job in enumerate(jobs):
        n, steps = job.settings["n"], job.settings["steps"]
        alike[id(job.known), job.model, job.record, n, steps].append(place)
    yield from alike.values()


@dataclass
class _Prepared:
    """A simulation whose first frame is taken, its random numbers, and what its model
    had called.
    """

    simulation: Simulation
    stream: Stream
    called: Calls

    @property
    def shared(self) -> bool:
        """Whether others have the same scenery: whether nothing of it is random."""
        job, flight = self.simulation.job, self.simulation.flight
        moves = flight.scenery.velocities is not None
        return not (is_drawn(job) or moves or flight.work.robots.rows)

    @property
    def kind(self) -> Hashable:
        """What trials have in common that fly together."""
        flight = self.simulation.flight
        scenery = id(flight.scenery) if self.shared else None
        return form(flight, self.stream), scenery


def flown(jobs: Sequence[Job], device: Device) -> list[Result]:
    """The results of jobs that have the same model, boids, steps and record."""
    results: list[Result] = []
    while len(results) < len(jobs):
        left = jobs[len(results) :]
        some = left[: _fitting(left[0], device)]
        began = time.perf_counter()
        landed = _landed([_prepared(job) for job in some], device)
        seconds = (time.perf_counter() - began) / len(some)
        results += [
            _result(job, one, seconds) for job, one in zip(some, landed, strict=True)
        ]
    return results


Landed = tuple[Simulation, int] | Result | None
"""A simulation after its last step on a device, and the state of its flight; what has
become of a trial that did not fly; None for one that is to be flown alone.
"""


def _result(job: Job, landed: Landed, seconds: float) -> Result:
    if isinstance(landed, Result):
        return landed
    if landed is not None:
        simulation, state = landed
        with suppress(Exception):  # flown alone, the trial says why
            return simulation.summary("diverged" if state == LOST else "done", seconds)
    return _alone(job)


def _alone(job: Job) -> Result:
    """The result of a trial that fails on a processor, too. Raises DeviceError for one
    that does not: then it was the device that did wrong.
    """
    result = run(job)
    if not result.has_failed:
        raise DeviceError(f"trial {job.trial_id} fails there, and not on a processor")
    return result


def _fitting(job: Job, device: Device) -> int:
    """How many trials like this one the memory of a device has room for."""
    prepared = _prepared(job)
    if prepared is None:
        return 1
    there, here = device.free_bytes(), virtual_memory().available
    room = int(min(SHARE * there, SHARE_HERE * here))
    return max(1, min(AT_ONCE, room // _batch([prepared]).bytes))


def _prepared(job: Job) -> _Prepared | None:
    """A job at its start; None where it cannot begin."""
    try:
        return _begun(job)
    except Exception:  # the trial is flown alone, and says why
        return None


def _begun(job: Job) -> _Prepared:
    simulation = Simulation(job, together=True, frames=FRAMES_THERE)
    simulation.taken.append(simulation.take_frames())
    with simulation.noise.lent() as rng:
        stream = stream_of(rng)
    return _Prepared(simulation, stream, calls_of(simulation.flight))


def _landed(prepared: Sequence[_Prepared | None], device: Device) -> list[Landed]:
    """What has flown, in order."""
    landed: list[Landed] = [None] * len(prepared)
    alike = defaultdict[Any, list[int]](list)
    for place, one in enumerate(prepared):
        if one is not None:
            alike[one.kind].append(place)
    for places in alike.values():
        together = [one for place in places if (one := prepared[place])]
        for place, flown in zip(places, _flown(together, device), strict=True):
            landed[place] = flown
    return landed


def _flown(prepared: Sequence[_Prepared], device: Device) -> Sequence[Landed]:
    """What has flown of simulations that are of one form; by halves, where the device
    has too little memory.
    """
    try:
        return _fly(prepared, device)
    except NoRoomError:
        half = len(prepared) // 2
        if not half:
            needed = f"{_batch(prepared).bytes:,} bytes"
            words = f"the GPU has too little memory for one trial, which needs {needed}"
            return [failed(prepared[0].simulation.job, words)]
        return [*_flown(prepared[:half], device), *_flown(prepared[half:], device)]


def _fly(prepared: Sequence[_Prepared], device: Device) -> list[Landed]:
    batch, record = _batch(prepared), prepared[0].simulation.job.record
    lost = set[int]()
    for kept in batch.fly(device, maps=record.heatmaps):
        for place, one in enumerate(prepared):
            try:
                taken = (
                    _taken(kept[place], one.simulation)
                    if kept
                    else one.simulation.take_frames()
                )
            except Exception:  # flown alone, the trial says why
                lost.add(place)
            else:
                one.simulation.taken.append(taken)
    return [
        None if place in lost else _ended(one, int(state))
        for place, (one, state) in enumerate(zip(prepared, batch.states, strict=True))
    ]


def _taken(frames: KeptFrames, simulation: Simulation) -> Taken:
    """Frames that were measured on a device, of which no boid is wanted."""
    count, states = len(frames.steps), len(simulation.flight.work.state)
    bodies, state = np.zeros((count, 4, 0)), np.zeros((count, states, 0))
    return Taken(frames.steps, frames.values, bodies, state)


def _ended(one: _Prepared, state: int) -> Landed:
    """None where the model has not done what it must in each step."""
    simulation = one.simulation
    with simulation.noise.lent() as rng:
        go_on(rng, one.stream)
    try:
        check_calls(simulation.flight, one.called)
    except RuntimeError:
        return None
    return None if state == ASTRAY else (simulation, state)


def _batch(prepared: Sequence[_Prepared]) -> Batch:
    job = prepared[0].simulation.job
    flights = [one.simulation.flight for one in prepared]
    metrics = metrics_of(job, job.record.metrics)
    there = not job.record.trajectories and all(map(is_there, metrics))
    streams = [one.stream for one in prepared]
    return Batch(flights, streams, metrics if there else None, prepared[0].shared)


def is_there(metric: Metric) -> bool:
    """Whether a metric is measured on a device: those of parts of the flock, and those
    that need memory, are measured on processors.
    """
    return not metric.part and not allocates(metric.measure)
