"""Environment maps: from the settings of a world to its obstacles.

A map's `draw(settings, rng)` returns its obstacles, an array of shape (M, 5): x and y
of the centre, half width, half height, and 1 for a disc (whose half width is its
radius) or 0 for a rectangle; or a sequence of such rows and of Polygons. To add a map,
write one such function and one entry of MAPS.
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
    """`size` is the width and height of a map that has its own, in `unit`; `random`
    says that every trial draws it.

    A map without a unit goes with any model.
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
    """A round table and `chairs` square chairs of half width `chair` at `distance` from
    its centre.
    """
    angles = [i * 2 * math.pi / chairs for i in range(chairs)]
    seats = [
        [x + distance * cos(a), y + distance * sin(a), chair, chair, 0.0]
        for a in angles
    ]
    return [[x, y, radius, radius, 1.0], *seats]


def empty(_settings: WorldSettings, _rng: np.random.Generator) -> Obstacles:
    """No obstacles."""
    return np.empty((0, 5))


def random_obstacles(settings: WorldSettings, rng: np.random.Generator) -> Obstacles:
    """`n_obstacles` discs, uniform at least `obstacle_margin` from the borders."""
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
    """`n` coordinates uniform between two bounds, or among the integers from one to the
    other.
    """
    if positions == INTEGER:
        return rng.integers(int(low), int(high), n, endpoint=True).astype(np.float64)
    return rng.uniform(low, high, n)


def cafeteria(_settings: WorldSettings, _rng: np.random.Generator) -> Obstacles:
    """Two tables of eight chairs."""
    return np.array(_table(200, 200, 40, 8, 10, 60) + _table(600, 400, 30, 8, 10, 50))


TABLE_PLACES = [(x, y) for y in (150, 300, 450) for x in (150, 300, 450, 600)]


def dense_cafeteria(_settings: WorldSettings, _rng: np.random.Generator) -> Obstacles:
    """Twelve shifted tables of four to eight chairs: each table's shift and number of
    chairs drawn together.
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
    """The dense cafeteria of the published heatmaps: all shifts drawn first, then all
    numbers of chairs.
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
    """Two square blocks of half width 100 about (400, 135) and (400, 465)."""
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


def build_world(settings: WorldSettings, obstacles: Obstacles) -> World:
    """The World of `settings` with the given obstacles, as a map draws them."""
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
    """Which obstacles can act at a place: a grid whose cell c holds `obstacle[first[c]
    : first[c + 1]]`, ascending.

    The grid covers the world. For places outside there is one more cell, the last, with
    the indices of all M obstacles.
    """

    columns: int
    rows: int
    columns_per_length: float
    rows_per_length: float
    first: NDArray[np.int64]
    obstacle: NDArray[np.int64]


MOST_COLUMNS = 80
"""Cells along the longer side of the world."""
CELLS_AN_OBSTACLE = 4
"""At most, of a square world, where obstacles are entered anew in each step."""


def build_reach(world: World, margin: float) -> Reach:
    """The Reach of obstacles that act up to `margin` beyond their larger half width (in
    the world's unit).
    """
    everywhere = math.isinf(margin) or world.obstacle_x.size == 0
    reach = _empty_reach(world, 1 if everywhere else MOST_COLUMNS)
    _count_entries(world, margin, reach)
    return _filled(world, margin, reach, int(reach.first.sum()))


def build_moving_reach(world: World, margin: float) -> Reach:
    """The Reach of obstacles that move, with room for them wherever they are: it has
    them where they are now, and `enter_obstacles` enters them anew. So cells are about
    as large as that in which an obstacle acts, and not many more than obstacles.
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
    """A Reach of no obstacle, with so many cells along the longer side."""
    cell = max(world.width, world.height) / most
    columns = max(1, round(world.width / cell))
    rows = max(1, round(world.height / cell))
    first, obstacle = np.zeros(columns * rows + 2, np.int64), np.zeros(0, np.int64)
    per_width, per_height = columns / world.width, rows / world.height
    return Reach(columns, rows, per_width, per_height, first, obstacle)


def _filled(world: World, margin: float, reach: Reach, room: int) -> Reach:
    """The Reach with all obstacles, and with room for so many entries."""
    reach = reach._replace(obstacle=np.zeros(room, np.int64))
    enter_obstacles(world, margin, reach)
    return reach


@jit
def enter_obstacles(world: World, margin: float, reach: Reach) -> None:
    """Enter all obstacles into `reach` where they are now, each within `margin` of its
    larger half width. Lists are filled from their ends.
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
    reach.first[cell] -= 1
    reach.obstacle[reach.first[cell]] = m


@jit
def _count_entries(world: World, margin: float, reach: Reach) -> None:
    """Add to the `first` of each cell how many obstacles are entered into it."""
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
    """The cells in which obstacle `m` acts: the first column and the one after the
    last, and such rows.
    """
    x, y = world.obstacle_x[m], world.obstacle_y[m]
    r = (max(world.half_width[m], world.half_height[m]) + margin) * (1 + 1e-9)
    left, right = _cells(x - r, x + r, reach.columns_per_length, reach.columns)
    low, high = _cells(y - r, y + r, reach.rows_per_length, reach.rows)
    return left, right, low, high


@jit
def _cells(low: float, high: float, per_length: float, n: int) -> tuple[int, int]:
    """The first of `n` cells that an interval touches, and the one after the last."""
    if math.isinf(high):
        return 0, n
    return max(0, math.floor(low * per_length)), min(
        n - 1, math.floor(high * per_length)
    ) + 1


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
    """The distance of (x, y) from the surface of obstacle `m`, negative inside."""
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
    """Whether (x, y) lies strictly inside an obstacle; `contact` is the Reach with
    margin 0.
    """
    cell = reach_cell(contact, x, y)
    for k in range(contact.first[cell], contact.first[cell + 1]):
        if inside_obstacle(world, contact.obstacle[k], x, y):
            return True
    return False
