"""Random numbers for kernels, from a few generators per thread.

A kernel is compiled without reference counts (`kernels/jit.py`). So a generator that is
passed to a kernel is never freed, and a new generator per trial would leak 6 kB per
trial. Instead a trial has only a state. For each call, a generator of the thread gets
this state and is lent to the kernel. This leaks 50 bytes per call.
"""

import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from typing import Any, cast

from numpy.random import PCG64, Generator, SeedSequence


class _Own(threading.local):
    def __init__(self) -> None:
        self.generators = [Generator(PCG64(0))]

    def get(self, place: int) -> Generator:
        while len(self.generators) <= place:
            self.generators.append(Generator(PCG64(0)))
        return self.generators[place]


_OWN = _Own()


class Randomness:
    """A stream of random numbers, equal to `np.random.default_rng(seed)`."""

    def __init__(self, seed: SeedSequence) -> None:
        self._state: Mapping[str, Any] = PCG64(seed).state

    @property
    def state(self) -> Mapping[str, Any]:
        """State of the bit generator.

        Setting a value that is not a state raises the error of NumPy: ValueError,
        TypeError or KeyError.
        """
        return self._state

    @state.setter
    def state(self, state: Mapping[str, Any]) -> None:
        bits = PCG64(0)
        bits.state = cast(Any, state)
        self._state = bits.state

    @contextmanager
    def lent(self, place: int = 0) -> Iterator[Generator]:
        """Lend a generator of the thread that continues this stream.

        Use the generator only inside the block, and each `place` for one stream at a
        time.
        """
        generator = _OWN.get(place)
        generator.bit_generator.state = cast(Any, self._state)
        try:
            yield generator
        finally:
            self._state = generator.bit_generator.state


@contextmanager
def lent_to_all(streams: Sequence[Randomness], count: int) -> Iterator[list[Generator]]:
    """Lend generators to several streams, and idle generators up to `count`."""
    with ExitStack() as stack:
        lent = [
            stack.enter_context(stream.lent(place))
            for place, stream in enumerate(streams)
        ]
        yield lent + [_OWN.get(place) for place in range(len(lent), count)]
