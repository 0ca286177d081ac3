"""Every search finds the same neighbours in ascending order, so that trials have the
same bits.
"""

from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kernels import neighbours, state
from kernels.near import build_near
from kernels.neighbours import (
    Grid,
    all_pairs,
    build_grid,
    cone,
    move,
    move_all,
    search,
    square_range,
)
from kernels.settings import OPEN, TORUS
from kernels.state import Flock, World
from kernels.torus import nearest_image
from sweep.testing import assert_keeps
from sweep.trial.simulation import Simulation
from sweep.trial.state import different
from tests import builders, naive
from tests.cases import slow_but
from tests.interpreter import interpreted


@pytest.fixture(scope="module", autouse=True)
def _every_list_is_read() -> Iterator[None]:
    """Else searches in small flocks would look at everyone, and the lists would go
    untested.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(neighbours, "CROWDED", 1)
        yield


coordinates = st.floats(-400, 1200) | st.sampled_from(
    [0.0, 100.0, 150.0, 300.0, 450.0, 800.0]
)
components = st.floats(-5, 5).map(lambda speed: round(speed, 3))


@st.composite
def flocks(draw: st.DrawFn) -> Flock:
    """Up to 25 boids, spread over the world and beyond, or gathered within some px of
    one place.
    """
    n = draw(st.integers(1, 25))
    spread = draw(st.sampled_from([1.0, 0.1, 0.001]))
    columns = [
        draw(st.lists(values, min_size=n, max_size=n))
        for values in (coordinates, coordinates, components, components)
    ]
    x, y, vx, vy = map(np.array, columns)
    return builders.a_flock(400 + (x - 400) * spread, 300 + (y - 300) * spread, vx, vy)


worlds = st.builds(
    builders.a_world,
    st.sampled_from([800.0, 600.0, 451.0]),
    st.just(600.0),
    st.sampled_from([OPEN, TORUS]),
    st.booleans(),
)
ranges = st.sampled_from([0.0, 10.0, 50.0, 150.0, 200.0, 1000.0])
rooms = st.sampled_from([1, 2, 5, 64])


def found_by(
    grid: Grid,
    flock: Flock,
    world: World,
    i: int,
    reach: float,
    fov: float,
    inclusive: bool,
) -> list[int]:
    near = build_near(flock.x.size)
    found = search(
        flock,
        world,
        grid,
        i,
        square_range(reach, inclusive),
        cone(fov),
        flock.vx[i],
        flock.vy[i],
        near,
    )
    return near.boid[:found].tolist()


@settings(max_examples=60)
@given(
    flocks(),
    worlds,
    ranges,
    st.sampled_from([0.0, 60.0, 150.0, 180.0, 270.0, 360.0]),
    st.booleans(),
    rooms,
)
def test_search_finds_the_boids_in_range_and_view_in_ascending_order(
    flock: Flock, world: World, reach: float, fov: float, inclusive: bool, room: int
) -> None:
    """Those within 1e-6 of a bound may be found or not, as angles and their cosines
    round differently.
    """
    grid, birds = build_grid(flock, world, reach, room), naive.birds(flock)
    for i in range(flock.x.size):
        found = found_by(grid, flock, world, i, reach, fov, inclusive)
        sure, possible = (
            {
                j
                for j, _ in naive.neighbours(
                    world, birds, i, reach, inclusive, fov, slack
                )
            }
            for slack in (-1e-6, 1e-6)
        )
        assert found == sorted(found)
        assert sure <= set(found) <= possible


@settings(max_examples=60)
@given(
    flocks(),
    worlds,
    ranges,
    st.booleans(),
    rooms,
    st.sampled_from([1.0, 1.3, 4.0]),
)
def test_a_grid_of_any_room_and_cell_finds_what_all_pairs_find(
    flock: Flock,
    world: World,
    reach: float,
    inclusive: bool,
    room: int,
    larger: float,
) -> None:
    grids = build_grid(flock, world, reach * larger, room), all_pairs(flock.x.size)
    for i in range(flock.x.size):
        first, second = (
            found_by(grid, flock, world, i, reach, 150.0, inclusive) for grid in grids
        )
        assert first == second


@settings(max_examples=60)
@given(flocks(), worlds, st.sampled_from([20.0, 50.0, 150.0, 200.0]), rooms, st.data())
def test_moves_keep_the_lists_of_a_grid_as_if_built_anew(
    flock: Flock, world: World, reach: float, room: int, data: st.DataObject
) -> None:
    """And each block is in one list, or spare."""
    grid = build_grid(flock, world, reach, room)
    for _ in range(data.draw(st.integers(1, 12))):
        i = data.draw(st.integers(0, flock.x.size - 1))
        flock.x[i], flock.y[i] = data.draw(coordinates), data.draw(coordinates)
        move(grid, i, flock.x[i], flock.y[i])
    if not grid.everyone:
        (kept, used), fresh = lists(grid), lists(build_grid(flock, world, reach))[0]
        assert kept == fresh
        assert sorted(used + spares(grid, len(used))) == list(range(len(grid.blocks)))


def lists(grid: Grid) -> tuple[list[list[int]], list[int]]:
    """The boids in the list of each cell, and the blocks of all of them."""
    found, used = [], []
    for cell in range(grid.columns * grid.rows):
        length, room = int(grid.blocks[cell, 0]), grid.blocks.shape[1] - 1
        blocks = [cell]
        for _ in range((length - 1) // room):
            blocks.append(int(grid.following[blocks[-1]]))
        found.append(grid.blocks[blocks, 1:].ravel()[:length].tolist())
        used += blocks
    return found, used


def spares(grid: Grid, used: int) -> list[int]:
    """The blocks that no list needs, of which there are all but `used`."""
    found, block = [], int(grid.spare[0])
    for _ in range(len(grid.blocks) - used):
        found.append(block)
        block = int(grid.following[block])
    return found


@pytest.mark.parametrize("room", [1, 2, 7])
def test_there_are_blocks_for_all_boids_in_one_place(room: int) -> None:
    """Each boid is in nine lists then, and each of these goes on over many blocks."""
    world, n = builders.a_world(), 60
    flock = builders.a_flock(np.linspace(0, 800, n), np.linspace(0, 600, n))
    grid = build_grid(flock, world, 50.0, room)
    for i in range(n):
        flock.x[i], flock.y[i] = 410.0 + i / 10, 310.0
        move(grid, i, flock.x[i], flock.y[i])
    others = [j for j in range(n) if j != 30]
    assert found_by(grid, flock, world, 30, 50.0, 360.0, False) == others
    assert max(map(len, lists(grid)[0])) == n


def in_a_large_flock(n: int) -> None:
    """Compare the neighbours in a flock that is laid out as large ones are."""
    rng, world = np.random.default_rng(5), builders.a_world()
    x, y, vx, vy = rng.uniform(-50, 650, (4, n))
    small = builders.a_flock(x, y, vx, vy)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(neighbours, "CROWDED", 1)
        patch.setattr(state, "LARGE_FLOCK", 50)
        large, everyone = state.laid_out(small), all_pairs(n)
        assert large.x.strides == (32,)
        grid = build_grid(large, world, 50.0)
    assert grid.ahead is not None
    for _ in range(3):
        large.x[:] += rng.uniform(-60, 60, n)
        small.x[:] = large.x
        move_all(grid, large)
        for i in range(n):
            assert found_by(grid, large, world, i, 50.0, 150.0, False) == found_by(
                everyone, small, world, i, 50.0, 150.0, False
            )


@pytest.mark.slow
def test_neighbours_in_a_large_flock_are_those_in_any_other() -> None:
    """Its memory is laid out otherwise, and asked for ahead."""
    in_a_large_flock(300)


def test_they_are_in_the_interpreter() -> None:
    """Where the search has not to be compiled for another layout."""
    interpreted(
        "from tests.kernels import test_neighbours as t\nt.in_a_large_flock(120)"
    )


@pytest.mark.slow
@pytest.mark.parametrize("model", builders.MODELS)
@pytest.mark.parametrize("update", ["sequential", "synchronous"])
def test_a_trial_has_the_same_bits_as_one_of_a_large_flock(
    model: str, update: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Slow, since numba compiles a model once more for flocks that are laid out so."""
    job = builders.job(model, n=60, steps=30, update=update)
    as_small = Simulation(job)
    monkeypatch.setattr(state, "LARGE_FLOCK", 50)
    as_large = Simulation(job)
    assert as_large.flock.x.strides != as_small.flock.x.strides
    for one in (as_small, as_large):
        one.take_frames()
        assert one.advance(30)
    assert different(as_small.state(), as_large.state()) == ""


