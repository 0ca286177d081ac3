"""Own models in lanes: what they do that ours do not has the bits that it has alone."""

import math
from dataclasses import replace
from typing import Annotated, Any, NamedTuple

import numpy as np
import pytest

from kernels.jit import jit
from kernels.lanes.kernel import weights_of
from kernels.lanes.vectors import WIDTH
from kernels.model import Model, Sight
from kernels.neighbours import ALL_ROUND, move_all, search
from kernels.recording import observe
from kernels.rules.borders import confine
from kernels.settings import COMMON, About
from kernels.state import remember
from kernels.worlds import MAPS, Map
from sweep.design.jobs import Job
from sweep.trial import lanes
from sweep.trial.lanes import Trials
from sweep.trial.simulation import run
from tests.builders import entered, every_metric, job
from tests.trial.test_lanes import numbers

PLAIN, FORGETS, OBSERVES_TWICE = range(3)


class HabitParams(NamedTuple):
    """What differs between trials, and what the model does."""

    pull_weight: Annotated[float, About("pull", "1/time^2", low=0, rule="pull")]
    few_weight: Annotated[int, About("a whole number", low=0, rule="few")]
    habit: Annotated[int, About("what the model does", low=0)]
    reach: Annotated[float, About("how far boids see", "length", low=0)]
    dt: Annotated[float, About("time of one update", "time", low=0, exclusive=True)]


STANDARD = COMMON | {
    "pull_weight": 0.01,
    "few_weight": 2,
    "habit": PLAIN,
    "reach": 60.0,
    "dt": 1.0,
    "n": 13,
    "steps": 40,
    "map": "empty",
    "width": 200.0,
    "height": 150.0,
    "start_speed": 2.0,
}


@jit
def _halved(length):
    """A length below 3; without end where it is infinite."""
    while length > 3.0:
        length *= 0.5
    return length


@jit
def _from_obstacles(world, x, y):
    away = 0.0
    for m in range(world.obstacle_x.size):
        dx, dy = x - world.obstacle_x[m], y - world.obstacle_y[m]
        if dx * dx + dy * dy < 1e4:
            away += dx / (1.0 + dy * dy)
    return away


@jit
def _pull(near, found, few):
    x, y, count = 0.0, 0.0, 0
    for k in range(found):
        if count < few and near.distance2[k] > 4.0:
            x += near.dx[k]
            y += near.dy[k]
            count += 1
    return x, y


@jit
def advance(flock, world, params, work, record, rng, steps):
    seen, near = work.before, work.near
    range2 = params.reach * params.reach
    for _ in range(steps):
        if params.habit != FORGETS:
            remember(flock, seen)
        for i in range(flock.x.size):
            found = search(seen, world, work.grid, i, range2, ALL_ROUND, 0.0, 0.0, near)
            x, y = _pull(near, found, params.few_weight)
            noise = rng.normal(0.0, 0.1)
            turned = _halved(abs(seen.x[i - 1])) * params.pull_weight
            ax = params.pull_weight * x + noise + 0.01 * math.sin(turned)
            ax += 1e-3 * _from_obstacles(world, flock.x[i], flock.y[i])
            vx = flock.vx[i] + ax * params.dt
            vy = flock.vy[i] + params.pull_weight * y * params.dt
            flock.x[i], flock.vx[i] = confine(
                flock.x[i] + vx, vx, world.width, world.borders
            )
            flock.y[i], flock.vy[i] = confine(
                flock.y[i] + vy, vy, world.height, world.borders
            )
        move_all(work.grid, flock)
        if params.habit == OBSERVES_TWICE:
            observe(flock, world, record)
        if not observe(flock, world, record):
            return False
    return True


def sight(params: HabitParams) -> Sight:
    return Sight(params.reach)


