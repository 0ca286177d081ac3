"""Pixels of obstacles and footprints."""

from typing import Any

import numpy as np

from tests.naive.rules import Vector


def inside_any(world: Any, x: float, y: float) -> bool:
    across, along = np.abs(x - world.obstacle_x), np.abs(y - world.obstacle_y)
    disc = across**2 + along**2 < world.half_width**2
    return bool(
        np.where(
            world.is_round,
            disc,
            (across < world.half_width) & (along < world.half_height),
        ).any()
    )


def blocked(world: Any, rows: int, columns: int) -> Vector:
    return np.array(
        [
            [inside_any(world, column, row) for column in range(columns)]
            for row in range(rows)
        ]
    )


def visits(
    positions: Vector, radius: float, stamp: bool, rows: int, columns: int
) -> Vector:
    """How many footprints at `positions` (K, 2) cover each pixel."""
    row, column = np.mgrid[0:rows, 0:columns]
    counts = np.zeros((rows, columns), int)
    for x, y in np.trunc(positions) if stamp else positions:
        counts += (column - x) ** 2 + (row - y) ** 2 <= radius**2
    return counts
