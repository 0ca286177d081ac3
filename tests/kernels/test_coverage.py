"""Visited pixels, escapes and collisions, against arrays of the whole world and
hand-made flights.
"""

from itertools import cycle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kernels.coverage import BAND, build_coverage, heatmap, mark, mark_share, unvisited
from kernels.events import COLLISIONS, ESCAPES
from kernels.settings import DISC, STAMP
from kernels.worlds import build_reach
from sweep.trial.simulation import Simulation, run
from tests import builders, naive
from tests.cases import slow_but

ROWS, COLUMNS = 50, 60
OBSTACLES = [[20, 20, 7, 7, 1], [45, 30, 6, 4, 0], [59, 49, 5, 5, 1]]
WORLD = builders.a_world(COLUMNS, ROWS, obstacles=OBSTACLES)
BLOCKED = naive.blocked(WORLD, ROWS, COLUMNS)
SMALL = {
    "map": "random_obstacles",
    "width": 160,
    "height": 120,
    "n_obstacles": 3,
    "obstacle_radius": 9,
}
SMALL |= {"obstacle_margin": 20, "start_margin": 0, "pixel": 1, "grid_cell": 1}

anywhere = st.floats(-8, 68).map(lambda place: round(place, 2))


def marked(
    positions: np.ndarray, footprint: int, radius: float
) -> tuple[np.ndarray, np.ndarray]:
    """The heatmap, and the running sums, after footprints at `positions` (K, 2)."""
    seen = builders.OBSERVATION._replace(footprint=footprint, footprint_radius=radius)
    coverage = build_coverage(WORLD, build_reach(WORLD, 0.0), seen)
    for x, y in positions:
        mark(coverage, x, y)
    return heatmap(coverage), coverage.sums


