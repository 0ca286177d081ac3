"""What trials share: sceneries, maps of visits and starts. A trial has the bits that it
has in a process that has drawn nothing before.
"""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from kernels.catalogue import BUILT_IN, Catalogue
from kernels.starts import STARTS, Start
from kernels.state import Flock, empty_flock
from sweep.design.jobs import Job
from sweep.spec.maps import Obstacles
from sweep.spec.study import Streams
from sweep.trial import scenery
from sweep.trial.lanes import AT_ONCE, fly
from sweep.trial.scenery import flock_drawn_now
from sweep.trial.simulation import Simulation
from tests import builders
from tests.oscillators import MODEL as OSCILLATORS

WALL: Obstacles = ((120.0, 90.0, 60.0, 80.0, 0.0),)
OTHER_WALL: Obstacles = ((120.0, 90.0, 110.0, 40.0, 0.0),)


def small(model: str = "nguyen2024", **changes: Any) -> Job:
    """A trial with visits on a small map without obstacles."""
    settings: dict[str, Any] = {
        "n": 12,
        "steps": 20,
        "map": "empty",
        "width": 240,
        "height": 180,
    }
    return builders.job(model, metrics=("coverage",), **(settings | changes))


def started(job: Job) -> bytes:
    return builders.state(Simulation(job).flock).tobytes()


@pytest.mark.parametrize("draws", STARTS)
def test_a_trial_begins_as_those_before_it_whatever_became_of_them(draws: str) -> None:
    """The flock, the visits, the state of boids and the random numbers: what is kept is
    nobody's own.
    """
    with builders.entered(OSCILLATORS):
        job = builders.job(
            *("oscillators", "as_run"),
            metrics=("coverage",),
            **{"n": 12, "steps": 20, "map": "cafeteria", "start_draws": draws},
        )
        first = Simulation(job)
        begun, visits = first.beginning(), first.visits
        assert first.advance(20)
        assert (first.visits != visits).any()
        again = Simulation(job)
        assert again.beginning() == begun
        assert again.flight.record.coverage.sums.tolist() == [0, 0, 0]


@pytest.mark.parametrize(
    "changes",
    [
        {"n": 11},
        {"start_speed": 3.5},
        {"start_margin": 70.0},
        {"width": 300.0},
        {"seed": 2},
        {"replicate": 1},
        {"start_draws": "python_random"},
        {
            "map": "random_obstacles",
            "n_obstacles": 9,
            "obstacle_radius": 30.0,
            "obstacle_margin": 40,
        },
    ],
)
def test_what_a_start_depends_on_tells_it_apart(changes: dict[str, Any]) -> None:
    job = small(start_free=True)
    before, other = started(job), small(start_free=True, **changes)
    drawn = builders.state(flock_drawn_now(other)).tobytes()
    assert before != drawn
    assert started(other) == drawn
    assert started(job) == before


def test_what_a_start_does_not_depend_on_has_it_drawn_once() -> None:
    """The weights of rules, the steps, and the random numbers of the flight."""
    calls = list[int]()

    def counted(n: int, *_others: Any) -> Flock:
        calls.append(n)
        return empty_flock(n)

    known = starting(counted)
    job = replace(small(), catalogue=known)
    settings = [{"steps": 7}, {"cohesion_weight": 0.25}, {"separation_range": 9.0}]
    for changes in settings:
        Simulation(replace(job, settings=job.settings | changes))
    Simulation(replace(job, streams=Streams(noise="common")))
    assert calls == [12]
    flock_drawn_now(job)
    assert calls == [12, 12]


def starting(draw: Any) -> Catalogue:
    """The built-in entries, with another start under the name that is usual."""
    starts = dict(STARTS) | {"numpy": Start(draw, "", "")}
    return replace(BUILT_IN, starts=starts)


def at_one(n: int, *_others: Any) -> Flock:
    return empty_flock(n)._replace(x=np.ones(n))


def at_two(n: int, *_others: Any) -> Flock:
    return empty_flock(n)._replace(x=np.full(n, 2.0))


def test_starts_and_maps_of_one_name_are_told_apart_by_what_they_are() -> None:
    """Those of two studies, which may bring their own, in one process."""
    one, two = (
        Simulation(replace(small(), catalogue=starting(draw)))
        for draw in (at_one, at_two)
    )
    assert set(one.flock.x) == {1.0}
    assert set(two.flock.x) == {2.0}

    walled = [
        Simulation(replace(small(start_free=True), obstacles=wall))
        for wall in (WALL, OTHER_WALL)
    ]
    for simulation, wall in zip(walled, (WALL, OTHER_WALL), strict=True):
        x, y, half_width, half_height, _ = wall[0]
        inside = (abs(simulation.flock.x - x) < half_width) & (
            abs(simulation.flock.y - y) < half_height
        )
        assert not inside.any()
    blocked = [simulation.visits < 0 for simulation in walled]
    assert (blocked[0] != blocked[1]).any()
    assert walled[0].beginning() != walled[1].beginning()


def test_random_obstacles_are_those_of_the_trial() -> None:
    jobs = [
        small(
            map="random_obstacles",
            n_obstacles=3,
            obstacle_radius=12.0,
            replicate=k,
            obstacle_margin=40,
        )
        for k in (0, 1, 0)
    ]
    first, other, again = map(Simulation, jobs)
    assert first.world.obstacle_x.tolist() == again.world.obstacle_x.tolist()
    assert first.world.obstacle_x.tolist() != other.world.obstacle_x.tolist()
    for simulation, job in zip((first, other), jobs, strict=False):
        x = scenery.obstacles(job)[:, 0]
        assert simulation.world.obstacle_x.tolist() == x.tolist()
    assert ((first.visits < 0) != (other.visits < 0)).any()


def test_what_is_large_is_not_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    job = small(n=13)
    begun = Simulation(job).beginning()
    monkeypatch.setattr(scenery, "KEPT_BOIDS", 12)
    monkeypatch.setattr(scenery, "KEPT_PIXELS", 240 * 180 - 1)
    kept = (scenery._kept_start, scenery._kept_pixels)
    asked = [cache.cache_info() for cache in kept]
    large = Simulation(job)
    assert [cache.cache_info() for cache in kept] == asked
    assert large.beginning() == begun
    assert all(cache.cache_info().maxsize for cache in kept)


@pytest.mark.parametrize("steps", [1, 300])
def test_pixels_that_trials_share_stay_unvisited(steps: int) -> None:
    """On narrow maps and, with few visits, others. Nobody can write what they share."""
    jobs = [
        small("aziel_chen2025", steps=steps, replicate=k, heatmaps=True)
        for k in range(AT_ONCE)
    ]
    simulations = [Simulation(job, together=True) for job in jobs]
    shared = simulations[0].flight.record.coverage.visits
    assert all(one.flight.record.coverage.visits is shared for one in simulations)
    with pytest.raises(ValueError, match="read-only"):
        shared[0] = 1
    before = shared.copy()
    results = fly(simulations, 0.0)
    assert np.array_equal(shared, before)
    for one, result in zip(simulations, results, strict=True):
        assert result.heatmap is not None
        assert (result.heatmap > 0).sum() == one.flight.record.coverage.sums[0] > 0
