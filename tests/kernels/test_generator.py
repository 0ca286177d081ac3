"""A Stream has the bits of NumPy's generator, alone and in whole flights."""

from typing import Any

import numpy as np
import pytest
from numpy.random import MT19937, PCG64, Generator, SeedSequence

from kernels import flight
from kernels.generator import Stream, go_on, stream_of
from kernels.jit import jit
from kernels.models import MODELS
from kernels.state import Floats
from sweep.trial.simulation import Simulation
from tests import builders
from tests.interpreter import interpreted

SEEDS: list[Any] = [0, 1, 2**64 - 1, [3, 1, 4, 1, 5], 20260101]
DRAWS = 100_000


@jit
def draw(rng: Any, numbers: Floats) -> None:
    """Numbers as kernels draw them, from a Generator or a Stream."""
    for k in range(numbers.size):
        if k % 3 == 0:
            numbers[k] = rng.random()
        else:
            numbers[k] = rng.uniform(-0.1 * k, 0.7)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_stream_has_the_numbers_of_the_generator(seed: Any) -> None:
    rng = np.random.default_rng(seed)
    stream, ours, theirs = stream_of(rng), np.zeros(DRAWS), np.zeros(DRAWS)
    draw(stream, ours)
    draw(rng, theirs)
    assert ours.tobytes() == theirs.tobytes()
    assert stream.words.tolist() == stream_of(rng).words.tolist()


@pytest.mark.parametrize("seed", SEEDS)
def test_the_generator_goes_on_where_the_stream_is(seed: Any) -> None:
    rng, other = np.random.default_rng(seed), np.random.default_rng(seed)
    rng.random(17), other.random(17)
    stream, numbers = stream_of(rng), np.zeros(1000)
    draw(stream, numbers)
    draw(other, numbers)
    go_on(rng, stream)
    assert rng.bit_generator.state == other.bit_generator.state
    assert rng.normal(size=9).tolist() == other.normal(size=9).tolist()


def test_states_at_the_ends_carry_all_the_way() -> None:
    """Limbs that are full, or empty, in the state and in what is added."""
    ends = [0, 1, 2**32 - 1, 2**64 - 1, 2**96, 2**128 - 1, 2**127]
    for state in ends:
        for added in ends:
            bits: Any = PCG64(0)
            bits.state = bits.state | {"state": {"state": state, "inc": added | 1}}
            rng = Generator(bits)
            stream = stream_of(rng)
            ours = [stream.random() for _ in range(20)]
            assert ours == rng.random(20).tolist()


PLAIN = """
import numpy as np
from kernels.generator import stream_of

for seed in (0, 7):
    rng = np.random.default_rng(seed)
    stream = stream_of(rng)
    for k in range(500):
        assert stream.random() == rng.random()
        assert stream.uniform(-1.5, k) == rng.uniform(-1.5, k)
"""


def test_the_interpreter_has_the_same_numbers() -> None:
    interpreted(PLAIN)


def test_other_bits_are_refused() -> None:
    with pytest.raises(TypeError, match="PCG64, and not those of MT19937"):
        stream_of(Generator(MT19937(SeedSequence(1))))


def flown(model: str, with_stream: bool) -> tuple[bytes, dict[str, Any]]:
    """The flock after all steps of a job, and the state of the generator then."""
    job = next(iter(builders.exact_jobs(model)))
    simulation = Simulation(job)
    with simulation.noise.lent() as rng:
        stream = stream_of(rng)
        drawn: Any = stream if with_stream else rng
        while simulation.steps_left:
            assert flight.advance(simulation.flight, drawn, simulation.steps_left)
            flight.forget_frames(simulation.flight)
        if with_stream:
            go_on(rng, stream)
    flock = simulation.flock
    return b"".join(np.asarray(one).tobytes() for one in flock), dict(
        simulation.noise.state
    )


@pytest.mark.slow
@pytest.mark.parametrize("model", MODELS)
def test_a_flight_with_a_stream_has_the_same_bits(model: str) -> None:
    assert flown(model, True) == flown(model, False)


def test_one_has_in_the_interpreter() -> None:
    """Where no model has to be compiled for streams."""
    interpreted(
        "from tests.kernels import test_generator as t\n"
        "t.test_a_flight_with_a_stream_has_the_same_bits('vicsek1995')"
    )


def test_there_are_no_normal_numbers() -> None:
    assert not hasattr(Stream, "normal")
