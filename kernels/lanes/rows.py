"""Where the numbers of eight trials lie: a row of eight for each boid."""

import operator
from typing import Any, NamedTuple

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.datamodel import models
from numba.core.datamodel.registry import register_default
from numba.core.imputils import lower_builtin, lower_getattr
from numba.core.typing.templates import (
    AbstractTemplate,
    AttributeTemplate,
    infer_getattr,
    infer_global,
    signature,
)
from numba.extending import overload

from kernels.lanes.texts import function_of
from kernels.lanes.vectors import (
    FOUND,
    INDEX,
    LANES,
    MASK,
    OPTIONS,
    WHOLE,
    WIDTH,
    Found,
    Vector,
    intrinsic,
    lane,
    put,
    spread,
)


class Each(NamedTuple):
    """The random numbers of each lane."""

    lane_0: Any
    lane_1: Any
    lane_2: Any
    lane_3: Any
    lane_4: Any
    lane_5: Any
    lane_6: Any
    lane_7: Any


class Rows(types.Type):
    """Rows of WIDTH numbers each, which stand for an array of numbers."""

    def __init__(self, vector: Vector) -> None:
        self.vector = vector
        super().__init__(f"rows of {vector}")


ROWS = {types.float64: Rows(LANES), types.int64: Rows(WHOLE)}


@register_default(Rows)
class _RowsModel(models.StructModel):
    def __init__(self, manager: Any, kind: Rows) -> None:
        data = types.CPointer(kind.vector.number)
        super().__init__(manager, kind, [("data", data), ("size", types.intp)])


@infer_getattr
class _Attributes(AttributeTemplate):
    key = Rows

    def resolve_size(self, _kind: Rows) -> Any:
        return types.intp


@lower_getattr(Rows, "size")
def _size(context: Any, builder: Any, kind: Rows, value: Any) -> Any:
    return cgutils.create_struct_proxy(kind)(context, builder, value=value).size


@intrinsic
def rows(_context: Any, array: Any) -> Any:
    """The rows that are an array (N, WIDTH)."""
    kind = ROWS[array.dtype]

    def code(context: Any, builder: Any, given: Any, arguments: Any) -> Any:
        held = context.make_array(given.args[0])(context, builder, arguments[0])
        made = cgutils.create_struct_proxy(kind)(context, builder)
        made.data = held.data
        made.size = cgutils.unpack_tuple(builder, held.shape)[0]
        return made._getvalue()

    return signature(kind, array), code


def _place(context: Any, builder: Any, given: Any, arguments: Any) -> Any:
    """The address of a row; a place below 0 is counted from the end."""
    kind, number = given.args[:2]
    held = cgutils.create_struct_proxy(kind)(context, builder, value=arguments[0])
    index = context.cast(builder, arguments[1], number, types.int64)
    if number.signed:
        from_end = builder.add(index, held.size)
        is_negative = builder.icmp_signed("<", index, ir.Constant(index.type, 0))
        index = builder.select(is_negative, from_end, index)
    offset = builder.mul(index, ir.Constant(index.type, WIDTH), flags=("nsw",))
    first = builder.gep(held.data, [offset], inbounds=True)
    return builder.bitcast(first, kind.vector.llvm.as_pointer())


@infer_global(operator.getitem)
class _Read(AbstractTemplate):
    def generic(self, arguments: tuple[Any, ...], _named: Any) -> Any:
        kind, index = arguments
        if isinstance(kind, Rows) and isinstance(index, types.Integer):
            return signature(kind.vector, *arguments)
        return None


@lower_builtin(operator.getitem, Rows, types.Integer)
def _read(context: Any, builder: Any, given: Any, arguments: Any) -> Any:
    return builder.load(_place(context, builder, given, arguments), align=8)


@infer_global(operator.setitem)
class _Write(AbstractTemplate):
    def generic(self, arguments: tuple[Any, ...], _named: Any) -> Any:
        kind, index, _ = arguments
        if isinstance(kind, Rows) and isinstance(index, types.Integer):
            return signature(types.none, kind, index, kind.vector)
        return None


@lower_builtin(operator.setitem, Rows, types.Integer, Vector)
def _write(context: Any, builder: Any, given: Any, arguments: Any) -> Any:
    place = _place(context, builder, given, arguments)
    builder.store(arguments[2], place, align=8)
    return context.get_dummy_value()


