"""Environment maps: from the settings of a world to the obstacles.

The function `draw(settings, rng)` of a map returns the obstacles. The result is an
array of shape (M, 5): x and y of the centre, half width, half height, and 1 for a disc
or 0 for a rectangle. The half width of a disc is the radius. The result may also be a
sequence of rows and Polygons. To add a map, write a function and an entry of MAPS.
"""

import math
import random
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels import arenas
from kernels.elementary import cos, sin
from kernels.jit import jit
from kernels.polygons import from_border, is_polygon
from kernels.registry import Registry
from kernels.settings import INTEGER, WorldSettings
from kernels.shapes import Obstacles, boxes_of, corners_of
from kernels.state import Corners, Floats, World


class Map(NamedTuple):
    """Environment map: the function that draws the obstacles, and the source.

    `size` is the width and height of a map with a fixed size, in `unit`. `random` is
    True if every trial draws the map again. A map without a unit fits any model.
    """

    draw: Callable[[WorldSettings, np.random.Generator], Obstacles]
    text: str
    source: str
    size: tuple[float, float] | None = None
    unit: str = ""
    random: bool = False


def _table(
    x: float, y: float, radius: float, chairs: int, chair: float, distance: float
) -> list[list[float]]:
    """Return a round table and the surrounding square chairs, as rows of five numbers.

    The table has the centre (`x`, `y`) and the radius `radius`. Each of `chairs` chairs
    has the half width `chair` and a centre at `distance` from the centre of the table.
    """
    angles = [i * 2 * math.pi / chairs for i in range(chairs)]
    seats = [
        [x + distance * cos(a), y + distance * sin(a), chair, chair, 0.0]
        for a in angles
    ]
    return [[x, y, radius, radius, 1.0], *seats]


def empty(_settings: WorldSettings, _rng: np.random.Generator) -> Obstacles:
    """Return no obstacles, shape (0, 5)."""
    return np.empty((0, 5))


def random_obstacles(settings: WorldSettings, rng: np.random.Generator) -> Obstacles:
    """Draw `n_obstacles` discs of equal radius.

    The centres are uniform at least `obstacle_margin` from the borders.
    """
    low, n = settings.obstacle_margin, settings.n_obstacles
    x, y = (
        _drawn(low, side - low, n, settings.obstacle_positions, rng)
        for side in (settings.width, settings.height)
    )
    radius = np.full(n, settings.obstacle_radius)
    return np.column_stack([x, y, radius, radius, np.ones(n)])


def _drawn(
    low: float, high: float, n: int, positions: int, rng: np.random.Generator
) -> Floats:
    """Draw `n` coordinates, uniform between two bounds or on the integers between.

    The bounds, truncated to integers, are included in the integers.
    """
    if positions == INTEGER:
        return rng.integers(int(low), int(high), n, endpoint=True).astype(np.float64)
    return rng.uniform(low, high, n)


def cafeteria(_settings: WorldSettings, _rng: np.random.Generator) -> Obstacles:
    """Return two tables of eight chairs."""
    return np.array(_table(200, 200, 40, 8, 10, 60) + _table(600, 400, 30, 8, 10, 50))


TABLE_PLACES = [(x, y) for y in (150, 300, 450) for x in (150, 300, 450, 600)]
"""Centres of the twelve tables before the shift, in px."""


def dense_cafeteria(_settings: WorldSettings, _rng: np.random.Generator) -> Obstacles:
    """Return twelve shifted tables of four to eight chairs.

    The shift and the number of chairs of each table are drawn together, from a fixed
    seed.
    """
    draws = random.Random(100)
    obstacles: list[list[float]] = []
    for x, y in TABLE_PLACES:
        dx, dy = draws.uniform(-40, 40), draws.uniform(-40, 40)
        obstacles += _table(x + dx, y + dy, 30, draws.randint(4, 8), 8, 45)
    return np.array(obstacles)


