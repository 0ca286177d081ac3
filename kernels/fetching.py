"""Memory requests ahead of use.

Data outside the caches of the processor arrives after the time of hundreds of
additions. A kernel requests data before the use, and continues meanwhile.
"""

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic, overload

BUILD: Any = cgutils
TO_BE_READ, NEAREST_CACHE, DATA = 0, 3, 1
"""Arguments of `prefetch` of LLVM, as numbers."""


def fetch(_array: Any, _place: Any) -> None:
    """Request the memory of an element of an array.

    The place is an index or a tuple of indices. The request changes no result.
    """


def _instruction(_: Any, array: Any, place: Any) -> Any:
    def code(context: Any, builder: Any, _signature: Any, given: Any) -> Any:
        held = BUILD.create_struct_proxy(array)(context, builder, given[0])
        several = isinstance(place, types.BaseTuple)
        indices = BUILD.unpack_tuple(builder, given[1]) if several else [given[1]]
        kinds = place if several else [place]
        whole = [
            context.cast(builder, index, kind, types.intp)
            for index, kind in zip(indices, kinds, strict=True)
        ]
        address = BUILD.get_item_pointer(context, builder, array, held, whole)
        number = ir.IntType(32)
        takes = ir.FunctionType(ir.VoidType(), [BUILD.voidptr_t, *[number] * 3])
        ask = BUILD.get_or_insert_function(builder.module, takes, "llvm.prefetch.p0")
        how = [number(one) for one in (TO_BE_READ, NEAREST_CACHE, DATA)]
        builder.call(ask, [builder.bitcast(address, BUILD.voidptr_t), *how])
        return context.get_dummy_value()

    return types.void(array, place), code


_FETCH: Any = intrinsic(_instruction)


def _compiled(*_: Any) -> Any:
    return lambda _array, _place: _FETCH(_array, _place)


# A statement of the module belongs to the stamps, as in kernels.indices.
overload(fetch, strict=False)(_compiled)
