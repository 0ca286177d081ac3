"""Vectors of numbers of eight trials, as numba types: one number per trial.

`LANES` holds floats, `WHOLE` integers and `MASK` truth values. Arithmetic of vectors is
the arithmetic of numbers, lane by lane and bitwise identical. LLVM computes vectors by
the rules of IEEE 754 too, and splits vectors that are wider than the vectors of the
processor. A number that is equal in all lanes stays a number until an operation with a
vector.
"""

import math
import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import extending, types
from numba.core import cgutils
from numba.core.datamodel import models
from numba.core.datamodel.registry import register_default
from numba.core.imputils import lower_builtin, lower_cast
from numba.core.typeconv.castgraph import Conversion
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import overload

from kernels.lanes.texts import function_of

WIDTH = 8
OPTIONS: Any = {"forceinline": True, "_nrt": False, "error_model": "numpy"}
"""Options of functions that are compiled within a kernel; see `kernels.jit`."""
intrinsic: Any = extending.intrinsic
"""numba's `intrinsic`, without a type.

According to numba's type, calls of an intrinsic pass a context. Calls pass no context.
"""
INDEX = ir.IntType(32)


class Vector(types.Type):
    """Type of WIDTH numbers of one kind."""

    def __init__(self, name: str, number: Any, bits: Any) -> None:
        self.number = number
        self.bits = bits
        super().__init__(name)

    @property
    def llvm(self) -> Any:
        """Type of LLVM."""
        return ir.VectorType(self.bits, WIDTH)

    def unify(self, _context: Any, other: Any) -> "Vector | None":
        """Return the common type of this type and `other`, for a variable.

        Parameters
        ----------
        _context : numba context
        other : type

        Returns
        -------
        Vector or None
            None if `other` is not a type of numbers.
        """
        if not is_number(other):
            return None
        return max(self, vector_of(other), key=(MASK, WHOLE, LANES).index)

    def can_convert_from(self, _context: Any, other: Any) -> Any:
        """Return numba's conversion from `other` to this type; None if impossible.

        Parameters
        ----------
        _context : numba context
        other : type
        """
        if is_number(other) and self.unify(None, other) is self:
            return Conversion.safe
        return None


LANES = Vector("lanes", types.float64, ir.DoubleType())
WHOLE = Vector("whole lanes", types.int64, ir.IntType(64))
MASK = Vector("mask of lanes", types.boolean, ir.IntType(1))


class Found(types.Type):
    """Type of the neighbours of a boid: a number per lane, and a list for all lanes."""

    def __init__(self) -> None:
        super().__init__("neighbours found in lanes")


FOUND = Found()


def varies(kind: Any) -> bool:
    """Return whether a type has one number per lane."""
    return isinstance(kind, Vector | Found)


def is_number(kind: Any) -> bool:
    """Return whether a type is the type of a number, a truth value or a vector."""
    return isinstance(kind, Vector | Found | types.Number | types.Boolean)


def is_truth(kind: Any) -> bool:
    """Return whether a type is the type of a truth value or a mask."""
    return kind is MASK or isinstance(kind, types.Boolean)


def vector_of(kind: Any) -> Vector:
    """Return the type of a vector of numbers of a type."""
    if isinstance(kind, Vector):
        return kind
    if isinstance(kind, types.Float):
        return LANES
    return WHOLE if isinstance(kind, types.Integer | Found) else MASK


@register_default(Found)
class _FoundModel(models.StructModel):
    def __init__(self, manager: Any, kind: Found) -> None:
        marks = types.CPointer(types.uint8)
        members = [("count", WHOLE), ("listed", types.int64), ("marks", marks)]
        super().__init__(manager, kind, members)


@lower_cast(Found, Vector)
def _count(context: Any, builder: Any, kind: Found, to: Vector, value: Any) -> Any:
    neighbours = cgutils.create_struct_proxy(kind)(context, builder, value=value)
    return context.cast(builder, neighbours.count, WHOLE, to)


@register_default(Vector)
class _VectorModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Vector) -> None:
        super().__init__(manager, kind, kind.llvm)


@lower_cast(types.Number, Vector)
@lower_cast(types.Boolean, Vector)
def _spread(context: Any, builder: Any, kind: Any, to: Vector, value: Any) -> Any:
    """Return a vector with one number in all lanes."""
    value = context.cast(builder, value, kind, to.number)
    if value.type != to.bits:
        value = builder.trunc(value, to.bits)
    nothing = ir.Constant(to.llvm, ir.Undefined)
    first = builder.insert_element(nothing, value, ir.Constant(INDEX, 0))
    everywhere = ir.Constant(ir.VectorType(INDEX, WIDTH), [0] * WIDTH)
    return builder.shuffle_vector(first, nothing, everywhere)


