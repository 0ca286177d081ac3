"""Parts of a large array as arrays of their own.

The state of thousands of flights is kept in a few large arrays. What a flight sees of
them are views: numbers that lie a `stride` apart. A view is made of the address of a
large array, so that nothing is copied, allocated or counted.
"""

from typing import Any

from llvmlite import ir
from numba.core import cgutils
from numpy.lib.stride_tricks import as_strided

BUILD: Any = cgutils
LAYOUT = "A"
"""That of arrays with gaps, in the words of numba."""


def view(whole: Any, first: Any, stride: Any, shape: tuple[Any, ...]) -> Any:
    """The array of this `shape` whose elements, row after row, are those of `whole`
    (E,) at `first`, `first + stride`, `first + 2 stride` and so on. It is `whole`
    itself that is read and written.
    """
    steps, step = [], int(stride) * whole.itemsize
    for length in reversed(shape):
        steps.append(step)
        step *= int(length)
    return as_strided(whole[int(first) :], tuple(map(int, shape)), tuple(steps[::-1]))


def instructions(whole: Any, shape: Any, kinds: Any, made: Any) -> Any:
    """The type of a view of the array at the address `whole`, and what it is compiled
    to, for a compiler whose types are `kinds` and which makes arrays by `made`.
    """
    found = kinds.Array(whole.dtype, len(shape), LAYOUT)

    def code(context: Any, builder: Any, _signature: Any, given: Any) -> Any:
        address, first, stride, lengths = given
        size = context.get_abi_sizeof(context.get_data_type(whole.dtype))
        element = context.get_constant(kinds.intp, size)
        step, steps = builder.mul(stride, element), []
        counts = BUILD.unpack_tuple(builder, lengths)
        for length in reversed(counts):
            steps.append(step)
            step = builder.mul(step, length)
        view = made.make_array(found)(context, builder)
        made.populate_array(
            view,
            data=builder.gep(address, [first]),
            shape=counts,
            strides=steps[::-1],
            itemsize=element,
            meminfo=ir.Constant(context.get_value_type(kinds.voidptr), None),
        )
        return view._getvalue()

    whole_numbers = kinds.UniTuple(kinds.intp, len(shape))
    return found(whole, kinds.intp, kinds.intp, whole_numbers), code
