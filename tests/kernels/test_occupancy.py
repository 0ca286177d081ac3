"""Occupancy grids: which cells are taken, as a slow twin has them, and that the arenas
leave a way.
"""

import math
from collections import deque

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kernels.catalogue import BUILT_IN
from kernels.model import OccupancySettings
from kernels.occupancy import build_occupancy, is_taken
from kernels.settings import WorldSettings
from kernels.worlds import MAPS, build_world, obstacle_distance
from sweep.spec.settings import preset_settings, settings_tuple
from tests import builders, naive

OBSTACLES = [
    [2.0, 2.0, 0.8, 0.8, 1],
    [3.5, 1.0, 1.2, 0.3, 0],
    [5.98, 3.9, 0.5, 0.5, 1],
    [-0.1, 3.0, 0.2, 0.9, 0],
]
WORLD = builders.a_world(6.02, 4.0, obstacles=OBSTACLES)
GRID = OccupancySettings(0.05, 0.2)
OCCUPANCY = build_occupancy(WORLD, GRID)


@pytest.mark.parametrize(
    ("cell", "inflation"), [(0.05, 0.2), (0.13, 0.0), (0.4, 1.1), (9.0, 0.2)]
)
def test_the_taken_cells_are_those_of_the_slow_twin(
    cell: float, inflation: float
) -> None:
    occupancy = build_occupancy(WORLD, OccupancySettings(cell, inflation))
    slow = naive.cells_within(WORLD, cell, inflation)
    assert (occupancy.taken == slow.taken).all()
    assert occupancy.per_length == slow.per_length


@given(st.floats(-1, 7), st.floats(-1, 5))
def test_a_place_is_taken_within_half_a_diagonal_of_the_inflation(
    x: float, y: float
) -> None:
    """Up to half the diagonal of a cell: what counts is its centre. Outside the grid
    everything is taken.
    """
    distance = min(obstacle_distance(WORLD, m, x, y) for m in range(len(OBSTACLES)))
    half = GRID.cell / math.sqrt(2)
    if not (0 <= x < 6.05 and 0 <= y < 4) or distance < GRID.inflation - half:
        assert is_taken(OCCUPANCY, x, y)
    elif distance > GRID.inflation + half:
        assert not is_taken(OCCUPANCY, x, y)


def test_a_wall_takes_the_cells_up_to_the_inflation() -> None:
    """A wall from 4.9 to 5.1 and an inflation of 0.2: the last free centres are 4.675
    and 5.325.
    """
    wall = build_occupancy(
        builders.a_world(10.0, 10.0, obstacles=[[5, 5, 0.1, 5, 0]]), GRID
    )
    centres = (np.flatnonzero(wall.taken[100]) + 0.5) * GRID.cell
    assert centres.tolist() == pytest.approx(np.arange(4.725, 5.3, 0.05).tolist())


@pytest.mark.parametrize(
    "place",
    [(math.nan, 1.0), (math.inf, 1.0), (1.0, -math.inf), (1e308, 1.0), (6.051, 0.1)],
)
def test_what_is_no_place_of_the_world_is_taken(place: tuple[float, float]) -> None:
    assert is_taken(OCCUPANCY, *place)


def test_a_grid_of_too_many_cells_is_an_error() -> None:
    with pytest.raises(
        ValueError, match="would have 16,000,000 cells; at most 10,000,000"
    ):
        build_occupancy(builders.a_world(200.0, 200.0), GRID)


def reachable(taken: np.ndarray, first: tuple[int, int]) -> np.ndarray:
    """The free cells that are connected to the cell (row, column), by going to the four
    next ones.
    """
    seen, frontier = np.zeros_like(taken), deque([first])
    seen[first] = True
    while frontier:
        row, column = frontier.popleft()
        for r, c in (
            (row + 1, column),
            (row - 1, column),
            (row, column + 1),
            (row, column - 1),
        ):
            if (
                0 <= r < len(taken)
                and 0 <= c < len(taken[0])
                and not taken[r, c]
                and not seen[r, c]
            ):
                seen[r, c] = True
                frontier.append((r, c))
    return seen


@pytest.mark.parametrize("inflation", [0.2, 0.4])
@pytest.mark.parametrize(
    "name", [name for name, entry in MAPS.items() if entry.unit == "m"]
)
def test_a_way_leads_from_one_corner_of_an_arena_to_the_other(
    name: str, inflation: float
) -> None:
    """For robots as wide as the model has them, and for some twice as wide; both
    corners are free themselves.
    """
    width, height = MAPS[name].size
    changes = {"map": name, "width": width, "height": height}
    known = builders.settings_of("rustamani2024", BUILT_IN)
    settings = settings_tuple(
        WorldSettings,
        preset_settings("rustamani2024", "as_run", BUILT_IN) | changes,
        known,
    )
    world = build_world(settings, MAPS[name].draw(settings, np.random.default_rng(0)))
    occupancy = build_occupancy(world, OccupancySettings(0.05, inflation))
    ways = reachable(occupancy.taken, (20, 20))
    assert not occupancy.taken[20, 20]
    assert ways[int((height - 1) / 0.05), int((width - 1) / 0.05)]
    assert (ways | occupancy.taken).all()
