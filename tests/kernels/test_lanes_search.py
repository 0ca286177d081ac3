"""The rough look in lanes, in single precision, leaves out nobody who is near."""

from itertools import product
from typing import Any

import numba
import numpy as np
import pytest

from kernels.lanes.rows import rows
from kernels.lanes.search import build_places, look_roughly, move
from kernels.lanes.vectors import OPTIONS, WIDTH
from kernels.neighbours import ALL_ROUND, Gaze, cone
from kernels.torus import nearest_image
from tests.builders import a_world

N = 41
WAY = float(np.nextafter(1.0, 0.0))
NOWHERE = np.zeros((2, WIDTH))


@numba.njit(**OPTIONS)
def told(places, x, y):  # type: ignore[no-untyped-def]
    all_x, all_y = rows(x), rows(y)
    for i in range(all_x.size):
        move(places, i, all_x[i], all_y[i])


@numba.njit(**OPTIONS)
def noted(world, places, i, range2, view, x, y, n):  # type: ignore[no-untyped-def]
    ahead_x, ahead_y = rows(x)[0], rows(y)[0]
    bound = view * (ahead_x * ahead_x + ahead_y * ahead_y)
    gaze = Gaze(range2, bound, ahead_x, ahead_y, x[i], y[i])
    look_roughly(world, places, i, gaze, view, n)


def are_close(
    world: Any,
    reach: float,
    length: float,
    x: Any,
    y: Any,
    view: float = ALL_ROUND,
    ahead: Any = NOWHERE,
) -> Any:
    """For boid 0, in which lanes others (N, WIDTH) may be within `length`, and within
    the cone `view` about the vectors `ahead` (2, WIDTH).
    """
    places = build_places(N, reach)
    told(places, x, y)
    ahead_x, ahead_y = ahead[:, None, :].copy()
    noted(world, places, 0, length * length, view, ahead_x, ahead_y, N)
    close = places.close[:N, None]
    return np.unpackbits(close, axis=1, bitorder="little").astype(bool)


@pytest.mark.parametrize("reach", [1e-30, 1.0, 60.0, 1e25])
def test_who_is_just_near_is_close(reach: float) -> None:
    for share, far in product((1.0, 1e-3), (1.0, 30.0, 999.0, 1e5)):
        at_the_end_are_close(reach, share, far)


def at_the_end_are_close(reach: float, share: float, far: float) -> None:
    """Others stand at the very end of the range, in all directions."""
    rng = np.random.default_rng(1)
    length = reach * share
    angle = rng.uniform(0.0, 2.0 * np.pi, (N, WIDTH))
    x, y = rng.uniform(-far, far, (2, 1, WIDTH)) * reach
    x = x + length * WAY * np.cos(angle)
    y = y + length * WAY * np.sin(angle)
    x[0], y[0] = x[0] - length * np.cos(angle[0]), y[0] - length * np.sin(angle[0])
    near = (x - x[0]) ** 2 + (y - y[0]) ** 2 < length**2
    assert near.sum() > 100
    found = are_close(a_world(1e6, 1e6), reach, length, x, y)
    assert not (near & ~found).any()


@pytest.mark.parametrize("share", [1.0, 1e-3])
def test_who_is_near_round_the_world_is_close(share: float) -> None:
    reach, size = 1.0, 997.3
    rng = np.random.default_rng(2)
    world = a_world(size, size)._replace(minimum_image=True)
    angle = rng.uniform(0.0, 2.0 * np.pi, (N, WIDTH))
    x, y = rng.uniform(0.0, 0.2 * share, (2, 1, WIDTH))
    x = (x + share * WAY * np.cos(angle)) % size
    y = (y + share * WAY * np.sin(angle)) % size
    x[0], y[0] = 0.1 * share, size - 0.1 * share
    image = np.vectorize(nearest_image)
    ways = image(x - x[0], size) ** 2 + image(y - y[0], size) ** 2
    near = ways < share**2
    assert near.sum() > 100
    assert not (near & ~are_close(world, reach, share, x, y)).any()


@pytest.mark.parametrize("fov", [0.0, 30.0, 150.0, 180.0, 270.0, 350.0])
def test_who_is_just_in_the_cone_is_close(fov: float) -> None:
    reaches, speeds = (1e-30, 1.0, 60.0, 1e18), (0.0, 1e-25, 1e-12, 5.0, 1e15)
    for reach, far, speed in product(reaches, (1.0, 30.0, 999.0), speeds):
        at_the_edge_are_close(reach, far, speed, fov)


def at_the_edge_are_close(reach: float, far: float, speed: float, fov: float) -> None:
    """Others stand at the very edge of the cone, near and far, on both sides."""
    rng = np.random.default_rng(4)
    view, half = float(cone(fov)), np.radians(fov / 2.0)
    heading = rng.uniform(0.0, 2.0 * np.pi, WIDTH)
    ahead = speed * np.array([np.cos(heading), np.sin(heading)])
    angle = heading + half * rng.choice([-1.0, 1.0], (N, WIDTH))
    way = reach * rng.choice([1e-6, 1e-2, 0.5, 1.0], (N, WIDTH)) * WAY
    x, y = rng.uniform(-far, far, (2, 1, WIDTH)) * reach
    x, y = x + way * np.cos(angle), y + way * np.sin(angle)
    x[0] -= way[0] * np.cos(angle[0])
    y[0] -= way[0] * np.sin(angle[0])
    dx, dy = x - x[0], y - y[0]
    along, square = dx * ahead[0] + dy * ahead[1], dx * dx + dy * dy
    in_view = along * abs(along) >= view * (ahead * ahead).sum(axis=0) * square
    seen = (square < reach**2) & (in_view | (speed == 0.0))
    assert seen.sum() > 20
    found = are_close(a_world(1e6, 1e6), reach, reach, x, y, view, ahead)
    assert not (seen & ~found).any()


def test_who_is_behind_is_not_close() -> None:
    x, y = np.zeros((2, N, WIDTH))
    x[1:] = np.linspace(-0.9, 0.9, N - 1)[:, None]
    ahead = np.ones((2, WIDTH)) * [[3.0], [0.0]]
    ahead[:, 5] = 0.0
    found = are_close(a_world(1e6, 1e6), 1.0, 1.0, x, y, float(cone(150.0)), ahead)
    in_front, slow = x > 0.0, np.arange(WIDTH) == 5
    assert found[:, slow].all()
    beyond = abs(x) > 0.1
    assert (found == in_front)[beyond & ~slow].all()


def test_squares_of_few_digits_are_close() -> None:
    """In single precision the squares of both parts of this way are rounded up."""
    length = float(np.sqrt(3.0 * 2.0**-149)) * 1.0001
    x, y = np.zeros((2, N, WIDTH))
    x[1:] = y[1:] = length * np.sqrt(0.5) * (1.0 - 1e-9)
    assert are_close(a_world(1e6, 1e6), length, length, x, y)[1:].all()


def test_who_is_far_is_not_close_and_places_without_a_number_are() -> None:
    x, y = np.zeros((2, N, WIDTH))
    x[1:] = 1.1
    x[1, 3], y[2, 4], x[3, 5] = np.nan, np.inf, 1e4
    found = are_close(a_world(1e6, 1e6), 1.0, 1.0, x, y)
    assert found[0].all()
    assert [tuple(one) for one in np.argwhere(found[1:])] == [(0, 3), (1, 4), (2, 5)]
