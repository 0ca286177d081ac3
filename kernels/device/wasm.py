"""WebAssembly, to which a kernel is compiled: for browsers, and for any processor.

Results of a trial are bitwise identical to the results of a processor under three
conditions:

- Each operation follows IEEE 754, rounded to the nearest number. WebAssembly has no
  other operations.
- No multiplication is fused with an addition. Only the instructions of "relaxed SIMD"
  are fused, and FEATURES excludes them.
- The module calls no function of its surroundings, which may round differently. A
  module that imports anything but memory is rejected.

numba translates a kernel to the text of LLVM, as for a processor. LLVM compiles this
text for WebAssembly, and the linker of LLVM makes a module of it. The extra `wasm`
installs the linker. The folder of compiled kernels stores modules.
"""

import subprocess
import sys
from functools import cache
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import llvmlite.binding as llvm
import numba
import numpy as np
import wasmtime
from numba import types
from numba.core.errors import NumbaError
from numba.extending import intrinsic
from numba.np import arrayobj
from numba.np.numpy_support import from_dtype

from kernels.caching import kept
from kernels.device.batch import DeviceError
from kernels.device.kernel import Kernel
from kernels.device.views import instructions

TRIPLE = "wasm32-unknown-unknown"
FEATURES = "+simd128,+bulk-memory,+sign-ext,+mutable-globals,+nontrapping-fptoint"
"""Instructions that all browsers have since 2023, without those of relaxed SIMD."""
LINKING = (
    "--no-entry",
    "--export=fly",
    "--export=__heap_base",
    "--import-memory",
    "--allow-undefined",  # an import, which is rejected with its name
    "--gc-sections",
    "--strip-all",
    "-zstack-size=1048576",
)
PLAIN: dict[str, Any] = {
    "_nrt": False,
    "no_cpython_wrapper": True,
    "no_cfunc_wrapper": True,
}
"""Options of numba: no reference counts, and no function for Python or C."""
POINTER: Any = types.CPointer
LARGE = "0x7FE0000000000000"
"""2 to the power of 1023, the largest power of two, in the text of LLVM."""
SMALL = "0x0360000000000000"
"""2 to the power of -969, whose product with a number has all 53 bits."""
SCALE = "0x43F0000000000000"
"""2 to the power of 64."""
VERSIONS = {"llvmlite": version("llvmlite"), "ziglang": version("ziglang")}
"""Versions of compiler and linker."""
LIBRARY = f"""
target triple = "{TRIPLE}"

declare i32 @llvm.smin.i32(i32, i32)
declare i32 @llvm.smax.i32(i32, i32)

define double @numba_nextafter(double %x, double %y) {{
  %unordered = fcmp uno double %x, %y
  %sum = fadd double %x, %y
  %equal = fcmp oeq double %x, %y
  %zero = fcmp oeq double %x, 0.0
  %bits_of_y = bitcast double %y to i64
  %sign = and i64 %bits_of_y, {-(2**63)}
  %least = or i64 %sign, 1
  %bits = bitcast double %x to i64
  %up = fcmp olt double %x, %y
  %positive = fcmp ogt double %x, 0.0
  %grows = icmp eq i1 %up, %positive
  %step = select i1 %grows, i64 1, i64 -1
  %moved = add i64 %bits, %step
  %next_bits = select i1 %zero, i64 %least, i64 %moved
  %next = bitcast i64 %next_bits to double
  %ordered = select i1 %equal, double %y, double %next
  %result = select i1 %unordered, double %sum, double %ordered
  ret double %result
}}

; Two factors at most come before the last: none of their products is rounded twice.
define double @numba_ldexp(double %x, i32 %n) {{
  %large = icmp sgt i32 %n, 1023
  %x_up = fmul double %x, {LARGE}
  %n_up = sub i32 %n, 1023
  %larger = icmp sgt i32 %n_up, 1023
  %x_up_more = fmul double %x_up, {LARGE}
  %n_less = sub i32 %n_up, 1023
  %n_up_more = call i32 @llvm.smin.i32(i32 %n_less, i32 1023)
  %x_raised = select i1 %larger, double %x_up_more, double %x_up
  %n_raised = select i1 %larger, i32 %n_up_more, i32 %n_up
  %small = icmp slt i32 %n, -1022
  %x_down = fmul double %x, {SMALL}
  %n_down = add i32 %n, 969
  %smaller = icmp slt i32 %n_down, -1022
  %x_down_more = fmul double %x_down, {SMALL}
  %n_more = add i32 %n_down, 969
  %n_down_more = call i32 @llvm.smax.i32(i32 %n_more, i32 -1022)
  %x_lowered = select i1 %smaller, double %x_down_more, double %x_down
  %n_lowered = select i1 %smaller, i32 %n_down_more, i32 %n_down
  %x_not_large = select i1 %small, double %x_lowered, double %x
  %n_not_large = select i1 %small, i32 %n_lowered, i32 %n
  %x_last = select i1 %large, double %x_raised, double %x_not_large
  %n_last = select i1 %large, i32 %n_raised, i32 %n_not_large
  %biased = add i32 %n_last, 1023
  %wide = zext i32 %biased to i64
  %bits = shl i64 %wide, 52
  %factor = bitcast i64 %bits to double
  %result = fmul double %x_last, %factor
  ret double %result
}}

define double @numba_frexp(double %x, ptr %exponent) {{
  %bits = bitcast double %x to i64
  %without_fraction = lshr i64 %bits, 52
  %biased = and i64 %without_fraction, 2047
  %subnormal = icmp eq i64 %biased, 0
  %scaled = fmul double %x, {SCALE}
  %normal = select i1 %subnormal, double %scaled, double %x
  %normal_bits = bitcast double %normal to i64
  %normal_without_fraction = lshr i64 %normal_bits, 52
  %normal_biased = and i64 %normal_without_fraction, 2047
  %narrow = trunc i64 %normal_biased to i32
  %offset = select i1 %subnormal, i32 {-1022 - 64}, i32 -1022
  %power = add i32 %narrow, %offset
  %without_power = and i64 %normal_bits, {-(2**63) + 2**52 - 1}
  %half_bits = or i64 %without_power, {1022 << 52}
  %half = bitcast i64 %half_bits to double
  %zero = fcmp oeq double %x, 0.0
  %special = icmp eq i64 %biased, 2047
  %unchanged = or i1 %zero, %special
  %last_power = select i1 %unchanged, i32 0, i32 %power
  store i32 %last_power, ptr %exponent
  %result = select i1 %unchanged, double %x, double %half
  ret double %result
}}
"""
"""Functions of the library of C that numba calls, in arithmetic that is exact.

They are the next number (`np.nextafter`), and the product with a power of two and the
parts of a number (`math.ldexp` and `math.frexp`).
"""


