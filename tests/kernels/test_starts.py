"""Initial flocks: where they may be, how they are spread, and the draws of the
published program.
"""

from itertools import product
from random import Random

import numpy as np
import pytest

from kernels.settings import (
    COMPONENTS,
    CONTINUOUS,
    HEADING,
    INTEGER,
    StartSettings,
)
from kernels.starts import STARTS, start_numpy, start_python_random
from kernels.state import Flock
from kernels.worlds import build_reach
from sweep.trial.simulation import Simulation, run
from tests import builders, naive

WORLD = builders.a_world(
    300.0, 200.0, obstacles=[[100, 100, 60, 60, 1], [220, 60, 50, 40, 0]]
)
EMPTY = builders.a_world(300.0, 200.0)
MANY = 4000


def start(
    n: int,
    positions: int,
    velocities: int,
    world: builders.World = WORLD,
    margin: float = 10.0,
    seed: int = 3,
    free: bool = True,
    disc: tuple[float, float, float] = (0.0, 0.0, 0.0),
    distance: float = 0.0,
) -> Flock:
    settings = StartSettings(
        positions, velocities, 2.0, margin, *disc, free, distance, 0
    )
    return start_numpy(
        n, settings, world, build_reach(world, 0.0), np.random.default_rng(seed), 0
    )


@pytest.mark.parametrize(
    ("positions", "velocities"),
    list(product([CONTINUOUS, INTEGER], [HEADING, COMPONENTS])),
)
def test_boids_start_within_the_margin_and_outside_obstacles(
    positions: int, velocities: int
) -> None:
    flock = start(300, positions, velocities)
    assert (
        (flock.x >= 10) & (flock.x <= 290) & (flock.y >= 10) & (flock.y <= 190)
    ).all()
    assert not any(
        naive.inside_any(WORLD, x, y) for x, y in zip(flock.x, flock.y, strict=True)
    )


@pytest.mark.parametrize(("model", "preset", "name"), builders.PRESETS_ON_MAPS)
def test_every_start_on_every_map_is_free(model: str, preset: str, name: str) -> None:
    size = builders.map_size(model, name)
    simulation = Simulation(
        builders.job(model, preset, map=name, **size, n=100, start_free=True)
    )
    flock, world = simulation.flock, simulation.world
    assert not any(
        naive.inside_any(world, x, y) for x, y in zip(flock.x, flock.y, strict=True)
    )


@pytest.mark.parametrize("positions", [CONTINUOUS, INTEGER])
def test_boids_start_in_their_disc_within_the_margin_and_outside_obstacles(
    positions: int,
) -> None:
    """The disc reaches into an obstacle and beyond the margin."""
    flock = start(300, positions, HEADING, disc=(20.0, 60.0, 40.0))
    assert ((flock.x >= 10) & (np.hypot(flock.x - 20, flock.y - 60) <= 40)).all()
    assert not any(
        naive.inside_any(WORLD, x, y) for x, y in zip(flock.x, flock.y, strict=True)
    )
    assert [flock.y.min(), flock.y.max()] == pytest.approx([21.0, 99.0], abs=3.0)


def test_positions_are_uniform_in_the_disc() -> None:
    """The square of the distance from its centre, and the angle: four checks beyond 4
    standard errors, 3e-4.
    """
    flock = start(MANY, CONTINUOUS, HEADING, EMPTY, disc=(120.0, 100.0, 50.0))
    dx, dy = flock.x - 120.0, flock.y - 100.0
    uniform_within((dx * dx + dy * dy) / 2500.0)
    uniform_within((np.arctan2(dy, dx) / np.pi + 1.0) / 2.0)


def test_a_disc_outside_the_world_has_no_free_place() -> None:
    with pytest.raises(RuntimeError, match="no free place for a boid"):
        start(3, CONTINUOUS, HEADING, EMPTY, disc=(-50.0, 100.0, 40.0))


