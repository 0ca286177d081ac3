"""Environment maps: from the settings of a world to its obstacles.

A map's `draw(settings, rng)` returns its obstacles, an array of shape (M, 5): x and y of the centre, half width, half
height, and 1 for a disc (whose half width is its radius) or 0 for a rectangle. To add a map, write one such function
and one entry of MAPS.
"""

import math
import random
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.jit import jit
from kernels.settings import INTEGER, WorldSettings
from kernels.state import Floats, World

Obstacles = NDArray[np.float64]


class Map(NamedTuple):
    """`size` is the width and height of a map that has its own, in `unit`; `random` says that every trial draws it.

    A map without a unit goes with any model.
    """

    draw: Callable[[WorldSettings, np.random.Generator], Obstacles]
    text: str
    source: str
    size: tuple[float, float] | None = None
    unit: str = ""
    random: bool = False


def _table(x: float, y: float, radius: float, chairs: int, chair: float, distance: float) -> list[list[float]]:
    """A round table and `chairs` square chairs of half width `chair` at `distance` from its centre."""
    angles = [i * 2 * math.pi / chairs for i in range(chairs)]
    seats = [[x + distance * math.cos(a), y + distance * math.sin(a), chair, chair, 0.0] for a in angles]
    return [[x, y, radius, radius, 1.0], *seats]


def empty(_settings: WorldSettings, _rng: np.random.Generator) -> Obstacles:
    """No obstacles."""
    return np.empty((0, 5))


def random_obstacles(settings: WorldSettings, rng: np.random.Generator) -> Obstacles:
    """`n_obstacles` discs, uniform at least `obstacle_margin` from the borders."""
    low, n = settings.obstacle_margin, settings.n_obstacles
    x, y = (_drawn(low, side - low, n, settings.obstacle_positions, rng) for side in (settings.width, settings.height))
    radius = np.full(n, settings.obstacle_radius)
    return np.column_stack([x, y, radius, radius, np.ones(n)])


def _drawn(low: float, high: float, n: int, positions: int, rng: np.random.Generator) -> Floats:
    """`n` coordinates uniform between two bounds, or among the integers from one to the other."""
    if positions == INTEGER:
        return rng.integers(int(low), int(high), n, endpoint=True).astype(np.float64)
    return rng.uniform(low, high, n)


def cafeteria(_settings: WorldSettings, _rng: np.random.Generator) -> Obstacles:
    """Two tables of eight chairs."""
    return np.array(_table(200, 200, 40, 8, 10, 60) + _table(600, 400, 30, 8, 10, 50))


TABLE_PLACES = [(x, y) for y in (150, 300, 450) for x in (150, 300, 450, 600)]


def dense_cafeteria(_settings: WorldSettings, _rng: np.random.Generator) -> Obstacles:
    """Twelve shifted tables of four to eight chairs: each table's shift and number of chairs drawn together."""
    draws = random.Random(100)
    obstacles: list[list[float]] = []
    for x, y in TABLE_PLACES:
        dx, dy = draws.uniform(-40, 40), draws.uniform(-40, 40)
        obstacles += _table(x + dx, y + dy, 30, draws.randint(4, 8), 8, 45)
    return np.array(obstacles)


def dense_cafeteria_heatmap(_settings: WorldSettings, _rng: np.random.Generator) -> Obstacles:
    """The dense cafeteria of the published heatmaps: all shifts drawn first, then all numbers of chairs."""
    draws = random.Random(100)
    places = [(x + draws.uniform(-40, 40), y + draws.uniform(-40, 40)) for x, y in TABLE_PLACES]
    return np.array([row for x, y in places for row in _table(x, y, 30, draws.randint(4, 8), 8, 45)])


def narrow_corridor(_settings: WorldSettings, _rng: np.random.Generator) -> Obstacles:
    """Two square blocks of half width 100 about (400, 135) and (400, 465)."""
    return np.array([[400.0, 135.0, 100.0, 100.0, 0.0], [400.0, 465.0, 100.0, 100.0, 0.0]])


_AZIEL = "aziel_chen2025, section 3.1"
MAPS: dict[str, Map] = {
    "empty": Map(empty, "no obstacles, any size", _AZIEL),
    "random_obstacles": Map(random_obstacles, "n_obstacles discs", "nguyen2024, section 3.1", random=True),
    "cafeteria": Map(cafeteria, "two tables with chairs", _AZIEL, (800.0, 600.0), "px"),
    "dense_cafeteria": Map(dense_cafeteria, "twelve tables with chairs", _AZIEL, (800.0, 600.0), "px"),
    "dense_cafeteria_heatmap": Map(dense_cafeteria_heatmap, "the draw of figure 6", _AZIEL, (800.0, 600.0), "px"),
    "narrow_corridor": Map(narrow_corridor, "two blocks and the gap between", _AZIEL, (800.0, 600.0), "px"),
}


