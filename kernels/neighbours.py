"""Search of neighbours by range and field of view, through a grid of cells.

The grid is exact under sequential updates. The plane is folded onto a torus of cells. A
cell is at least as large as the range. Every cell lists the boids of its 3 x 3 block in
ascending order. So a search reads one list, and sums over neighbours are bitwise
identical with any grid. A move into another cell changes at most nine lists of each of
the two cells. If a list is long, a search reads all boids instead. The two searches
find equal neighbours in equal order.

A list begins in a reserved block, and continues in spare blocks. So cells have room for
gathered boids, and most lists of a large flock fill one line of the processor cache.
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
"""Offset between blocks that share no cell."""
ALL_ROUND = -4.0
"""Bound of a cone that holds all directions: below -1, the cosine times its size."""
ROOM, SMALL_FLOCK = 15, 256
"""Boids per block, and the largest flock whose blocks hold all boids.

With the length of the list, a block of ROOM boids is 64 bytes.
"""
AHEAD = 8
"""Number of boids before a search at which its memory is prefetched."""
CROWDED = 4
"""Divisor of N for the longest list that is read.

A search over all boids is vectorised and faster than a list of more than N / CROWDED
boids. If the mean list is longer, the grid has no lists.
"""


class Grid(NamedTuple):
    """Lists of boids in C = columns x rows cells, for N boids.

    `columns_per_length` and `rows_per_length` are cells per unit of length.

    `blocks` (B, 1 + room) hold the lists. The list of cell c begins in block c. The
    first element of block c is the length of the list; the remaining elements are
    boids. `following` (B,) holds the next block of a list after a full block. Spare
    blocks form a separate chain, which begins with `spare` (1,).

    `column` and `row` (N,) hold the cell of each boid. Searches do not read lists of
    more than `longest` boids; with `everyone` the grid has no lists. `ahead` is the
    number of boids ahead for which memory is prefetched; None to prefetch nothing. A
    `published` grid has the positions that boids know, and only `move_published`
    changes this grid. Indices are unsigned, which numba reads faster.
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
    """View of one boid: range, cone and position.

    `range2` is the squared range. `bound` is the bound of `cone` times |h|^2. The
    vector h = (`ahead_x`, `ahead_y`) points ahead, and (`x`, `y`) is the position of
    the boid.
    """

    range2: float
    bound: float
    ahead_x: float
    ahead_y: float
    x: float
    y: float


def all_pairs(n: int) -> Grid:
    """Return a grid without lists for `n` boids: every search reads all boids."""
    return Grid(1, 1, 0.0, 0.0, n, True, None, False, *_lists(1, 1, n))


def _lists(cells: int, room: int, n: int) -> tuple[Indices, ...]:
    """Return empty lists for a number of cells, and the cells of `n` boids.

    A boid is in nine lists. All blocks of a list but the last are full, so the blocks
    suffice.
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
    """Return the grid of a flock; without lists if lists would slow a search down.

    Cells tile the world. So with periodic boundaries the fold is the torus of the
    world. The number of cells is at most about 4 N.

    Parameters
    ----------
    flock : Flock
        N boids, which are entered into the grid.
    world : World
        World of the flock.
    search_range : float
        Largest distance at which neighbours are searched, in the unit of length.
    room : int, default 0
        Boids per block. With 0 a block has room for a whole small flock; in a large
        flock, for twice the mean list and at least ROOM. With a positive number the
        grid has lists even if most lists are too long to be read.
    published : bool, default False
        True if `flock` has the positions that boids know.

    Returns
    -------
    Grid
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
    """Return the numbers of columns and rows, with at most about `most` cells.

    Each is 1, or at least 3 so that a block holds no cell twice. Cells are a little
    larger than the range.
    """
    cell = max(search_range * (1 + 1e-6), 1e-9)
    columns, rows = world.width / cell, world.height / cell
    shrink = min(1.0, math.sqrt(most / max(columns * rows, 1.0)))
    columns, rows = int(columns * shrink), int(rows * shrink)
    return (columns if columns >= 3 else 1), (rows if rows >= 3 else 1)


@jit
def _index(position: float, per_length: float, n: int) -> int:
    """Return the column or row of a coordinate on the folded plane.

    `position` must be finite.
    """
    k = math.floor(position * per_length)
    return k if 0 <= k < n else k % n


@jit
def fill(grid: Grid, flock: Flock) -> None:
    """Enter every boid of a flock into an emptied grid."""
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
    """Enter boid `i` into the lists of the block about a cell, or remove it.

    Cells that are also in the block `columns_off` to the right and `rows_off` above
    stay as they are.
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
    """Return the index `k`, at most n off, within 0..n-1."""
    if k < 0:
        return k + n
    return k - n if k >= n else k


@jit
def _offset(k: int, n: int) -> int:
    """Return the difference of two indices on a circle of `n`; FAR if not adjacent.

    The difference of adjacent and of equal indices is -1, 0 or 1.
    """
    if abs(k) <= 1:
        return k
    if abs(k) == n - 1:
        return -1 if k > 0 else 1
    return FAR


@jit
def _insert(grid: Grid, cell: int, i: int) -> None:
    """Enter boid `i` into the list of a cell.

    A boid that no longer fits into a block moves into the next block.
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
    """Insert boid `i` in order among the first `k` elements of a block.

    The last of the `k` elements is lost.
    """
    while k > 1 and grid.blocks[block, k - 1] > i:
        grid.blocks[block, k] = grid.blocks[block, k - 1]
        k -= 1
    grid.blocks[block, k] = i