def dense_cafeteria_heatmap(
    _settings: WorldSettings, _rng: np.random.Generator
) -> Obstacles:
    """Return the dense cafeteria of the published heatmaps.

    All shifts are drawn first, then all numbers of chairs, from a fixed seed.
    """
    draws = random.Random(100)
    places = [
        (x + draws.uniform(-40, 40), y + draws.uniform(-40, 40))
        for x, y in TABLE_PLACES
    ]
    return np.array(
        [row for x, y in places for row in _table(x, y, 30, draws.randint(4, 8), 8, 45)]
    )


def narrow_corridor(_settings: WorldSettings, _rng: np.random.Generator) -> Obstacles:
    """Return two square blocks of half width 100 about (400, 135) and (400, 465)."""
    return np.array(
        [[400.0, 135.0, 100.0, 100.0, 0.0], [400.0, 465.0, 100.0, 100.0, 0.0]]
    )


_RUSTAMANI = "rustamani2024, section 3"
_AZIEL = "aziel_chen2025, section 3.1"
MAPS = Registry(
    "boidsweep.maps",
    Map,
    {
        "empty": Map(empty, "no obstacles, any size", _AZIEL),
        "random_obstacles": Map(
            random_obstacles,
            "n_obstacles discs",
            "nguyen2024, section 3.1",
            random=True,
        ),
        "cafeteria": Map(
            cafeteria, "two tables with chairs", _AZIEL, (800.0, 600.0), "px"
        ),
        "dense_cafeteria": Map(
            dense_cafeteria, "twelve tables with chairs", _AZIEL, (800.0, 600.0), "px"
        ),
        "dense_cafeteria_heatmap": Map(
            dense_cafeteria_heatmap,
            "the draw of figure 6",
            _AZIEL,
            (800.0, 600.0),
            "px",
        ),
        "narrow_corridor": Map(
            narrow_corridor,
            "two blocks and the gap between",
            _AZIEL,
            (800.0, 600.0),
            "px",
        ),
        "arena": Map(
            arenas.arena, "an empty square for robots", _RUSTAMANI, (10.0, 10.0), "m"
        ),
        "arena_two_obstacles": Map(
            *(
                arenas.arena_two_obstacles,
                "a disc and a box on the diagonal",
                _RUSTAMANI,
            ),
            (10.0, 10.0),
            "m",
        ),
        "maze": Map(
            arenas.maze,
            "walls across the diagonal",
            "ours, in the spirit of " + _RUSTAMANI,
            (10.0, 10.0),
            "m",
        ),
        "field": Map(
            arenas.arena,
            "an empty rectangle, three times as long",
            _RUSTAMANI,
            (30.0, 10.0),
            "m",
        ),
    },
)
"""Maps by their names in specs."""


def build_world(settings: WorldSettings, obstacles: Obstacles) -> World:
    """Return the World of `settings` with the obstacles that a map draws."""
    boxes = boxes_of(obstacles, settings.width, settings.height)
    x, y, half_width, half_height, is_round = np.ascontiguousarray(boxes.T)
    size = (settings.width, settings.height, settings.borders, settings.minimum_image)
    return World(
        *size,
        x,
        y,
        half_width,
        half_height,
        is_round == 1.0,
        settings.goal_x,
        settings.goal_y,
        corners_of(obstacles),
    )


class Reach(NamedTuple):
    """Grid of the obstacles that can act at a point.

    The indices of the obstacles of cell c are `obstacle[first[c] : first[c + 1]]`,
    ascending. The grid covers the world. An additional last cell is for all points
    outside and has the indices of all M obstacles. `columns_per_length` and
    `rows_per_length` are cells per unit of length.
    """

    columns: int
    rows: int
    columns_per_length: float
    rows_per_length: float
    first: NDArray[np.int64]
    obstacle: NDArray[np.int64]