def build_world(settings: WorldSettings, obstacles: Obstacles) -> World:
    """The World of `settings` with the given obstacles, as a map draws them."""
    x, y, half_width, half_height, is_round = np.ascontiguousarray(obstacles.T)
    size = (settings.width, settings.height, settings.borders, settings.minimum_image)
    return World(*size, x, y, half_width, half_height, is_round == 1.0, settings.goal_x, settings.goal_y)


class Reach(NamedTuple):
    """Which obstacles can act at a place: a grid whose cell c holds `obstacle[first[c] : first[c + 1]]`, ascending.

    The grid covers the world; a place outside may be reached by all M obstacles, whose indices stand last.
    """

    columns: int
    rows: int
    columns_per_length: float
    rows_per_length: float
    first: NDArray[np.int64]
    obstacle: NDArray[np.int64]


CELL = 10.0


def build_reach(world: World, margin: float) -> Reach:
    """The Reach of obstacles that act up to `margin` beyond their larger half width (in the world's unit)."""
    one_cell = math.isinf(margin) or world.obstacle_x.size == 0
    columns = 1 if one_cell else max(1, min(1000, round(world.width / CELL)))
    rows = 1 if one_cell else max(1, min(1000, round(world.height / CELL)))
    first = np.zeros(columns * rows + 2, np.int64)
    reach = np.maximum(world.half_width, world.half_height) + margin
    size = _fill_reach(world, reach, columns, rows, first, np.empty(0, np.int64))
    obstacle = np.empty(size, np.int64)
    _fill_reach(world, reach, columns, rows, first, obstacle)
    return Reach(columns, rows, columns / world.width, rows / world.height, first, obstacle)


@jit
def _fill_reach(
    world: World, reach: Floats, columns: int, rows: int, first: NDArray[np.int64], obstacle: NDArray[np.int64]
) -> int:
    """Fill `first`, and `obstacle` unless it is empty; return how long `obstacle` must be."""
    width = world.width / columns
    height = world.height / rows
    size = 0
    for cell in range(columns * rows):
        first[cell] = size
        x = (cell % columns + 0.5) * width
        y = (cell // columns + 0.5) * height
        for m in range(reach.size):
            beside = abs(x - world.obstacle_x[m]) > 0.5 * width + reach[m]
            above = abs(y - world.obstacle_y[m]) > 0.5 * height + reach[m]
            if not (beside or above):
                if obstacle.size > 0:
                    obstacle[size] = m
                size += 1
    first[columns * rows] = size
    for m in range(reach.size):
        if obstacle.size > 0:
            obstacle[size] = m
        size += 1
    first[columns * rows + 1] = size
    return size


@jit
def reach_cell(reach: Reach, x: float, y: float) -> int:
    """The cell of `reach` at (x, y); the last one outside the world."""
    column = x * reach.columns_per_length
    row = y * reach.rows_per_length
    if 0.0 <= column < reach.columns and 0.0 <= row < reach.rows:
        return int(row) * reach.columns + int(column)
    return reach.columns * reach.rows


@jit
def inside_obstacle(world: World, m: int, x: float, y: float) -> bool:
    """Whether (x, y) lies strictly inside obstacle `m`."""
    dx = x - world.obstacle_x[m]
    dy = y - world.obstacle_y[m]
    if world.is_round[m]:
        return bool(dx * dx + dy * dy < world.half_width[m] * world.half_width[m])
    return bool(abs(dx) < world.half_width[m] and abs(dy) < world.half_height[m])


@jit
def obstacle_distance(world: World, m: int, x: float, y: float) -> float:
    """The distance of (x, y) from the surface of obstacle `m`, negative inside."""
    dx = abs(x - world.obstacle_x[m])
    dy = abs(y - world.obstacle_y[m])
    if world.is_round[m]:
        return float(math.sqrt(dx * dx + dy * dy) - world.half_width[m])
    dx -= world.half_width[m]
    dy -= world.half_height[m]
    across, along = max(dx, 0.0), max(dy, 0.0)
    return float(math.sqrt(across * across + along * along) + min(max(dx, dy), 0.0))


@jit
def inside_any(world: World, contact: Reach, x: float, y: float) -> bool:
    """Whether (x, y) lies strictly inside an obstacle; `contact` is the Reach with margin 0."""
    cell = reach_cell(contact, x, y)
    for k in range(contact.first[cell], contact.first[cell + 1]):
        if inside_obstacle(world, contact.obstacle[k], x, y):
            return True
    return False
