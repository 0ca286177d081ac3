"""Trials side by side in numba-cuda's simulator of a GPU, as they fly alone.

One thread flies one trial, from the large arrays of a launch. The simulator runs the
text of kernels in the interpreter. So this shows that layout and launch have the
bits of single flights, and not what instructions of a GPU give.
"""

import pytest

from kernels.models import MODELS
from tests.commands import python

pytest.importorskip("numba_cuda", reason="the extra `gpu` is not installed")

BEGIN = """
from dataclasses import replace

from tests import builders

def begun(model):
    job = next(iter(builders.exact_jobs(model)))
    return [replace(job, seed=job.seed + k) for k in range(3)]

def say(result):
    print(builders.fingerprint(result))
"""
ALONE = """
from sweep.trial.simulation import run

for job in begun(MODEL):
    say(run(job))
"""
TOGETHER = """
import numba
from numba import cuda
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
    say(result)
assert Simulator.launches >= 3
"""


@pytest.mark.parametrize(
    "model",
    [
        pytest.param(model, marks=() if model == "vicsek1995" else pytest.mark.slow)
        for model in MODELS
    ],
)
def test_trials_side_by_side_have_the_bits_of_trials_alone(model: str) -> None:
    """Two blocks of two threads, of which one has no trial."""
    alone = python(BEGIN + ALONE.replace("MODEL", repr(model)), NUMBA_DISABLE_JIT="0")
    together = python(
        BEGIN + TOGETHER.replace("MODEL", repr(model)),
        NUMBA_DISABLE_JIT="1",
        NUMBA_ENABLE_CUDASIM="1",
    )
    assert len(set(alone.split())) == 3
    assert together == alone
