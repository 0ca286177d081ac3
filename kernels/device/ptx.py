"""PTX, the instructions of an NVIDIA GPU as text, to which a kernel is compiled.

Compilation needs neither a GPU nor a driver, so that any machine can run the tests.
Results of a trial are bitwise identical to the results of a processor under three
conditions:

- Each operation follows IEEE 754, rounded to the nearest number. PTX has these
  operations.
- No multiplication is fused with an addition. A fused operation (`fma`) rounds once,
  and a processor rounds twice. An option of the compiler excludes fused operations.
- No called function rounds differently. The sine of NVIDIA's library does round
  differently: the option does not exclude the fused operations of the library.

`Compiled.refusal` reports violations.

A kernel is compiled from the source code for processors. The source code calls some
instructions of a processor, and functions to which numba-cuda gives a different
meaning. HERE lists substitutes, also for `max` and `min`: the library and Python
differ for NaN, and for zeros of different signs.

The folder of compiled kernels stores PTX. numba-cuda asks a driver for the compute
capability; `_answered` gives the answer.
"""

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
    """Return the version of a package; "" if it is not installed as a package."""
    try:
        return version(package)
    except PackageNotFoundError:
        return ""


VERSIONS = {"numba_cuda": version("numba-cuda"), "nvvm": _version("nvidia-nvvm")}
"""Versions of the compilers, on which the results of a trial may depend."""
CAPABILITY = (9, 0)
"""Compute capability of an H100 and an H200."""
OPTIONS = {"opt": 3, "fma": 0, "ftz": 0, "prec-div": 1, "prec-sqrt": 1}
"""Options of the compiler.

The options exclude fused operations, keep subnormal numbers, and round division and
square root to the nearest number.
"""


def _floor(x: Any) -> Any:
    return np.int64(libdevice.floor(x))


def _ceil(x: Any) -> Any:
    return np.int64(libdevice.ceil(x))


def _max(first: Any, *more: Any) -> Any:
    most = first
    for number in more:
        most = number if number > most else most
    return most


def _min(first: Any, *more: Any) -> Any:
    least = first
    for number in more:
        least = number if number < least else least
    return least


def _nextafter(x: Any, y: Any) -> Any:
    return libdevice.nextafter(x, y)


def _lowest(bits: Any) -> Any:
    return np.uint64(cuda.ffs(bits) - 1)


def _fetch(_array: Any, _place: Any) -> None:
    return


def _instructions(_: Any, large: Any, _first: Any, _stride: Any, shape: Any) -> Any:
    return instructions(large, shape, types, arrayobj)


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
        (function, function)
        for function in (
            *(fours.four, fours.parts, fours.plus, fours.minus, fours.times),
            fours.below,
        )
    ),
)
"""Functions that kernels call, each with the function that a GPU calls instead.

On a GPU, as in the interpreter, four numbers side by side are four single numbers.
"""


FUSED = re.compile(r"\bfma\.\S+|\bmad\.\S*b?f\d+\S*")
FUSIBLE = re.compile(r"\b(?:add|sub|mul)\.f\d+\b")
"""Operations without a rounding mode, which an assembler may fuse."""
SIGNED = re.compile(
    r"\bmin\.f64[^;]*\b0d0000000000000000|\bmax\.f64[^;]*\b0d8000000000000000"
)
"""Minimum of a number and 0, and maximum of a number and -0.

A GPU orders 0 above -0, and a processor takes the first argument.
"""
ROUGH = re.compile(r"\b\w+(?:\.\w+)*\.(?:approx|full|ftz)\b")
CALL = re.compile(r"^\s*call(?:\.uni)?\s+(?:\([^)]*\),\s*)?([\w$]+)", re.MULTILINE)
OWN = re.compile(r"^\s*(?:\.weak\s+)?\.func\s+(?:\([^)]*\)\s*)?([\w$]+)", re.MULTILINE)
REMAINDER = re.compile(r"\bfrem\b")
REMAINDERS = "// remainders of floats: "
"""Beginning of the first line of a text, before the number of remainders of floats.

A processor computes the exact remainder of two floats. A GPU would use the truncated
quotient. PTX does not show remainders, so the first line reports the number.
"""
ENTRY = re.compile(r"\.entry\s+([\w$]+)\(")


