"""Visits counted by rows of a footprint, on maps of 16-bit pixels if this is faster.

The counts are equal to the counts of kernels.coverage, except for visits to obstacles,
which no code reads. `room_left` returns the number of visits for which 16 bits suffice.
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
"""Largest count of a pixel on a narrow map."""
LOWEST = -(2**15)
"""First count of an obstacle pixel on a narrow map; the count stays negative."""
ROW = WIDTH
"""Pixels of a row of a footprint that are counted at once."""


class Marks(NamedTuple):
    """Visits of a trial.

    `coverage` is the coverage of a trial, or a copy with the pixels on a narrow map.
    `rows` (R,) has the pixels of each row of the footprint as bits, at most ROW. The
    lowest bit is the first pixel. `rows` is empty if the footprint does not fit.
    `blocked` are the indices of obstacle pixels on a narrow map. `clipped` (1,) counts
    the footprints that were not marked by rows since the last reset of obstacle pixels.
    Only clipped footprints visit obstacles.
    """

    coverage: Coverage
    rows: NDArray[np.uint8]
    blocked: NDArray[np.int64]
    clipped: NDArray[np.int64]

    @property
    def is_narrow(self) -> bool:
        """True if the map has 16 bits per pixel."""
        return self.coverage.visits.dtype == np.int16


def wide_marks(coverage: Coverage) -> Marks:
    """Return marks on a map in the format of single trials."""
    rows = _footprint_rows(coverage)
    return Marks(coverage, rows, np.zeros(0, np.int64), np.zeros(1, np.int64))


def narrow_marks(coverages: Sequence[Coverage], alike: bool) -> list[Marks]:
    """Return marks on narrow maps of trials without visits.

    `alike` means that all trials have identical obstacles.

    All maps are one array, because NumPy requests large pages of memory for a large
    array. With pages of 4 kB, the look-up of pages took as long as the counting of
    visits: 50 ns per boid-step, and 25 ns with large pages.
    """
    maps: Any = np.empty((len(coverages), coverages[0].visits.size), np.int16)
    rows = _footprint_rows(coverages[0])
    marks = list[Marks]()
    for visits, coverage in zip(maps, coverages, strict=True):
        if marks and alike:
            visits[:] = maps[0]
            blocked = marks[0].blocked
        else:
            blocked = np.flatnonzero(coverage.visits < 0)
            visits[:] = 0
            visits[blocked] = LOWEST
        narrow = coverage._replace(visits=visits)
        marks.append(Marks(narrow, rows, blocked, np.zeros(1, np.int64)))
    return marks


def room_left(marks: Marks) -> int:
    """Return how many more visits any pixel of a narrow map can count.

    The function reads the whole map, which loads the map into the cache: the gain is
    larger than the cost.
    """
    return MOST - int(marks.coverage.visits.max(initial=0))


def _footprint_rows(coverage: Coverage) -> NDArray[np.uint8]:
    reach = int(coverage.radius)
    side = 2 * reach + 1
    if coverage.stamp.size == 0 or side > min(ROW, coverage.columns):
        return np.zeros(0, np.uint8)
    rows = np.zeros((side, ROW), np.bool_)
    rows[coverage.stamp // coverage.columns, coverage.stamp % coverage.columns] = True
    return np.packbits(rows, axis=1, bitorder="little")[:, 0].copy()


def widened(marks: Marks) -> Coverage:
    """Return the visits of a narrow map on a map in the format of single trials."""
    visits = marks.coverage.visits.astype(np.int32)
    visits[marks.blocked] = BLOCKED
    return marks.coverage._replace(visits=visits)


def free_obstacles(marks: Marks, visits: int) -> None:
    """Reset visits of obstacle pixels if a narrow map lacks room for `visits` more."""
    if marks.clipped[0] + visits > MOST:
        marks.coverage.visits[marks.blocked] = LOWEST
        marks.clipped[0] = 0


@jit
def mark_step(
    marks: Marks, x_of: NDArray[np.float64], y_of: NDArray[np.float64]
) -> None:
    """Mark the footprint of each boid, as kernels.coverage.mark does, row by row.

    Parameters
    ----------
    marks : Marks
    x_of : array (N,) of float
        Position of each boid.
    y_of : array (N,) of float
    """
    coverage = marks.coverage
    radius = coverage.radius
    columns = coverage.columns
    right = columns - radius - 1.0
    top = coverage.rows - radius - 1.0
    height = marks.rows.shape[0]
    reach = int(radius)
    new = 0
    visits = 0
    before = spread(0)
    for i in range(x_of.size):
        x, y = x_of[i] * coverage.per_length, y_of[i] * coverage.per_length
        if height > 0 and radius <= x < right and radius <= y < top:
            corner = (int(y) - reach) * columns + int(x) - reach
            for k in range(0, height - 1, 2):
                first = corner + k * columns
                more = _mark_two(coverage.visits, first, columns, marks.rows, row=k)
                new += more[0]
                visits += more[1]
                before = before + more[2]
            if height % 2 == 1:
                k = height - 1
                first = corner + k * columns
                more = _mark_row(coverage.visits, first, columns, marks.rows, row=k)
                new += more[0]
                visits += more[1]
                before = before + more[2]
        elif (
            -radius - 1.0 < x < columns + radius
            and -radius - 1.0 < y < coverage.rows + radius
        ):
            marks.clipped[0] += 1
            _mark_clipped(coverage, x, y, rank=0, size=1)
    _add(coverage, new, visits, _total(before))


@jit
def _total(counts: Any) -> int:
    total = 0
    for k in range(ROW):
        total += lane_of(counts, k)
    return total


def _marking(count: int) -> Any:
    """Return the intrinsic that counts pixels of `count` rows of a footprint, 1 or 2.

    The rows begin at `row`. The first pixel of the first row has the index `first`, and
    `apart` is the distance between rows. The result has the number of new pixels, the
    number of all pixels, and the sum of the counts before, in lanes.
    """

    @intrinsic
    def marking(
        _context: Any, visits: Any, first: Any, apart: Any, rows: Any, row: Any
    ) -> Any:
        kind = ir.IntType(visits.dtype.bitwidth)
        size = visits.dtype.bitwidth // 8
        line = ir.VectorType(kind, ROW)
        pixels = ir.VectorType(kind, count * ROW)

        def code(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
            def place(array: int, index: Any, target: Any) -> Any:
                array_of = context.make_array(sig.args[array])
                data = array_of(context, builder, arguments[array]).data
                place = builder.gep(data, [index], inbounds=True)
                return builder.bitcast(place, target.as_pointer())

            def number(at: int) -> Any:
                return context.cast(builder, arguments[at], sig.args[at], types.int64)

            nothing = ir.Constant(pixels, None)
            begin = number(1)
            places = [place(0, begin, line)]
            if count > 1:
                places.append(place(0, builder.add(begin, number(2)), line))
            lines = [builder.load(address, align=size) for address in places]
            before = _joined(builder, lines)
            bits = builder.load(place(3, number(4), ir.IntType(count * ROW)), align=1)
            stamp = builder.bitcast(bits, ir.VectorType(MASK.bits, count * ROW))
            free = builder.icmp_signed(">=", before, nothing)
            counts = builder.and_(free, stamp)
            after = builder.add(before, builder.zext(counts, pixels))
            for k, address in enumerate(places):
                builder.store(_part(builder, after, k), address, align=size)
            is_new = builder.and_(counts, builder.icmp_signed("==", before, nothing))
            held = builder.select(counts, before, nothing)
            numbers = [_number_of(builder, is_new), _number_of(builder, counts)]
            # Two counts without a sign have room for their sum.
            total = _part(builder, held, 0)
            for k in range(1, count):
                total = builder.add(total, _part(builder, held, k))
            numbers.append(builder.zext(total, WHOLE.llvm))
            return context.make_tuple(builder, sig.return_type, numbers)

        counted = types.Tuple((types.int64, types.int64, WHOLE))
        return signature(counted, *(visits, first, apart, rows, row)), code

    return marking


_mark_row = _marking(1)
_mark_two = _marking(2)


def _joined(builder: Any, lines: list[Any]) -> Any:
    """Return the pixels of all rows, 1 or 2, as one vector."""
    if len(lines) == 1:
        return lines[0]
    order = ir.Constant(ir.VectorType(INDEX, 2 * ROW), list(range(2 * ROW)))
    return builder.shuffle_vector(*lines, order)


def _part(builder: Any, pixels: Any, k: int) -> Any:
    """Return the pixels of row `k` of 1 or 2 rows."""
    if pixels.type.count == ROW:
        return pixels
    places = list(range(k * ROW, (k + 1) * ROW))
    order = ir.Constant(ir.VectorType(INDEX, ROW), places)
    return builder.shuffle_vector(pixels, pixels, order)


def _number_of(builder: Any, mask: Any) -> Any:
    """Return the number of pixels in which a mask is true."""
    bits = builder.bitcast(mask, ir.IntType(mask.type.count))
    return builder.zext(builder.ctpop(bits), WHOLE.bits)
