"""Parts of a large array, as arrays for kernels.

A few large arrays hold the state of thousands of trials. Each trial reads views:
elements at intervals of a `stride`. A view is made from the address of a large array,
without copies, allocations or reference counts.
"""

from typing import Any

from llvmlite import ir
from numba.core import cgutils
from numpy.lib.stride_tricks import as_strided

BUILD: Any = cgutils
LAYOUT = "A"
"""numba's name for the layout of arrays with gaps."""


def view(large: Any, first: Any, stride: Any, shape: tuple[Any, ...]) -> Any:
    """Return a view of elements of a large array, at intervals of a stride.

    The view is no copy: a write to the view changes the large array.

    Parameters
    ----------
    large : array (E,)
        The large array.
    first : int
        Index of the first element.
    stride : int
        Distance between successive elements of the view, in elements.
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