MOST_COLUMNS = 80
"""Number of cells along the longer side of the world."""
CELLS_AN_OBSTACLE = 4
"""Maximum number of cells per obstacle in a square world of moving obstacles."""


def build_reach(world: World, margin: float) -> Reach:
    """Return the Reach of obstacles that do not move.

    An obstacle acts up to `margin` beyond its larger half width, in the unit of length.
    """
    everywhere = math.isinf(margin) or world.obstacle_x.size == 0
    reach = _empty_reach(world, 1 if everywhere else MOST_COLUMNS)
    _count_entries(world, margin, reach)
    return _filled(world, margin, reach, int(reach.first.sum()))


def build_moving_reach(world: World, margin: float) -> Reach:
    """Return the Reach of moving obstacles at the present positions.

    The Reach has room for obstacles at any positions, and `enter_obstacles` enters the
    obstacles again after a move. So a cell is about as large as the region in which an
    obstacle acts, and the number of cells is not much larger than the number of
    obstacles. An obstacle acts up to `margin` beyond its larger half width, in the unit
    of length. The world has at least one obstacle.
    """
    n, longer = world.obstacle_x.size, max(world.width, world.height)
    extent = np.maximum(world.half_width, world.half_height) + margin
    most = math.sqrt(CELLS_AN_OBSTACLE * n)
    side = max(2.0 * float(extent.mean()), longer / most)
    reach = _empty_reach(world, max(1, round(longer / side)))
    across, along = (
        np.minimum(np.ceil(2.0 * extent * per_length) + 2.0, cells).sum()
        for per_length, cells in (
            (reach.columns_per_length, reach.columns),
            (reach.rows_per_length, reach.rows),
        )
    )
    return _filled(world, margin, reach, n + int(across * along))


def _empty_reach(world: World, most: int) -> Reach:
    """Return a Reach of no obstacle, with `most` cells along the longer side."""
    cell = max(world.width, world.height) / most
    columns = max(1, round(world.width / cell))
    rows = max(1, round(world.height / cell))
    first, obstacle = np.zeros(columns * rows + 2, np.int64), np.zeros(0, np.int64)
    per_width, per_height = columns / world.width, rows / world.height
    return Reach(columns, rows, per_width, per_height, first, obstacle)


def _filled(world: World, margin: float, reach: Reach, room: int) -> Reach:
    """Return the Reach with all obstacles entered, and with room for `room` entries."""
    reach = reach._replace(obstacle=np.zeros(room, np.int64))
    enter_obstacles(world, margin, reach)
    return reach


@jit
def enter_obstacles(world: World, margin: float, reach: Reach) -> None:
    """Enter all obstacles into a Reach at the present positions.

    Lists are filled from the end, so that indices ascend.

    Parameters
    ----------
    world : World
        World with the M obstacles.
    margin : float
        Distance beyond the larger half width up to which an obstacle acts, in the unit
        of length.
    reach : Reach
        Grid with room for all entries; its lists are overwritten.
    """
    cells = reach.first.size - 1
    for cell in range(cells):
        reach.first[cell] = 0
    _count_entries(world, margin, reach)
    end = 0
    for cell in range(cells):
        end += reach.first[cell]
        reach.first[cell] = end
    reach.first[cells] = end
    for m in range(world.obstacle_x.size - 1, -1, -1):
        left, right, low, high = _touched(world, margin, reach, m)
        for row in range(low, high):
            for column in range(left, right):
                _enter(reach, row * reach.columns + column, m)
        _enter(reach, cells - 1, m)


@jit
def _enter(reach: Reach, cell: int, m: int) -> None:
    """Put obstacle `m` before the list of a cell."""
    reach.first[cell] -= 1
    reach.obstacle[reach.first[cell]] = m


@jit
def _count_entries(world: World, margin: float, reach: Reach) -> None:
    """Add to `first` of each cell the number of obstacles that belong to the cell."""
    for m in range(world.obstacle_x.size):
        left, right, low, high = _touched(world, margin, reach, m)
        for row in range(low, high):
            for column in range(left, right):
                reach.first[row * reach.columns + column] += 1
        reach.first[reach.first.size - 2] += 1


