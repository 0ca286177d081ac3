"""What kernels import and call, and what models are made of."""

import ast
from collections.abc import Iterator

from tests.house.imports import within
from tests.house.sources import Checkout, Finding, Module

KERNELS_MAY_IMPORT = {
    "kernels",
    "numpy",
    "numba",
    "math",
    "random",
    "hashlib",
    "os",
    "pathlib",
    "typing",
    "collections",
    "dataclasses",
    "functools",
}
STAMPS_MAY_IMPORT = {"ast", "contextlib", "importlib", "json", "sys", "types"}
"""What reads code, to say what computes a trial."""
REGISTRY_MAY_IMPORT = {"importlib", "site", "sys"}
"""What asks installed packages."""
LANES_MAY_IMPORT = {
    *("ast", "builtins", "inspect", "itertools", "linecache", "operator", "textwrap"),
    "llvmlite",
}
"""What makes functions of functions, and types for numba."""
MADE = {"lanes": LANES_MAY_IMPORT}
"""What packages import whose kernels are made of others."""


MAY_IMPORT_TOO = {
    "kernels/stamps.py": STAMPS_MAY_IMPORT,
    "kernels/identity.py": STAMPS_MAY_IMPORT,
    "kernels/caching.py": {
        *("contextlib", "glob", "sys", "time", "types", "warnings", "weakref")
    },
    "kernels/registry.py": REGISTRY_MAY_IMPORT,
    "kernels/device/assembly.py": {"cuda", "re"},
    "kernels/device/batch.py": {"contextlib"},
    "kernels/device/gpu.py": {"ctypes", "cuda"},
    "kernels/device/kernel.py": {"textwrap"},
    "kernels/device/ptx.py": {"contextlib", "importlib", "re"},
    "kernels/device/views.py": {"llvmlite"},
    "kernels/device/wasm.py": {
        *("importlib", "llvmlite", "subprocess", "sys", "tempfile", "wasmtime"),
    },
    "kernels/device/wasmtime_host.py": {"wasmtime"},
    "kernels/fetching.py": {"llvmlite"},
    "kernels/fours.py": {"llvmlite"},
    "kernels/indices.py": {"llvmlite"},
    "kernels/robots/abilities.py": {"ast", "inspect"},
    "kernels/robots/readers.py": {"ast"},
}
"""What single modules import besides."""
COMPILERS = {
    f"kernels/{name}.py"
    for name in (
        *("__init__", "caching", "fetching", "fours", "generator", "indices", "jit"),
        *("device/ptx", "device/views", "device/wasm"),
    )
}
"""One module says how kernels are compiled. Others say where the compiled code is kept,
and what is compiled to instructions of the processor that Python has no words for, or
of a GPU, or of WebAssembly. Lanes have their own types.
"""

EXACT = {
    *("ceil", "copysign", "degrees", "factorial", "floor", "frexp", "isfinite"),
    *("isinf", "isqrt", "ldexp", "prod", "radians", "sqrt"),
}
"""What a mathematics library rounds as IEEE 754 says, or not at all."""
ROUNDED_ANYHOW = {
    *("arctan2", "cos", "einsum", "exp", "expm1", "hypot", "leggauss", "linalg"),
    *("log", "log1p", "log2", "normal", "power", "sin", "standard_normal"),
}
"""Methods and functions of NumPy whose last bits depend on the processor, or on the
mathematics library.
"""


def kernels_know_nothing_above_them(checkout: Checkout) -> Iterator[Finding]:
    for module in checkout.part("kernels"):
        made = MADE.get(module.name.split("/")[1], set())
        allowed = KERNELS_MAY_IMPORT | MAY_IMPORT_TOO.get(module.name, made)
        for line, imported in module.imports:
            if not within(imported, allowed):
                yield module.finding(line, f"a kernel may not import {imported}")


def kernels_have_no_input_or_output(checkout: Checkout) -> Iterator[Finding]:
    for module in checkout.part("kernels"):
        for node in module.nodes:
            match node:
                case ast.Call(ast.Name("print" | "open" | "input" as called)):
                    yield module.finding(node, f"a kernel may not call {called}")


def one_module_says_how_kernels_are_compiled(checkout: Checkout) -> Iterator[Finding]:
    for module in checkout.part("kernels"):
        if module.name in COMPILERS or "/lanes/" in module.name:
            continue
        for line, imported in module.imports:
            if within(imported, {"numba"}):
                yield module.finding(line, f"{imported} is for kernels/jit.py")


def _inexact(module: Module) -> Iterator[tuple[ast.AST, str]]:
    """What a module has that libraries round as they like."""
    for node in module.nodes:
        match node:
            case ast.Call(ast.Attribute(ast.Name("math"), called)):
                if called not in EXACT:
                    yield node, f"math.{called}"
            case ast.Attribute(attr=attribute) if attribute in ROUNDED_ANYHOW:
                yield node, f".{attribute}"
            case ast.FunctionDef():
                for one in ast.walk(node):
                    inexact = ast.Pow | ast.MatMult
                    if isinstance(one, ast.BinOp) and isinstance(one.op, inexact):
                        yield one, "a power or a product of matrices"


def kernels_call_nothing_that_a_library_rounds_as_it_likes(
    checkout: Checkout,
) -> Iterator[Finding]:
    """They call those of kernels.elementary and kernels.chance, which have the same
    bits everywhere. Only constants of modules are powers.
    """
    examples = [checkout.module(name) for name in checkout.files("examples/**/*.py")]
    for module in [*checkout.part("kernels"), *examples]:
        for node, what in _inexact(module):
            yield module.finding(node, f"{what} has other bits elsewhere")


def a_model_has_params_sight_and_advance_and_no_more(
    checkout: Checkout,
) -> Iterator[Finding]:
    for module in checkout.part("kernels/models"):
        if "__init__" in module.name:
            continue
        names = sorted(node.name for node in module.public)
        if names != ["Params", "advance", "sight"]:
            what = f"a model has Params, advance and sight, not {', '.join(names)}"
            yield module.finding(1, what)


RULES = (
    kernels_know_nothing_above_them,
    kernels_have_no_input_or_output,
    one_module_says_how_kernels_are_compiled,
    kernels_call_nothing_that_a_library_rounds_as_it_likes,
    a_model_has_params_sight_and_advance_and_no_more,
)
