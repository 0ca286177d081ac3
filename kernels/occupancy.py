"""Occupancy grids, as robots keep them: which cells of the world are within a distance
of an obstacle.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.jit import jit
from kernels.model import MOST_CELLS, OccupancySettings
from kernels.state import World
from kernels.worlds import obstacle_distance


class Occupancy(NamedTuple):
    """`taken` (rows, columns) says which cells are taken. Everything outside the grid
    counts as taken too.
    """

    taken: NDArray[np.bool_]
    per_length: float


def no_occupancy() -> Occupancy:
    """The empty grid of a model that uses none."""
    return Occupancy(np.zeros((0, 0), np.bool_), 0.0)


def build_occupancy(world: World, settings: OccupancySettings) -> Occupancy:
    """The grid of `world`: a cell is taken if its centre is nearer than
    `settings.inflation` to an obstacle.

    Raises ValueError where it would have more than MOST_CELLS cells.
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
    """Mark the cells near every obstacle as taken. Only the cells in the square about
    the obstacle are looked at.
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
    """Whether the cell at (x, y) is taken; True outside the grid."""
    column, row = x * occupancy.per_length, y * occupancy.per_length
    rows, columns = occupancy.taken.shape
    return bool(
        not (0.0 <= column < columns and 0.0 <= row < rows)
        or occupancy.taken[int(row), int(column)]
    )
