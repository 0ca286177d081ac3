"""Visited pixels.

A pixel is a point (column, row) of the world, with integers in units of the side of a
pixel. A pixel outside all obstacles is traversable.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.jit import jit
from kernels.settings import STAMP, Observation
from kernels.state import Indices, World
from kernels.worlds import Reach, inside_any

BLOCKED, N_SUMS = -(2**30), 3
"""First visit count of pixels in obstacles, and number of sums.

Counts in obstacles always stay negative, so no second array is needed to mark
obstacles.
"""
BAND = 64
"""Rows of pixels per band of a thread.

Few footprints are in two bands, and a gathered flock covers more than one band.
"""


class Coverage(NamedTuple):
    """Visit counts and their running sums.

    `visits` (rows * columns,) counts footprints, row by row, and is negative in
    obstacles. `traversable` is the number of pixels outside obstacles, and `per_length`
    the number of pixels per unit of length. `stamp` (P,) holds the P pixels of a
    footprint about a position truncated to integers, counted from the corner of the
    square of the footprint. `stamp` is empty if footprints are discs about the true
    position. `sums` (3,) holds the number of visited pixels, the sum and the sum of
    squares of the visit counts.
    """

    visits: NDArray[np.int32]
    rows: int
    columns: int
    traversable: int
    per_length: float
    radius: float
    stamp: Indices
    sums: NDArray[np.int64]


def build_coverage(world: World, contact: Reach, observation: Observation) -> Coverage:
    """Return a Coverage of a world without any visit.

    Parameters
    ----------
    world : World
        Gives size and obstacles.
    contact : Reach
        The Reach of `world` with margin 0.
    observation : Observation
        Gives side of a pixel, radius and kind of footprints.

    Returns
    -------
    Coverage
    """
    rows, columns = coverage_shape(world.width, world.height, observation.pixel)
    radius = observation.footprint_radius
    visits = np.zeros(rows * columns, np.int32)
    block(world, contact, visits, rows, columns, observation.pixel)
    traversable = int((visits == 0).sum())
    stamp = (
        _stamp(radius, columns)
        if observation.footprint == STAMP
        else np.zeros(0, np.uint32)
    )
    return Coverage(
        visits,
        rows,
        columns,
        traversable,
        1.0 / observation.pixel,
        radius,
        stamp,
        np.zeros(N_SUMS, np.int64),
    )


def coverage_shape(width: float, height: float, pixel: float) -> tuple[int, int]:
    """Return the numbers of rows and columns of whole pixels in a world.

    Parameters
    ----------
    width, height : float
        Size of the world.
    pixel : float
        Side of a pixel, in the same unit.

    Returns
    -------
    tuple of int
        Rows and columns. A remainder below 1e-12 of the size makes a whole pixel.
    """
    return int(height / pixel * (1 + 1e-12)), int(width / pixel * (1 + 1e-12))


def no_coverage() -> Coverage:
    """Return a Coverage without pixels, for trials that record none."""
    return Coverage(
        np.zeros(0, np.int32),
        0,
        0,
        0,
        0.0,
        0.0,
        np.zeros(0, np.uint32),
        np.zeros(N_SUMS, np.int64),
    )


def unvisited(coverage: Coverage) -> Coverage:
    """Return a Coverage of the same pixels with separate arrays.

    `coverage` must have no visits.
    """
    return coverage._replace(visits=coverage.visits.copy(), sums=coverage.sums.copy())


def go_on_covering(coverage: Coverage, earlier: Coverage) -> None:
    """Take over the visits of an earlier Coverage of a world with equal pixels.

    Obstacles may differ: pixels that are in obstacles before or now have no visits.
    Nothing is taken over from a world with other pixels.

    Parameters
    ----------
    coverage : Coverage
        Coverage without visits, changed in place.
    earlier : Coverage
        Coverage with the visits so far.
    """
    if (coverage.rows, coverage.columns, coverage.per_length) != (
        *(earlier.rows, earlier.columns, earlier.per_length),
    ):
        return
    lasting = (coverage.visits < 0) == (earlier.visits < 0)
    coverage.visits[lasting] = earlier.visits[lasting]
    visits = coverage.visits[coverage.visits > 0].astype(np.int64)
    coverage.sums[:] = visits.size, visits.sum(), (visits * visits).sum()


def _stamp(radius: float, columns: int) -> Indices:
    whole = int(radius)
    y, x = np.mgrid[-whole : whole + 1, -whole : whole + 1]
    inside = x * x + y * y <= radius * radius
    pixels: Indices = ((y + whole) * columns + x + whole)[inside].astype(np.uint32)
    return pixels


@jit
def block(
    world: World,
    contact: Reach,
    visits: NDArray[np.int32],
    rows: int,
    columns: int,
    pixel: float,
) -> None:
    """Mark the pixels of `visits` in obstacles.

    Parameters
    ----------
    world : World
        Gives obstacles.
    contact : Reach
        The Reach of `world` with margin 0.
    visits : array of int32, shape (rows * columns,)
        Visit counts; BLOCKED is written for pixels in obstacles.
    rows, columns : int
        Shape of the pixels.
    pixel : float
        Side of a pixel.
    """
    for row in range(rows):
        for column in range(columns):
            if inside_any(world, contact, column * pixel, row * pixel):
                visits[row * columns + column] = BLOCKED


@jit
def mark(coverage: Coverage, x: float, y: float) -> None:
    """Count a visit of the footprint about (x, y).

    The footprint has the pixels within `radius` of the position, or of the pixel of the
    position. Pixels outside the world or in obstacles do not count. Source: section 3.2
    of aziel_chen2025.

    Parameters
    ----------
    coverage : Coverage
        Visit counts and sums, changed in place.
    x, y : float
        Position of a boid.
    """
    mark_share(coverage, x, y, 0, 1)


@jit
def mark_share(coverage: Coverage, x: float, y: float, rank: int, size: int) -> None:
    """Count a visit as `mark` does, in the rows of one of `size` threads.

    Parameters
    ----------
    coverage : Coverage
        Visit counts and sums, changed in place.
    x, y : float
        Position of a boid.
    rank : int
        Index of the thread, from 0.
    size : int
        Number of threads.
    """
    x, y = x * coverage.per_length, y * coverage.per_length
    radius = coverage.radius
    right, top = coverage.columns - radius - 1.0, coverage.rows - radius - 1.0
    if coverage.stamp.size > 0 and radius <= x < right and radius <= y < top:
        row, width = int(y) - int(radius), 2 * int(radius)
        corner = np.uint32(row * coverage.columns + int(x) - int(radius))
        if size > 1 and row // BAND != (row + width) // BAND:
            _mark_stamp(coverage, corner, rank, size)
        elif _is_of(row, rank, size):
            _mark_stamp(coverage, corner, 0, 1)
    elif (
        -radius - 1.0 < x < coverage.columns + radius
        and -radius - 1.0 < y < coverage.rows + radius
    ):
        _mark_clipped(coverage, x, y, rank, size)


@jit
def _is_of(row: int, rank: int, size: int) -> bool:
    """Return whether a row of pixels belongs to the `rank`-th of `size` threads.

    Bands of BAND rows belong to the threads in turn.
    """
    return row // BAND % size == rank


@jit
def _mark_stamp(coverage: Coverage, corner: np.uint32, rank: int, size: int) -> None:
    """Count the stamp whose square has its first pixel at `corner`.

    The whole square is in the world.
    """
    new, visits, total = 0, 0, 0
    for k in range(coverage.stamp.size):
        pixel = corner + coverage.stamp[k]
        if size > 1 and not _is_of(int(pixel) // coverage.columns, rank, size):
            continue
        count = coverage.visits[pixel]
        coverage.visits[pixel] = count + 1
        new += int(count == 0)
        visits += int(count >= 0)
        total += max(count, 0)
    _add(coverage, new, visits, total)


@jit
def _mark_clipped(coverage: Coverage, x: float, y: float, rank: int, size: int) -> None:
    """Count the part of the footprint about (x, y) that is in the world.

    The centre of a footprint with a stamp is the point truncated to integers.
    """
    radius = coverage.radius
    if coverage.stamp.size > 0:
        x, y = float(int(x)), float(int(y))
    new, visits, total = 0, 0, 0
    for row in range(
        max(0, math.ceil(y - radius)),
        min(coverage.rows - 1, math.floor(y + radius)) + 1,
    ):
        if not _is_of(row, rank, size):
            continue
        half = math.sqrt(max(0.0, radius * radius - (row - y) * (row - y)))
        for column in range(
            max(0, math.ceil(x - half)),
            min(coverage.columns - 1, math.floor(x + half)) + 1,
        ):
            count = coverage.visits[row * coverage.columns + column]
            coverage.visits[row * coverage.columns + column] = count + 1
            new += int(count == 0)
            visits += int(count >= 0)
            total += max(count, 0)
    _add(coverage, new, visits, total)


@jit
def _add(coverage: Coverage, new: int, visits: int, total: int) -> None:
    """Add one more visit of each of some pixels to the sums.

    The `visits` pixels had `total` visits together, and `new` of the pixels had no
    visit. The square of a count grows by 2 count + 1.
    """
    coverage.sums[0] += new
    coverage.sums[1] += visits
    coverage.sums[2] += 2 * total + visits


def heatmap(coverage: Coverage) -> NDArray[np.int32]:
    """Return visit counts, shape (rows, columns); -1 in obstacles."""
    counts = np.where(coverage.visits < 0, np.int32(-1), coverage.visits)
    return counts.reshape(coverage.rows, coverage.columns)
