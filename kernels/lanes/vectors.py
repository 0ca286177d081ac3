"""Numbers of eight trials at once, as numba types: one number of each trial in each.

`LANES` holds floats, `WHOLE` integers and `MASK` truth values. They have the arithmetic
that the numbers have, lane by lane and with the same bits: LLVM computes vectors by the
rules of IEEE 754 too, and splits those that are wider than the processor's. A number
that is the same in all lanes stays a number until it meets a vector.
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
"""What is compiled within a kernel, as `kernels.jit` has it."""
intrinsic: Any = extending.intrinsic
"""numba's own: it says of an intrinsic that calls give it a context, which they do not.
"""
INDEX = ir.IntType(32)


class Vector(types.Type):
    """WIDTH numbers of one kind."""

    def __init__(self, name: str, number: Any, bits: Any) -> None:
        self.number, self.bits = number, bits
        super().__init__(name)

    @property
    def llvm(self) -> Any:
        return ir.VectorType(self.bits, WIDTH)

    def unify(self, _context: Any, other: Any) -> "Vector | None":
        """The type of a variable that is this or `other`."""
        if not is_number(other):
            return None
        return max(self, vector_of(other), key=(MASK, WHOLE, LANES).index)

    def can_convert_from(self, _context: Any, other: Any) -> Any:
        if is_number(other) and self.unify(None, other) is self:
            return Conversion.safe
        return None


LANES = Vector("lanes", types.float64, ir.DoubleType())
WHOLE = Vector("whole lanes", types.int64, ir.IntType(64))
MASK = Vector("mask of lanes", types.boolean, ir.IntType(1))


class Found(types.Type):
    """How many neighbours a boid has in each lane, and who is one in any of them."""

    def __init__(self) -> None:
        super().__init__("neighbours found in lanes")


FOUND = Found()


def varies(one: Any) -> bool:
    """Whether a type is that of a number which each lane has for itself."""
    return isinstance(one, Vector | Found)


def is_number(one: Any) -> bool:
    """Whether a type is that of a number, a truth value, or several."""
    return isinstance(one, Vector | Found | types.Number | types.Boolean)


def is_truth(one: Any) -> bool:
    """Whether a type is that of a truth value, or several."""
    return one is MASK or isinstance(one, types.Boolean)


def vector_of(one: Any) -> Vector:
    """The type of several such numbers."""
    if isinstance(one, Vector):
        return one
    if isinstance(one, types.Float):
        return LANES
    return WHOLE if isinstance(one, types.Integer | Found) else MASK


@register_default(Found)
class _FoundModel(models.StructModel):
    def __init__(self, manager: Any, kind: Found) -> None:
        marks = types.CPointer(types.uint8)
        members = [("count", WHOLE), ("listed", types.int64), ("marks", marks)]
        super().__init__(manager, kind, members)


@lower_cast(Found, Vector)
def _count(context: Any, builder: Any, kind: Found, to: Vector, value: Any) -> Any:
    found = cgutils.create_struct_proxy(kind)(context, builder, value=value)
    return context.cast(builder, found.count, WHOLE, to)


@register_default(Vector)
class _VectorModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Vector) -> None:
        super().__init__(manager, kind, kind.llvm)


@lower_cast(types.Number, Vector)
@lower_cast(types.Boolean, Vector)
def _spread(context: Any, builder: Any, kind: Any, to: Vector, value: Any) -> Any:
    """One number in all lanes."""
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
    """Give `function` a meaning for vectors. `result` is the type of what it returns
    and the type to which its arguments are brought, from their types.
    """

    @infer_global(function)
    class _Template(AbstractTemplate):
        def generic(self, arguments: tuple[Any, ...], _named: Any) -> Any:
            if not (any(map(varies, arguments)) and all(map(is_number, arguments))):
                return None
            found, joint = result(arguments)
            if joint not in codes:
                return None
            return signature(found, *[joint] * len(arguments))

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
    """The type in which Python computes with numbers of these types."""
    found = max(map(vector_of, arguments), key=(MASK, WHOLE, LANES).index)
    return WHOLE if found is MASK else found


# Of an operator: the type of what it returns, and that to which its arguments are
# brought, from their types.


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
    """LLVM's own function of this name for vectors of floats."""

    def code(builder: Any, *arguments: Any) -> Any:
        kind = ir.FunctionType(LANES.llvm, [one.type for one in arguments])
        function = cgutils.get_or_insert_function(
            builder.module, kind, f"llvm.{name}.v{WIDTH}f64"
        )
        return builder.call(function, arguments)

    return code


