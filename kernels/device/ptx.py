"""What a model is compiled to on an NVIDIA GPU: PTX, the text of its instructions.

Neither a GPU nor its driver is needed, so that this is tested anywhere. A flight has
the bits that it has on a processor if three things hold. Each operation is that of IEEE
754, rounded to the nearest number; PTX has them. No multiplication is fused with an
addition (`fma`), which rounds once where a processor rounds twice; an option of the
compiler says so. And no function is called that rounds in its own way, as the sine of
NVIDIA's library does, which has fused operations whatever the option says. So
`Compiled.refusal` looks for what is left of these.

A kernel is compiled from the text that processors have. Where this calls what is an
instruction of a processor, or what numba-cuda gives another meaning, HERE has what
takes its place. `max` and `min` are there because those of the library treat numbers
that are none, and zeros of both signs, in another way than Python.

This module needs numba-cuda, the extra `gpu`, and nothing imports it that flies on
processors. numba-cuda asks a driver for the kind of GPU; `_answered` answers it.
"""

import math
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

import numpy as np
from numba import cuda
from numba.cuda import compiler, dispatcher, libdevice, types
from numba.cuda.core.errors import NumbaError
from numba.cuda.descriptor import cuda_target
from numba.cuda.extending import overload_method
from numba.cuda.typing.typeof import typeof

from kernels import fetching, fours, generator, indices
from kernels.flight import Flight
from kernels.generator import Stream

CAPABILITY = (9, 0)
"""The kind of GPU, as NVIDIA counts them: that of an H100 and an H200."""
OPTIONS = {"opt": 3, "fma": 0, "ftz": 0, "prec-div": 1, "prec-sqrt": 1}
"""Of the compiler: no fused operations, all numbers below the normal ones, and division
and square root rounded to the nearest number.
"""


def _floor(x: Any) -> Any:
    return np.int64(libdevice.floor(x))


def _ceil(x: Any) -> Any:
    return np.int64(libdevice.ceil(x))


def _max(first: Any, *others: Any) -> Any:
    most = first
    for other in others:
        most = other if other > most else most
    return most


def _min(first: Any, *others: Any) -> Any:
    least = first
    for other in others:
        least = other if other < least else least
    return least


def _nextafter(x: Any, y: Any) -> Any:
    return libdevice.nextafter(x, y)


def _lowest(bits: Any) -> Any:
    return np.uint64(cuda.ffs(bits) - 1)


def _fetch(_array: Any, _place: Any) -> None:
    return


HERE: tuple[tuple[Any, Callable[..., Any]], ...] = (
    (math.floor, _floor),
    (math.ceil, _ceil),
    (max, _max),
    (min, _min),
    (np.nextafter, _nextafter),
    (indices.lowest, _lowest),
    (indices.word, indices.collected),
    (fetching.fetch, _fetch),
    *(
        (one, one)
        for one in (
            *(fours.four, fours.parts, fours.plus, fours.minus, fours.times),
            fours.below,
        )
    ),
)
"""What kernels call, and what is called on a GPU instead. Four numbers side by side are
four numbers there, as in the interpreter.
"""


FUSED = re.compile(r"\b(?:fma|mad)\.\w+\.f\d+\b")
ROUGH = re.compile(r"\b\w+(?:\.\w+)*\.(?:approx|full|ftz)\b")
CALL = re.compile(r"^\s*call(?:\.uni)?\s+(?:\([^)]*\),\s*)?([\w$]+)", re.MULTILINE)


class NotForDeviceError(Exception):
    """A model has no PTX; the message says why."""


class Compiled(NamedTuple):
    """The PTX of a model, and what of it may give other bits than a processor: how many
    operations are fused and how many are approximate, and the names of the functions
    that it calls.
    """

    ptx: str
    fused: int
    rough: int
    calls: tuple[str, ...]

    @property
    def refusal(self) -> str:
        """Why a flight would not have the bits that it has on a processor; "" where it
        has them.
        """
        found = {
            f"{self.fused} fused operations": self.fused > 0,
            f"{self.rough} approximate operations": self.rough > 0,
            f"calls of {', '.join(self.calls)}": len(self.calls) > 0,
        }
        return ", ".join(words for words, there in found.items() if there)


class _Device(NamedTuple):
    """What numba-cuda asks a driver for."""

    compute_capability: tuple[int, int] = CAPABILITY


@contextmanager
def _instead(holder: Any, name: str, value: Any) -> Iterator[None]:
    usual = getattr(holder, name)
    setattr(holder, name, value)
    try:
        yield
    finally:
        setattr(holder, name, usual)


@contextmanager
def _answered() -> Iterator[None]:
    """Within it, numba-cuda compiles for CAPABILITY without a driver, and what kernels
    call is what stands in HERE.
    """
    context = cuda_target.typing_context
    usual = context.resolve_value_type
    made = [(one, cuda.jit(device=True)(other)) for one, other in HERE]

    def resolve(value: Any) -> Any:
        return usual(next((other for one, other in made if value is one), value))

    with (
        _instead(context, "resolve_value_type", resolve),
        _instead(dispatcher, "get_current_device", _Device),
    ):
        yield


def compiled_for_device(flight: Flight, stream: Stream) -> Compiled:
    """What `advance` of the model of a flight is compiled to, for arrays like those of
    this flight. Raises NotForDeviceError where it cannot be.
    """
    given = flight.flock, flight.world, flight.params, flight.work, flight.record
    plain = getattr(flight.model.advance, "py_func", flight.model.advance)
    try:
        with _answered():
            made = compiler.compile_cuda(
                plain,
                types.boolean,
                tuple(map(typeof, (*given, stream, 1))),
                nvvm_options=OPTIONS,
                cc=CAPABILITY,
            )
            [ptx] = made.library.get_asm_strs(cc=CAPABILITY)
    except NumbaError as error:
        raise NotForDeviceError(f"model {flight.model.name}: {error}") from error
    calls = tuple(sorted(set(CALL.findall(ptx))))
    return Compiled(ptx, len(FUSED.findall(ptx)), len(ROUGH.findall(ptx)), calls)


for name, method in generator.METHODS.items():
    overload_method(types.BaseNamedTuple, name)(method)
