"""Random numbers for kernels, from a few generators a thread.

A kernel is compiled without reference counts (`kernels/jit.py`), so a generator that
was given to it is never freed: a new one for every trial would leave 6 kB a trial in
memory for ever. So a trial has only a state. For a call a generator of the thread
gets this state and is lent to the kernel. This leaves 50 bytes a call.
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
    """One stream of random numbers: those of `np.random.default_rng(seed)`.

    `state` is that of the bit generator; setting one that is none raises what NumPy
    does, a ValueError, TypeError or KeyError.
    """

    def __init__(self, seed: SeedSequence) -> None:
        self._state: Mapping[str, Any] = PCG64(seed).state

    @property
    def state(self) -> Mapping[str, Any]:
        return self._state

    @state.setter
    def state(self, state: Mapping[str, Any]) -> None:
        bits = PCG64(0)
        bits.state = cast(Any, state)
        self._state = bits.state

    @contextmanager
    def lent(self, place: int = 0) -> Iterator[Generator]:
        """A generator of the thread, set to go on with this stream. Use it only inside,
        and each `place` for one stream at a time.
        """
        generator = _OWN.get(place)
        generator.bit_generator.state = cast(Any, self._state)
        try:
            yield generator
        finally:
            self._state = generator.bit_generator.state


@contextmanager
def lent_to_all(streams: Sequence[Randomness], count: int) -> Iterator[list[Generator]]:
    """A generator for each of several streams, and more to make up `count`, of which
    nobody needs the numbers.
    """
    with ExitStack() as stack:
        lent = [
            stack.enter_context(stream.lent(place))
            for place, stream in enumerate(streams)
        ]
        yield lent + [_OWN.get(place) for place in range(len(lent), count)]