def some_discs(settings: Any, rng: Any) -> Any:
    """None to three discs."""
    count = int(rng.integers(4))
    place = rng.uniform(0.0, settings.width, (count, 2))
    size = np.full((count, 2), 8.0)
    return np.hstack([place, size, np.ones((count, 1))])


def two_discs(settings: Any, rng: Any) -> Any:
    place = rng.uniform(0.0, settings.width, (2, 2))
    return np.hstack([place, np.full((2, 2), 8.0), np.ones((2, 1))])


MODEL = Model(
    name="many_habits",
    source="",
    params=HabitParams,
    presets={"standard": STANDARD},
    metrics=("speed",),
    sight=sight,
    advance=advance,
)


@pytest.fixture(autouse=True)
def _known(monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.setitem(MAPS, "some_discs", Map(some_discs, "d", "t", random=True))
    monkeypatch.setitem(MAPS, "two_discs", Map(two_discs, "d", "t", random=True))
    with entered(MODEL):
        yield


def trials(**changes: Any) -> list[Job]:
    weights = changes.pop("weights", (0.01, 0.02, 0.03, 0.005, 0.01, 0.02, 0.0, 0.04))
    base = job(MODEL.name, "standard", metrics=every_metric(MODEL.name), **changes)
    return [
        replace(base, settings=base.settings | {"pull_weight": one}, replicate=k)
        for k, one in enumerate(weights)
    ]


def are_equal(monkeypatch: pytest.MonkeyPatch, jobs: list[Job], group: bool) -> Any:
    """The results of jobs together; `group` says whether they must fly so."""
    failed = []

    def attempt(together: Any, jobs: Any) -> Any:
        try:
            return together(jobs)
        except Exception as error:
            failed.append(error)
            return error

    monkeypatch.setattr(lanes, "_attempt", attempt)
    results = Trials(together=True).several(jobs)
    for one, mine in zip(jobs, results, strict=True):
        assert numbers(mine) == numbers(run(one))
    assert bool(failed) != group, failed
    return results


def test_draws_loops_and_places_from_the_end(monkeypatch: pytest.MonkeyPatch) -> None:
    are_equal(monkeypatch, trials(), True)
    are_equal(monkeypatch, trials(weights=(0.01, 0.2, 0.0, 0.03, 0.5)), True)
    for n, steps in ((1, 1), (2, 3)):
        are_equal(monkeypatch, trials(n=n, steps=steps), True)


@pytest.mark.slow
def test_few_boids_mark_their_heatmaps(monkeypatch: pytest.MonkeyPatch) -> None:
    for n, steps in ((1, 1), (2, 3)):
        are_equal(monkeypatch, trials(n=n, steps=steps, heatmaps=True), True)


def test_lanes_that_diverge_do_not_run_on(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where they did, a loop in one of them would never end."""
    weights = (0.01, 1.5e308, 0.02, 1e308, 0.0, 1e80, 0.01, 1e308)
    results = are_equal(monkeypatch, trials(weights=weights), True)
    assert [one.status for one in results].count("diverged") >= 2


@pytest.mark.slow
def test_all_diverge(monkeypatch: pytest.MonkeyPatch) -> None:
    are_equal(monkeypatch, trials(weights=(1e308,) * WIDTH), True)


@pytest.mark.parametrize("habit", [FORGETS, OBSERVES_TWICE])
def test_models_that_observe_otherwise_fly_alone(
    monkeypatch: pytest.MonkeyPatch, habit: int
) -> None:
    are_equal(monkeypatch, trials(habit=habit), False)


def test_different_numbers_of_obstacles_fly_alone(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    are_equal(monkeypatch, trials(map="some_discs"), False)


@pytest.mark.slow
def test_as_many_obstacles_elsewhere(monkeypatch: pytest.MonkeyPatch) -> None:
    are_equal(monkeypatch, trials(map="two_discs"), True)


def test_whole_numbers_do_not_differ_in_lanes() -> None:
    assert weights_of(MODEL) == ("pull_weight",)
