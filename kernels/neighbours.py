"""Who sees whom: range and field of view, through a cell grid that is exact under
sequential updates.

The plane is folded onto a torus of cells, which are at least as large as the range.
Every cell lists the boids of its 3 x 3 block in ascending order. So a search reads one
list, and sums over neighbours have the same bits with any grid. A move into another
cell changes at most nine lists of each. If that list is long, a search looks at
everyone instead. Both ways find the same neighbours in the same order.

A list begins in a block of its own, and goes on in others that are taken from a store.
So there is room wherever boids gather, and most lists of a large flock are one line of
the processor's cache.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from kernels.elementary import cos
from kernels.fetching import fetch
from kernels.indices import (
    WORD,
    lowest,
    signed,
    unsigned,
    without_lowest,
    word,
)
from kernels.jit import jit
from kernels.near import Near
from kernels.robots.hearing import heard
from kernels.robots.senses import Senses
from kernels.settings import METRIC
from kernels.state import Flock, Indices, World, aligned, is_large
from kernels.topology import UNSETTLED, select
from kernels.torus import nearest_image

FAR = 9
ALL_ROUND = -4.0
ROOM, SMALL_FLOCK = 15, 256
"""With the length of the list, a block with this room is 64 bytes."""
AHEAD = 8
"""So many boids before its search, the memory that it will read is asked for."""
CROWDED = 4
"""A list of more than N / CROWDED boids takes longer to read than everyone: the
processor looks at several boids of everyone at once. Where the mean list is so long,
there are none.
"""


class Grid(NamedTuple):
    """C = columns x rows cells for N boids.

    `blocks` (B, 1 + room) hold the lists. That of cell c begins in block c, whose first
    place has the length of the list; the others hold boids. `following` (B,) says in
    which block a list goes on that fills one. Blocks that no list needs are a chain of
    their own, which begins with `spare` (1,). `column` and `row` (N,) say in which cell
    a boid is. Lists of more than `longest` are not read; with `everyone` there are no
    lists. `ahead` says how many boids ahead memory is asked for, 0 for none.
    `published` says that the grid has boids where others know them, which only
    `move_published` changes. Indices are unsigned, which numba reads faster.
    """

    columns: int
    rows: int
    columns_per_length: float
    rows_per_length: float
    longest: int
    everyone: bool
    ahead: int | None
    published: bool
    blocks: Indices
    following: Indices
    spare: Indices
    column: Indices
    row: Indices


class Gaze(NamedTuple):
    """What one boid can see: the square of its range, the bound of its cone times
    |h|^2, the vector h ahead, and where it is.
    """

    range2: float
    bound: float
    ahead_x: float
    ahead_y: float
    x: float
    y: float


def all_pairs(n: int) -> Grid:
    """The grid without lists: every search reads everyone."""
    return Grid(1, 1, 0.0, 0.0, n, True, None, False, *_lists(1, 1, n))


def _lists(cells: int, room: int, n: int) -> tuple[Indices, ...]:
    """Empty lists for so many cells, and the cells of `n` boids.

    A boid is in nine lists. All blocks of a list but the last are full, so that there
    are enough.
    """
    blocks = cells + 9 * n // room
    return (
        aligned((blocks, 1 + room), np.uint32),
        np.zeros(blocks, np.uint32),
        np.zeros(1, np.uint32),
        np.zeros(n, np.uint32),
        np.zeros(n, np.uint32),
    )


def build_grid(
    flock: Flock,
    world: World,
    search_range: float,
    room: int = 0,
    published: bool = False,
) -> Grid:
    """The grid of `flock` for searches up to `search_range`; all-pairs where a grid
    would not pay.

    Cells tile the world, so that the fold is the torus where positions wrap. There are
    at most about 4 N of them. A block has room for `room` boids; if that is 0, for all
    of a small flock, for twice the mean of a large one. With a `room` there are lists
    also where most are too long to be read. `published` says whether the places of
    `flock` are those that boids know of each other.
    """
    n = flock.x.size
    columns, rows = _shape(world, search_range, 4 * n + 16)
    cells = columns * rows
    if cells < (9 if room else 9 * CROWDED):
        return all_pairs(n)
    if room == 0:
        room = n if n <= SMALL_FLOCK else max(ROOM, 18 * n // cells)
    grid = Grid(
        columns,
        rows,
        columns / world.width,
        rows / world.height,
        n // CROWDED,
        False,
        AHEAD if is_large(n) else None,
        published,
        *_lists(cells, min(room, n), n),
    )
    fill(grid, flock)
    return grid


def _shape(world: World, search_range: float, most: int) -> tuple[int, int]:
    """Columns and rows: 1, or at least 3 so that a block holds no cell twice. Cells are
    a little larger than the range.
    """
    cell = max(search_range * (1 + 1e-6), 1e-9)
    columns, rows = world.width / cell, world.height / cell
    shrink = min(1.0, math.sqrt(most / max(columns * rows, 1.0)))
    columns, rows = int(columns * shrink), int(rows * shrink)
    return (columns if columns >= 3 else 1), (rows if rows >= 3 else 1)


@jit
def _index(position: float, per_length: float, n: int) -> int:
    """The column or row of a coordinate on the folded plane;
    `position` must be finite.
    """
    k = math.floor(position * per_length)
    return k if 0 <= k < n else k % n


@jit
def fill(grid: Grid, flock: Flock) -> None:
    """Enter every boid of `flock` into an emptied `grid`."""
    cells = grid.columns * grid.rows
    for cell in range(cells):
        grid.blocks[cell, 0] = 0
    for block in range(grid.following.size):
        grid.following[block] = block + 1
    grid.spare[0] = cells
    for i in range(flock.x.size):
        grid.column[i] = _index(flock.x[i], grid.columns_per_length, grid.columns)
        grid.row[i] = _index(flock.y[i], grid.rows_per_length, grid.rows)
        _change_block(grid, int(grid.column[i]), int(grid.row[i]), FAR, FAR, i, True)


@jit
def _change_block(
    grid: Grid,
    column: int,
    row: int,
    columns_off: int,
    rows_off: int,
    i: int,
    enter: bool,
) -> None:
    """Enter boid `i` into the lists of the block about a cell, or remove it from them.

    Cells that are also in the block `columns_off` to the right and `rows_off` above are
    left as they are.
    """
    across = min(1, grid.columns - 1)
    along = min(1, grid.rows - 1)
    for r in range(-along, along + 1):
        first = _fold(row + r, grid.rows) * grid.columns
        for c in range(-across, across + 1):
            if abs(c - columns_off) > 1 or abs(r - rows_off) > 1:
                if enter:
                    _insert(grid, first + _fold(column + c, grid.columns), i)
                else:
                    _remove(grid, first + _fold(column + c, grid.columns), i)


@jit
def _fold(k: int, n: int) -> int:
    """The index `k`, at most n off, back in 0..n-1."""
    if k < 0:
        return k + n
    return k - n if k >= n else k


@jit
def _offset(k: int, n: int) -> int:
    """The difference `k` of two indices on a circle of `n`: -1, 0 or 1 for neighbours,
    else FAR.
    """
    if abs(k) <= 1:
        return k
    if abs(k) == n - 1:
        return -1 if k > 0 else 1
    return FAR


@jit
def _insert(grid: Grid, cell: int, i: int) -> None:
    """Enter boid `i` into the list of a cell: what no longer fits into a block is
    carried into the next one.
    """
    room = grid.blocks.shape[1] - 1
    block, left, carried = cell, int(grid.blocks[cell, 0]), i
    grid.blocks[cell, 0] += 1
    while left >= room:
        last = int(grid.blocks[block, room])
        if carried < last:
            _put(grid, block, room, carried)
            carried = last
        left -= room
        if left == 0:
            _lengthen(grid, block)
        block = int(grid.following[block])
    _put(grid, block, left + 1, carried)


@jit
def _put(grid: Grid, block: int, k: int, i: int) -> None:
    """Put boid `i` in its place among the first `k` of a block; the last is lost."""
    while k > 1 and grid.blocks[block, k - 1] > i:
        grid.blocks[block, k] = grid.blocks[block, k - 1]
        k -= 1
    grid.blocks[block, k] = i


@jit
def _lengthen(grid: Grid, block: int) -> None:
    """Let a spare block follow `block`."""
    new = int(grid.spare[0])
    grid.spare[0] = grid.following[new]
    grid.following[block] = new


@jit
def _remove(grid: Grid, cell: int, i: int) -> None:
    """Remove boid `i` from the list of a cell: each block gets the first boid of the
    next one.
    """
    room = grid.blocks.shape[1] - 1
    block, left, k = cell, int(grid.blocks[cell, 0]), 1
    grid.blocks[cell, 0] -= 1
    while left > room and grid.blocks[block, room] < i:
        block = int(grid.following[block])
        left -= room
    while grid.blocks[block, k] != i:
        k += 1
    while left > room:
        following = int(grid.following[block])
        _close(grid, block, k, room)
        grid.blocks[block, room] = grid.blocks[following, 1]
        block, k = following, 1
        left -= room
    _close(grid, block, k, left)
    if left == 1 and block != cell:
        grid.following[block] = grid.spare[0]
        grid.spare[0] = block


@jit
def _close(grid: Grid, block: int, k: int, last: int) -> None:
    """Fill place `k` of a block with what stands after it, up to `last`."""
    while k < last:
        grid.blocks[block, k] = grid.blocks[block, k + 1]
        k += 1


@jit
def move(grid: Grid, i: int, x: float, y: float) -> None:
    """Tell `grid` that boid `i` is now at (x, y). Positions that are not finite are
    left to the end of the step.
    """
    if not (grid.everyone or grid.published):
        _move(grid, i, x, y)


@jit
def _move(grid: Grid, i: int, x: float, y: float) -> None:
    if not math.isfinite(x + y):
        return
    old_column, old_row = int(grid.column[i]), int(grid.row[i])
    column = _index(x, grid.columns_per_length, grid.columns)
    row = _index(y, grid.rows_per_length, grid.rows)
    if column != old_column or row != old_row:
        columns_off = _offset(column - old_column, grid.columns)
        rows_off = _offset(row - old_row, grid.rows)
        if grid.ahead is not None:
            _fetch_block(grid, old_column, old_row)
            _fetch_block(grid, column, row)
        _change_block(grid, old_column, old_row, columns_off, rows_off, i, False)
        _change_block(grid, column, row, -columns_off, -rows_off, i, True)
        grid.column[i], grid.row[i] = column, row


@jit
def move_all(grid: Grid, flock: Flock) -> None:
    """Tell `grid` where all boids are now, in index order."""
    if not (grid.everyone or grid.published):
        _move_all(grid, flock)


@jit
def move_published(grid: Grid, others: Flock) -> None:
    """Tell a `published` grid where boids know all others to be now."""
    if grid.published:
        _move_all(grid, others)


@jit
def _move_all(grid: Grid, flock: Flock) -> None:
    for i in range(flock.x.size):
        if grid.ahead is not None:
            k = min(i + AHEAD, flock.x.size - 1)
            _fetch_crossing(grid, k, flock.x[k], flock.y[k])
        _move(grid, i, flock.x[i], flock.y[i])


@jit
def _fetch_crossing(grid: Grid, i: int, x: float, y: float) -> None:
    """Ask for the lists that boid `i` will change by its move to (x, y)."""
    if math.isfinite(x + y):
        column = _index(x, grid.columns_per_length, grid.columns)
        row = _index(y, grid.rows_per_length, grid.rows)
        if column != grid.column[i] or row != grid.row[i]:
            _fetch_block(grid, int(grid.column[i]), int(grid.row[i]))
            _fetch_block(grid, column, row)


@jit
def _fetch_block(grid: Grid, column: int, row: int) -> None:
    """Ask for the lists of the block about a cell, before they are changed."""
    for r in range(-1, 2):
        first = _fold(row + r, grid.rows) * grid.columns
        for c in range(-1, 2):
            fetch(grid.blocks, (first + _fold(column + c, grid.columns), 0))


@jit
def square_range(length: float, inclusive: bool) -> float:
    """The bound b for squared distances: `distance2 < b` means nearer than `length`, or
    with `inclusive` at most at `length`.
    """
    square = length * length
    return np.nextafter(square, np.inf) if inclusive else square


@jit
def cone(fov: float) -> float:
    """The bound of `search` for a full field of view of `fov` degrees; 360 degrees and
    more see everything.
    """
    cosine = cos(math.radians(0.5 * fov))
    return ALL_ROUND if fov >= 360.0 else cosine * abs(cosine)


@jit
def search(
    seen: Flock,
    world: World,
    grid: Grid,
    i: int,
    range2: float,
    view: float,
    ahead_x: float,
    ahead_y: float,
    near: Near,
) -> int:
    """Find the neighbours of boid `i` in ascending order, fill `near` and return how
    many there are.

    In sight are those nearer than the square root of `range2` and within the `cone`
    about the vector h = (ahead_x, ahead_y): with the cosine s/(|d||h|) of the angle,
    s|s| >= view |d|^2 |h|^2. Where h is zero, a boid sees all round. Neighbours are
    those of them of whom it hears by the senses of `near`, and who count by its
    topology.
    """
    bound = view * (ahead_x * ahead_x + ahead_y * ahead_y)
    around = near.topology.around
    x, y = _own_place(near.senses, seen, i)
    first = Gaze(min(range2, around * around), bound, ahead_x, ahead_y, x, y)
    found = _search_in_sight(seen, world, grid, i, first, near)
    found = heard(near.senses, world, i, near, found)
    if near.topology.kind == METRIC:
        return found
    if first.range2 < range2:
        found = select(near, found, around)
        if found != UNSETTLED:
            return found
        gaze = Gaze(range2, bound, ahead_x, ahead_y, x, y)
        found = _search_everyone(seen, world, i, gaze, near)
        found = heard(near.senses, world, i, near, found)
    return select(near, found, math.inf)


@jit
def _own_place(senses: Senses | None, seen: Flock, i: int) -> tuple[float, float]:
    """Where boid `i` knows itself to be."""
    if senses is None:
        return seen.x[i], seen.y[i]
    return senses.own.x[i], senses.own.y[i]


@jit
def _own_cell(senses: Senses | None, grid: Grid, i: int, gaze: Gaze) -> Any:
    """The cell in which boid `i` knows itself to be."""
    if senses is None:
        return grid.row[i] * grid.columns + grid.column[i]
    row = _index(gaze.y, grid.rows_per_length, grid.rows)
    return row * grid.columns + _index(gaze.x, grid.columns_per_length, grid.columns)


@jit
def _search_in_sight(
    seen: Flock, world: World, grid: Grid, i: int, gaze: Gaze, near: Near
) -> int:
    """All in sight of boid `i`, in ascending order; the range of `gaze` is at most that
    of `grid`.
    """
    cell = _own_cell(near.senses, grid, i, gaze)
    if grid.everyone or grid.blocks[cell, 0] > grid.longest:
        return _search_everyone(seen, world, i, gaze, near)
    if grid.ahead is not None:
        _fetch_ahead(seen, grid, i)
    length = grid.blocks[cell, 0]
    if length < grid.blocks.shape[1]:
        return _look_at_block(seen, world, i, grid, cell, length, gaze, near, 0)
    return _search_blocks(seen, world, i, grid, cell, gaze, near)


@jit
def _search_blocks(
    seen: Flock, world: World, i: int, grid: Grid, cell: int, gaze: Gaze, near: Near
) -> int:
    """`search` in a list of more than one block."""
    left, room = int(grid.blocks[cell, 0]), grid.blocks.shape[1] - 1
    block, found = int(cell), 0
    while left > 0:
        here = min(left, room)
        found = _look_at_block(seen, world, i, grid, block, here, gaze, near, found)
        left -= here
        block = int(grid.following[block])
    return found


@jit
def _look_at_block(
    seen: Flock,
    world: World,
    i: int,
    grid: Grid,
    block: int,
    length: int,
    gaze: Gaze,
    near: Near,
    found: int,
) -> int:
    """Add the neighbours of boid `i` among the first `length` in a block to the `found`
    ones in `near`; return how many they are then.
    """
    for k in range(length):
        j = grid.blocks[block, k + unsigned(1)]
        near.boid[found] = j
        near.dx[found], near.dy[found], near.distance2[found], is_near = _look(
            seen, world, j, gaze
        )
        # Branchless: always write the slot, advance only if the boid is near. The
        # processor would mispredict this branch.
        found += int(is_near & (j != i))
    return found


@jit
def _fetch_ahead(seen: Flock, grid: Grid, i: int) -> None:
    """Ask for what the searches of boids after `i` will read: first the list, and when
    it is there, the boids in its first block.
    """
    n = grid.row.size
    k = min(i + 2 * AHEAD, n - 1)
    fetch(grid.blocks, (grid.row[k] * grid.columns + grid.column[k], 0))
    k = min(i + AHEAD, n - 1)
    cell = grid.row[k] * grid.columns + grid.column[k]
    room = unsigned(grid.blocks.shape[1] - 1)
    for m in range(min(unsigned(grid.blocks[cell, 0]), room)):
        j = grid.blocks[cell, m + unsigned(1)]
        fetch(seen.x, j)


@jit
def _search_everyone(seen: Flock, world: World, i: int, gaze: Gaze, near: Near) -> int:
    """`search` among everyone. The first pass runs on several boids at once, the second
    reads a word of marks at a time, and only those that are set.
    """
    n, found = unsigned(seen.x.size), unsigned(0)
    for j in range(n):
        near.mark[j] = _look(seen, world, j, gaze)[3]
    near.mark[i] = False
    for first in range(unsigned(0), n, WORD):
        marks = word(near.mark, first)
        while marks != unsigned(0):
            j = first + lowest(marks)
            marks = without_lowest(marks)
            near.boid[found] = j
            near.dx[found], near.dy[found], near.distance2[found], _ = _look(
                seen, world, j, gaze
            )
            found += unsigned(1)
    return signed(found)


@jit
def _look(
    seen: Flock, world: World, j: int, gaze: Gaze
) -> tuple[float, float, float, bool]:
    """The displacement from where a boid looks to boid `j`, its square, and whether `j`
    is in range and in view.
    """
    dx, dy = seen.x[j] - gaze.x, seen.y[j] - gaze.y
    if world.minimum_image:
        dx = nearest_image(dx, world.width)
        dy = nearest_image(dy, world.height)
    distance2 = dx * dx + dy * dy
    along = dx * gaze.ahead_x + dy * gaze.ahead_y
    in_view = along * abs(along) >= gaze.bound * distance2
    # A model without a heading says so with zeros, and then no cone is computed.
    all_round = (gaze.ahead_x == 0.0) & (gaze.ahead_y == 0.0)
    return dx, dy, distance2, (distance2 < gaze.range2) & (all_round | in_view)