@intrinsic
def write_turned(
    _context: Any, value: Any, first: Any, trail: Any, step: Any, field: Any
) -> Any:
    """Write WIDTH rows, from `first` on, into `trail` (WIDTH, S, F, N): what stands in
    one lane becomes neighbours in trail[lane, step, field, first:].
    """

    def code(context: Any, builder: Any, given: Any, arguments: Any) -> Any:
        begin = _place(context, builder, given, arguments)
        turned = _transposed(
            builder,
            [
                builder.load(builder.gep(begin, [INDEX(row)], inbounds=True), align=8)
                for row in range(WIDTH)
            ],
        )
        made = context.make_array(given.args[2])(context, builder, arguments[2])
        place = made.data
        strides = cgutils.unpack_tuple(builder, made.strides)
        for k, at in enumerate((3, 4, 1), 1):
            index = context.cast(builder, arguments[at], given.args[at], types.intp)
            offset = builder.mul(index, strides[k])
            place = cgutils.pointer_add(builder, place, offset, place.type)
        for row in turned:
            there = builder.bitcast(place, row.type.as_pointer())
            builder.store(row, there, align=8)
            place = cgutils.pointer_add(builder, place, strides[0], place.type)
        return context.get_dummy_value()

    return signature(types.none, value, first, trail, step, field), code


def _transposed(builder: Any, rows: list[Any]) -> list[Any]:
    """The columns of a square of numbers: its quarters are exchanged, then theirs."""
    for apart in (1, 2, 4):
        for one in range(WIDTH):
            if one & apart:
                continue
            pair = rows[one], rows[one + apart]
            for other, start in ((one, 0), (one + apart, apart)):
                places = [
                    WIDTH + k - apart + start if k & apart else k + start
                    for k in range(WIDTH)
                ]
                mask = ir.Constant(ir.VectorType(INDEX, WIDTH), places)
                rows[other] = builder.shuffle_vector(*pair, mask)
    return rows


@intrinsic
def found(_context: Any, count: Any, listed: Any, marks: Any) -> Any:
    """What a search has found: how many neighbours in each lane, how many are listed,
    and an array of masks that says in which lanes each of these is one.
    """

    def code(context: Any, builder: Any, given: Any, arguments: Any) -> Any:
        made = cgutils.create_struct_proxy(FOUND)(context, builder)
        made.count = arguments[0]
        made.listed = context.cast(builder, arguments[1], given.args[1], types.int64)
        held = context.make_array(given.args[2])(context, builder, arguments[2])
        made.marks = held.data
        return made._getvalue()

    return signature(FOUND, count, listed, marks), code


@intrinsic
def _listed(_context: Any, one: Any) -> Any:
    def code(context: Any, builder: Any, given: Any, arguments: Any) -> Any:
        kind, value = given.args[0], arguments[0]
        return cgutils.create_struct_proxy(kind)(context, builder, value=value).listed

    return signature(types.int64, one), code


@intrinsic
def _marked(_context: Any, one: Any, at: Any) -> Any:
    def code(context: Any, builder: Any, given: Any, arguments: Any) -> Any:
        kind, value = given.args[0], arguments[0]
        held = cgutils.create_struct_proxy(kind)(context, builder, value=value)
        index = context.cast(builder, arguments[1], given.args[1], types.int64)
        place = builder.gep(held.marks, [index], inbounds=True)
        return builder.bitcast(builder.load(place), MASK.llvm)

    return signature(MASK, one, at), code


def listed(one: Any) -> Any:
    """How often a loop over what was found is run."""
    return one


@overload(listed, jit_options=OPTIONS, strict=False)
def _count_listed(one: Any) -> Any:
    if isinstance(one, Found):
        return lambda one: _listed(one)
    return lambda one: one


def marked(one: Any, at: Any) -> Any:
    """The lanes in which the entry `at` of what was found counts."""
    return True


@overload(marked, jit_options=OPTIONS, strict=False)
def _mark(one: Any, at: Any) -> Any:
    if isinstance(one, Found):
        return lambda one, at: _marked(one, at)
    return lambda one, at: True


def of_lane(value: Any, at: Any) -> Any:
    """What a value is in one lane."""
    return value


@overload(of_lane, jit_options=OPTIONS, strict=False)
def _of_lane(value: Any, at: Any) -> Any:
    if isinstance(value, Vector):
        return lambda value, at: lane(value, at)
    if is_each(value):
        return lambda value, at: value[at]
    if is_named(value) and holds_lanes(value):
        parts = (
            f"{'row_of' if isinstance(kind, Stacked) else 'of_lane'}(value.{name}, at)"
            for name, kind in zip(value.fields, value.types, strict=True)
        )
        return function_of(
            f"def chosen(value, at): return Made({', '.join(parts)})",
            {"Made": value.instance_class, "of_lane": of_lane, "row_of": row_of},
        )
    return None if holds_lanes(value) else lambda value, at: value


