"""Who sees whom, in lanes: everybody is asked, first roughly and then exactly.

Trials have their boids at different places, so no grid serves several. The rough answer
comes from places in single precision, two boids in eight trials at a time. It is never
wrong about a neighbour: its bound is wider than the rounding, and a place that is too
far away to be told apart counts as near.
"""

import math
from typing import Any, NamedTuple

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.datamodel import models
from numba.core.datamodel.registry import register_default
from numba.core.typing.templates import signature
from numpy.typing import NDArray

from kernels import neighbours
from kernels.lanes.conversion import converted
from kernels.lanes.rows import found
from kernels.lanes.vectors import (
    LANES,
    OPTIONS,
    WIDTH,
    any_lane,
    bits_of,
    intrinsic,
    spread,
    where,
)
from kernels.neighbours import ALL_ROUND, Gaze
from kernels.state import aligned

piece = numba.njit(**OPTIONS)
look = converted(neighbours._look)

FARTHEST = 1000.0
"""Places up to so many times the range are told apart: in single precision two of them
are off by less than ROUNDING times the range.
"""
ROUNDING, WIDER = 3e-4, 1.001
"""How much further a rough look goes: a part of the range of the grid, and of its own.
"""
OFF = 2e-3
"""More than s|s| and view |d|^2 |h|^2 of `kernels.neighbours.search` together are off
in single precision, a part of range^2 |h|^2. The ROUNDING of d makes 0.0013 of it.
"""
LEAST = 1e-36
"""Squares below have fewer digits in single precision, and count as near."""
HALF, PAIR = (ir.VectorType(ir.FloatType(), size) for size in (WIDTH, 2 * WIDTH))


class Places(NamedTuple):
    """Where boids are in single precision, in the place of a Grid: `x` and `y` (N + 1,
    WIDTH), which are no numbers beyond `farthest`; and `close` (N + 1,), the lanes in
    which each may be near.
    """

    x: NDArray[np.float32]
    y: NDArray[np.float32]
    close: NDArray[np.uint8]
    reach: float
    farthest: float


def build_places(n: int, reach: float) -> Places:
    """Room for the places of `n` boids that search up to `reach`."""
    x, y = (aligned((n + 1, WIDTH), np.float32) for _ in "xy")
    x[:], y[:] = np.nan, np.nan
    return Places(x, y, np.zeros(n + 1, np.uint8), reach, FARTHEST * reach)


class _TwoRows(types.Type):
    """Two rows of places, for two boids."""

    def __init__(self) -> None:
        super().__init__("two rows of places")


PAIRS = _TwoRows()


@register_default(_TwoRows)
class _TwoRowsModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: _TwoRows) -> None:
        super().__init__(manager, kind, PAIR)


def _row(context: Any, builder: Any, given: Any, arguments: Any, kind: Any) -> Any:
    """The address of a row of single precision, for a vector of `kind`."""
    array = context.make_array(given.args[0])(context, builder, arguments[0])
    row = context.cast(builder, arguments[1], given.args[1], types.int64)
    first = builder.mul(row, ir.Constant(row.type, WIDTH))
    there = builder.gep(array.data, [first], inbounds=True)
    return builder.bitcast(there, kind.as_pointer())


@intrinsic
def put_place(_context: Any, rows: Any, row: Any, place: Any, farthest: Any) -> Any:
    """Write places in single precision, not a number where they are too far."""

    def code(context: Any, builder: Any, given: Any, arguments: Any) -> Any:
        wide = context.cast(builder, arguments[2], given.args[2], LANES)
        most = context.cast(builder, arguments[3], given.args[3], LANES)
        length = intrinsic_of(builder, "fabs", f"v{WIDTH}f64", wide)
        near = builder.fcmp_ordered("<=", length, most)
        nothing = ir.Constant(HALF, [float("nan")] * WIDTH)
        value = builder.select(near, builder.fptrunc(wide, HALF), nothing)
        builder.store(value, _row(context, builder, given, arguments, HALF), align=4)
        return context.get_dummy_value()

    return signature(types.none, rows, row, place, farthest), code


@intrinsic
def twice(_context: Any, rows: Any, row: Any) -> Any:
    """A row of places, for a comparison with two others."""

    def code(context: Any, builder: Any, given: Any, arguments: Any) -> Any:
        place = _row(context, builder, given, arguments, HALF)
        return _doubled(builder, builder.load(place, align=4))

    return signature(PAIRS, rows, row), code


