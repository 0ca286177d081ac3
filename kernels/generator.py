"""Random numbers of NumPy's generator for kernels that cannot call NumPy.

A GPU has no `numpy.random.Generator`.

A `Stream` computes the numbers of `Generator(PCG64)` with integers of 32 bits, bitwise
identical. Each step multiplies the state of 128 bits by a factor and adds an increment.
The two halves of the state give a number of 64 bits, rotated by the value of the
highest six bits. So a run may continue with a Stream where a Generator stopped, and
vice versa.

The generator is PCG XSL RR 128/64: M. E. O'Neill (2014), PCG: a family of simple fast
space-efficient statistically good algorithms for random number generation, Harvey Mudd
College, HMC-CS-2014-0905.

A Stream has the methods `random` and `uniform`, but not `normal`. In the tails, NumPy
calls the logarithm of the system, and the last bits of this logarithm may differ
between systems. `normal` of kernels.chance accepts a Stream or a Generator.
"""

from collections.abc import Callable
from typing import Any, NamedTuple, cast

import numpy as np
from numba import types
from numba.extending import overload_method
from numpy.random import PCG64, Generator
from numpy.typing import NDArray

from kernels.jit import jit

Words = NDArray[np.uint64]

LIMBS, LIMB_BITS = 4, 32
LIMB, TOP = np.uint64(LIMB_BITS), np.uint64(58)
LOW = np.uint64(2**LIMB_BITS - 1)
FACTOR = 0x2360ED051FC65DA44385DF649FCCF645
M0, M1, M2, M3 = (
    np.uint64(FACTOR >> LIMB_BITS * k & 2**LIMB_BITS - 1) for k in range(LIMBS)
)
"""Factor of the state, lowest 32 bits first."""
WIDTH, MOST_TURN = np.uint64(64), np.uint64(63)
DROPPED, UNIT = np.uint64(11), 2.0**-53
"""Shift and unit that turn 64 random bits into a number below 1 with 53 bits."""


class Stream(NamedTuple):
    """Random numbers of one trial.

    `words` (8,) has the 128 bits of the state and the 128 bits of the increment, in
    parts of 32 bits, the lowest first.
    """

    words: Words

    def random(self) -> float:
        """Return a number that is uniform in [0, 1)."""
        return random(self.words)

    def uniform(self, low: float, high: float) -> float:
        """Return a number that is uniform in [low, high).

        Parameters
        ----------
        low, high : float
            Ends of the range.
        """
        return uniform(self.words, low, high)


@jit
def bits(words: Words) -> Any:
    """Return the next 64 random bits, and advance the state by one step."""
    a, b, c, d = words[0], words[1], words[2], words[3]
    aa, ab, ba = a * M0, a * M1, b * M0
    ac, bb, ca = a * M2, b * M1, c * M0
    s = (aa & LOW) + words[4]
    words[0] = s & LOW
    s = (s >> LIMB) + (aa >> LIMB) + (ab & LOW) + (ba & LOW) + words[5]
    words[1] = s & LOW
    s = (s >> LIMB) + (ab >> LIMB) + (ba >> LIMB) + words[6]
    s += (ac & LOW) + (bb & LOW) + (ca & LOW)
    words[2] = s & LOW
    s = (s >> LIMB) + (ac >> LIMB) + (bb >> LIMB) + (ca >> LIMB) + words[7]
    s += (a * M3 & LOW) + (b * M2 & LOW) + (c * M1 & LOW) + (d * M0 & LOW)
    words[3] = s & LOW
    high = words[3] << LIMB | words[2]
    mixed, turn = high ^ (words[1] << LIMB | words[0]), high >> TOP
    return mixed >> turn | mixed << ((WIDTH - turn) & MOST_TURN)


@jit
def random(words: Words) -> float:
    """Return a number that is uniform in [0, 1), as `Generator.random` does."""
    return float(bits(words) >> DROPPED) * UNIT


@jit
def uniform(words: Words, low: float, high: float) -> float:
    """Return a number that is uniform in [low, high), as `Generator.uniform` does.

    Parameters
    ----------
    words : array of uint64, shape (8,)
        State of a Stream, changed in place.
    low, high : float
        Ends of the range.

    Returns
    -------
    float
    """
    return low + (high - low) * random(words)


def stream_of(rng: Generator) -> Stream:
    """Return a stream that continues from the state of `rng`; `rng` does not change.

    Raises TypeError if the generator of `rng` is not PCG64.
    """
    state = _state(rng)["state"]
    numbers = state["state"] | state["inc"] << 128
    words = [numbers >> LIMB_BITS * k & int(LOW) for k in range(2 * LIMBS)]
    return Stream(np.array(words, np.uint64))


def go_on(rng: Generator, stream: Stream) -> None:
    """Set `rng`, the origin of `stream`, to the state of the stream."""
    state = _state(rng)
    limbs = stream.words[:LIMBS].tolist()
    state["state"]["state"] = sum(limb << LIMB_BITS * k for k, limb in enumerate(limbs))
    rng.bit_generator.state = state


def _state(rng: Generator) -> dict[str, Any]:
    if not isinstance(rng.bit_generator, PCG64):
        name = type(rng.bit_generator).__name__
        raise TypeError(f"a Stream has the bits of PCG64, and not those of {name}")
    return cast("dict[str, Any]", rng.bit_generator.state)


def _random(stream: Any) -> Any:
    return random(stream.words)


def _uniform(stream: Any, low: Any, high: Any) -> Any:
    return uniform(stream.words, low, high)


def _for_random(stream: Any) -> Any:
    return _random if stream.instance_class is Stream else None


def _for_uniform(stream: Any, low: Any, high: Any) -> Any:  # noqa: ARG001
    return _uniform if stream.instance_class is Stream else None


METHODS: dict[str, Callable[..., Any]] = {
    "random": _for_random,
    "uniform": _for_uniform,
}
"""Functions that numba asks for the methods of a named tuple.

The functions return the compiled method of a Stream, and None for any further tuple.
"""
# Statements of the module belong to the stamps, as in kernels.indices.
for name, compiled in METHODS.items():
    overload_method(types.BaseNamedTuple, name)(compiled)
