"""Trials side by side in numba-cuda's simulator of a GPU, as they fly alone.

One thread flies one trial, and arrays are laid out as `[element, trial]`, but for those
whose sizes differ between trials, such as places near obstacles. The simulator runs the
text of kernels in the interpreter. So this shows that a launch with this layout has the
bits of single flights, and not what instructions of a GPU give.
"""

import pytest

from kernels.models import MODELS
from tests.commands import python

BEGIN = """
import hashlib
from dataclasses import replace

import numpy as np
from kernels import flight
from kernels.generator import stream_of
from sweep.trial.simulation import Simulation
from tests import builders

def begun(model):
    job = next(iter(builders.exact_jobs(model)))
    return [Simulation(replace(job, seed=job.seed + k)) for k in range(3)]

def arrays(tree):
    if isinstance(tree, np.ndarray):
        return [tree]
    if isinstance(tree, tuple):
        return [array for part in tree for array in arrays(part)]
    return []

def say(flock, record):
    digest = hashlib.sha256()
    for array in arrays((flock, record)):
        digest.update(np.ascontiguousarray(array).tobytes())
    print(digest.hexdigest())
"""
ALONE = """
for simulation in begun(MODEL):
    with simulation.noise.lent() as rng:
        assert flight.advance(simulation.flight, rng, simulation.steps_left)
    assert simulation.steps_left == 0
    say(simulation.flight.flock, simulation.flight.record)
"""
TOGETHER = """
import numba
from numba import cuda

assert numba.config.DISABLE_JIT and cuda.config.ENABLE_CUDASIM

def made(tree, parts):
    return type(tree)(*parts) if hasattr(tree, "_fields") else type(tree)(parts)

def laid_out(trees):
    first = trees[0]
    if isinstance(first, np.ndarray) and len({tree.shape for tree in trees}) == 1:
        return np.stack(trees, axis=-1)
    if isinstance(first, tuple):
        return made(first, [laid_out(parts) for parts in zip(*trees, strict=True)])
    return list(trees)

def of_trial(tree, trial):
    if isinstance(tree, np.ndarray):
        return tree[..., trial]
    if isinstance(tree, tuple):
        return made(tree, [of_trial(part, trial) for part in tree])
    return tree[trial]

def fly(trees, steps, done):
    trial = cuda.grid(1)
    if trial < done.size:
        done[trial] = advance(*of_trial(trees, trial), steps)

together, streams = begun(MODEL), []
for simulation in together:
    with simulation.noise.lent() as rng:
        streams.append(stream_of(rng))
flights, advance = [one.flight for one in together], together[0].flight.model.advance
trees = laid_out([
    (one.flock, one.world, one.params, one.work, one.record, stream)
    for one, stream in zip(flights, streams, strict=True)
])
done = np.zeros(len(flights), np.bool_)
cuda.jit(fly)[2, 2](trees, together[0].steps_left, done)
assert done.all()
for trial in range(len(flights)):
    flock, _, _, _, record, _ = of_trial(trees, trial)
    say(flock, record)
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