def _instruction(name: str) -> Callable[..., Any]:
    """LLVM's instruction of this name."""
    return lambda builder, *arguments: getattr(builder, name)(*arguments)


def _compared(sign: str) -> dict[Vector, Callable[..., Any]]:
    """As Python does: NaN is unequal to all numbers, and neither less nor more."""

    def floats(builder: Any, one: Any, other: Any) -> Any:
        kind = builder.fcmp_unordered if sign == "!=" else builder.fcmp_ordered
        return kind(sign, one, other)

    def whole(builder: Any, one: Any, other: Any) -> Any:
        return builder.icmp_signed(sign, one, other)

    return {LANES: floats, WHOLE: whole}


def _extreme(sign: str) -> dict[Vector, Callable[..., Any]]:
    """As Python does: the first argument, unless the second is beyond it."""
    codes = _compared(sign)

    def chosen(kind: Vector) -> Callable[..., Any]:
        def code(builder: Any, one: Any, other: Any) -> Any:
            return builder.select(codes[kind](builder, other, one), other, one)

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
    """The vector of a number, the same in all lanes; a vector stays what it is."""
    kind = vector_of(value)

    def code(context: Any, builder: Any, given: Any, arguments: Any) -> Any:
        return context.cast(builder, arguments[0], given.args[0], kind)

    return signature(kind, value), code


def _brought_to(kind: Vector) -> Any:
    """The intrinsic that gives a vector another kind of numbers."""

    def brought(_context: Any, value: Any) -> Any:
        def code(context: Any, builder: Any, given: Any, arguments: Any) -> Any:
            return context.cast(builder, arguments[0], given.args[0], kind)

        return signature(kind, value), code

    return intrinsic(brought)


_floats_of, _whole_of = _brought_to(LANES), _brought_to(WHOLE)


@intrinsic
def _select(context: Any, mask: Any, one: Any, other: Any) -> Any:
    kind = context.unify_types(one, other) if one != other else one
    kind = vector_of(kind)

    def code(context: Any, builder: Any, given: Any, arguments: Any) -> Any:
        _, first, second = given.args
        test = arguments[0]
        if not isinstance(given.args[0], Vector):
            test = builder.trunc(test, MASK.bits) if test.type != MASK.bits else test
        return builder.select(
            test,
            context.cast(builder, arguments[1], first, kind),
            context.cast(builder, arguments[2], second, kind),
        )

    return signature(kind, mask, one, other), code


@intrinsic
def lane(_context: Any, vector: Any, at: Any) -> Any:
    """The number of the lane `at`; a number is the same in all lanes."""

    def code(context: Any, builder: Any, given: Any, arguments: Any) -> Any:
        if not isinstance(given.args[0], Vector):
            return arguments[0]
        index = context.cast(builder, arguments[1], given.args[1], types.int32)
        return builder.extract_element(arguments[0], index)

    found = vector.number if isinstance(vector, Vector) else vector
    return signature(found, vector, at), code


@intrinsic
def put(_context: Any, vector: Any, at: Any, number: Any) -> Any:
    """`vector` with another number in the lane `at`."""

    def code(context: Any, builder: Any, given: Any, arguments: Any) -> Any:
        index = context.cast(builder, arguments[1], given.args[1], types.int32)
        value = context.cast(builder, arguments[2], given.args[2], vector.number)
        if value.type != vector.bits:
            value = builder.trunc(value, vector.bits)
        return builder.insert_element(arguments[0], value, index)

    return signature(vector, vector, at, number), code


def _read_as(of_vectors: Vector, of_numbers: Any) -> Any:
    """The intrinsic that reads the bits of a number, or of several, as another kind."""

    def read(_context: Any, value: Any) -> Any:
        kind = of_vectors if varies(value) else of_numbers
        before = LANES if of_vectors is WHOLE else WHOLE
        plain = before if varies(value) else before.number

        def code(context: Any, builder: Any, given: Any, arguments: Any) -> Any:
            number = context.cast(builder, arguments[0], given.args[0], plain)
            return builder.bitcast(number, context.get_value_type(kind))

        return signature(kind, value), code

    return intrinsic(read)


number_bits, bits_number = _read_as(WHOLE, types.int64), _read_as(LANES, types.float64)
"""The bits of floats as integers, and the other way round."""


def looked_up(table: Any, k: Any) -> Any:
    """The entry of a table, for each lane its own."""
    return table[k]


