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
"""numba's word for the layout of arrays with gaps."""


def view(large: Any, first: Any, stride: Any, shape: tuple[Any, ...]) -> Any:
    """Return a view of elements of a large array that lie a stride apart.

    Nothing is copied: who writes to the view writes to the large array.

    Parameters
    ----------
    large : array (E,)
        The large array.
    first : int
        Index of the first element.
    stride : int
        Elements from one element of the view to the next.
    shape : tuple of int
        Shape of the view, filled row after row.
    """
    steps = []
    step = int(stride) * large.itemsize
    for length in reversed(shape):
        steps.append(step)
        step *= int(length)
    return as_strided(large[int(first) :], tuple(map(int, shape)), tuple(steps[::-1]))


def instructions(large: Any, shape: Any, kinds: Any, arrays: Any) -> Any:
    """Return the signature and the code of `view` for a compiler.

    Parameters
    ----------
    large : type
        Pointer type of the address of a large array.
    shape : type
        Tuple type of the shape of the view.
    kinds : module
        Types of the compiler.
    arrays : module
        Functions of the compiler that build arrays.
    """
    kind = kinds.Array(large.dtype, len(shape), LAYOUT)

    def code(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        address, first, stride, lengths = arguments
        size = context.get_abi_sizeof(context.get_data_type(large.dtype))
        element = context.get_constant(kinds.intp, size)
        step = builder.mul(stride, element)
        steps = []
        counts = BUILD.unpack_tuple(builder, lengths)
        for length in reversed(counts):
            steps.append(step)
            step = builder.mul(step, length)
        view = arrays.make_array(kind)(context, builder)
        arrays.populate_array(
            view,
            data=builder.gep(address, [first]),
            shape=counts,
            strides=steps[::-1],
            itemsize=element,
            meminfo=ir.Constant(context.get_value_type(kinds.voidptr), None),
        )
        return view._getvalue()

    integers = kinds.UniTuple(kinds.intp, len(shape))
    return kind(large, kinds.intp, kinds.intp, integers), code