@intrinsic
def way(_context: Any, rows: Any, row: Any, start: Any) -> Any:
    """From places to those in a row and the next one, in single precision."""

    def code(context: Any, builder: Any, given: Any, arguments: Any) -> Any:
        there = builder.load(_row(context, builder, given, arguments, PAIR), align=4)
        return builder.fsub(there, arguments[2])

    return signature(PAIRS, rows, row, start), code


@intrinsic
def shorter(_context: Any, way: Any, period: Any) -> Any:
    """The same ways where the world is a torus, the short way round."""

    def code(context: Any, builder: Any, given: Any, arguments: Any) -> Any:
        length = intrinsic_of(builder, "fabs", f"v{2 * WIDTH}f32", arguments[0])
        whole = single(context, builder, given.args[1], arguments[1])
        other = builder.fsub(whole, length)
        other = intrinsic_of(builder, "fabs", f"v{2 * WIDTH}f32", other)
        return builder.select(builder.fcmp_ordered("<", other, length), other, length)

    return signature(PAIRS, way, period), code


@intrinsic
def twice_single(_context: Any, value: Any) -> Any:
    """Numbers of all lanes in single precision, for a comparison with two boids."""

    def code(context: Any, builder: Any, given: Any, arguments: Any) -> Any:
        wide = context.cast(builder, arguments[0], given.args[0], LANES)
        return _doubled(builder, builder.fptrunc(wide, HALF))

    return signature(PAIRS, value), code


@intrinsic
def note_close(_context: Any, close: Any, at: Any, x: Any, y: Any, bound: Any) -> Any:
    """Note in which lanes ways (x, y) are no longer than the root of `bound`, or are
    not known, for two boids.
    """

    def code(context: Any, builder: Any, given: Any, arguments: Any) -> Any:
        x, y = arguments[2:4]
        square = _fused(builder, x, x, builder.fmul(y, y))
        most = single(context, builder, given.args[4], arguments[4])
        mask = builder.fcmp_unordered("<=", square, most)
        _note(context, builder, given, arguments, mask)
        return context.get_dummy_value()

    return signature(types.none, close, at, x, y, bound), code


@intrinsic
def note_seen(
    _context: Any, close: Any, at: Any, x: Any, y: Any, bound: Any, beam: Any
) -> Any:
    """As `note_close`, but only lanes in which they may be in the cone of `beam`."""

    def code(context: Any, builder: Any, given: Any, arguments: Any) -> Any:
        x, y = arguments[2:4]
        ahead_x, ahead_y, cone, slack = cgutils.unpack_tuple(builder, arguments[5])
        square = _fused(builder, x, x, builder.fmul(y, y))
        along = _fused(builder, x, ahead_x, builder.fmul(y, ahead_y))
        length = intrinsic_of(builder, "fabs", f"v{2 * WIDTH}f32", along)
        ahead = _fused(builder, along, length, slack)
        most = single(context, builder, given.args[4], arguments[4])
        mask = builder.and_(
            builder.fcmp_unordered("<=", square, most),
            builder.fcmp_unordered(">=", ahead, builder.fmul(cone, square)),
        )
        _note(context, builder, given, arguments, mask)
        return context.get_dummy_value()

    return signature(types.none, close, at, x, y, bound, beam), code


def _note(context: Any, builder: Any, given: Any, arguments: Any, mask: Any) -> None:
    """Write the mask of two boids into an array of masks."""
    array = context.make_array(given.args[0])(context, builder, arguments[0])
    index = context.cast(builder, arguments[1], given.args[1], types.int64)
    both = ir.IntType(2 * WIDTH)
    there = builder.bitcast(
        builder.gep(array.data, [index], inbounds=True), both.as_pointer()
    )
    builder.store(builder.bitcast(mask, both), there, align=1)


def _doubled(builder: Any, half: Any) -> Any:
    """Numbers of all lanes, for each of two boids."""
    lanes = [*range(WIDTH), *range(WIDTH)]
    order = ir.Constant(ir.VectorType(ir.IntType(32), 2 * WIDTH), lanes)
    return builder.shuffle_vector(half, half, order)


