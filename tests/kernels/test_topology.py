"""With whom of those in sight a boid interacts: what a search keeps is what a slow twin
keeps, and no bit depends on where it looks first.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kernels.flight import rebuild_grid
from kernels.models import MODELS
from kernels.near import Topology, build_near
from kernels.neighbours import (
    ALL_ROUND,
    Grid,
    all_pairs,
    build_grid,
    cone,
    search,
    square_range,
)
from kernels.settings import METRIC, NEAREST, OPEN, TORUS, VORONOI
from kernels.state import Flock, World
from kernels.topology import UNSETTLED, select, topology_of
from sweep.spec.study import Streams
from sweep.trial.simulation import Simulation
from sweep.trial.state import different
from tests import builders, naive

WIDTH, HEIGHT = 800.0, 600.0
BOUND = 1e-9
"""Corners of Voronoi cells that are nearer to each other than this, a part of their
distance, may be one: rounding decides. Double precision leaves 1e-16 of each product.
"""


@st.composite
def flocks(draw: st.DrawFn) -> Flock:
    """Up to 40 boids at random places; of some flocks many are at the same place, in
    one line, or on the corners of a square lattice.
    """
    n = draw(st.integers(1, 40))
    rng = np.random.default_rng(draw(st.integers(0, 10**6)))
    x, y = rng.uniform(0, WIDTH, n), rng.uniform(0, HEIGHT, n)
    kind = draw(st.sampled_from(["spread", "lattice", "line", "clump", "same"]))
    if kind == "lattice":
        x, y = np.floor(x / 100) * 100, np.floor(y / 100) * 100
    if kind == "line":
        y[:] = 300.0
    if kind == "clump":
        x, y = 400 + (x - 400) / 50, 300 + (y - 300) / 50
    if kind == "same":
        x[n // 2 :], y[n // 2 :] = x[0], y[0]
    return builders.a_flock(x, y, *rng.normal(0, 1, (2, n)))


worlds = st.builds(
    builders.a_world,
    st.just(WIDTH),
    st.just(HEIGHT),
    st.sampled_from([OPEN, TORUS]),
    st.booleans(),
)
ranges = st.sampled_from([80.0, 250.0, math.inf])
views = st.sampled_from([360.0, 200.0])
counts = st.integers(1, 9)


def found_by(
    grid: Grid,
    flock: Flock,
    world: World,
    i: int,
    reach: float,
    fov: float,
    topology: Topology,
) -> list[int]:
    near = build_near(flock.x.size, topology)
    found = search(
        flock,
        world,
        grid,
        i,
        square_range(reach, False),
        cone(fov),
        flock.vx[i],
        flock.vy[i],
        near,
    )
    return near.boid[:found].tolist()


def a_topology(kind: int, nearest: int, around: float = math.inf) -> Topology:
    return Topology(kind, nearest, around)


@settings(max_examples=60)
@given(flocks(), worlds, ranges, views, counts)
def test_the_nearest_in_sight_are_kept(
    flock: Flock, world: World, reach: float, fov: float, count: int
) -> None:
    """In any order of sorting, their distances are the least; of equal ones the lowest
    index is kept.
    """
    everyone = all_pairs(flock.x.size)
    for i in range(flock.x.size):
        at = everyone, flock, world, i, reach, fov
        sighted = found_by(*at, a_topology(METRIC, count))
        kept = found_by(*at, a_topology(NEAREST, count))
        assert kept == naive.nearest_of(world, flock, i, sighted, count)


@settings(max_examples=50)
@given(flocks(), worlds, ranges, views)
def test_voronoi_neighbours_are_those_whose_cells_share_a_side(
    flock: Flock, world: World, reach: float, fov: float
) -> None:
    everyone = all_pairs(flock.x.size)
    for i in range(flock.x.size):
        at = everyone, flock, world, i, reach, fov
        sighted = found_by(*at, a_topology(METRIC, 1))
        kept = set(found_by(*at, a_topology(VORONOI, 1)))
        sure, possible = (
            naive.voronoi_of(world, flock, i, sighted, slack)
            for slack in (-BOUND, BOUND)
        )
        assert sure <= kept <= possible


@settings(max_examples=100)
@given(
    flocks(),
    worlds,
    ranges,
    views,
    st.sampled_from([NEAREST, VORONOI]),
    counts,
    st.sampled_from([20.0, 90.0, 200.0]),
)
def test_where_a_search_looks_first_changes_nothing(
    flock: Flock,
    world: World,
    reach: float,
    fov: float,
    kind: int,
    count: int,
    around: float,
) -> None:
    everyone = all_pairs(flock.x.size)
    grid = build_grid(flock, world, min(around, reach), 5)
    for i in range(flock.x.size):
        whole = found_by(everyone, flock, world, i, reach, fov, a_topology(kind, count))
        first = found_by(
            grid, flock, world, i, reach, fov, a_topology(kind, count, around)
        )
        assert first == whole


def test_on_a_square_lattice_four_cells_share_a_side() -> None:
    """Those across a corner touch in one point, which is no side."""
    across, along = np.meshgrid(np.arange(5.0), np.arange(5.0))
    flock = builders.a_flock(across.ravel(), along.ravel(), *np.ones((2, 25)))
    kept = found_by(
        all_pairs(25),
        flock,
        builders.a_world(),
        12,
        math.inf,
        360.0,
        a_topology(VORONOI, 1),
    )
    assert kept == [7, 11, 13, 17]


def test_round_a_torus_a_flock_has_six_voronoi_neighbours_in_the_mean() -> None:
    """Euler: a tessellation of the torus in which three cells meet at each corner has
    3 N sides, each between two cells. And who is a neighbour has one.
    """
    n, rng = 1000, np.random.default_rng(1)
    x, y = rng.uniform(0, WIDTH, n), rng.uniform(0, HEIGHT, n)
    flock = builders.a_flock(x, y, *np.ones((2, n)))
    world = builders.a_world(WIDTH, HEIGHT, TORUS, True)
    topology = topology_of(builders.a_sensing(neighbours="voronoi"), n, world)
    grid = build_grid(flock, world, topology.around)
    assert not grid.everyone
    pairs = {
        (i, j)
        for i in range(n)
        for j in found_by(grid, flock, world, i, 300.0, 360.0, topology)
    }
    assert len(pairs) == 6 * n
    assert {(j, i) for i, j in pairs} == pairs


@pytest.mark.parametrize("kind", ["nearest", "voronoi"])
def test_a_search_seldom_looks_further_than_around(kind: str) -> None:
    """Boids at random places round a torus: of 2000 fewer than 4 do, which is four
    times what kernels.topology promises.
    """
    n, rng = 2000, np.random.default_rng(2)
    x, y = rng.uniform(0, WIDTH, n), rng.uniform(0, HEIGHT, n)
    flock = builders.a_flock(x, y, *np.ones((2, n)))
    world = builders.a_world(WIDTH, HEIGHT, TORUS, True)
    topology = topology_of(builders.a_sensing(neighbours=kind), n, world)
    grid, near = build_grid(flock, world, topology.around), build_near(n)
    around2 = square_range(topology.around, False)
    settled = 0
    for i in range(n):
        found = search(flock, world, grid, i, around2, ALL_ROUND, 0.0, 0.0, near)
        judged = near._replace(topology=topology)
        settled += select(judged, found, topology.around) != UNSETTLED
    assert n - 4 < settled


@pytest.mark.parametrize("kind", ["nearest", "voronoi"])
@pytest.mark.parametrize("model", MODELS)
def test_every_model_flies_with_the_same_bits_in_any_grid(
    model: str, kind: str
) -> None:
    """And the flight is another one than with all in sight."""
    changes = {"n": 60, "steps": 40, "neighbours": kind, "nearest": 3}
    one, other = (Simulation(builders.job(model, **changes)) for _ in range(2))
    rebuild_grid(other.flight, room=2)
    usual = Simulation(builders.job(model, n=60, steps=40))
    for simulation in (one, other, usual):
        simulation.take_frames()
        assert simulation.advance(40)
    assert different(one.state(), other.state()) == ""
    assert different(one.state(), usual.state()) != ""


@pytest.mark.parametrize("kind", ["nearest", "voronoi"])
def test_who_counts_knows_no_length(kind: str) -> None:
    """Twice the world, the range and the speed: all headings have the same bits, as 2
    is a power of 2.
    """
    one, twice = (
        {"width": s * 5.0, "height": s * 5.0, "max_speed": s * 0.25} for s in (1, 2)
    )
    common = {"n": 80, "steps": 60, "neighbours": kind, "nearest": 5, "noise": 1.0}
    flights = []
    for scale in (one, twice):
        scale |= {"start_speed": scale["max_speed"]}
        scale |= {"interaction_range": 2.0 * scale["width"]}
        job = builders.job("vicsek1995", **common, **scale)
        flights.append(Simulation(replace(job, streams=Streams(noise="common"))))
    for simulation in flights:
        simulation.take_frames()
        assert simulation.advance(60)
    small, large = (simulation.flock for simulation in flights)
    assert (2.0 * small.x == large.x).all()
    assert (2.0 * small.vx == large.vx).all()
    assert (2.0 * small.vy == large.vy).all()
