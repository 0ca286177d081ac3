"""Devices that fly trials, for tests of who sends them there; workers import them.

Each flies trials as `Trials` does, whose bits those of a real one are, and has troubles
that a real one may have.
"""

import os
import signal
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sweep import trial
from sweep.design.jobs import Job
from sweep.trial.result import Result
from sweep.trial.simulation import run
from sweep.workers.executors import Loky, Serial
from sweep.workers.on_device import OnDevice

ABOUT = {"name": "Test GPU 9", "driver": "13.0", "numba_cuda": "0.30.4", "nvvm": "13.5"}


@dataclass(frozen=True)
class OfProcessors:
    """A device without trouble."""

    def several(self, jobs: Sequence[Job]) -> list[Result]:
        return [run(job) for job in jobs]


@dataclass(frozen=True)
class KillsOnce:
    """It kills its process when it is sent the first trials, but once: `marker` is a
    file that says that it has.
    """

    marker: Path

    def several(self, jobs: Sequence[Job]) -> list[Result]:
        if len(jobs) > 1 and not self.marker.exists():
            self.marker.touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return [run(job) for job in jobs]


@dataclass(frozen=True)
class Breaks:
    """It raises an error for batches with a trial of this number, or kills its process
    where it `kills`.
    """

    replicate: int
    kills: bool = False

    def several(self, jobs: Sequence[Job]) -> list[Result]:
        if any(is_whole(job) and job.replicate == self.replicate for job in jobs):
            if self.kills:
                os.kill(os.getpid(), signal.SIGKILL)
            raise RuntimeError("an illegal address was met")
        return [run(job) for job in jobs]


def is_whole(job: Job) -> bool:
    """Whether it is none that only asks whether the device answers."""
    return bool(job.settings["steps"] != 1)


@dataclass
class Dies:
    """In this process: it flies so many batches, then no more. `batches` has their
    trials.
    """

    after: int
    batches: list[list[Job]] = field(default_factory=list)

    def several(self, jobs: Sequence[Job]) -> list[Result]:
        if len(self.batches) == self.after:
            raise RuntimeError("the driver does not answer")
        if all(map(is_whole, jobs)):
            self.batches.append(list(jobs))
        return [run(job) for job in jobs]


@dataclass
class Interrupted(Dies):
    """In this process: Ctrl-C is pressed while the batch after so many flies."""

    def several(self, jobs: Sequence[Job]) -> list[Result]:
        if all(map(is_whole, jobs)):
            self.batches.append(list(jobs))
            if len(self.batches) == self.after + 1:
                signal.raise_signal(signal.SIGINT)
        return [run(job) for job in jobs]


@dataclass(frozen=True)
class Rounds:
    """One metric of one trial of each batch is off by a bit."""

    def several(self, jobs: Sequence[Job]) -> list[Result]:
        first, *others = (run(job) for job in jobs)
        off = {name: float(np.nextafter(x, 9)) for name, x in first.last.items()}
        return [replace(first, last=off), *others]


def can_fly(_job: Job) -> str:
    return ""


def on_device(device: Any, at_once: int = 4, refusal: Any = can_fly) -> OnDevice:
    """How a device flies trials, a few in a batch."""
    return OnDevice(device, refusal, at_once, ABOUT)


@dataclass(frozen=True)
class InThisProcess(Serial):
    """The engine of a device, without workers."""

    device: Any = OfProcessors()
    at_once: int = 4
    refusal: Any = can_fly

    @property
    def flying(self) -> OnDevice:
        return on_device(self.device, self.at_once, self.refusal)


@dataclass
class InWorkers(Loky):
    """The engine of a device that worker processes share."""

    device: Any = OfProcessors()
    at_once: int = 4

    @property
    def flying(self) -> OnDevice:
        return on_device(self.device, self.at_once)


@contextmanager
def there(
    patch: pytest.MonkeyPatch,
    device: Any = OfProcessors(),
    problem: str = "",
    **names: Any,
) -> Iterator[None]:
    """Within it, `--executor cuda` finds a device here; commands use this process."""
    about = {
        "MOST_ON_DEVICE": 4,
        "DeviceTrials": lambda _device: device,
        "refusal_of": can_fly,
        "problem": lambda: problem,
    }
    with patch.context() as patched:
        for name, value in (about | names).items():
            patched.setitem(vars(trial), name, value)
        patched.setattr("sweep.workers.gpu.this_gpu", lambda: ABOUT)
        patched.setattr("sweep.workers.engines.find_spec", lambda name: name)
        patched.delenv("CUDA_VISIBLE_DEVICES", raising=False)
        yield
