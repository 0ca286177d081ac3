"""Who sees whom: range and field of view, through a cell grid that is exact under
sequential updates.

The plane is folded onto a torus of cells, which are at least as large as the range.
Every cell lists the boids of its 3 x 3 block in ascending order. So a search reads one
list, and sums over neighbours have the same bits with any grid. A move into another
cell changes at most nine lists. If that list is long, or if any list has overflowed and
`full` is set, a search looks at everyone instead. Both ways find the same neighbours in
the same order.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.jit import jit
from kernels.state import Floats, Flock, Indices, World

FAR = 9
ALL_ROUND = -4.0
CAPACITY, SMALL_FLOCK = 64, 256
CROWDED = 4
"""A list of more than N / CROWDED boids takes longer to read than everyone: the
processor looks at several boids of everyone at once.
"""


class Grid(NamedTuple):
    """C = columns x rows cells for N boids.

    `members` (C, capacity) holds the lists, the first `length[c]` places of each in
    use; `column` and `row` (N,) say in which cell a boid is; `full` (1,) says that a
    list has overflowed. Lists of more than `longest` are not read. Indices are
    unsigned, which numba reads faster.
    """

    columns: int
    rows: int
    columns_per_length: float
    rows_per_length: float
    longest: int
    members: Indices
    length: Indices
    column: Indices
    row: Indices
    full: NDArray[np.bool_]


class Near(NamedTuple):
    """Room for the neighbours of one boid: who, displacement to it and its square;
    arrays of shape (N + 1,).

    `mark` (N,) says of everyone whether it is one.
    """

    boid: Indices
    dx: Floats
    dy: Floats
    distance2: Floats
    mark: NDArray[np.bool_]


class Gaze(NamedTuple):
    """What one boid can see: the square of its range, the bound of its cone times
    |h|^2, and the vector h ahead.
    """

    range2: float
    bound: float
    ahead_x: float
    ahead_y: float


def build_near(n: int) -> Near:
    """Room for the neighbours of one of `n` boids."""
    return Near(
        np.zeros(n + 1, np.uint32),
        np.zeros(n + 1),
        np.zeros(n + 1),
        np.zeros(n + 1),
        np.zeros(n, np.bool_),
    )


def all_pairs(n: int) -> Grid:
    """The grid of one cell that is always full: every search reads everyone."""
    return Grid(1, 1, 0.0, 0.0, n, *_lists(1, 0, n), np.ones(1, np.bool_))


def _lists(
    cells: int, capacity: int, n: int
) -> tuple[Indices, Indices, Indices, Indices]:
    members, length = np.zeros((cells, capacity), np.uint32), np.zeros(cells, np.uint32)
    return members, length, np.zeros(n, np.uint32), np.zeros(n, np.uint32)


def build_grid(
    flock: Flock, world: World, search_range: float, capacity: int = 0
) -> Grid:
    """The grid of `flock` for searches up to `search_range`; all-pairs where a grid
    would not pay.

    Cells tile the world, so that the fold is the torus where positions wrap. There are
    at most about 4 N of them. A list has room for `capacity` boids; if that is 0, for
    all of a small flock, for four times the mean of a large one.
    """
    n = flock.x.size
    columns, rows = _shape(world, search_range, 4 * n + 16)
    if columns * rows < 9:
        return all_pairs(n)
    if capacity == 0:
        capacity = n if n <= SMALL_FLOCK else max(CAPACITY, 36 * n // (columns * rows))
    lists = _lists(columns * rows, min(capacity, n), n)
    grid = Grid(
        columns,
        rows,
        columns / world.width,
        rows / world.height,
        n // CROWDED,
        *lists,
        np.zeros(1, np.bool_),
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
    for cell in range(grid.length.size):
        grid.length[cell] = 0
    grid.full[0] = False
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
    k = int(grid.length[cell])
    if k == grid.members.shape[1]:
        grid.full[0] = True
        return
    while k > 0 and grid.members[cell, k - 1] > i:
        grid.members[cell, k] = grid.members[cell, k - 1]
        k -= 1
    grid.members[cell, k] = i
    grid.length[cell] += 1


@jit
def _remove(grid: Grid, cell: int, i: int) -> None:
    k, last = 0, int(grid.length[cell]) - 1
    while grid.members[cell, k] != i:
        k += 1
    while k < last:
        grid.members[cell, k] = grid.members[cell, k + 1]
        k += 1
    grid.length[cell] = last


@jit
def move(grid: Grid, i: int, x: float, y: float) -> None:
    """Tell `grid` that boid `i` is now at (x, y). Positions that are not finite are
    left to the end of the step.
    """
    if grid.full[0] or not math.isfinite(x + y):
        return
    old_column, old_row = int(grid.column[i]), int(grid.row[i])
    column = _index(x, grid.columns_per_length, grid.columns)
    row = _index(y, grid.rows_per_length, grid.rows)
    if column != old_column or row != old_row:
        columns_off = _offset(column - old_column, grid.columns)
        rows_off = _offset(row - old_row, grid.rows)
        _change_block(grid, old_column, old_row, columns_off, rows_off, i, False)
        _change_block(grid, column, row, -columns_off, -rows_off, i, True)
        grid.column[i], grid.row[i] = column, row


@jit
def move_all(grid: Grid, flock: Flock) -> None:
    """Tell `grid` where all boids are now, in index order."""
    for i in range(flock.x.size):
        move(grid, i, flock.x[i], flock.y[i])


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
    cosine = math.cos(math.radians(0.5 * fov))
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

    A neighbour is nearer than the square root of `range2` and within the `cone` about
    the vector h = (ahead_x, ahead_y): with the cosine s/(|d||h|) of the angle, s|s| >=
    view |d|^2 |h|^2. Where h is zero, a boid sees all round.
    """
    gaze = Gaze(
        range2, view * (ahead_x * ahead_x + ahead_y * ahead_y), ahead_x, ahead_y
    )
    cell = grid.row[i] * grid.columns + grid.column[i]
    if grid.full[0] or grid.length[cell] > grid.longest:
        return _search_all(seen, world, i, gaze, near)
    found = 0
    for k in range(grid.length[cell]):
        j = grid.members[cell, k]
        near.boid[found] = j
        near.dx[found], near.dy[found], near.distance2[found], is_near = _look(
            seen, world, i, j, gaze
        )
        # Branchless: always write the slot, advance only if the boid is near. The
        # processor would mispredict this branch.
        found += int(is_near & (j != i))
    return found


