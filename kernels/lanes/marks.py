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
from kernels.lanes.vectors import WHOLE, WIDTH, intrinsic, spread
from kernels.lanes.vectors import lane as lane_of

MOST = 2**15 - 1
LOWEST = -(2**15)
"""Where counts of obstacle pixels stay."""
ROW = WIDTH
"""Pixels of a footprint's row that are counted at once, at least."""


class Marks(NamedTuple):
    """`coverage` is that of a flight, or has its pixels on a narrow map. `rows` (R,
    ROW), of the type of the visits, has 1 where the footprint has a pixel, and is empty
    where it does not fit. `blocked` are the pixels of obstacles on a narrow map, and
    `clipped` (1,) counts the footprints since they were freed that were not marked by
    rows: only these visit obstacles.
    """

    coverage: Coverage
    rows: NDArray[Any]
    blocked: NDArray[np.int64]
    clipped: NDArray[np.int64]

    @property
    def is_narrow(self) -> bool:
        return self.coverage.visits.dtype == np.int16


def wide_marks(coverage: Coverage) -> Marks:
    """Marks on the map of a flight itself."""
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
    rows = _footprint_rows(coverages[0]).astype(np.int16)
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


def _footprint_rows(coverage: Coverage) -> NDArray[np.int32]:
    whole = int(coverage.radius)
    side = 2 * whole + 1
    if coverage.stamp.size == 0 or side > min(ROW, coverage.columns):
        return np.zeros((0, ROW), np.int32)
    rows = np.zeros((side, ROW), np.int32)
    rows[coverage.stamp // coverage.columns, coverage.stamp % coverage.columns] = 1
    return rows


def widen(marks: Marks, coverage: Coverage) -> None:
    """Bring what is marked into `coverage`, of which `marks` were built."""
    counted = marks.coverage.visits
    np.copyto(coverage.visits, counted, where=counted >= 0)
    coverage.visits[marks.blocked] = BLOCKED


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
    fits, whole = marks.rows.shape[0] > 0, int(radius)
    new, seen, held = 0, 0, spread(0)
    for i in range(x_of.size):
        x, y = x_of[i] * coverage.per_length, y_of[i] * coverage.per_length
        if fits and radius <= x < right and radius <= y < top:
            corner = (int(y) - whole) * columns + int(x) - whole
            for k in range(marks.rows.shape[0]):
                first = corner + k * columns
                more = _mark_row(coverage.visits, first, marks.rows, k)
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


@intrinsic
def _mark_row(_context: Any, visits: Any, first: Any, rows: Any, row: Any) -> Any:
    """Count the pixels of one row of a footprint. Returns how many are new, how many
    there are, and their counts before.
    """
    kind = ir.IntType(visits.dtype.bitwidth)
    pixels, size = ir.VectorType(kind, ROW), visits.dtype.bitwidth // 8

    def code(context: Any, builder: Any, given: Any, arguments: Any) -> Any:
        def place(array: int, index: Any) -> Any:
            made = context.make_array(given.args[array])
            data = made(context, builder, arguments[array]).data
            there = builder.gep(data, [index], inbounds=True)
            return builder.bitcast(there, pixels.as_pointer())

        def number(at: int) -> Any:
            return context.cast(builder, arguments[at], given.args[at], types.int64)

        nothing = ir.Constant(pixels, [0] * ROW)
        there = place(0, number(1))
        before = builder.load(there, align=size)
        stamp = place(2, builder.mul(number(3), ir.Constant(WHOLE.bits, ROW)))
        ones = builder.load(stamp, align=size)
        free = builder.icmp_signed(">=", before, nothing)
        counts = builder.and_(free, builder.icmp_signed("!=", ones, nothing))
        more = builder.select(counts, ones, nothing)
        builder.store(builder.add(before, more), there, align=size)
        is_new = builder.and_(counts, builder.icmp_signed("==", before, nothing))
        held = builder.select(counts, before, nothing)
        numbers = [_number_of(builder, is_new), _number_of(builder, counts)]
        numbers.append(builder.zext(held, WHOLE.llvm))
        return context.make_tuple(builder, given.return_type, numbers)

    found = types.Tuple((types.int64, types.int64, WHOLE))
    return signature(found, visits, first, rows, row), code


def _number_of(builder: Any, mask: Any) -> Any:
    """In how many places a mask is true."""
    bits = builder.bitcast(mask, ir.IntType(ROW))
    return builder.zext(builder.ctpop(bits), WHOLE.bits)