@jit
def _lengthen(grid: Grid, block: int) -> None:
    """Append a spare block to `block`."""
    new = int(grid.spare[0])
    grid.spare[0] = grid.following[new]
    grid.following[block] = new


@jit
def _remove(grid: Grid, cell: int, i: int) -> None:
    """Remove boid `i` from the list of a cell.

    Each block gets the first boid of the next block. An emptied block becomes a spare
    block.
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
    """Shift the elements of a block after `k` by one towards `k`, up to `last`."""
    while k < last:
        grid.blocks[block, k] = grid.blocks[block, k + 1]
        k += 1


@jit
def move(grid: Grid, i: int, x: float, y: float) -> None:
    """Enter a boid at its new position.

    Grids that are published or have no lists stay as they are. A position that is not
    finite is ignored, since the run ends after the step.

    Parameters
    ----------
    grid : Grid
        Grid of the flock.
    i : int
        Index of the boid.
    x, y : float
        New position, in the unit of length of the model.
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
    """Enter all boids at their positions, in index order.

    Grids that are published or have no lists stay as they are.
    """
    if not (grid.everyone or grid.published):
        _move_all(grid, flock)


@jit
def move_published(grid: Grid, others: Flock) -> None:
    """Enter all boids of a published grid at the positions that boids know.

    Unpublished grids stay as they are.
    """
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
    """Prefetch the lists that boid `i` will change by its move to (x, y)."""
    if math.isfinite(x + y):
        column = _index(x, grid.columns_per_length, grid.columns)
        row = _index(y, grid.rows_per_length, grid.rows)
        if column != grid.column[i] or row != grid.row[i]:
            _fetch_block(grid, int(grid.column[i]), int(grid.row[i]))
            _fetch_block(grid, column, row)


@jit
def _fetch_block(grid: Grid, column: int, row: int) -> None:
    """Prefetch the lists of the block about a cell, before they are changed."""
    for r in range(-1, 2):
        first = _fold(row + r, grid.rows) * grid.columns
        for c in range(-1, 2):
            fetch(grid.blocks, (first + _fold(column + c, grid.columns), 0))


@jit
def square_range(length: float, inclusive: bool) -> float:
    """Return the bound b of squared distances; `distance2 < b` means in range.

    Boids in range are nearer than `length`, or with `inclusive` at most at `length`.
    """
    square = length * length
    return np.nextafter(square, np.inf) if inclusive else square


@jit
def cone(fov: float) -> float:
    """Return the bound of `search` for a full field of view of `fov` degrees.

    A field of 360 degrees and more holds all directions.
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
    """Find the neighbours of a boid in ascending order; return their number.

    The boid perceives boids nearer than the square root of `range2` and within the cone
    about the vector h = (ahead_x, ahead_y). With d the displacement and s the product
    d.h, s / (|d||h|) is the cosine of the angle, and the cone is s|s| >= view |d|^2
    |h|^2. If h is zero, the boid sees all round. Neighbours are the perceived boids
    whose messages the `senses` of `near` let through and that the topology of `near`
    selects.

    Parameters
    ----------
    seen : Flock
        Positions that boids know.
    world : World
        World of the flock.
    grid : Grid
        Grid of `seen`. The search range of the grid is at least the range, or the
        distance `around` of the topology if `around` is less.
    i : int
        Index of the boid that searches.
    range2 : float
        Bound of squared distances; see `square_range`.
    view : float
        Bound of the field of view; see `cone`.
    ahead_x, ahead_y : float
        Vector h ahead of the boid, of any length.
    near : Near
        Storage for the neighbours, which is overwritten.

    Returns
    -------
    int
        Number of neighbours; the neighbours are the first elements of the arrays of
        `near`.
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
    """Return the own position that boid `i` knows."""
    if senses is None:
        return seen.x[i], seen.y[i]
    return senses.own.x[i], senses.own.y[i]


@jit
def _own_cell(senses: Senses | None, grid: Grid, i: int, gaze: Gaze) -> Any:
    """Return the cell of the own position that boid `i` knows."""
    if senses is None:
        return grid.row[i] * grid.columns + grid.column[i]
    row = _index(gaze.y, grid.rows_per_length, grid.rows)
    return row * grid.columns + _index(gaze.x, grid.columns_per_length, grid.columns)


@jit
def _search_in_sight(
    seen: Flock, world: World, grid: Grid, i: int, gaze: Gaze, near: Near
) -> int:
    """Find all boids that boid `i` perceives, in ascending order; return the number.

    The range of `gaze` is at most the range of `grid`.
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
    """Do `search` in a list of more than one block."""
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
    """Append the perceived boids among the first `length` of a block to `near`.

    `found` is the number of boids in `near` before. Return the number afterwards.
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
    """Prefetch the memory that the searches of boids after `i` will read.

    The list is first. Once the list is loaded, the boids in its first block follow.
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
    """Do `search` among all boids.

    The first pass is vectorised over boids. The second pass reads a word of marks at a
    time, and only the marks that are set.
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
    """Return the displacement to boid `j`, its square, and whether `j` is perceived.

    The displacement begins at the position of `gaze`.
    """
    dx, dy = seen.x[j] - gaze.x, seen.y[j] - gaze.y
    if world.minimum_image:
        dx = nearest_image(dx, world.width)
        dy = nearest_image(dy, world.height)
    distance2 = dx * dx + dy * dy
    along = dx * gaze.ahead_x + dy * gaze.ahead_y
    in_view = along * abs(along) >= gaze.bound * distance2
    # A model without a heading passes zeros, and then no cone is computed.
    all_round = (gaze.ahead_x == 0.0) & (gaze.ahead_y == 0.0)
    return dx, dy, distance2, (distance2 < gaze.range2) & (all_round | in_view)