def test_a_torus_of_three_columns_is_searched_by_grid_across_its_border() -> None:
    world = builders.a_world(300.0, 900.0, TORUS, minimum_image=True)
    flock = builders.a_flock(
        np.array([5.0, 295.0, 150.0]), np.array([5.0, 895.0, 450.0])
    )
    grid = build_grid(flock, world, 99.0)
    assert (grid.columns, grid.everyone) == (3, False)
    assert found_by(grid, flock, world, 0, 99.0, 360.0, False) == [1]


def test_there_are_no_lists_where_most_are_too_long_to_be_read(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A list has 9 N / C boids on average. With a room that is asked for there are."""
    monkeypatch.setattr(neighbours, "CROWDED", 4)
    flock = builders.a_flock(np.full(8, 5.0), np.full(8, 5.0))
    for width, everyone in ((500.0, True), (600.0, False)):
        world = builders.a_world(width, 700.0)
        assert build_grid(flock, world, 99.0).everyone == everyone
        assert not build_grid(flock, world, 99.0, 4).everyone


@pytest.mark.parametrize(("inclusive", "found"), [(True, [1]), (False, [])])
def test_a_neighbour_exactly_at_the_range_counts_only_if_inclusive(
    inclusive: bool, found: list[int]
) -> None:
    flock = builders.a_flock(np.array([100.0, 130.0]), np.array([100.0, 140.0]))
    assert (
        found_by(all_pairs(2), flock, builders.a_world(), 0, 50.0, 360.0, inclusive)
        == found
    )


def test_a_boid_sees_ahead_within_its_cone_and_all_round_at_rest() -> None:
    flock = builders.a_flock(
        np.array([100.0, 120.0, 80.0]), np.full(3, 100.0), np.array([1.0, 1.0, 0.0])
    )
    seen = [
        found_by(all_pairs(3), flock, builders.a_world(), i, 50.0, 150.0, False)
        for i in range(3)
    ]
    assert seen == [[1], [], [0, 1]]


@given(st.floats(0, 799.999), st.floats(0, 799.999))
def test_the_nearest_image_is_at_most_half_a_period_off(a: float, b: float) -> None:
    assert abs(nearest_image(a - b, 800.0)) == min(abs(a - b), 800.0 - abs(a - b))


@pytest.mark.parametrize(
    ("model", "preset"), slow_but(builders.FIRST_PRESETS, builders.PRESETS)
)
def test_all_pairs_and_every_grid_give_the_same_bits(model: str, preset: str) -> None:
    """For every update and kind of borders; flocks over six columns, gathered until
    lists are long, or mostly outside the world.
    """
    about = builders.MODELS[model]
    presets = {preset: about.presets[preset]}
    assert_keeps(about._replace(presets=presets), "grid")