@overload(looked_up, jit_options=OPTIONS, strict=False)
def _looked_up(_table: Any, k: Any) -> Any:
    if not varies(k):
        return lambda _table, k: _table[k]

    def each(_table: Any, k: Any) -> Any:
        found = spread(_table[lane(k, 0)])
        for at in range(1, WIDTH):
            found = put(found, at, _table[lane(k, at)])
        return found

    return each


@intrinsic
def in_any(_context: Any, mask: Any) -> Any:
    """Whether a mask is true in any lane."""

    def code(_context: Any, builder: Any, _given: Any, arguments: Any) -> Any:
        bits = builder.bitcast(arguments[0], ir.IntType(WIDTH))
        return builder.icmp_unsigned("!=", bits, ir.Constant(bits.type, 0))

    return signature(types.boolean, mask), code


@intrinsic
def bits_of(_context: Any, mask: Any) -> Any:
    """A mask as a byte."""

    def code(_context: Any, builder: Any, _given: Any, arguments: Any) -> Any:
        return builder.bitcast(arguments[0], ir.IntType(WIDTH))

    return signature(types.uint8, mask), code


@intrinsic
def mask_of(_context: Any, bits: Any) -> Any:
    """The mask of a byte."""

    def code(_context: Any, builder: Any, _given: Any, arguments: Any) -> Any:
        return builder.bitcast(arguments[0], MASK.llvm)

    return signature(MASK, types.uint8), code


def where(test: Any, one: Any, other: Any) -> Any:
    """`one` in lanes in which `test` is true, else `other`; tuples part by part."""
    return one if test else other


@overload(where, jit_options=OPTIONS, strict=False)
def _where(test: Any, one: Any, other: Any) -> Any:
    if varies(test) and test is not MASK:
        return None
    if isinstance(one, types.BaseTuple):
        parts = (f"where(test, one[{k}], other[{k}])" for k in range(len(one)))
        text = f"def chosen(test, one, other): return ({', '.join(parts)},)"
        return function_of(text, {"where": where})
    if any(isinstance(kind, Vector) for kind in (test, one, other)):
        return lambda test, one, other: _select(test, one, other)
    return lambda test, one, other: one if test else other


def both(one: Any, other: Any) -> Any:
    """`one and other`, of which both are computed."""
    return one and other


@overload(both, jit_options=OPTIONS, strict=False)
def _both(one: Any, other: Any) -> Any:
    if not (is_truth(one) and is_truth(other)):
        return None
    return lambda one, other: one & other


def either(one: Any, other: Any) -> Any:
    """`one or other`, of which both are computed."""
    return one or other


@overload(either, jit_options=OPTIONS, strict=False)
def _either(one: Any, other: Any) -> Any:
    if not (is_truth(one) and is_truth(other)):
        return None
    return lambda one, other: one | other


def negated(test: Any) -> Any:
    """`not test`."""
    return not test


@overload(negated, jit_options=OPTIONS, strict=False)
def _negated(test: Any) -> Any:
    if varies(test) and test is not MASK:
        return None
    if test is MASK:
        return lambda test: _select(test, False, True)
    return lambda test: not test


def as_float(value: Any) -> Any:
    """`float(value)`."""
    return float(value)


@overload(as_float, jit_options=OPTIONS, strict=False)
def _as_float(value: Any) -> Any:
    if varies(value):
        return lambda value: _floats_of(value)
    return lambda value: float(value)


def as_int(value: Any) -> Any:
    """`int(value)` of a truth value or an integer."""
    return int(value)


@overload(as_int, jit_options=OPTIONS, strict=False)
def _as_int(value: Any) -> Any:
    if varies(value) and value is not LANES:
        return lambda value: _whole_of(value)
    if not isinstance(value, Vector):
        return lambda value: int(value)
    return None


def as_bool(value: Any) -> Any:
    """`bool(value)`."""
    return bool(value)


@overload(as_bool, jit_options=OPTIONS, strict=False)
def _as_bool(value: Any) -> Any:
    if value is MASK:
        return lambda value: value
    if varies(value):
        return lambda value: value != 0
    return lambda value: bool(value)


def any_lane(test: Any) -> Any:
    """Whether a test is true in any lane."""
    return test


@overload(any_lane, jit_options=OPTIONS, strict=False)
def _any_lane(test: Any) -> Any:
    if isinstance(test, Vector):
        return lambda test: in_any(test)
    return lambda test: test
