"""Repulsion by obstacles and walls."""

import math

from kernels.arbitration import TINY
from kernels.jit import jit
from kernels.state import World
from kernels.worlds import Reach, reach_cell


@jit
def _size(world: World, m: int) -> float:
    """Radius of a disc, larger half width of a rectangle."""
    return float(max(world.half_width[m], world.half_height[m]))


@jit
def repulsion_unit(
    world: World, reach: Reach, margin: float, x: float, y: float
) -> tuple[float, float]:
    """The sum of unit vectors away from obstacles within `margin` of their surface: Eq.
    (7) of nguyen2024.
    """
    force_x, force_y = 0.0, 0.0
    cell = reach_cell(reach, x, y)
    for k in range(reach.first[cell], reach.first[cell + 1]):
        m = reach.obstacle[k]
        dx = x - world.obstacle_x[m]
        dy = y - world.obstacle_y[m]
        distance = math.sqrt(dx * dx + dy * dy)
        scale = (1.0 if distance < _size(world, m) + margin else 0.0) / max(
            distance, TINY
        )
        force_x += dx * scale
        force_y += dy * scale
    return force_x, force_y


@jit
def repulsion_inverse(
    world: World, reach: Reach, margin: float, epsilon: float, x: float, y: float
) -> tuple[float, float]:
    """The sum of d / (|d| (|d| + epsilon)) over obstacles within `margin` of their
    surface: f_obs of aziel_chen2025.

    The text has (|d| + epsilon)^2 below the line; the two agree to one part in 10^10
    from 1 px on.
    """
    force_x, force_y = 0.0, 0.0
    cell = reach_cell(reach, x, y)
    for k in range(reach.first[cell], reach.first[cell + 1]):
        m = reach.obstacle[k]
        dx = x - world.obstacle_x[m]
        dy = y - world.obstacle_y[m]
        distance = math.sqrt(dx * dx + dy * dy)
        scale = (1.0 if distance < _size(world, m) + margin else 0.0) / max(
            distance * (distance + epsilon), TINY
        )
        force_x += dx * scale
        force_y += dy * scale
    return force_x, force_y


@jit
def repulsion_linear(
    world: World, reach: Reach, margin: float, x: float, y: float
) -> tuple[float, float]:
    """The sum of displacements from obstacles within `margin` of their surface: Eq.
    (25) of patel2023.
    """
    force_x, force_y = 0.0, 0.0
    cell = reach_cell(reach, x, y)
    for k in range(reach.first[cell], reach.first[cell + 1]):
        m = reach.obstacle[k]
        dx = x - world.obstacle_x[m]
        dy = y - world.obstacle_y[m]
        counts = 1.0 if math.sqrt(dx * dx + dy * dy) < _size(world, m) + margin else 0.0
        force_x += dx * counts
        force_y += dy * counts
    return force_x, force_y


@jit
def wall_repulsion(position: float, length: float, epsilon: float) -> float:
    """1/(x + epsilon) - 1/(L - x + epsilon) for one coordinate in [0, L]: f_wall of
    aziel_chen2025.

    Beyond a wall the sign changes: a boid that escapes is driven away, as in the
    authors' program.
    """
    return 1.0 / (position + epsilon) - 1.0 / (length - position + epsilon)