class Module(NamedTuple):
    """A WebAssembly module of a kernel, with the function `fly`."""

    code: bytes

    @property
    def refusal(self) -> str:
        """Reason why results may differ from the results of a processor, or ""."""
        calls = _calls(self.code)
        return f"calls of {', '.join(calls)}" if calls else ""

    @property
    def pages(self) -> int:
        """Least memory of the module, in pages of 64 KiB."""
        memory: Any = _imports(self.code)["memory"]
        return int(memory.limits.min)


@cache
def _calls(code: bytes) -> list[str]:
    """Return the imports of a module, except the memory."""
    return sorted(_imports(code).keys() - {"memory"})


@cache
def _imports(code: bytes) -> dict[str, Any]:
    """Return the types of the imports of a module, by name."""
    imports = wasmtime.Module(wasmtime.Engine(), code).imports
    return {str(entry.name): entry.type for entry in imports}


class NoModuleError(DeviceError):
    """Error of a model that cannot be compiled to WebAssembly; with the reason."""


def module_of(kernel: Kernel) -> Module:
    """Return the module of a kernel.

    The arguments of `fly` are two addresses for numba, which writes there; the index of
    the trial; the numbers of the kernel, each of 64 bits; and the addresses of the
    arrays. Raises NoModuleError if the kernel cannot be compiled.
    """
    key = kernel.key(TRIPLE, FEATURES, LINKING, VERSIONS)
    return Module(kept(f"{key}.wasm", lambda: _linked(_compiled(kernel))))


@intrinsic
def _view(_: Any, large: Any, _first: Any, _stride: Any, shape: Any) -> Any:
    return instructions(large, shape, types, arrayobj)


def _compiled(kernel: Kernel) -> bytes:
    """Return the object file of a kernel."""
    fly = kernel.of_trial_with(view=_view)
    arguments = [
        types.int64,
        *(from_dtype(np.dtype(kind)) for kind in kernel.numbers.values()),
        *(POINTER(from_dtype(kind)) for kind in kernel.arrays.values()),
    ]
    dispatcher: Any = numba.njit(error_model="numpy", **PLAIN)(fly)
    try:
        dispatcher.compile(types.void(*arguments))
    except NumbaError as error:
        raise NoModuleError(f"model {kernel.model.name}: {error}") from error
    [overload] = dispatcher.overloads.values()
    return _for_wasm(overload.library.get_llvm_str(), overload.fndesc.llvm_func_name)


def _for_wasm(text: str, name: str) -> bytes:
    """Return the object file of a text of LLVM, whose function `name` becomes `fly`."""
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    machine = llvm.Target.from_triple(TRIPLE).create_target_machine(
        features=FEATURES, opt=3, reloc="static"
    )
    module = llvm.parse_assembly(text)
    module.triple = TRIPLE
    module.data_layout = str(machine.target_data)
    helper = llvm.parse_assembly(LIBRARY)
    helper.data_layout = module.data_layout
    module.link_in(helper)
    module.get_function(name).name = "fly"
    for part in (*module.functions, *module.global_variables):
        if not part.is_declaration and part.name != "fly":
            part.linkage = llvm.Linkage.internal
    tuning = llvm.create_pipeline_tuning_options(speed_level=3)
    passes = llvm.create_pass_builder(machine, tuning)
    passes.getModulePassManager().run(module, passes)
    code: bytes = machine.emit_object(module)
    return code


def _linked(code: bytes) -> bytes:
    """Return the module of an object file."""
    with TemporaryDirectory(prefix="boidsweep-") as folder:
        before = Path(folder, "fly.o")
        after = Path(folder, "fly.wasm")
        before.write_bytes(code)
        command = [sys.executable, "-m", "ziglang", "wasm-ld", *LINKING]
        done = subprocess.run(
            [*command, "-o", after, before],
            capture_output=True,
            encoding="utf-8",
            check=False,
        )
        if done.returncode:
            raise NoModuleError(f"the linker failed: {done.stderr.strip()}")
        return after.read_bytes()