@jit
def _touched(
    world: World, margin: float, reach: Reach, m: int
) -> tuple[int, int, int, int]:
    """Return the cells in which obstacle `m` acts, as bounds of columns and of rows.

    The bounds are the first column, the end of the columns, the first row and the end
    of the rows. The ends are exclusive.
    """
    x, y = world.obstacle_x[m], world.obstacle_y[m]
    r = (max(world.half_width[m], world.half_height[m]) + margin) * (1 + 1e-9)
    left, right = _cells(x - r, x + r, reach.columns_per_length, reach.columns)
    low, high = _cells(y - r, y + r, reach.rows_per_length, reach.rows)
    return left, right, low, high


@jit
def _cells(low: float, high: float, per_length: float, n: int) -> tuple[int, int]:
    """Return the first and the end (exclusive) of the cells from `low` to `high`."""
    if math.isinf(high):
        return 0, n
    return max(0, math.floor(low * per_length)), min(
        n - 1, math.floor(high * per_length)
    ) + 1


@jit
def reach_cell(reach: Reach, x: float, y: float) -> int:
    """Return the index of the cell of a Reach at a point; the last cell outside.

    Parameters
    ----------
    reach : Reach
        Grid of obstacles.
    x, y : float
        Point, in the unit of length of the model.
    """
    column = x * reach.columns_per_length
    row = y * reach.rows_per_length
    if 0.0 <= column < reach.columns and 0.0 <= row < reach.rows:
        return int(row) * reach.columns + int(column)
    return reach.columns * reach.rows


@jit
def inside_obstacle(world: World, m: int, x: float, y: float) -> bool:
    """Return whether a point is strictly inside an obstacle.

    Parameters
    ----------
    world : World
        World with the obstacles.
    m : int
        Index of the obstacle.
    x, y : float
        Point, in the unit of length of the model.
    """
    return _inside(world.corners, world, m, x, y)


@jit
def _inside(corners: Corners | None, world: World, m: int, x: float, y: float) -> bool:
    if corners is not None and is_polygon(corners, m):
        _, _, solid = from_border(corners, m, x, y)
        return solid
    dx = x - world.obstacle_x[m]
    dy = y - world.obstacle_y[m]
    if world.is_round[m]:
        return bool(dx * dx + dy * dy < world.half_width[m] * world.half_width[m])
    return bool(abs(dx) < world.half_width[m] and abs(dy) < world.half_height[m])


@jit
def obstacle_distance(world: World, m: int, x: float, y: float) -> float:
    """Return the distance of a point from the surface of an obstacle; negative inside.

    Parameters
    ----------
    world : World
        World with the obstacles.
    m : int
        Index of the obstacle.
    x, y : float
        Point, in the unit of length of the model.

    Returns
    -------
    float
        Euclidean distance, in the unit of length. Inside a rectangle the value is minus
        the distance to the nearest side.
    """
    return _distance(world.corners, world, m, x, y)


@jit
def _distance(
    corners: Corners | None, world: World, m: int, x: float, y: float
) -> float:
    if corners is not None and is_polygon(corners, m):
        from_x, from_y, solid = from_border(corners, m, x, y)
        distance = math.sqrt(from_x * from_x + from_y * from_y)
        return -distance if solid else distance
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
    """Return whether a point is strictly inside any obstacle.

    Parameters
    ----------
    world : World
        World with the obstacles.
    contact : Reach
        Reach of `world` with margin 0.
    x, y : float
        Point, in the unit of length of the model.
    """
    cell = reach_cell(contact, x, y)
    for k in range(contact.first[cell], contact.first[cell + 1]):
        if inside_obstacle(world, contact.obstacle[k], x, y):
            return True
    return False
