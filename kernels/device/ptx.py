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

What is compiled is kept in the folder of compiled kernels. numba-cuda asks a driver
for the kind of GPU; `_answered` answers it.
"""

import hashlib
import math
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.metadata import PackageNotFoundError, version
from typing import Any, NamedTuple

import numpy as np
from numba import cuda
from numba.core.errors import NumbaError
from numba.cuda import compiler, dispatcher, libdevice, types
from numba.cuda.cudadrv.error import NvvmError
from numba.cuda.descriptor import cuda_target
from numba.cuda.extending import intrinsic, overload_method
from numba.cuda.np import arrayobj
from numba.cuda.np.numpy_support import from_dtype

from kernels import fetching, fours, generator, indices
from kernels.caching import kept
from kernels.device.batch import DeviceError
from kernels.device.kernel import Kernel
from kernels.device.views import instructions, view


def _version(package: str) -> str:
    """That of a package; "" where it was not installed as one."""
    try:
        return version(package)
    except PackageNotFoundError:
        return ""


VERSIONS = {"numba_cuda": version("numba-cuda"), "nvvm": _version("nvidia-nvvm")}
"""Of what compiles: what the bits of a flight may depend on."""
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


def _instructions(_: Any, whole: Any, _first: Any, _stride: Any, shape: Any) -> Any:
    return instructions(whole, shape, types, arrayobj)


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


FUSED = re.compile(r"\bfma\.\S+|\bmad\.\S*b?f\d+\S*")
FUSIBLE = re.compile(r"\b(?:add|sub|mul)\.f\d+\b")
"""Operations that do not say how they round: an assembler may fuse them."""
SIGNED = re.compile(
    r"\bmin\.f64[^;]*\b0d0000000000000000|\bmax\.f64[^;]*\b0d8000000000000000"
)
"""The smaller of a number and 0, the larger of one and -0: a GPU has 0 above -0, where
a processor takes the first of the two.
"""
ROUGH = re.compile(r"\b\w+(?:\.\w+)*\.(?:approx|full|ftz)\b")
CALL = re.compile(r"^\s*call(?:\.uni)?\s+(?:\([^)]*\),\s*)?([\w$]+)", re.MULTILINE)
OWN = re.compile(r"^\s*(?:\.weak\s+)?\.func\s+(?:\([^)]*\)\s*)?([\w$]+)", re.MULTILINE)
REMAINDER, REMAINDERS = re.compile(r"\bfrem\b"), "// remainders of floats: "
"""A processor has the exact remainder of two floats; a GPU would take the quotient,
truncated. The text of its instructions does not show it, so its first line says so.
"""
ENTRY = re.compile(r"\.entry\s+([\w$]+)\(")


class NotForDeviceError(DeviceError):
    """A model has no PTX, or one that may give other bits; the message says why."""


class Compiled(NamedTuple):
    """The `text` of what a kernel is compiled to."""

    text: str

    @property
    def entry(self) -> str:
        """The name by which it is called."""
        [name] = ENTRY.findall(self.text)
        return str(name)

    @property
    def refusal(self) -> str:
        """Why a flight would not have the bits that it has on a processor; "" where it
        has them.
        """
        own = set(OWN.findall(self.text))
        calls = sorted(set(CALL.findall(self.text)) - own)
        remainders = self.text.partition("\n")[0].removeprefix(REMAINDERS)
        found = {
            "fused": len(FUSED.findall(self.text)),
            "fusible": len(FUSIBLE.findall(self.text)),
            "approximate": len(ROUGH.findall(self.text)),
            "sign of zero": len(SIGNED.findall(self.text)),
            "remainder": int(remainders),
        }
        words = [f"{count} {kind} operations" for kind, count in found.items() if count]
        return ", ".join([*words, f"calls of {', '.join(calls)}"] if calls else words)


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
    made.append((view, intrinsic(_instructions)))

    def resolve(value: Any) -> Any:
        return usual(next((other for one, other in made if value is one), value))

    with (
        _instead(context, "resolve_value_type", resolve),
        _instead(dispatcher, "get_current_device", _Device),
    ):
        yield


def ptx_of(kernel: Kernel, capability: tuple[int, int] = CAPABILITY) -> Compiled:
    """What a kernel is compiled to for a GPU of this kind: a function of its numbers,
    each of 64 bits, and of the addresses of its arrays. Raises NotForDeviceError where
    it cannot be.
    """
    name = f"{_key(kernel, capability)}.ptx"
    text = kept(name, lambda: _compiled(kernel, capability).encode("ascii"))
    return Compiled(text.decode("ascii"))


def _key(kernel: Kernel, capability: tuple[int, int]) -> str:
    """What decides whether a kernel must be compiled again."""
    parts = kernel.stamp, kernel.text, kernel.maps, capability, OPTIONS, VERSIONS
    names = [f"{one.__module__}.{one.__qualname__}" for one in kernel.classes]
    return hashlib.sha256(repr((parts, names)).encode()).hexdigest()[:48]


def _compiled(kernel: Kernel, capability: tuple[int, int]) -> str:
    addresses = [types.CPointer(from_dtype(kind)) for kind in kernel.arrays.values()]
    kinds = [from_dtype(np.dtype(one)) for one in kernel.numbers.values()]
    entry = kernel.of_thread(cuda)
    try:
        with _answered():
            made = compiler.compile_cuda(
                entry,
                types.void,
                (*kinds, *addresses),
                nvvm_options=OPTIONS,
                cc=capability,
            )
            name = made.fndesc.llvm_func_name
            compiler.kernel_fixup(made.library.get_function(name), False)
            [ptx] = made.library.get_asm_strs(cc=capability)
            remainders = len(REMAINDER.findall("".join(made.library.llvm_strs)))
    except (NumbaError, NvvmError) as error:
        raise NotForDeviceError(f"model {kernel.model.name}: {error}") from error
    return f"{REMAINDERS}{remainders}\n{ptx}"


for name, method in generator.METHODS.items():
    overload_method(types.BaseNamedTuple, name)(method)