class Stacked(types.Type):
    """An array for each lane, all in one."""

    def __init__(self, array: Any) -> None:
        self.array = array
        super().__init__(f"stacked {array}")


@register_default(Stacked)
class _StackedModel(models.StructModel):
    def __init__(self, manager: Any, kind: Stacked) -> None:
        super().__init__(manager, kind, [("array", kind.array)])


@intrinsic
def stacked(_context: Any, array: Any) -> Any:
    """The arrays (...) of the lanes, from an array (WIDTH, ...)."""
    kind = Stacked(array)

    def code(context: Any, builder: Any, _given: Any, arguments: Any) -> Any:
        made = cgutils.create_struct_proxy(kind)(context, builder)
        made.array = arguments[0]
        return made._getvalue()

    return signature(kind, array), code


@intrinsic
def row_of(_context: Any, value: Any, at: Any) -> Any:
    """The array of one lane. It is for arguments of calls only: a function without
    reference counts may return no array.
    """
    whole = value.array
    kind = whole.copy(ndim=whole.ndim - 1)

    def code(context: Any, builder: Any, given: Any, arguments: Any) -> Any:
        held = cgutils.create_struct_proxy(value)(context, builder, value=arguments[0])
        array = context.make_array(whole)(context, builder, held.array)
        index = context.cast(builder, arguments[1], given.args[1], types.intp)
        shape = cgutils.unpack_tuple(builder, array.shape)
        strides = cgutils.unpack_tuple(builder, array.strides)
        made = context.make_array(kind)(context, builder)
        context.populate_array(
            made,
            data=cgutils.pointer_add(
                builder, array.data, builder.mul(index, strides[0]), array.data.type
            ),
            shape=cgutils.pack_array(builder, shape[1:]),
            strides=cgutils.pack_array(builder, strides[1:]),
            itemsize=array.itemsize,
            meminfo=None,
            parent=None,
        )
        return made._getvalue()

    return signature(kind, value, at), code


def stack_all(value: Any) -> Any:
    """A named tuple whose arrays are those of the lanes."""
    return value


@overload(stack_all, jit_options=OPTIONS, strict=False)
def _stack_all(value: Any) -> Any:
    parts = (
        f"stacked(value.{name})" if isinstance(kind, types.Array) else f"value.{name}"
        for name, kind in zip(value.fields, value.types, strict=True)
    )
    return function_of(
        f"def chosen(value): return Made({', '.join(parts)})",
        {"Made": value.instance_class, "stacked": stacked},
    )


def is_each(kind: Any) -> bool:
    """Whether a type is that of something which each lane has for itself and which is
    no number.
    """
    if isinstance(kind, Stacked):
        return True
    return isinstance(kind, types.NamedUniTuple) and kind.instance_class is Each


def holds_lanes(kind: Any) -> bool:
    """Whether a type holds anything that each lane has for itself."""
    if is_each(kind) or isinstance(kind, Vector | Found | Rows):
        return True
    return is_tuple(kind) and any(map(holds_lanes, kind.types))


def is_tuple(kind: Any) -> bool:
    """Whether a type is that of a tuple, whose `types` are those of its members."""
    return isinstance(kind, types.BaseTuple)


def is_named(kind: Any) -> bool:
    """Whether a type is that of a named tuple, which has `fields` too."""
    return isinstance(kind, types.BaseNamedTuple)


def spread_all(value: Any) -> Any:
    """A number, or each of a tuple, in all lanes."""
    return value


@overload(spread_all, jit_options=OPTIONS, strict=False)
def _spread_all(value: Any) -> Any:
    if is_tuple(value):
        parts = (f"spread_all(value[{k}])" for k in range(len(value)))
        text = f"def chosen(value): return ({', '.join(parts)},)"
        return function_of(text, {"spread_all": spread_all})
    return lambda value: spread(value)


def put_all(result: Any, at: Any, value: Any) -> Any:
    """`result` with another number, or other ones of a tuple, in the lane `at`."""
    return value


@overload(put_all, jit_options=OPTIONS, strict=False)
def _put_all(result: Any, at: Any, value: Any) -> Any:
    if is_tuple(value):
        parts = (f"put_all(result[{k}], at, value[{k}])" for k in range(len(value)))
        text = f"def chosen(result, at, value): return ({', '.join(parts)},)"
        return function_of(text, {"put_all": put_all})
    return lambda result, at, value: put(result, at, value)
