"""Trials side by side in numba-cuda's simulator of a GPU, as they fly alone.

One thread flies one trial, from the large arrays of a launch. The simulator runs the
text of kernels in the interpreter. So this shows that layout and launch have the
bits of single flights, and not what instructions of a GPU give.
"""

from dataclasses import replace

import pytest

from kernels.models import MODELS
from sweep.design.jobs import Job
from sweep.trial.simulation import run
from tests import builders
from tests.cases import slow_but
from tests.commands import python

pytest.importorskip("numba_cuda", reason="the extra `gpu` is not installed")

TOGETHER = """
import numba
from numba import cuda
from tests import builders
from tests.kernels.test_simulator import begun
from kernels.device.host import Host
from sweep.trial.on_device import flown

assert numba.config.DISABLE_JIT and cuda.config.ENABLE_CUDASIM

class Simulator(Host):
    launches = 0

    def load(self, kernel):
        return cuda.jit(kernel.of_thread(cuda))

    def call(self, program, numbers, rooms, count):
        Simulator.launches += 1
        program[2, 2](*numbers, *rooms)

for result in flown(begun(MODEL), Simulator()):
    print(builders.fingerprint(result))
assert Simulator.launches >= 3
"""


def begun(model: str) -> list[Job]:
    """Three jobs of a model that differ in their seeds."""
    job = next(iter(builders.exact_jobs(model)))
    return [replace(job, seed=job.seed + k) for k in range(3)]


@pytest.mark.parametrize("model", slow_but(["vicsek1995"], MODELS))
def test_trials_side_by_side_have_the_bits_of_trials_alone(model: str) -> None:
    """Two blocks of two threads, of which one has no trial."""
    alone = [builders.fingerprint(run(job)) for job in begun(model)]
    together = python(
        TOGETHER.replace("MODEL", repr(model)),
        NUMBA_DISABLE_JIT="1",
        NUMBA_ENABLE_CUDASIM="1",
    )
    assert len(set(alone)) == 3
    assert together.split() == alone