@pytest.mark.parametrize("size", [2, 3, 5])
@pytest.mark.parametrize(
    ("footprint", "radius"), [(STAMP, 2.0), (STAMP, 70.0), (DISC, 2.3), (DISC, 0.9)]
)
def test_threads_count_together_what_one_counts_each_in_its_rows(
    footprint: int, radius: float, size: int
) -> None:
    """Also of footprints in two bands, in more, and over the edges of the world."""
    rows = 5 * BAND + 7
    world = builders.a_world(COLUMNS, rows, obstacles=[[20, BAND, 7, 7, 1]])
    seen = builders.OBSERVATION._replace(footprint=footprint, footprint_radius=radius)
    fresh = build_coverage(world, build_reach(world, 0.0), seen)
    wanted, shared = unvisited(fresh), unvisited(fresh)
    low, high = (-5.0, -5.0), (COLUMNS + 5.0, rows + 5.0)
    places = np.random.default_rng(1).uniform(low, high, (400, 2))
    for x, y in places:
        mark(wanted, x, y)
    for rank in range(size):
        before = heatmap(unvisited(shared))
        for x, y in places:
            mark_share(shared, x, y, rank, size)
        touched = np.flatnonzero((heatmap(shared) != before).any(axis=1))
        assert set(touched // BAND % size) == {rank}
    assert np.array_equal(shared.visits, wanted.visits)
    assert np.array_equal(shared.sums, wanted.sums)


@given(
    st.lists(st.tuples(anywhere, anywhere), max_size=25),
    st.sampled_from([DISC, STAMP]),
    st.sampled_from([0, 1, 2, 2.3, 5]),
)
def test_marks_and_their_sums_are_those_of_the_naive_array(
    positions: list[tuple[float, float]], footprint: int, radius: float
) -> None:
    """Positions of two decimals, inside and outside; ties are those of whole numbers,
    which are exact.
    """
    places = np.array(positions).reshape(-1, 2)
    tied = footprint == DISC and near_a_tie(places, radius)
    counts, sums = marked(places, footprint, radius)
    visits = naive.visits(places, radius, footprint == STAMP, ROWS, COLUMNS)[~BLOCKED]
    if not tied:
        np.testing.assert_array_equal(counts[~BLOCKED], visits)
    assert sums.tolist() == [
        np.count_nonzero(counts[~BLOCKED]),
        *((counts[~BLOCKED] ** k).sum() for k in (1, 2)),
    ]
    assert (counts[BLOCKED] == -1).all()


def near_a_tie(places: np.ndarray, radius: float) -> bool:
    """Whether a pixel is as far as the radius up to rounding: then it may be in the
    disc or not.
    """
    row, column = np.mgrid[-20 : ROWS + 20, -20 : COLUMNS + 20]
    squares = [(column - x) ** 2 + (row - y) ** 2 for x, y in places]
    return any((np.abs(square - radius**2) < 1e-9).any() for square in squares)


@pytest.mark.parametrize("footprint", [DISC, STAMP])
def test_half_the_world_with_half_the_pixel_is_covered_alike(footprint: int) -> None:
    """To the pixel, as a factor of two rounds nothing."""
    places = np.random.default_rng(2).uniform(-5, 60, (200, 2))
    whole, sums = marked(places, footprint, 2.0)
    seen = builders.OBSERVATION._replace(footprint=footprint, pixel=0.5)
    obstacles = np.array(OBSTACLES) * [0.5, 0.5, 0.5, 0.5, 1.0]
    world = builders.a_world(COLUMNS / 2, ROWS / 2, obstacles=obstacles)
    coverage = build_coverage(world, build_reach(world, 0.0), seen)
    for x, y in places / 2:
        mark(coverage, x, y)
    assert np.array_equal(heatmap(coverage), whole)
    assert np.array_equal(coverage.sums, sums)


def test_a_stamp_of_radius_2_has_13_pixels_about_the_truncated_position() -> None:
    counts, _ = marked(np.array([[10.9, 10.9]]), STAMP, 2.0)
    row, column = np.nonzero(counts == 1)
    assert sorted(zip(row, column, strict=True)) == [
        *[(8, 10), (9, 9), (9, 10), (9, 11)],
        *[(10, column) for column in (8, 9, 10, 11, 12)],
        *[(11, 9), (11, 10), (11, 11), (12, 10)],
    ]


FOOTPRINTS = "disc", "stamp"


@pytest.mark.parametrize(
    ("model", "preset", "footprint"),
    slow_but(
        [
            (*which, each)
            for which, each in zip(builders.FIRST_PRESETS[:4], cycle(FOOTPRINTS))
        ],
        [(*which, each) for which in builders.PRESETS for each in FOOTPRINTS],
    ),
)
def test_a_whole_trial_marks_what_its_trajectory_covers(
    model: str, preset: str, footprint: str
) -> None:
    """Boids that leave the small world and return included; the start is not marked."""
    changes = {
        "n": 10,
        "steps": 60,
        "footprint": footprint,
        "borders": "open",
        "cohesion_weight": 0.01,
    }
    simulation = Simulation(
        builders.job(
            model, preset, metrics=("speed",), heatmaps=True, **SMALL, **changes
        )
    )
    path = builders.trajectory(builders.to_end(simulation))
    places = np.hstack(path[1:, :2]).T
    counts = heatmap(simulation.flight.record.coverage)
    open_ground = ~naive.blocked(simulation.world, 120, 160)
    assert simulation.flight.record.coverage.traversable == open_ground.sum()
    visits = naive.visits(places, 2.0, footprint == "stamp", 120, 160)
    np.testing.assert_array_equal(counts, np.where(open_ground, visits, -1))


@pytest.mark.parametrize("ddof", [0, 1])
def test_coverage_metrics_are_those_of_the_heatmap(ddof: int) -> None:
    """The deviation from running sums of squares loses few of its digits: 1e-9."""
    covering = ("coverage", "coverage_total", "coverage_cv")
    result = run(
        builders.job(
            "aziel_chen2025",
            metrics=covering,
            heatmaps=True,
            n=20,
            steps=80,
            coverage_cv_ddof=ddof,
            **SMALL,
        )
    )
    counts = result.heatmap[result.heatmap >= 0]
    assert result.last["coverage"] == 100 * np.count_nonzero(counts) / counts.size
    assert (
        result.last["coverage_total"]
        == 100 * np.count_nonzero(counts) / result.heatmap.size
    )
    assert result.last["coverage_cv"] == pytest.approx(
        counts.std(ddof=ddof) / counts.mean(), rel=1e-9
    )


@pytest.mark.parametrize("preset", ["as_written", "as_run"])
def test_the_coverage_curve_starts_at_0_and_never_falls(preset: str) -> None:
    a_job = builders.job(
        "aziel_chen2025", preset, series=("coverage",), n=15, steps=60, every=4, **SMALL
    )
    curve = run(a_job).series["coverage"]
    assert curve[0] == 0.0
    assert (np.diff(curve) >= 0.0).all()
    assert 0.0 < curve[-1] <= 100.0


def flight(
    x: float, y: float, vx: float, vy: float, steps: int, **changes: object
) -> dict[str, float]:
    """Escapes and collisions of one boid that nothing acts upon, in a small world of
    round obstacles.
    """
    settings = (
        SMALL
        | {"n": 1, "steps": steps, "borders": "open"}
        | builders.weightless("nguyen2024")
        | changes
    )
    a_job = builders.job(
        "nguyen2024", "as_written", metrics=("escapes", "collisions"), **settings
    )
    simulation = builders.place(Simulation(a_job), x, y, vx, vy)
    world = simulation.world._replace(
        obstacle_x=np.array([50.0, 80.0, 110.0]), obstacle_y=np.full(3, 60.0)
    )
    watch = simulation.flight.record.watch._replace(contact=build_reach(world, 0.0))
    flight = simulation.flight
    flight.scenery = flight.scenery._replace(world=world)
    flight.record = flight.record._replace(watch=watch)
    builders.to_end(simulation)
    return {
        "escapes": int(watch.events[ESCAPES]),
        "collisions": int(watch.events[COLLISIONS]),
    }


def test_crossing_three_obstacles_and_leaving_counts_each_once() -> None:
    assert flight(2.0, 60.0, 3.0, 0.0, steps=40) == {"escapes": 0, "collisions": 3}
    assert flight(2.0, 60.0, 3.0, 0.0, steps=70) == {"escapes": 1, "collisions": 3}


def test_staying_outside_is_one_escape_and_each_return_allows_another() -> None:
    assert flight(150.0, 20.0, 30.0, 0.0, steps=9) == {"escapes": 1, "collisions": 0}
    assert flight(-40.0, 20.0, 30.0, 0.0, steps=9) == {"escapes": 1, "collisions": 0}, (
        "it did not leave where it began"
    )


def test_touching_a_surface_is_no_collision_and_the_border_is_no_escape() -> None:
    assert flight(41.0, 60.0, 0.0, 0.0, steps=3) == {"escapes": 0, "collisions": 0}
    assert flight(160.0, 120.0, 0.0, 0.0, steps=3) == {"escapes": 0, "collisions": 0}


def test_a_torus_is_never_left() -> None:
    assert flight(150.0, 20.0, 30.0, 7.0, steps=50, borders="torus")["escapes"] == 0
