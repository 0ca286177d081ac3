"""Indices that compiled code takes as they are.

numba lets an index count from the end, as Python does. So each signed index that may be
negative needs a test, and a loop with such tests does not compute several numbers at
once. An unsigned index needs none.
"""

from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.cpython.unsafe.numbers import trailing_zeros
from numba.extending import intrinsic, overload
from numpy.typing import NDArray

from kernels.jit import jit

Marks = NDArray[np.bool_]
WORD = np.uint64(64)
"""Marks are read as one number of so many bits."""
PIECE = 8
"""No processor that numba knows computes with more numbers of 64 bits at once."""


@jit
def unsigned(k: int) -> Any:
    """The index or number of places `k`, which is not negative."""
    return np.uint64(k)


@jit
def signed(k: Any) -> int:
    """A number of places that was counted unsigned, as numbers of kernels are: numba
    makes a float of what may be either.
    """
    return np.int64(k)  # type: ignore[return-value]


@jit
def whole(count: int) -> Any:
    """The least multiple of PIECE that is not below `count`. Of a loop so long,
    compiled code takes no turn alone; what the last ones compute is for nobody.
    """
    return unsigned((count + PIECE - 1) // PIECE * PIECE)


def build_marks(n: int) -> Marks:
    """At least `n` marks in whole words; none is set."""
    return np.zeros(-(-n // int(WORD)) * int(WORD), np.bool_)


def word(marks: Marks, first: Any) -> Any:
    """WORD marks from the place `first` on, the first of them as the lowest bit."""
    some = marks[first : first + WORD]
    return np.uint64(np.packbits(some, bitorder="little").view(np.uint64)[0])


def lowest(bits: Any) -> Any:
    """The place of the lowest bit that is set; `bits` is not zero."""
    return np.uint64((int(bits) & -int(bits)).bit_length() - 1)


@jit
def without_lowest(bits: Any) -> Any:
    """`bits`, which is not zero, without the lowest bit that is set."""
    return bits & (bits - np.uint64(1))


@intrinsic
def _word(_: Any, marks: Any, first: Any) -> Any:
    """What `word` is compiled to: a vector of bytes becomes one of bits."""

    def code(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        data = context.make_array(signature.args[0])(context, builder, given[0]).data
        many = ir.VectorType(ir.IntType(8), int(WORD))
        place = builder.bitcast(builder.gep(data, [given[1]]), many.as_pointer())
        found = builder.load(place)
        found.align = 1
        is_set = builder.icmp_unsigned("!=", found, ir.Constant(many, None))
        return builder.bitcast(is_set, ir.IntType(int(WORD)))

    return types.uint64(marks, first), code


def collected(marks: Any, first: Any) -> Any:
    """`word` of marks that do not lie together."""
    bits = np.uint64(0)
    for k in range(WORD):
        if marks[first + np.uint64(k)]:
            bits |= np.uint64(1) << np.uint64(k)
    return bits


def _compiled_word(marks: Any, _first: Any) -> Any:
    compiled: Any = _word
    together = marks.layout == "C"
    return (lambda marks, first: compiled(marks, first)) if together else collected


def _compiled_lowest(_: Any) -> Any:
    compiled: Any = trailing_zeros
    return lambda bits: compiled(bits)


# Statements of the module belong to the stamps of all its functions: so a change in
# what is compiled changes them, too.
overload(word, strict=False)(_compiled_word)
overload(lowest, strict=False)(_compiled_lowest)
