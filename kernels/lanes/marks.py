"""Visits counted a row of a footprint at a time, where that pays on maps of 16 bits a
pixel.

The counts are those of kernels.coverage, but for visits to obstacles, which nobody
sees. `room_left` says how long 16 bits are enough.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from llvmlite import ir
from numba import types
from numba.core.typing.templates import signature
from numpy.typing import NDArray

from kernels.coverage import BLOCKED, Coverage, _add, _mark_clipped
from kernels.jit import jit
from kernels.lanes.vectors import INDEX, MASK, WHOLE, WIDTH, intrinsic, spread
from kernels.lanes.vectors import lane as lane_of

MOST = 2**15 - 1
LOWEST = -(2**15)
"""Where counts of obstacle pixels stay."""
ROW = WIDTH
"""Pixels of a footprint's row that are counted at once, at least."""


class Marks(NamedTuple):
    """`coverage` is that of a flight, or has its pixels on a narrow map. `rows` (R,)
    says of each row of the footprint in which of ROW places it has a pixel, the first
    as the lowest bit; it is empty where the footprint does not fit. `blocked` are the
    pixels of obstacles on a narrow map, and `clipped` (1,) counts the footprints since
    they were freed that were not marked by rows: only these visit obstacles.
    """

    coverage: Coverage
    rows: NDArray[np.uint8]
    blocked: NDArray[np.int64]
    clipped: NDArray[np.int64]

    @property
    def is_narrow(self) -> bool:
        return self.coverage.visits.dtype == np.int16


def wide_marks(coverage: Coverage) -> Marks:
    """Marks on a map as single flights have it."""
    rows, none = _footprint_rows(coverage), np.zeros(0, np.int64)
    return Marks(coverage, rows, none, np.zeros(1, np.int64))


def narrow_marks(coverages: Sequence[Coverage], alike: bool) -> list[Marks]:
    """Marks on narrow maps of flights that have visited nothing. `alike` says that all
    have the same obstacles.

    All maps are one array: NumPy asks for large pages of memory for a large array. With
    pages of 4 kB the processor looked up pages as long as it counted visits: 50 ns a
    boid-step, and 25 with large ones.
    """
    maps: Any = np.empty((len(coverages), coverages[0].visits.size), np.int16)
    rows = _footprint_rows(coverages[0])
    made = list[Marks]()
    for visits, coverage in zip(maps, coverages, strict=True):
        if made and alike:
            visits[:], blocked = maps[0], made[0].blocked
        else:
            blocked = np.flatnonzero(coverage.visits < 0)
            visits[:] = 0
            visits[blocked] = LOWEST
        narrow = coverage._replace(visits=visits)
        made.append(Marks(narrow, rows, blocked, np.zeros(1, np.int64)))
    return made


def room_left(marks: Marks) -> int:
    """How many more visits a pixel can have on a narrow map, whatever pixel it is.

    It reads the whole map, which brings it near: that saves more than it takes.
    """
    return MOST - int(marks.coverage.visits.max(initial=0))


