"""How kernels are compiled: two decorators, and nothing else in the project calls
numba.

Kernels are compiled at their first call (no signatures), cached on disk (see
kernels.caching), and keep IEEE arithmetic, since `fastmath` gives different bits on
different processors. With NUMBA_DISABLE_JIT=1 the decorated functions stay plain
Python, which is the reference the tests compare with.

numba counts references to every array that a function touches, with atomic
instructions, and a boid-step touches dozens of arrays. A kernel that allocates nothing
does not need this: aziel_chen2025 went from 930 to 340 ns a boid-step without reference
counts, and after other changes from 290 to 160 by inlining all calls.
"""

from collections.abc import Callable
from typing import Any, ParamSpec, TypeVar, cast

import numba

from kernels.caching import OURS, ByClasses

P = ParamSpec("P")
R = TypeVar("R")


def _compiled(function: Callable[P, R], **options: Any) -> Callable[P, R]:
    OURS.add(function)
    compiled = numba.njit(cache=True, error_model="numpy", **options)(function)
    if compiled is not function:  # as it is with NUMBA_DISABLE_JIT=1
        compiled._cache._cache_file = ByClasses(function, compiled._cache)
    return cast("Callable[P, R]", compiled)


def jit(function: Callable[P, R]) -> Callable[P, R]:
    """Compile `function`, which must not allocate: no new arrays, no `a[:] = b` between
    arrays.
    """
    return _compiled(function, forceinline=True, _nrt=False)


def jit_with_memory(function: Callable[P, R]) -> Callable[P, R]:
    """Compile `function`, which may allocate arrays."""
    return _compiled(function)