@lower_cast(Vector, Vector)
def _convert(_context: Any, builder: Any, kind: Vector, to: Vector, value: Any) -> Any:
    if kind is to:
        return value
    if to is LANES and kind is WHOLE:
        return builder.sitofp(value, to.llvm)
    return (builder.uitofp if to is LANES else builder.zext)(value, to.llvm)


def _defines(
    function: Any,
    result: Callable[[tuple[Any, ...]], Any],
    codes: dict[Vector, Callable[..., Any]],
) -> None:
    """Define the meaning of `function` for vectors.

    From the types of the arguments, `result` returns two types: the type of the result,
    and the type to which the arguments are cast. `codes` has the code by type of the
    cast arguments.
    """

    @infer_global(function)
    class _Template(AbstractTemplate):
        def generic(self, arguments: tuple[Any, ...], _named: Any) -> Any:
            if not (any(map(varies, arguments)) and all(map(is_number, arguments))):
                return None
            returned, joint = result(arguments)
            if joint not in codes:
                return None
            return signature(returned, *[joint] * len(arguments))

    for kind, code in codes.items():
        for count in (1, 2):

            def lower(
                _context: Any,
                builder: Any,
                _signature: Any,
                arguments: Any,
                code: Callable[..., Any] = code,
            ) -> Any:
                return code(builder, *arguments)

            lower_builtin(function, *[kind] * count)(lower)


def _joint(arguments: tuple[Any, ...]) -> Vector:
    """Return the type in which Python computes with numbers of the given types."""
    widest = max(map(vector_of, arguments), key=(MASK, WHOLE, LANES).index)
    return WHOLE if widest is MASK else widest


# Each function returns two types for an operator, from the types of the arguments: the
# type of the result, and the type to which the arguments are cast.


def _same(arguments: tuple[Any, ...]) -> tuple[Vector, Vector]:
    joint = _joint(arguments)
    return joint, joint


def _floats(_arguments: tuple[Any, ...]) -> tuple[Vector, Vector]:
    return LANES, LANES


def _truth(arguments: tuple[Any, ...]) -> tuple[Vector, Vector]:
    return MASK, _joint(arguments)


def _masks(arguments: tuple[Any, ...]) -> tuple[Any, Any]:
    joint = max(map(vector_of, arguments), key=(MASK, WHOLE, LANES).index)
    return joint, joint


def _llvm_function(name: str) -> Callable[..., Any]:
    """Return the code of LLVM's function for vectors of floats."""

    def code(builder: Any, *arguments: Any) -> Any:
        kind = ir.FunctionType(LANES.llvm, [argument.type for argument in arguments])
        function = cgutils.get_or_insert_function(
            builder.module, kind, f"llvm.{name}.v{WIDTH}f64"
        )
        return builder.call(function, arguments)

    return code


def _instruction(name: str) -> Callable[..., Any]:
    """Return the code of LLVM's instruction `name`."""
    return lambda builder, *arguments: getattr(builder, name)(*arguments)


def _compared(sign: str) -> dict[Vector, Callable[..., Any]]:
    """Return the code of a comparison by type, with the rules of Python.

    NaN is unequal to all numbers, and neither less nor greater.
    """

    def floats(builder: Any, first: Any, second: Any) -> Any:
        kind = builder.fcmp_unordered if sign == "!=" else builder.fcmp_ordered
        return kind(sign, first, second)

    def integers(builder: Any, first: Any, second: Any) -> Any:
        return builder.icmp_signed(sign, first, second)

    return {LANES: floats, WHOLE: integers}


def _extreme(sign: str) -> dict[Vector, Callable[..., Any]]:
    """Return the code of `max` or `min` by type, with the rules of Python.

    The result is the first argument, unless the second argument is beyond the first.
    """
    codes = _compared(sign)

    def chosen(kind: Vector) -> Callable[..., Any]:
        def code(builder: Any, first: Any, second: Any) -> Any:
            return builder.select(codes[kind](builder, second, first), second, first)

        return code

    return {kind: chosen(kind) for kind in codes}


for _operators, _name in (
    ((operator.add, operator.iadd), "add"),
    ((operator.sub, operator.isub), "sub"),
    ((operator.mul, operator.imul), "mul"),
):
    for _operator in _operators:
        _defines(
            _operator,
            _same,
            {LANES: _instruction(f"f{_name}"), WHOLE: _instruction(_name)},
        )
for _operator in (operator.truediv, operator.itruediv):
    _defines(_operator, _floats, {LANES: _instruction("fdiv")})