@jit
def _search_all(seen: Flock, world: World, i: int, gaze: Gaze, near: Near) -> int:
    """`search` among everyone, in two passes of which the first runs on several boids
    at once.
    """
    for j in range(seen.x.size):
        near.mark[j] = _look(seen, world, i, j, gaze)[3]
    near.mark[i] = False
    found = 0
    for j in range(seen.x.size):
        near.boid[found] = j
        found += int(near.mark[j])
    for k in range(found):
        near.dx[k], near.dy[k], near.distance2[k], _ = _look(
            seen, world, i, near.boid[k], gaze
        )
    return found


@jit
def _look(
    seen: Flock, world: World, i: int, j: int, gaze: Gaze
) -> tuple[float, float, float, bool]:
    """The displacement from boid `i` to `j`, its square, and whether `j` is in range
    and in view.
    """
    dx = seen.x[j] - seen.x[i]
    dy = seen.y[j] - seen.y[i]
    if world.minimum_image:
        dx = nearest_image(dx, world.width)
        dy = nearest_image(dy, world.height)
    distance2 = dx * dx + dy * dy
    along = dx * gaze.ahead_x + dy * gaze.ahead_y
    return (
        dx,
        dy,
        distance2,
        (distance2 < gaze.range2) & (along * abs(along) >= gaze.bound * distance2),
    )


@jit
def nearest_image(d: float, period: float) -> float:
    """The difference `d` of two coordinates in [0, period),
    taken the short way round.
    """
    if d > 0.5 * period:
        return d - period
    if d < -0.5 * period:
        return d + period
    return d