def _footprint_rows(coverage: Coverage) -> NDArray[np.uint8]:
    whole = int(coverage.radius)
    side = 2 * whole + 1
    if coverage.stamp.size == 0 or side > min(ROW, coverage.columns):
        return np.zeros(0, np.uint8)
    rows = np.zeros((side, ROW), np.bool_)
    rows[coverage.stamp // coverage.columns, coverage.stamp % coverage.columns] = True
    return np.packbits(rows, axis=1, bitorder="little")[:, 0].copy()


def widened(marks: Marks) -> Coverage:
    """What is marked on a narrow map, on a map of its own as single flights have it."""
    visits = marks.coverage.visits.astype(np.int32)
    visits[marks.blocked] = BLOCKED
    return marks.coverage._replace(visits=visits)


def free_obstacles(marks: Marks, visits: int) -> None:
    """Forget visits of obstacle pixels on a narrow map, where it has no room for so
    many more.
    """
    if marks.clipped[0] + visits > MOST:
        marks.coverage.visits[marks.blocked] = LOWEST
        marks.clipped[0] = 0


@jit
def mark_step(
    marks: Marks, x_of: NDArray[np.float64], y_of: NDArray[np.float64]
) -> None:
    """kernels.coverage.mark for each boid, whose places are given, row by row."""
    coverage = marks.coverage
    radius, columns = coverage.radius, coverage.columns
    right, top = columns - radius - 1.0, coverage.rows - radius - 1.0
    height, whole = marks.rows.shape[0], int(radius)
    new, seen, held = 0, 0, spread(0)
    for i in range(x_of.size):
        x, y = x_of[i] * coverage.per_length, y_of[i] * coverage.per_length
        if height > 0 and radius <= x < right and radius <= y < top:
            corner = (int(y) - whole) * columns + int(x) - whole
            for k in range(0, height - 1, 2):
                first = corner + k * columns
                more = _mark_two(coverage.visits, first, columns, marks.rows, k)
                new, seen, held = new + more[0], seen + more[1], held + more[2]
            if height % 2 == 1:
                k = height - 1
                first = corner + k * columns
                more = _mark_row(coverage.visits, first, columns, marks.rows, k)
                new, seen, held = new + more[0], seen + more[1], held + more[2]
        elif (
            -radius - 1.0 < x < columns + radius
            and -radius - 1.0 < y < coverage.rows + radius
        ):
            marks.clipped[0] += 1
            _mark_clipped(coverage, x, y, 0, 1)
    _add(coverage, new, seen, _total(held))


@jit
def _total(counts: Any) -> int:
    total = 0
    for k in range(ROW):
        total += lane_of(counts, k)
    return total


def _marking(count: int) -> Any:
    """What counts the pixels of so many rows of a footprint, one or two, from `row` on:
    the first of them at the place `first`, each `apart` from the one before. It gives
    how many are new, how many there are, and their counts before.
    """

    @intrinsic
    def marking(
        _context: Any, visits: Any, first: Any, apart: Any, rows: Any, row: Any
    ) -> Any:
        kind, size = ir.IntType(visits.dtype.bitwidth), visits.dtype.bitwidth // 8
        line, pixels = ir.VectorType(kind, ROW), ir.VectorType(kind, count * ROW)

        def code(context: Any, builder: Any, given: Any, arguments: Any) -> Any:
            def place(array: int, index: Any, there: Any) -> Any:
                made = context.make_array(given.args[array])
                data = made(context, builder, arguments[array]).data
                place = builder.gep(data, [index], inbounds=True)
                return builder.bitcast(place, there.as_pointer())

            def number(at: int) -> Any:
                return context.cast(builder, arguments[at], given.args[at], types.int64)

            nothing = ir.Constant(pixels, None)
            begin = number(1)
            places = [place(0, begin, line)]
            if count > 1:
                places.append(place(0, builder.add(begin, number(2)), line))
            lines = [builder.load(one, align=size) for one in places]
            before = _joined(builder, lines)
            bits = builder.load(place(3, number(4), ir.IntType(count * ROW)), align=1)
            stamp = builder.bitcast(bits, ir.VectorType(MASK.bits, count * ROW))
            free = builder.icmp_signed(">=", before, nothing)
            counts = builder.and_(free, stamp)
            after = builder.add(before, builder.zext(counts, pixels))
            for k, one in enumerate(places):
                builder.store(_part(builder, after, k), one, align=size)
            is_new = builder.and_(counts, builder.icmp_signed("==", before, nothing))
            held = builder.select(counts, before, nothing)
            numbers = [_number_of(builder, is_new), _number_of(builder, counts)]
            # Two counts without a sign have room for their sum.
            total = _part(builder, held, 0)
            for k in range(1, count):
                total = builder.add(total, _part(builder, held, k))
            numbers.append(builder.zext(total, WHOLE.llvm))
            return context.make_tuple(builder, given.return_type, numbers)

        found = types.Tuple((types.int64, types.int64, WHOLE))
        return signature(found, visits, first, apart, rows, row), code

    return marking


_mark_row, _mark_two = _marking(1), _marking(2)


def _joined(builder: Any, lines: list[Any]) -> Any:
    """The pixels of one row, or of two."""
    if len(lines) == 1:
        return lines[0]
    order = ir.Constant(ir.VectorType(INDEX, 2 * ROW), list(range(2 * ROW)))
    return builder.shuffle_vector(*lines, order)


def _part(builder: Any, pixels: Any, k: int) -> Any:
    """The pixels of row `k` of one or two."""
    if pixels.type.count == ROW:
        return pixels
    places = list(range(k * ROW, (k + 1) * ROW))
    order = ir.Constant(ir.VectorType(INDEX, ROW), places)
    return builder.shuffle_vector(pixels, pixels, order)


def _number_of(builder: Any, mask: Any) -> Any:
    """In how many places a mask is true."""
    bits = builder.bitcast(mask, ir.IntType(mask.type.count))
    return builder.zext(builder.ctpop(bits), WHOLE.bits)
