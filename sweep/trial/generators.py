"""Random numbers for kernels, from one generator a thread.

A kernel is compiled without reference counts (`kernels/jit.py`), so a generator that
was given to it is never freed: a new one for every trial would leave 6 kB a trial in
memory for ever. So a trial has only a state. For a call the generator of the thread
gets this state and is lent to the kernel. This leaves 50 bytes a call.
"""

import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any, cast

from numpy.random import PCG64, Generator, SeedSequence


class _Own(threading.local):
    def __init__(self) -> None:
        self.generator = Generator(PCG64(0))


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
    def lent(self) -> Iterator[Generator]:
        """The thread's generator, set to go on with this stream. Use it only inside,
        and for one stream at a time.
        """
        bits = _OWN.generator.bit_generator
        bits.state = cast(Any, self._state)
        try:
            yield _OWN.generator
        finally:
            self._state = bits.state
