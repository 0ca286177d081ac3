"""Decorators that compile kernels.

Few further modules call numba. The modules `kernels.indices`, `kernels.fetching`,
`kernels.fours` and `kernels.generator` define the compiled code of their functions. The
package `kernels.lanes` defines types and the functions that vectorised kernels call.
The package `kernels.device` compiles kernels for a GPU.

Kernels are compiled at their first call (no signatures), cached on disk (see
kernels.caching), and keep IEEE arithmetic, since `fastmath` gives different results on
different processors. With NUMBA_DISABLE_JIT=1 the decorated functions stay plain
Python, the reference of the tests.

A kernel works on arrays and numbers alone and releases the lock of Python (`nogil`). So
threads such as the thread of a web server run at the same time.

numba counts references to every array that a function touches, with atomic
instructions, and a boid-step touches dozens of arrays. A kernel without allocations
does not need reference counts. Without reference counts, aziel_chen2025 went from 930
to 340 ns per boid-step. After further changes, inlining all calls reduced the time from
290 to 160 ns.

With each function numba compiles a wrapper for callers in Python, which extracts all
fields of all arguments from objects, and a wrapper for callers in C. Only kernels call
most kernels, and the wrappers took half of the compile time of a model. So numba gets
two functions: a function for callers in Python, and a function without wrappers for
kernels. The two functions are compiled on demand and cached separately.
"""

from collections.abc import Callable
from typing import Any, ParamSpec, TypeVar, cast

import numba
from numba.core.registry import CPUDispatcher
from numba.extending import typeof_impl

from kernels.caching import MADE_OF, OURS, ByClasses

P = ParamSpec("P")
R = TypeVar("R")


def _compiled(function: Callable[P, R], **options: Any) -> Callable[P, R]:
    OURS.add(function)
    compiled = numba.njit(cache=True, nogil=True, error_model="numpy", **options)(
        function
    )
    if compiled is not function:  # not with NUMBA_DISABLE_JIT=1
        compiled._cache._cache_file = ByClasses(function, compiled._cache)
    return cast("Callable[P, R]", compiled)


def jit(function: Callable[P, R]) -> Callable[P, R]:
    """Compile `function`, which must not allocate.

    The function makes no new arrays, and has no `a[:] = b` between arrays.
    """
    return _compiled(function, forceinline=True, _nrt=False)


def jit_apart(function: Callable[P, R]) -> Callable[P, R]:
    """Compile `function`, which must not allocate, once for all its callers.

    Kernels of `jit` are inlined into each caller. `jit_apart` is for long functions
    that most runs do not call.
    """
    return _compiled(function, _nrt=False)


def jit_with_memory(function: Callable[P, R]) -> Callable[P, R]:
    """Compile `function`, which may allocate arrays."""
    return _compiled(function)


def jit_as(function: Callable[P, R], like: Callable[..., Any]) -> Callable[P, R]:
    """Compile `function`, which is generated from `like` or calls generated code.

    `function` must not allocate. The cache keeps the compiled code as long as the code
    of `like` is valid.
    """
    MADE_OF[function] = like
    return _compiled(function, _nrt=False)


def allocates(kernel: Callable[..., Any]) -> bool:
    """Return whether a kernel may allocate arrays, see `jit_with_memory`.

    The result is False if kernels are not compiled, and for a function that is not a
    kernel.
    """
    options: dict[str, Any] = getattr(kernel, "targetoptions", {"_nrt": False})
    return bool(options.get("_nrt", True))


@typeof_impl.register(CPUDispatcher)
def _type_within(called: Any, _context: object) -> Any:
    """Return the type of a function that compiled code names.

    A kernel of the project has the type of its version without wrappers.
    """
    function = called.py_func
    if function not in OURS:
        return called._numba_type_
    if not hasattr(called, "within"):
        bare = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
        twin: Any = CPUDispatcher(function, targetoptions=called.targetoptions | bare)
        twin.enable_caching()
        twin._cache._cache_file = ByClasses(function, twin._cache, within=True)
        called.within = twin
    return called.within._numba_type_
