"""Four decorators that compile kernels.

Nothing else in the project calls numba, but for kernels.indices, kernels.fetching,
kernels.fours and kernels.generator, which define what functions of their own are
compiled to, for kernels.lanes, which makes types of its own and what these kernels
call, and for kernels.device.

Kernels are compiled at their first call (no signatures), cached on disk (see
kernels.caching), and keep IEEE arithmetic, since `fastmath` gives different results on
different processors. With NUMBA_DISABLE_JIT=1 the decorated functions stay plain
Python, which is the reference the tests compare with.

A kernel works on arrays and numbers alone, so it holds no lock of Python (`nogil`):
while it runs, other threads do too, such as the thread of a web server.

numba counts references to every array that a function touches, with atomic
instructions, and a boid-step touches dozens of arrays. A kernel that allocates nothing
does not need this: aziel_chen2025 went from 930 to 340 ns per boid-step without
reference counts, and after other changes from 290 to 160 by inlining all calls.

Numba compiles with each function a wrapper for callers in Python, which takes all
fields of all arguments out of their objects, and one for callers in C. Most kernels are
called by kernels alone, and these wrappers took half of the time of compiling a model.
So a function is two for numba: one for callers in Python, and one without wrappers,
which kernels call. Each is compiled where it is needed, and cached by itself.
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
    if compiled is not function:  # as it is with NUMBA_DISABLE_JIT=1
        compiled._cache._cache_file = ByClasses(function, compiled._cache)
    return cast("Callable[P, R]", compiled)


def jit(function: Callable[P, R]) -> Callable[P, R]:
    """Compile `function`, which must not allocate.

    It makes no new arrays, and has no `a[:] = b` between arrays.
    """
    return _compiled(function, forceinline=True, _nrt=False)


def jit_apart(function: Callable[P, R]) -> Callable[P, R]:
    """Compile `function`, which must not allocate, once for all its callers.

    Other kernels are inlined into each caller. Use this for long functions that most
    runs do not call.
    """
    return _compiled(function, _nrt=False)


def jit_with_memory(function: Callable[P, R]) -> Callable[P, R]:
    """Compile `function`, which may allocate arrays."""
    return _compiled(function)


def jit_as(function: Callable[P, R], like: Callable[..., Any]) -> Callable[P, R]:
    """Compile `function`, which is made of the text of `like` or calls such a function.

    It must not allocate either. Its compiled code is kept as long as the code of `like`
    is valid.
    """
    MADE_OF[function] = like
    return _compiled(function, _nrt=False)


def allocates(kernel: Callable[..., Any]) -> bool:
    """Return whether a kernel may allocate arrays, see `jit_with_memory`.

    It is False where kernels are not compiled, and for a function that is no kernel.
    """
    options: dict[str, Any] = getattr(kernel, "targetoptions", {"_nrt": False})
    return bool(options.get("_nrt", True))


@typeof_impl.register(CPUDispatcher)
def _type_within(called: Any, _context: object) -> Any:
    """Return the type of a function of numba where compiled code names it.

    A kernel of the project has the type of its twin without wrappers.
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
