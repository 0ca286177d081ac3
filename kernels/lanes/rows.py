"""Memory of the numbers of eight trials: a row of eight numbers per boid."""

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
    """Random number generators of the lanes."""

    lane_0: Any
    lane_1: Any
    lane_2: Any
    lane_3: Any
    lane_4: Any
    lane_5: Any
    lane_6: Any
    lane_7: Any


class Rows(types.Type):
    """Type of rows of WIDTH numbers each, used in place of an array of numbers."""

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
        """Return the type of the number of rows."""
        return types.intp


@lower_getattr(Rows, "size")
def _size(context: Any, builder: Any, kind: Rows, value: Any) -> Any:
    return cgutils.create_struct_proxy(kind)(context, builder, value=value).size


@intrinsic
def rows(_context: Any, array: Any) -> Any:
    """Return an array (N, WIDTH) as rows."""
    kind = ROWS[array.dtype]

    def code(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        held = context.make_array(sig.args[0])(context, builder, arguments[0])
        proxy = cgutils.create_struct_proxy(kind)(context, builder)
        proxy.data = held.data
        proxy.size = cgutils.unpack_tuple(builder, held.shape)[0]
        return proxy._getvalue()

    return signature(kind, array), code


def _place(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
    """Return the address of a row; an index below 0 counts from the end."""
    kind, number = sig.args[:2]
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
        """Return the signature of a read of rows; None for a read of another type.

        Parameters
        ----------
        arguments : tuple of type
        _named : dict of type
            Arguments with names, which are not used.
        """
        kind, index = arguments
        if isinstance(kind, Rows) and isinstance(index, types.Integer):
            return signature(kind.vector, *arguments)
        return None


@lower_builtin(operator.getitem, Rows, types.Integer)
def _read(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
    return builder.load(_place(context, builder, sig, arguments), align=8)


@infer_global(operator.setitem)
class _Write(AbstractTemplate):
    def generic(self, arguments: tuple[Any, ...], _named: Any) -> Any:
        """Return the signature of a write to rows; None for a write to another type.

        Parameters
        ----------
        arguments : tuple of type
        _named : dict of type
            Arguments with names, which are not used.
        """
        kind, index, _ = arguments
        if isinstance(kind, Rows) and isinstance(index, types.Integer):
            return signature(types.none, kind, index, kind.vector)
        return None


@lower_builtin(operator.setitem, Rows, types.Integer, Vector)
def _write(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
    place = _place(context, builder, sig, arguments)
    builder.store(arguments[2], place, align=8)
    return context.get_dummy_value()


@intrinsic
def write_turned(
    _context: Any, value: Any, first: Any, trail: Any, step: Any, field: Any
) -> Any:
    """Write WIDTH rows, transposed, into a trail.

    Numbers of a lane become adjacent in ``trail[lane, step, field, first:]``.

    Parameters
    ----------
    _context : numba context
    value : Rows
    first : int
        Index of the first row.
    trail : array (WIDTH, S, F, N) of float
    step : int
    field : int
    """

    def code(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        begin = _place(context, builder, sig, arguments)
        turned = _transposed(
            builder,
            [
                builder.load(builder.gep(begin, [INDEX(row)], inbounds=True), align=8)
                for row in range(WIDTH)
            ],
        )
        array = context.make_array(sig.args[2])(context, builder, arguments[2])
        place = array.data
        strides = cgutils.unpack_tuple(builder, array.strides)
        for k, at in enumerate((3, 4, 1), 1):
            index = context.cast(builder, arguments[at], sig.args[at], types.intp)
            offset = builder.mul(index, strides[k])
            place = cgutils.pointer_add(builder, place, offset, place.type)
        for row in turned:
            address = builder.bitcast(place, row.type.as_pointer())
            builder.store(row, address, align=8)
            place = cgutils.pointer_add(builder, place, strides[0], place.type)
        return context.get_dummy_value()

    return signature(types.none, *(value, first, trail, step, field)), code


def _transposed(builder: Any, rows: list[Any]) -> list[Any]:
    """Return the columns of a square of numbers.

    The function exchanges quarters of the square, then quarters of each quarter.
    """
    for apart in (1, 2, 4):
        for first in range(WIDTH):
            if first & apart:
                continue
            pair = rows[first], rows[first + apart]
            for row, start in ((first, 0), (first + apart, apart)):
                places = [
                    WIDTH + k - apart + start if k & apart else k + start
                    for k in range(WIDTH)
                ]
                mask = ir.Constant(ir.VectorType(INDEX, WIDTH), places)
                rows[row] = builder.shuffle_vector(*pair, mask)
    return rows


@intrinsic
def found(_context: Any, count: Any, listed: Any, marks: Any) -> Any:
    """Return the result of a search for the neighbours of a boid.

    Parameters
    ----------
    _context : numba context
    count : Vector of int
        Number of neighbours in each lane.
    listed : int
        Number of boids that are neighbours in any lane.
    marks : array of uint8
        Lanes in which each listed boid is a neighbour, as bits.
    """

    def code(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        proxy = cgutils.create_struct_proxy(FOUND)(context, builder)
        proxy.count = arguments[0]
        proxy.listed = context.cast(builder, arguments[1], sig.args[1], types.int64)
        held = context.make_array(sig.args[2])(context, builder, arguments[2])
        proxy.marks = held.data
        return proxy._getvalue()

    return signature(FOUND, count, listed, marks), code


@intrinsic
def _listed(_context: Any, neighbours: Any) -> Any:
    def code(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        kind = sig.args[0]
        value = arguments[0]
        return cgutils.create_struct_proxy(kind)(context, builder, value=value).listed

    return signature(types.int64, neighbours), code


@intrinsic
def _marked(_context: Any, neighbours: Any, at: Any) -> Any:
    def code(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        kind = sig.args[0]
        value = arguments[0]
        held = cgutils.create_struct_proxy(kind)(context, builder, value=value)
        index = context.cast(builder, arguments[1], sig.args[1], types.int64)
        place = builder.gep(held.marks, [index], inbounds=True)
        return builder.bitcast(builder.load(place), MASK.llvm)

    return signature(MASK, neighbours, at), code


def listed(neighbours: Any) -> Any:
    """Return the number of turns of a loop over neighbours."""
    return neighbours


@overload(listed, jit_options=OPTIONS, strict=False)
def _count_listed(neighbours: Any) -> Any:
    if isinstance(neighbours, Found):
        return lambda neighbours: _listed(neighbours)
    return lambda neighbours: neighbours


def marked(neighbours: Any, at: Any) -> Any:
    """Return the lanes in which entry `at` of the list is a neighbour."""
    return True


@overload(marked, jit_options=OPTIONS, strict=False)
def _mark(neighbours: Any, at: Any) -> Any:
    if isinstance(neighbours, Found):
        return lambda neighbours, at: _marked(neighbours, at)
    return lambda neighbours, at: True


def of_lane(value: Any, at: Any) -> Any:
    """Return the part of a value that belongs to one lane."""
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
    """Type of one array that holds an array per lane."""

    def __init__(self, array: Any) -> None:
        self.array = array
        super().__init__(f"stacked {array}")


@register_default(Stacked)
class _StackedModel(models.StructModel):
    def __init__(self, manager: Any, kind: Stacked) -> None:
        super().__init__(manager, kind, [("array", kind.array)])


@intrinsic
def stacked(_context: Any, array: Any) -> Any:
    """Return an array (WIDTH, ...) as the arrays (...) of the lanes."""
    kind = Stacked(array)

    def code(context: Any, builder: Any, _sig: Any, arguments: Any) -> Any:
        proxy = cgutils.create_struct_proxy(kind)(context, builder)
        proxy.array = arguments[0]
        return proxy._getvalue()

    return signature(kind, array), code


@intrinsic
def row_of(_context: Any, value: Any, at: Any) -> Any:
    """Return the array of one lane.

    Use the result as an argument of a call only: a function without reference counts
    cannot return an array.

    Parameters
    ----------
    _context : numba context
    value : Stacked
    at : int
        Index of the lane.
    """
    array_kind = value.array
    kind = array_kind.copy(ndim=array_kind.ndim - 1)

    def code(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        held = cgutils.create_struct_proxy(value)(context, builder, value=arguments[0])
        array = context.make_array(array_kind)(context, builder, held.array)
        index = context.cast(builder, arguments[1], sig.args[1], types.intp)
        shape = cgutils.unpack_tuple(builder, array.shape)
        strides = cgutils.unpack_tuple(builder, array.strides)
        row = context.make_array(kind)(context, builder)
        context.populate_array(
            row,
            data=cgutils.pointer_add(
                builder, array.data, builder.mul(index, strides[0]), array.data.type
            ),
            shape=cgutils.pack_array(builder, shape[1:]),
            strides=cgutils.pack_array(builder, strides[1:]),
            itemsize=array.itemsize,
            meminfo=None,
            parent=None,
        )
        return row._getvalue()

    return signature(kind, value, at), code


def stack_all(value: Any) -> Any:
    """Return a named tuple with the arrays of the lanes in place of arrays."""
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
    """Return whether a type is the type of an object per lane that is not a number."""
    if isinstance(kind, Stacked):
        return True
    return isinstance(kind, types.NamedUniTuple) and kind.instance_class is Each


def holds_lanes(kind: Any) -> bool:
    """Return whether a type holds numbers or objects per lane."""
    if is_each(kind) or isinstance(kind, Vector | Found | Rows):
        return True
    return is_tuple(kind) and any(map(holds_lanes, kind.types))


def is_tuple(kind: Any) -> bool:
    """Return whether a type is the type of a tuple, with the `types` of the members."""
    return isinstance(kind, types.BaseTuple)


def is_named(kind: Any) -> bool:
    """Return whether a type is the type of a named tuple, which also has `fields`."""
    return isinstance(kind, types.BaseNamedTuple)


def spread_all(value: Any) -> Any:
    """Return a number, or each number of a tuple, in all lanes."""
    return value


@overload(spread_all, jit_options=OPTIONS, strict=False)
def _spread_all(value: Any) -> Any:
    if is_tuple(value):
        parts = (f"spread_all(value[{k}])" for k in range(len(value)))
        text = f"def chosen(value): return ({', '.join(parts)},)"
        return function_of(text, {"spread_all": spread_all})
    return lambda value: spread(value)


def put_all(result: Any, at: Any, value: Any) -> Any:
    """Return numbers with replaced numbers in one lane.

    Parameters
    ----------
    result : Vector or tuple
    at : int
        Index of the lane.
    value : number or tuple
        New numbers of the lane.
    """
    return value


@overload(put_all, jit_options=OPTIONS, strict=False)
def _put_all(result: Any, at: Any, value: Any) -> Any:
    if is_tuple(value):
        parts = (f"put_all(result[{k}], at, value[{k}])" for k in range(len(value)))
        text = f"def chosen(result, at, value): return ({', '.join(parts)},)"
        return function_of(text, {"put_all": put_all})
    return lambda result, at, value: put(result, at, value)
