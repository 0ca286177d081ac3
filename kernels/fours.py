"""Four numbers in one register, for SIMD arithmetic in compiled code.

The order of additions decides the rounding of a sum, so a loop over neighbours cannot
add several terms at once. But a loop can add to four sums at once, in one register of
the processor. The results equal the results of separate additions. The interpreter uses
tuples of four numbers, and kernels.lanes reads the same source text.
"""

from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.core.datamodel import models
from numba.core.datamodel.registry import register_default
from numba.core.imputils import lower_builtin
from numba.core.typing.templates import AbstractTemplate, infer_global, signature

from kernels.caching import OURS

Four = tuple[float, float, float, float]
REGISTER = ir.VectorType(ir.DoubleType(), 4)
NUMBER = types.float64
SIDES = types.UniTuple(NUMBER, 4)


class SideBySide(types.Type):
    """Type of four numbers in one register, for compiled code."""

    def __init__(self) -> None:
        super().__init__("four numbers side by side")


FOUR = SideBySide()


@register_default(SideBySide)
class _InRegister(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: SideBySide) -> None:
        super().__init__(manager, kind, REGISTER)


def four(a: float, b: float, c: float, d: float) -> Four:
    """Return four numbers side by side.

    Parameters
    ----------
    a, b, c, d : float

    Returns
    -------
    Four
    """
    return a, b, c, d


def parts(one: Four) -> Four:
    """Return the four numbers as a tuple."""
    return one[0], one[1], one[2], one[3]


def plus(one: Four, other: Four) -> Four:
    """Return the four sums."""
    return one[0] + other[0], one[1] + other[1], one[2] + other[2], one[3] + other[3]


def minus(one: Four, other: Four) -> Four:
    """Return the four differences."""
    return one[0] - other[0], one[1] - other[1], one[2] - other[2], one[3] - other[3]


def times(one: Four, other: Four) -> Four:
    """Return the four products."""
    return one[0] * other[0], one[1] * other[1], one[2] * other[2], one[3] * other[3]


def below(number: float, bounds: Four) -> Four:
    """Return 1 for each of four bounds above a number, else 0."""
    return (
        1.0 if number < bounds[0] else 0.0,
        1.0 if number < bounds[1] else 0.0,
        1.0 if number < bounds[2] else 0.0,
        1.0 if number < bounds[3] else 0.0,
    )


def _join(_context: Any, builder: Any, *numbers: Any) -> Any:
    made = ir.Constant(REGISTER, ir.Undefined)
    for k, number in enumerate(numbers):
        made = builder.insert_element(made, number, ir.IntType(32)(k))
    return made


def _part(context: Any, builder: Any, one: Any) -> Any:
    numbers = [builder.extract_element(one, ir.IntType(32)(k)) for k in range(4)]
    return context.make_tuple(builder, SIDES, numbers)


def _add(_context: Any, builder: Any, one: Any, other: Any) -> Any:
    return builder.fadd(one, other)


def _subtract(_context: Any, builder: Any, one: Any, other: Any) -> Any:
    return builder.fsub(one, other)


def _multiply(_context: Any, builder: Any, one: Any, other: Any) -> Any:
    return builder.fmul(one, other)


def _compare(context: Any, builder: Any, number: Any, bounds: Any) -> Any:
    test = builder.fcmp_ordered("<", _join(context, builder, *[number] * 4), bounds)
    return builder.select(test, REGISTER([1.0] * 4), REGISTER([0.0] * 4))


def _is_compiled(
    function: Callable[..., Any], made: Callable[..., Any], result: Any, *given: Any
) -> None:
    """Register the builder of compiled code for a function of argument types `given`.

    `made(context, builder, *arguments)` returns the code.
    """

    @infer_global(function)
    class _Template(AbstractTemplate):
        def generic(self, _arguments: Any, _named: Any) -> Any:
            return signature(result, *given)

    def code(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        return made(context, builder, *arguments)

    lower_builtin(function, *given)(code)
    OURS.add(function)


# Statements of the module belong to the stamps of all its functions, as in
# kernels.indices.
_is_compiled(four, _join, FOUR, NUMBER, NUMBER, NUMBER, NUMBER)
_is_compiled(parts, _part, SIDES, FOUR)
_is_compiled(plus, _add, FOUR, FOUR, FOUR)
_is_compiled(minus, _subtract, FOUR, FOUR, FOUR)
_is_compiled(times, _multiply, FOUR, FOUR, FOUR)
_is_compiled(below, _compare, FOUR, NUMBER, FOUR)
