"""Occupancy grids of robots: the cells near obstacles."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.jit import jit
from kernels.model import MOST_CELLS, OccupancySettings
from kernels.state import World
from kernels.worlds import obstacle_distance


class Occupancy(NamedTuple):
    """Grid of occupied cells.

    `taken` (rows, columns) is True for occupied cells. All positions outside the grid
    count as taken too. `per_length` is the number of cells per unit of length.
    """

    taken: NDArray[np.bool_]
    per_length: float


def no_occupancy() -> Occupancy:
    """Return the empty grid of a model without an occupancy grid."""
    return Occupancy(np.zeros((0, 0), np.bool_), 0.0)


def build_occupancy(world: World, settings: OccupancySettings) -> Occupancy:
    """Return the occupancy grid of a world.

    A cell is taken if its centre is nearer than `settings.inflation` to an obstacle.

    Raises
    ------
    ValueError
        If the grid would have more than MOST_CELLS cells.
    """
    rows, columns = (
        math.ceil(world.height / settings.cell),
        math.ceil(world.width / settings.cell),
    )
    if rows * columns > MOST_CELLS:
        raise ValueError(
            f"the occupancy grid would have {rows * columns:,} cells; at most"
            f" {MOST_CELLS:,} are allowed"
        )
    taken = np.zeros((rows, columns), np.bool_)
    _take(world, settings.cell, settings.inflation, taken)
    return Occupancy(taken, 1.0 / settings.cell)


@jit
def _take(
    world: World, cell: float, inflation: float, taken: NDArray[np.bool_]
) -> None:
    """Mark the cells near every obstacle as taken.

    The loops visit only the cells in the rectangle about each obstacle.
    """
    rows, columns = taken.shape
    for m in range(world.obstacle_x.size):
        across = world.half_width[m] + inflation
        along = max(world.half_width[m], world.half_height[m]) + inflation
        left = max(0, math.floor((world.obstacle_x[m] - across) / cell))
        right = min(columns - 1, math.ceil((world.obstacle_x[m] + across) / cell))
        low = max(0, math.floor((world.obstacle_y[m] - along) / cell))
        high = min(rows - 1, math.ceil((world.obstacle_y[m] + along) / cell))
        for row in range(low, high + 1):
            for column in range(left, right + 1):
                if (
                    obstacle_distance(
                        world, m, (column + 0.5) * cell, (row + 0.5) * cell
                    )
                    < inflation
                ):
                    taken[row, column] = True


@jit
def is_taken(occupancy: Occupancy, x: float, y: float) -> bool:
    """Return whether the cell at a point is taken; True outside the grid.

    Parameters
    ----------
    occupancy : Occupancy
        Grid of the world.
    x, y : float
        Point, in the unit of length of the model.
    """
    column, row = x * occupancy.per_length, y * occupancy.per_length
    rows, columns = occupancy.taken.shape
    return bool(
        not (0.0 <= column < columns and 0.0 <= row < rows)
        or occupancy.taken[int(row), int(column)]
    )