@pytest.mark.parametrize("positions", [CONTINUOUS, INTEGER])
def test_boids_start_apart(positions: int) -> None:
    """In a torus whose borders are seen across also across these. Without a distance
    some of so many are nearer.
    """
    torus = EMPTY._replace(minimum_image=True)
    size = np.array([300.0, 200.0])
    for world in (EMPTY, torus):
        for distance, apart in ((12.0, True), (0.0, False)):
            flock = start(100, positions, HEADING, world, margin=0.0, distance=distance)
            places = np.stack([flock.x, flock.y], axis=1)
            off = np.abs(places[:, None] - places)
            if world is torus:
                off = np.minimum(off, size - off)
            nearest = np.hypot(*np.moveaxis(off, 2, 0))[np.triu_indices(100, 1)].min()
            assert (nearest >= 12.0) == apart


@pytest.mark.parametrize("positions", [CONTINUOUS, INTEGER])
@pytest.mark.parametrize("size", [(300.0, 26.0), (26.0, 300.0)])
def test_boids_start_apart_across_each_border(
    positions: int, size: tuple[float, float]
) -> None:
    """In so narrow a torus nearly all boids are near its long border: some would be
    too near across it, whichever axis it ends.
    """
    torus = builders.a_world(*size)._replace(minimum_image=True)
    flock = start(25, positions, HEADING, torus, margin=0.0, distance=12.0)
    places = np.stack([flock.x, flock.y], axis=1)
    off = np.abs(places[:, None] - places)
    pairs = np.triu_indices(25, 1)
    across = np.hypot(*np.moveaxis(np.minimum(off, np.array(size) - off), 2, 0))
    assert across[pairs].min() >= 12.0
    narrow = int(np.argmin(size))
    other = off[:, :, 1 - narrow]
    other = np.minimum(other, max(size) - other)
    assert (np.hypot(off[:, :, narrow], other)[pairs] > across[pairs]).any()


def test_boids_that_find_no_place_apart_are_refused() -> None:
    with pytest.raises(RuntimeError, match="start_distance leaves no room for so many"):
        start(40, CONTINUOUS, HEADING, EMPTY, distance=90.0)


@pytest.mark.parametrize("positions", [CONTINUOUS, INTEGER])
def test_a_radius_of_zero_draws_as_ever(positions: int) -> None:
    """The first draws of the generator, one pair a boid where every place is free."""
    flock, draws = (
        start(2, positions, HEADING, EMPTY),
        np.random.default_rng(3).random(4),
    )
    width, height = (
        (280.0 * draws[::2], 180.0 * draws[1::2])
        if positions == CONTINUOUS
        else (np.floor(281.0 * draws[::2]), np.floor(181.0 * draws[1::2]))
    )
    assert flock.x.tolist() == (10.0 + width).tolist()
    assert flock.y.tolist() == (10.0 + height).tolist()


def test_continuous_positions_are_uniform() -> None:
    """Means and variances of 4000 draws: four checks beyond 4 standard errors with a
    probability of 3e-4.
    """
    flock = start(MANY, CONTINUOUS, HEADING, EMPTY)
    for places, length in ((flock.x, 280.0), (flock.y, 180.0)):
        uniform_within((places - 10.0) / length)


def test_integer_positions_include_both_borders_equally_often() -> None:
    """Of 4000 draws on 11 places each comes 364 times, give or take 18: 22 checks at
    4.5 with 1.5e-4.
    """
    flock = start(MANY, INTEGER, HEADING, builders.a_world(10.0, 10.0), margin=0.0)
    for places in (flock.x, flock.y):
        values, counts = np.unique(places, return_counts=True)
        assert values.tolist() == list(range(11))
        assert (np.abs(counts - MANY / 11) < 4.5 * np.sqrt(MANY / 11 * 10 / 11)).all()


