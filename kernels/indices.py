"""Unsigned indices, which compiled code uses without a test.

In numba an index can count from the end, as in Python. So each signed index that may be
negative needs a test, and a loop with tests is not vectorised. An unsigned index needs
no test.
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
"""Number of marks that are read as one number."""
PIECE = 8
"""Largest number of 64-bit numbers in one register of a supported processor."""


@jit
def unsigned(k: int) -> Any:
    """Return the non-negative index or count `k` as an unsigned number."""
    return np.uint64(k)


@jit
def signed(k: Any) -> int:
    """Return an unsigned count as a signed number, which kernels use.

    numba converts a number to float if the number may be signed or unsigned.
    """
    return np.int64(k)  # type: ignore[return-value]


@jit
def whole(count: int) -> Any:
    """Return the least multiple of PIECE that is not below `count`.

    A compiled loop of this length has no remainder. The results of the last iterations
    are not used.
    """
    return unsigned((count + PIECE - 1) // PIECE * PIECE)


def build_marks(n: int) -> Marks:
    """Return at least `n` unset marks in full words."""
    return np.zeros(-(-n // int(WORD)) * int(WORD), np.bool_)


def word(marks: Marks, first: Any) -> Any:
    """Return WORD marks from the index `first` on; the first is the lowest bit."""
    some = marks[first : first + WORD]
    return np.uint64(np.packbits(some, bitorder="little").view(np.uint64)[0])


def lowest(bits: Any) -> Any:
    """Return the index of the lowest bit that is set; `bits` is not zero."""
    return np.uint64((int(bits) & -int(bits)).bit_length() - 1)


@jit
def without_lowest(bits: Any) -> Any:
    """Return `bits`, which is not zero, without the lowest bit that is set."""
    return bits & (bits - np.uint64(1))


@intrinsic
def _word(_: Any, marks: Any, first: Any) -> Any:
    """Build the compiled form of `word`: a vector of bytes becomes a vector of bits."""

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
    """Return `word` of marks that are not contiguous."""
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


# Statements of the module belong to the stamps of all its functions. So a change in
# compiled code changes the stamps, too.
overload(word, strict=False)(_compiled_word)
overload(lowest, strict=False)(_compiled_lowest)