class NotForDeviceError(DeviceError):
    """Error of a model without PTX or with results that may differ; with the reason."""


class Compiled(NamedTuple):
    """PTX of a kernel."""

    text: str

    @property
    def entry(self) -> str:
        """Name by which a driver finds the function."""
        [name] = ENTRY.findall(self.text)
        return str(name)

    @property
    def refusal(self) -> str:
        """Reason why results may differ from the results of a processor, or ""."""
        own = set(OWN.findall(self.text))
        calls = sorted(set(CALL.findall(self.text)) - own)
        remainders = self.text.partition("\n")[0].removeprefix(REMAINDERS)
        counts = {
            "fused": len(FUSED.findall(self.text)),
            "fusible": len(FUSIBLE.findall(self.text)),
            "approximate": len(ROUGH.findall(self.text)),
            "sign of zero": len(SIGNED.findall(self.text)),
            "remainder": int(remainders),
        }
        words = [
            f"{count} {kind} operations" for kind, count in counts.items() if count
        ]
        return ", ".join([*words, f"calls of {', '.join(calls)}"] if calls else words)


class _Device(NamedTuple):
    """Answers to the questions that numba-cuda asks a driver."""

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
    """Compile for CAPABILITY without a driver, and with HERE, in a context."""
    context = cuda_target.typing_context
    usual = context.resolve_value_type
    substitutes = [
        (function, cuda.jit(device=True)(substitute)) for function, substitute in HERE
    ]
    substitutes.append((view, intrinsic(_instructions)))

    def resolve(value: Any) -> Any:
        for function, substitute in substitutes:
            if value is function:
                return usual(substitute)
        return usual(value)

    with (
        _instead(context, "resolve_value_type", resolve),
        _instead(dispatcher, "get_current_device", _Device),
    ):
        yield


def ptx_of(kernel: Kernel, capability: tuple[int, int] = CAPABILITY) -> Compiled:
    """Return the PTX of a kernel for a GPU of a compute capability.

    The arguments of the function in PTX are the numbers of the kernel, each of 64 bits,
    and the addresses of the arrays. Raises NotForDeviceError if the kernel cannot be
    compiled.
    """
    name = f"{kernel.key(capability, OPTIONS, VERSIONS)}.ptx"
    text = kept(name, lambda: _compiled(kernel, capability).encode("ascii"))
    return Compiled(text.decode("ascii"))


def _compiled(kernel: Kernel, capability: tuple[int, int]) -> str:
    addresses = [types.CPointer(from_dtype(kind)) for kind in kernel.arrays.values()]
    kinds = [from_dtype(np.dtype(kind)) for kind in kernel.numbers.values()]
    entry = kernel.of_thread(cuda)
    try:
        with _answered():
            compiled = compiler.compile_cuda(
                entry,
                types.void,
                (*kinds, *addresses),
                nvvm_options=OPTIONS,
                cc=capability,
            )
            name = compiled.fndesc.llvm_func_name
            compiler.kernel_fixup(compiled.library.get_function(name), False)
            [ptx] = compiled.library.get_asm_strs(cc=capability)
            remainders = len(REMAINDER.findall("".join(compiled.library.llvm_strs)))
    except (NumbaError, NvvmError) as error:
        raise NotForDeviceError(f"model {kernel.model.name}: {error}") from error
    return f"{REMAINDERS}{remainders}\n{ptx}"


for name, method in generator.METHODS.items():
    overload_method(types.BaseNamedTuple, name)(method)