_defines(operator.neg, _same, {LANES: _instruction("fneg"), WHOLE: _instruction("neg")})
_defines(math.sqrt, _floats, {LANES: _llvm_function("sqrt")})
_defines(abs, _same, {LANES: _llvm_function("fabs")})
for _operator, _sign in (
    (operator.lt, "<"),
    (operator.le, "<="),
    (operator.gt, ">"),
    (operator.ge, ">="),
    (operator.eq, "=="),
    (operator.ne, "!="),
):
    _defines(_operator, _truth, _compared(_sign))
_defines(max, _same, _extreme(">"))
_defines(min, _same, _extreme("<"))
for _operators, _name in (
    ((operator.and_, operator.iand), "and_"),
    ((operator.or_, operator.ior), "or_"),
):
    for _operator in _operators:
        _defines(
            _operator, _masks, {MASK: _instruction(_name), WHOLE: _instruction(_name)}
        )


for _operators, _name in (
    ((operator.lshift, operator.ilshift), "shl"),
    ((operator.rshift, operator.irshift), "ashr"),
):
    for _operator in _operators:
        _defines(_operator, _same, {WHOLE: _instruction(_name)})


@intrinsic
def spread(_context: Any, value: Any) -> Any:
    """Return a vector with a number in all lanes; return a vector unchanged."""
    kind = vector_of(value)

    def code(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        return context.cast(builder, arguments[0], sig.args[0], kind)

    return signature(kind, value), code


def _brought_to(kind: Vector) -> Any:
    """Return the intrinsic that casts a vector to another kind of numbers."""

    def brought(_context: Any, value: Any) -> Any:
        def code(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
            return context.cast(builder, arguments[0], sig.args[0], kind)

        return signature(kind, value), code

    return intrinsic(brought)


_floats_of = _brought_to(LANES)
_whole_of = _brought_to(WHOLE)


@intrinsic
def _select(context: Any, mask: Any, value: Any, otherwise: Any) -> Any:
    kind = context.unify_types(value, otherwise) if value != otherwise else value
    kind = vector_of(kind)

    def code(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        _, first, second = sig.args
        test = arguments[0]
        if not isinstance(sig.args[0], Vector):
            test = builder.trunc(test, MASK.bits) if test.type != MASK.bits else test
        return builder.select(
            test,
            context.cast(builder, arguments[1], first, kind),
            context.cast(builder, arguments[2], second, kind),
        )

    return signature(kind, mask, value, otherwise), code


@intrinsic
def lane(_context: Any, vector: Any, at: Any) -> Any:
    """Return the number of one lane; a number is equal in all lanes.

    Parameters
    ----------
    _context : numba context
    vector : Vector or number
    at : int
        Index of the lane.
    """

    def code(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        if not isinstance(sig.args[0], Vector):
            return arguments[0]
        index = context.cast(builder, arguments[1], sig.args[1], types.int32)
        return builder.extract_element(arguments[0], index)

    kind = vector.number if isinstance(vector, Vector) else vector
    return signature(kind, vector, at), code


@intrinsic
def put(_context: Any, vector: Any, at: Any, number: Any) -> Any:
    """Return a vector with a replaced number in one lane.

    Parameters
    ----------
    _context : numba context
    vector : Vector
    at : int
        Index of the lane.
    number : number
        New number of the lane.
    """

    def code(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        index = context.cast(builder, arguments[1], sig.args[1], types.int32)
        value = context.cast(builder, arguments[2], sig.args[2], vector.number)
        if value.type != vector.bits:
            value = builder.trunc(value, vector.bits)
        return builder.insert_element(arguments[0], value, index)

    return signature(vector, vector, at, number), code


def _read_as(of_vectors: Vector, of_numbers: Any) -> Any:
    """Return the intrinsic that reads the bits of numbers as another kind."""

    def read(_context: Any, value: Any) -> Any:
        kind = of_vectors if varies(value) else of_numbers
        before = LANES if of_vectors is WHOLE else WHOLE
        plain = before if varies(value) else before.number

        def code(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
            number = context.cast(builder, arguments[0], sig.args[0], plain)
            return builder.bitcast(number, context.get_value_type(kind))

        return signature(kind, value), code

    return intrinsic(read)


number_bits = _read_as(WHOLE, types.int64)
"""Function that returns the bits of floats as integers."""
bits_number = _read_as(LANES, types.float64)
"""Function that returns the floats of bits that are integers."""


def looked_up(table: Any, k: Any) -> Any:
    """Return the entry of a table at index `k` of each lane."""
    return table[k]


@overload(looked_up, jit_options=OPTIONS, strict=False)
def _looked_up(_table: Any, k: Any) -> Any:
    if not varies(k):
        return lambda _table, k: _table[k]

    def each(_table: Any, k: Any) -> Any:
        entries = spread(_table[lane(k, 0)])
        for at in range(1, WIDTH):
            entries = put(entries, at, _table[lane(k, at)])
        return entries

    return each


@intrinsic
def in_any(_context: Any, mask: Any) -> Any:
    """Return whether a mask is true in any lane."""

    def code(_context: Any, builder: Any, _sig: Any, arguments: Any) -> Any:
        bits = builder.bitcast(arguments[0], ir.IntType(WIDTH))
        return builder.icmp_unsigned("!=", bits, ir.Constant(bits.type, 0))

    return signature(types.boolean, mask), code


@intrinsic
def bits_of(_context: Any, mask: Any) -> Any:
    """Return a mask as a byte."""

    def code(_context: Any, builder: Any, _sig: Any, arguments: Any) -> Any:
        return builder.bitcast(arguments[0], ir.IntType(WIDTH))

    return signature(types.uint8, mask), code


@intrinsic
def mask_of(_context: Any, bits: Any) -> Any:
    """Return the mask of a byte."""

    def code(_context: Any, builder: Any, _sig: Any, arguments: Any) -> Any:
        return builder.bitcast(arguments[0], MASK.llvm)

    return signature(MASK, types.uint8), code


def where(test: Any, value: Any, otherwise: Any) -> Any:
    """Select values lane by lane, and tuples part by part.

    Parameters
    ----------
    test : bool or mask
    value : number, Vector or tuple
        Result in lanes in which `test` is true.
    otherwise : number, Vector or tuple
        Result in lanes in which `test` is false.
    """
    return value if test else otherwise


@overload(where, jit_options=OPTIONS, strict=False)
def _where(test: Any, value: Any, otherwise: Any) -> Any:
    if varies(test) and test is not MASK:
        return None
    if isinstance(value, types.BaseTuple):
        parts = (f"where(test, value[{k}], otherwise[{k}])" for k in range(len(value)))
        text = f"def chosen(test, value, otherwise): return ({', '.join(parts)},)"
        return function_of(text, {"where": where})
    if any(isinstance(kind, Vector) for kind in (test, value, otherwise)):
        return lambda test, value, otherwise: _select(test, value, otherwise)
    return lambda test, value, otherwise: value if test else otherwise


def both(first: Any, second: Any) -> Any:
    """Return `first and second`; the second side is always computed."""
    return first and second


@overload(both, jit_options=OPTIONS, strict=False)
def _both(first: Any, second: Any) -> Any:
    if not (is_truth(first) and is_truth(second)):
        return None
    return lambda first, second: first & second


def either(first: Any, second: Any) -> Any:
    """Return `first or second`; the second side is always computed."""
    return first or second


@overload(either, jit_options=OPTIONS, strict=False)
def _either(first: Any, second: Any) -> Any:
    if not (is_truth(first) and is_truth(second)):
        return None
    return lambda first, second: first | second


def negated(test: Any) -> Any:
    """Return `not test`."""
    return not test


@overload(negated, jit_options=OPTIONS, strict=False)
def _negated(test: Any) -> Any:
    if varies(test) and test is not MASK:
        return None
    if test is MASK:
        return lambda test: _select(test, False, True)
    return lambda test: not test


def as_float(value: Any) -> Any:
    """Return `float(value)`."""
    return float(value)


@overload(as_float, jit_options=OPTIONS, strict=False)
def _as_float(value: Any) -> Any:
    if varies(value):
        return lambda value: _floats_of(value)
    return lambda value: float(value)


def as_int(value: Any) -> Any:
    """Return `int(value)` of a truth value or an integer."""
    return int(value)


@overload(as_int, jit_options=OPTIONS, strict=False)
def _as_int(value: Any) -> Any:
    if varies(value) and value is not LANES:
        return lambda value: _whole_of(value)
    if not isinstance(value, Vector):
        return lambda value: int(value)
    return None


def as_bool(value: Any) -> Any:
    """Return `bool(value)`."""
    return bool(value)


@overload(as_bool, jit_options=OPTIONS, strict=False)
def _as_bool(value: Any) -> Any:
    if value is MASK:
        return lambda value: value
    if varies(value):
        return lambda value: value != 0
    return lambda value: bool(value)


def any_lane(test: Any) -> Any:
    """Return whether a test is true in any lane."""
    return test


@overload(any_lane, jit_options=OPTIONS, strict=False)
def _any_lane(test: Any) -> Any:
    if isinstance(test, Vector):
        return lambda test: in_any(test)
    return lambda test: test