def _fused(builder: Any, one: Any, other: Any, more: Any) -> Any:
    """one * other + more, rounded once where the processor is faster so."""
    function = cgutils.get_or_insert_function(
        builder.module,
        ir.FunctionType(PAIR, [PAIR] * 3),
        f"llvm.fmuladd.v{2 * WIDTH}f32",
    )
    return builder.call(function, [one, other, more])


def intrinsic_of(builder: Any, name: str, kind: str, value: Any) -> Any:
    """The result of a function that LLVM has."""
    about = ir.FunctionType(value.type, [value.type])
    function = cgutils.get_or_insert_function(
        builder.module, about, f"llvm.{name}.{kind}"
    )
    return builder.call(function, [value])


def single(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    """A number in single precision, in all places of a PAIR."""
    number = context.cast(builder, value, kind, types.float64)
    narrow = builder.fptrunc(number, ir.FloatType())
    nothing = ir.Constant(PAIR, ir.Undefined)
    first = builder.insert_element(nothing, narrow, ir.Constant(ir.IntType(32), 0))
    everywhere = ir.Constant(ir.VectorType(ir.IntType(32), 2 * WIDTH), [0] * 2 * WIDTH)
    return builder.shuffle_vector(first, nothing, everywhere)


@piece
def look_roughly(world: Any, places: Any, i: Any, gaze: Any, view: Any, n: Any) -> None:
    """Note who of `n` may be a neighbour of boid `i`, by its gaze and its cone."""
    farther = WIDER * math.sqrt(gaze.range2) + ROUNDING * places.reach
    bound = farther * farther + LEAST
    x, y = twice(places.x, i), twice(places.y, i)
    if world.minimum_image:
        for j in range(0, n, 2):
            dx = shorter(way(places.x, j, x), world.width)
            dy = shorter(way(places.y, j, y), world.height)
            note_close(places.close, j, dx, dy, bound)
    elif any_lane(view > ALL_ROUND):
        beam = _beam(gaze, max(farther, places.reach))
        for j in range(0, n, 2):
            dx, dy = way(places.x, j, x), way(places.y, j, y)
            note_seen(places.close, j, dx, dy, bound, beam)
    else:
        for j in range(0, n, 2):
            dx, dy = way(places.x, j, x), way(places.y, j, y)
            note_close(places.close, j, dx, dy, bound)


@piece
def _beam(gaze: Any, farthest: Any) -> Any:
    """The vector ahead, the bound of the cone, and by how much a comparison of both may
    be off, in single precision, for ways of at most `farthest`.
    """
    square = spread(gaze.ahead_x * gaze.ahead_x + gaze.ahead_y * gaze.ahead_y)
    slack = (OFF * farthest * farthest + LEAST) * square + LEAST
    return (
        twice_single(gaze.ahead_x),
        twice_single(gaze.ahead_y),
        twice_single(gaze.bound),
        twice_single(where(square >= LEAST, slack, math.inf)),
    )


@piece
def search(
    seen: Any,
    world: Any,
    places: Any,
    i: Any,
    range2: Any,
    view: Any,
    ahead_x: Any,
    ahead_y: Any,
    near: Any,
) -> Any:
    """kernels.neighbours.search in all lanes: those who may be a neighbour in any lane,
    and in which they are.
    """
    bound = view * (ahead_x * ahead_x + ahead_y * ahead_y)
    gaze = Gaze(range2, bound, ahead_x, ahead_y, seen.x[i], seen.y[i])
    n = seen.x.size
    look_roughly(world, places, i, gaze, view, n)
    places.close[i] = 0
    listed, count = 0, spread(0)
    for j in range(n):
        near.boid[listed] = j
        listed += int(places.close[j] != 0)
    # Each store has a place that the processor knows early: otherwise all reads wait.
    for k in range(listed):
        near.dx[k], near.dy[k], near.distance2[k], is_near = look(
            seen, world, near.boid[k], gaze
        )
        near.mark[k] = bits_of(is_near)
        count = count + is_near
    return found(count, listed, near.mark)


@piece
def move(places: Any, i: Any, x: Any, y: Any) -> None:
    """Tell where boid `i` is now."""
    put_place(places.x, i, x, places.farthest)
    put_place(places.y, i, y, places.farthest)


@piece
def move_all(places: Any, flock: Any) -> None:
    """Tell where all boids are now."""
    for i in range(flock.x.size):
        move(places, i, flock.x[i], flock.y[i])
