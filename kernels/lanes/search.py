"""The search for neighbours in lanes: among all boids, first roughly and then exactly.

Boids of different trials have different positions, so trials cannot share a grid. The
rough search uses positions in single precision, and tests two boids in eight trials at
a time. The rough search misses no neighbour: the bound includes a margin above rounding
errors, and a position that is too far away to be resolved counts as near.
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
"""Multiple of the range up to which positions are resolved.

In single precision, the error of the difference of two positions is less than ROUNDING
times the range.
"""
ROUNDING = 3e-4
"""Margin of the rough search, as a fraction of the range of the grid."""
WIDER = 1.001
"""Factor by which the rough search extends the range."""
OFF = 2e-3
"""Error of s|s| and view |d|^2 |h|^2 together, as a fraction of range^2 |h|^2.

The comparison is the comparison of `kernels.neighbours.search`, in single precision.
The ROUNDING of d accounts for 0.0013.
"""
LEAST = 1e-36
"""Limit below which squares lose digits in single precision, and count as near."""
HALF, PAIR = (ir.VectorType(ir.FloatType(), size) for size in (WIDTH, 2 * WIDTH))


class Places(NamedTuple):
    """Positions of boids in single precision, used in lanes instead of a Grid.

    `x` and `y` (N + 1, WIDTH) are NaN beyond `farthest`. `close` (N + 1,) has the lanes
    in which each boid may be near, as bits. `reach` is the maximum range of a search.
    """

    x: NDArray[np.float32]
    y: NDArray[np.float32]
    close: NDArray[np.uint8]
    reach: float
    farthest: float


def build_places(n: int, reach: float) -> Places:
    """Return memory for the positions of `n` boids that search up to `reach`."""
    x, y = (aligned((n + 1, WIDTH), np.float32) for _ in "xy")
    x[:] = np.nan
    y[:] = np.nan
    close = np.zeros(n + 1, np.uint8)
    return Places(x, y, close, reach, farthest=FARTHEST * reach)


class _TwoRows(types.Type):
    """Type of two rows of positions, for two boids."""

    def __init__(self) -> None:
        super().__init__("two rows of places")


PAIRS = _TwoRows()


@register_default(_TwoRows)
class _TwoRowsModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: _TwoRows) -> None:
        super().__init__(manager, kind, PAIR)


def _row(context: Any, builder: Any, sig: Any, arguments: Any, kind: Any) -> Any:
    """Return the address of a row of single precision, for a vector of `kind`."""
    array = context.make_array(sig.args[0])(context, builder, arguments[0])
    row = context.cast(builder, arguments[1], sig.args[1], types.int64)
    first = builder.mul(row, ir.Constant(row.type, WIDTH))
    address = builder.gep(array.data, [first], inbounds=True)
    return builder.bitcast(address, kind.as_pointer())


@intrinsic
def put_place(_context: Any, rows: Any, row: Any, place: Any, farthest: Any) -> Any:
    """Write positions in single precision, NaN for positions beyond `farthest`.

    Parameters
    ----------
    _context : numba context
    rows : array (N + 1, WIDTH) of float32
    row : int
        Index of the boid.
    place : Vector
        Coordinate of the boid in each lane.
    farthest : float
        Largest coordinate that is kept.
    """

    def code(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        wide = context.cast(builder, arguments[2], sig.args[2], LANES)
        most = context.cast(builder, arguments[3], sig.args[3], LANES)
        length = intrinsic_of(builder, "fabs", f"v{WIDTH}f64", wide)
        near = builder.fcmp_ordered("<=", length, most)
        nothing = ir.Constant(HALF, [float("nan")] * WIDTH)
        value = builder.select(near, builder.fptrunc(wide, HALF), nothing)
        builder.store(value, _row(context, builder, sig, arguments, kind=HALF), align=4)
        return context.get_dummy_value()

    return signature(types.none, *(rows, row, place, farthest)), code


@intrinsic
def twice(_context: Any, rows: Any, row: Any) -> Any:
    """Return a row of positions, for a comparison with two further rows.

    Parameters
    ----------
    _context : numba context
    rows : array (N + 1, WIDTH) of float32
    row : int
        Index of the boid.
    """

    def code(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        place = _row(context, builder, sig, arguments, kind=HALF)
        return _doubled(builder, builder.load(place, align=4))

    return signature(PAIRS, rows, row), code


@intrinsic
def way(_context: Any, rows: Any, row: Any, start: Any) -> Any:
    """Return the vectors to a boid and the next boid, in single precision.

    Parameters
    ----------
    _context : numba context
    rows : array (N + 1, WIDTH) of float32
    row : int
        Index of the first of the two boids.
    start : pair of rows
        Coordinate from which the vectors begin, from `twice`.
    """

    def code(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        ends = builder.load(_row(context, builder, sig, arguments, kind=PAIR), align=4)
        return builder.fsub(ends, arguments[2])

    return signature(PAIRS, rows, row, start), code


@intrinsic
def shorter(_context: Any, way: Any, period: Any) -> Any:
    """Return the absolute components of the shortest vectors in a periodic world.

    Parameters
    ----------
    _context : numba context
    way : pair of rows
        Components of vectors, from `way`.
    period : float
        Size of the world in this direction.
    """

    def code(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        length = intrinsic_of(builder, "fabs", f"v{2 * WIDTH}f32", arguments[0])
        size = single(context, builder, sig.args[1], arguments[1])
        round_the_world = builder.fsub(size, length)
        kind = f"v{2 * WIDTH}f32"
        opposite = intrinsic_of(builder, "fabs", kind, round_the_world)
        is_shorter = builder.fcmp_ordered("<", opposite, length)
        return builder.select(is_shorter, opposite, length)

    return signature(PAIRS, way, period), code


@intrinsic
def twice_single(_context: Any, value: Any) -> Any:
    """Return numbers in single precision, for a comparison with two boids."""

    def code(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        wide = context.cast(builder, arguments[0], sig.args[0], LANES)
        return _doubled(builder, builder.fptrunc(wide, HALF))

    return signature(PAIRS, value), code


@intrinsic
def note_close(_context: Any, close: Any, at: Any, x: Any, y: Any, bound: Any) -> Any:
    """Note the lanes in which two boids may be within a range.

    In these lanes, vectors (x, y) are short enough, or NaN.

    Parameters
    ----------
    _context : numba context
    close : array (N + 1,) of uint8
        Lanes of each boid.
    at : int
        Index of the first of the two boids.
    x : pair of rows
    y : pair of rows
    bound : float
        Square of the range.
    """

    def code(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        x, y = arguments[2:4]
        square = _fused(builder, x, x, builder.fmul(y, y))
        most = single(context, builder, sig.args[4], arguments[4])
        mask = builder.fcmp_unordered("<=", square, most)
        _note(context, builder, sig, arguments, mask=mask)
        return context.get_dummy_value()

    return signature(types.none, *(close, at, x, y, bound)), code


@intrinsic
def note_seen(
    _context: Any, close: Any, at: Any, x: Any, y: Any, bound: Any, beam: Any
) -> Any:
    """Note the lanes in which two boids may be within a range and a cone.

    Parameters
    ----------
    _context : numba context
    close : array (N + 1,) of uint8
        Lanes of each boid.
    at : int
        Index of the first of the two boids.
    x : pair of rows
    y : pair of rows
    bound : float
        Square of the range.
    beam : tuple
        The cone, from `_beam`.
    """

    def code(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        x, y = arguments[2:4]
        ahead_x, ahead_y, cone, slack = cgutils.unpack_tuple(builder, arguments[5])
        square = _fused(builder, x, x, builder.fmul(y, y))
        along = _fused(builder, x, ahead_x, builder.fmul(y, ahead_y))
        length = intrinsic_of(builder, "fabs", f"v{2 * WIDTH}f32", along)
        ahead = _fused(builder, along, length, slack)
        most = single(context, builder, sig.args[4], arguments[4])
        mask = builder.and_(
            builder.fcmp_unordered("<=", square, most),
            builder.fcmp_unordered(">=", ahead, builder.fmul(cone, square)),
        )
        _note(context, builder, sig, arguments, mask=mask)
        return context.get_dummy_value()

    return signature(types.none, *(close, at, x, y, bound, beam)), code


def _note(context: Any, builder: Any, sig: Any, arguments: Any, mask: Any) -> None:
    """Write the mask of two boids into an array of masks."""
    array = context.make_array(sig.args[0])(context, builder, arguments[0])
    index = context.cast(builder, arguments[1], sig.args[1], types.int64)
    both = ir.IntType(2 * WIDTH)
    address = builder.bitcast(
        builder.gep(array.data, [index], inbounds=True), both.as_pointer()
    )
    builder.store(builder.bitcast(mask, both), address, align=1)


def _doubled(builder: Any, half: Any) -> Any:
    """Return numbers of all lanes, for each of two boids."""
    lanes = [*range(WIDTH), *range(WIDTH)]
    order = ir.Constant(ir.VectorType(ir.IntType(32), 2 * WIDTH), lanes)
    return builder.shuffle_vector(half, half, order)


def _fused(builder: Any, first: Any, second: Any, addend: Any) -> Any:
    """Return first * second + addend, rounded once if a fused operation is faster."""
    function = cgutils.get_or_insert_function(
        builder.module,
        ir.FunctionType(PAIR, [PAIR] * 3),
        f"llvm.fmuladd.v{2 * WIDTH}f32",
    )
    return builder.call(function, [first, second, addend])


def intrinsic_of(builder: Any, name: str, kind: str, value: Any) -> Any:
    """Return the call of a function of LLVM.

    Parameters
    ----------
    builder : llvmlite builder
    name : str
        Name of the function, for example ``"fabs"``.
    kind : str
        LLVM's name of the type, for example ``"v8f64"``.
    value : llvmlite value
    """
    function_type = ir.FunctionType(value.type, [value.type])
    function = cgutils.get_or_insert_function(
        builder.module, function_type, f"llvm.{name}.{kind}"
    )
    return builder.call(function, [value])


def single(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    """Return a number in single precision, in all lanes of a PAIR.

    Parameters
    ----------
    context : numba context
    builder : llvmlite builder
    kind : type
        numba's type of the number.
    value : llvmlite value
    """
    number = context.cast(builder, value, kind, types.float64)
    narrow = builder.fptrunc(number, ir.FloatType())
    nothing = ir.Constant(PAIR, ir.Undefined)
    first = builder.insert_element(nothing, narrow, ir.Constant(ir.IntType(32), 0))
    everywhere = ir.Constant(ir.VectorType(ir.IntType(32), 2 * WIDTH), [0] * 2 * WIDTH)
    return builder.shuffle_vector(first, nothing, everywhere)


@piece
def look_roughly(world: Any, places: Any, i: Any, gaze: Any, view: Any, n: Any) -> None:
    """Note the boids that may be neighbours of a boid.

    Parameters
    ----------
    world : World
    places : Places
        `close` is written.
    i : int
        Index of the boid.
    gaze : Gaze
        Range and cone of the boid in each lane.
    view : Vector or float
        Bound of the cone, see `kernels.neighbours.cone`.
    n : int
        Number of boids.
    """
    farther = WIDER * math.sqrt(gaze.range2) + ROUNDING * places.reach
    bound = farther * farther + LEAST
    x = twice(places.x, i)
    y = twice(places.y, i)
    if world.minimum_image:
        for j in range(0, n, 2):
            dx = shorter(way(places.x, j, x), world.width)
            dy = shorter(way(places.y, j, y), world.height)
            note_close(places.close, j, dx, dy, bound=bound)
    elif any_lane(view > ALL_ROUND):
        beam = _beam(gaze, max(farther, places.reach))
        for j in range(0, n, 2):
            dx = way(places.x, j, x)
            dy = way(places.y, j, y)
            note_seen(places.close, j, dx, dy, bound=bound, beam=beam)
    else:
        for j in range(0, n, 2):
            dx = way(places.x, j, x)
            dy = way(places.y, j, y)
            note_close(places.close, j, dx, dy, bound=bound)


@piece
def _beam(gaze: Any, farthest: Any) -> Any:
    """Return a cone in single precision, for vectors of at most `farthest`.

    The result has the vector ahead, the bound of the cone, and the largest error of a
    comparison with the vector and the bound.
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
    flock: Any,
    world: Any,
    places: Any,
    i: Any,
    range2: Any,
    view: Any,
    ahead_x: Any,
    ahead_y: Any,
    near: Any,
) -> Any:
    """Search for neighbours in all lanes; see `kernels.neighbours.search`.

    The list has boids that are neighbours in any lane, each with a mask of the lanes.

    Parameters
    ----------
    flock : Flock
        Boids that may be neighbours.
    world : World
    places : Places
    i : int
        Index of the boid.
    range2 : Vector or float
        Square of the range.
    view : Vector or float
        Bound of the cone, see `kernels.neighbours.cone`.
    ahead_x : Vector
        Vector ahead.
    ahead_y : Vector
    near : Near
        Neighbours; the list is written.
    """
    bound = view * (ahead_x * ahead_x + ahead_y * ahead_y)
    gaze = Gaze(range2, bound, ahead_x, ahead_y, x=flock.x[i], y=flock.y[i])
    n = flock.x.size
    look_roughly(world, places, i, gaze, view=view, n=n)
    places.close[i] = 0
    listed = 0
    count = spread(0)
    for j in range(n):
        near.boid[listed] = j
        listed += int(places.close[j] != 0)
    # The processor knows the address of each store early: otherwise all reads wait.
    for k in range(listed):
        near.dx[k], near.dy[k], near.distance2[k], is_near = look(
            flock, world, near.boid[k], gaze
        )
        near.mark[k] = bits_of(is_near)
        count = count + is_near
    return found(count, listed, near.mark)


@piece
def move(places: Any, i: Any, x: Any, y: Any) -> None:
    """Note the position of a boid.

    Parameters
    ----------
    places : Places
    i : int
        Index of the boid.
    x : Vector
    y : Vector
    """
    put_place(places.x, i, x, places.farthest)
    put_place(places.y, i, y, places.farthest)


@piece
def move_all(places: Any, flock: Any) -> None:
    """Note the positions of all boids."""
    for i in range(flock.x.size):
        move(places, i, flock.x[i], flock.y[i])