def test_headings_are_uniform_at_one_speed() -> None:
    """Two checks beyond 4 standard errors: 1.3e-4; the speed is right to a few
    roundings.
    """
    flock = start(MANY, CONTINUOUS, HEADING, EMPTY)
    np.testing.assert_allclose(np.hypot(flock.vx, flock.vy), 2.0, rtol=1e-15)
    uniform_within((np.arctan2(flock.vy, flock.vx) / np.pi + 1.0) / 2.0)


def test_velocity_components_are_uniform() -> None:
    """Four checks beyond 4 standard errors: 3e-4."""
    flock = start(MANY, CONTINUOUS, COMPONENTS, EMPTY)
    for components in (flock.vx, flock.vy):
        uniform_within((components + 2.0) / 4.0)


def uniform_within(draws: np.ndarray) -> None:
    """Draws lie in [0, 1], with mean 1/2 and variance 1/12 within 4 standard errors
    (variance of squares: 1/180).
    """
    assert draws.min() >= 0.0
    assert draws.max() <= 1.0
    assert abs(draws.mean() - 0.5) < 4 * np.sqrt(1 / 12 / draws.size)
    assert abs(((draws - 0.5) ** 2).mean() - 1 / 12) < 4 * np.sqrt(1 / 180 / draws.size)


def test_the_published_program_draws_place_three_spare_numbers_and_heading() -> None:
    settings = StartSettings(CONTINUOUS, HEADING, 5.0, 50.0, 0, 0, 0, True, 0, 0)
    flock = start_python_random(
        2, settings, EMPTY, build_reach(EMPTY, 0.0), np.random.default_rng(), 27
    )
    draws = Random(27)
    for i in range(2):
        assert (flock.x[i], flock.y[i]) == (
            draws.uniform(50, 250),
            draws.uniform(50, 150),
        )
        [draws.random() for _ in range(3)]
        heading = draws.uniform(0, 2 * np.pi)
        assert (
            np.hypot(
                flock.vx[i] - 5 * np.cos(heading), flock.vy[i] - 5 * np.sin(heading)
            )
            < 1e-14
        )


def test_boids_may_start_inside_obstacles_where_the_study_says_so() -> None:
    """A third of the box is obstacle: of 300 free draws none inside would be one chance
    in 10^50.
    """
    flock = start(300, CONTINUOUS, HEADING, free=False)
    inside = [
        naive.inside_any(WORLD, x, y) for x, y in zip(flock.x, flock.y, strict=True)
    ]
    assert 0 < sum(inside) < 300


@pytest.mark.parametrize("draws", ["numpy", "python_random"])
def test_a_world_without_a_free_place_is_an_error_not_an_endless_search(
    draws: str,
) -> None:
    filled = {
        "map": "random_obstacles",
        "width": 60,
        "height": 60,
        "obstacle_margin": 30,
        "obstacle_radius": 80,
    }
    filled["start_free"] = True
    result = run(
        builders.job(
            "nguyen2024", n=3, steps=2, start_draws=draws, n_obstacles=1, **filled
        )
    )
    assert result.status == "failed"
    assert "no free place for a boid" in result.error


@pytest.mark.parametrize("velocities", [HEADING, COMPONENTS])
def test_an_ordered_start_has_one_velocity_at_the_places_of_another(
    velocities: int,
) -> None:
    settings = StartSettings(CONTINUOUS, velocities, 2.0, 10.0, 0, 0, 0, True, 0, 0)
    flocks = [
        STARTS[name].draw(
            50,
            settings,
            WORLD,
            build_reach(WORLD, 0.0),
            np.random.default_rng(3),
            0,
        )
        for name in ("ordered", "portable")
    ]
    ordered, portable = flocks
    assert ordered.x.tolist() == portable.x.tolist()
    assert ordered.y.tolist() == portable.y.tolist()
    velocity = (portable.vx[0], portable.vy[0])
    assert {*zip(ordered.vx, ordered.vy, strict=True)} == {velocity}
