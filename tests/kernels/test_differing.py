"""Robots whose parameters differ: against slow twins that read those of each robot, by
the law of the factors, and by what must not change.

Random numbers have fixed keys. Statistical checks are two-sided at Z standard errors: a
check of a normal number fails by chance once in 147,000 keys, and there are six. The
test of Kolmogorov and Smirnov is at the same level.
"""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy import stats

from kernels.chance import ChanceKey
from kernels.inspection import seen_by, velocities_after
from kernels.models import MODELS
from kernels.robots.spreads import build_rows
from kernels.settings import Spread
from sweep.design.jobs import Job, stream
from sweep.spec.settings import settings_of
from sweep.spec.study import Streams
from sweep.trial.lanes import AT_ONCE, groups
from sweep.trial.looking import accelerations
from sweep.trial.simulation import Simulation
from tests import builders, naive
from tests.cases import slow_but
from tests.examples import flown
from tests.interpreter import interpreted

KEY, Z = ChanceKey(17, 4), 4.5
LEVEL = 2.0 * stats.norm.sf(Z)
UNITY = 1e-300
"""A spread whose factors are 1: exp of a smaller number than 1e-290 is 1."""
ROUND = ("control_period",)
"""Parameters whose twins count steps, so that they must be whole numbers of these."""


def spreads(model: str, spread: float) -> dict[str, float]:
    """The settings by which all parameters differ that may."""
    every = settings_of(model, builders.BUILT_IN).spreads.values()
    return {one.name: spread for one in every if one.spread_of not in ROUND}


def small(model: str, spread: float, **changes: Any) -> Job:
    """A small flock among obstacles, which all forces push, with the same noise at any
    spread.
    """
    lengths = {"width": 300, "height": 280, "obstacle_margin": 60}
    settings: dict[str, Any] = {
        "map": "random_obstacles",
        "n_obstacles": 6,
        "n": 14,
        "steps": 20,
        "seed": 27,
        "cohesion_weight": 0.2,
        "alignment_weight": 0.3,
        "separation_weight": 0.05,
        "goal_weight": 1e-4,
        "metrics": (),
    }
    settings |= builders.scaled(model, **lengths, obstacle_radius=15)
    a_job = builders.job(
        model, **(settings | builders.IDEAL | spreads(model, spread) | changes)
    )
    return replace(a_job, streams=Streams(noise="common"))


def own_of(simulation: Simulation) -> dict[str, np.ndarray]:
    """The parameters of each robot, (N,) each."""
    (table,) = simulation.flight.work.robots.rows
    return {name: np.array(table[name]) for name in table.dtype.names}


# ---- against the twins


@pytest.mark.parametrize("update", builders.UPDATES)
@pytest.mark.parametrize("model", builders.COMPILED_AS_ROBOTS)
def test_each_robot_flies_by_parameters_of_its_own(model: str, update: str) -> None:
    """For 20 steps, as `test_a_model_does_what_its_slow_twin_does`, whose bound it has.
    Parameters of 10 % more or less change places by more than 1e-3 px.
    """
    a_job = small(model, 0.1, update=update)
    simulation = Simulation(a_job)
    own = {
        name: values
        for name, values in own_of(simulation).items()
        if f"{name}_spread" in a_job.settings
    }
    settings = naive.OfRobots(a_job.settings, own)
    birds = naive.birds(simulation.flock)
    rng = np.random.default_rng(stream(a_job, "noise"))
    for _ in range(20):
        birds = getattr(naive, model)(settings, simulation.world, birds, rng)
        simulation.advance(1)
        slow = np.array([[*bird.position, *bird.velocity] for bird in birds]).T
        np.testing.assert_allclose(
            builders.state(simulation.flock), slow, rtol=0, atol=1e-10
        )
    alike = Simulation(small(model, 0.0, update=update))
    alike.advance(20)
    off = np.abs(builders.state(alike.flock) - builders.state(simulation.flock))
    assert off.max() > 1e-3 * builders.scale(model)


@pytest.mark.parametrize("model", builders.COMPILED_AS_ROBOTS)
def test_a_table_of_the_same_parameters_changes_no_bit(model: str) -> None:
    """And there is none where no spread is above 0."""
    alike, tabled = (Simulation(small(model, spread)) for spread in (0.0, UNITY))
    assert alike.flight.work.robots.rows == ()
    assert len(tabled.flight.work.robots.rows[0]) == 14
    for simulation in (alike, tabled):
        assert simulation.advance(20)
    assert (
        builders.state(alike.flock).tobytes() == builders.state(tabled.flock).tobytes()
    )


@pytest.mark.parametrize(
    "model", slow_but(["cucker_smale2007", "vasarhelyi2018"], MODELS)
)
def test_all_models_do_in_the_interpreter(model: str) -> None:
    code = (
        "from tests.kernels import test_differing as t\n"
        "for update in t.builders.UPDATES:\n"
        f"    t.test_each_robot_flies_by_parameters_of_its_own({model!r}, update)\n"
        f"t.test_a_table_of_the_same_parameters_changes_no_bit({model!r})"
    )
    interpreted(code)


def various() -> Job:
    """A small trial in which all parameters differ."""
    return small("nguyen2024", 0.3, metrics=("speed",), series=("speed",))


def test_compiled_or_not_the_bits_are_the_same() -> None:
    alone = (
        "from tests import builders\n"
        "from tests.kernels.test_differing import various\n"
        "print(builders.bits(various()))"
    )
    assert builders.bits(various()) == interpreted(alone).strip()


# ---- the law of the factors


class Limits(tuple[float, ...]):
    """Stands for the Params of a model: numbers by name."""

    _fields = ("least", "most", "share")

    def __getattr__(self, name: str) -> float:
        return float(self[self._fields.index(name)])

    def _asdict(self) -> dict[str, float]:
        return dict(zip(self._fields, self, strict=True))


LIMITS = Limits((0.5, 3.0, 0.9))


def logs(n: int, **deviations: float) -> list[np.ndarray]:
    """The logarithms of the factors of `n` robots, (N,) for each parameter."""
    every = [Spread(name, one, 0.0, math.inf) for name, one in deviations.items()]
    (table,) = build_rows(LIMITS, every, KEY, n)
    return [np.log(table[name] / getattr(LIMITS, name)) for name in deviations]


def test_the_logarithms_of_factors_are_normal_and_independent() -> None:
    n, deviation = 20_000, 0.3
    least, most = (one / deviation for one in logs(n, least=deviation, most=deviation))
    for found in (least, most):
        assert stats.kstest(found, "norm").pvalue > LEVEL
        assert abs(found.mean()) < Z / math.sqrt(n)
        assert abs((found**2).mean() - 1.0) < Z * math.sqrt(2.0 / n)
    assert abs((least * most).mean()) < Z / math.sqrt(n)
    assert abs((least[1:] * least[:-1]).mean()) < Z / math.sqrt(n - 1)


def test_a_robot_keeps_its_place_at_any_spread_and_in_any_company() -> None:
    """Its factor is a power of that at another spread, to rounding, whatever else
    differs, and however many robots there are.
    """
    (small_,), (large,) = logs(50, most=0.1), logs(40, most=0.4)
    np.testing.assert_allclose(large, 4.0 * small_[:40], rtol=1e-12, atol=1e-15)
    np.testing.assert_array_equal(logs(50, least=0.2, most=0.1)[1], small_)


def test_values_stay_within_the_bounds_of_their_setting() -> None:
    every = [Spread("share", 2.0, 0.2, 1.0), Spread("most", 0.0, 0.0, 9.0)]
    (table,) = build_rows(LIMITS, every, KEY, 400)
    assert (table.share.min(), table.share.max()) == (0.2, 1.0)
    assert set(table.most) == {3.0}
    assert set(table.least) == {0.5}
    assert build_rows(LIMITS, every[1:], KEY, 400) == ()


# ---- in flights


@pytest.mark.slow
def test_each_robot_is_as_fast_as_its_own_limit_lets_it() -> None:
    """Boids of the example swirl faster and faster, up to max_speed."""
    a_job = flown.job("vortex", "standard", n=30, steps=300, max_speed_spread=0.25)
    simulation = Simulation(a_job)
    assert simulation.advance(300)
    most = own_of(simulation)["max_speed"]
    assert most.max() > 1.5 * most.min()
    speed = np.hypot(simulation.flock.vx, simulation.flock.vy)
    np.testing.assert_allclose(speed, most, rtol=1e-12)


def by_grid_and_in_pairs(borders: str, steps: int) -> None:
    """With the same bits as without a grid; robots see from 4 to 30 times as far as
    others.
    """
    changes: dict[str, Any] = {"n": 150, "metrics": (), "borders": borders}
    changes |= {"steps": steps}
    changes |= {"width": 1000.0, "height": 900.0, "map": "empty"}
    changes |= {"perception_range": 30.0, "perception_range_spread": 0.6}
    changes |= {"minimum_image": borders == "torus"}
    gridded = Simulation(builders.job("aziel_chen2025", **changes))
    own = own_of(gridded)["perception_range"]
    assert own.max() > 4.0 * own.min()
    paired = Simulation(
        replace(builders.job("aziel_chen2025", **changes), all_pairs=True)
    )
    for simulation in (gridded, paired):
        assert simulation.advance(steps)
    there, here = (builders.state(one.flock) for one in (gridded, paired))
    assert there.tobytes() == here.tobytes()


@pytest.mark.slow
@pytest.mark.parametrize("borders", ["bounded", "torus"])
def test_the_grid_lets_the_farthest_sighted_see(borders: str) -> None:
    by_grid_and_in_pairs(borders, 10)


@pytest.mark.slow
def test_it_is_seen_whom_a_robot_sees_by_its_own_range() -> None:
    changes: dict[str, Any] = {"n": 60, "metrics": (), "map": "empty", "fov": 360}
    changes |= {"perception_range": 60.0, "perception_range_spread": 0.5}
    simulation = Simulation(builders.job("aziel_chen2025", **changes))
    flock, own = simulation.flock, own_of(simulation)["perception_range"]
    for boid in range(60):
        seen = seen_by(simulation.flight, boid)
        away = np.hypot(flock.x - flock.x[boid], flock.y - flock.y[boid])
        near = np.flatnonzero(away < own[boid])
        assert seen.range == own[boid]
        assert seen.neighbours == [one for one in near.tolist() if one != boid]


@pytest.mark.slow
def test_what_one_rule_does_is_that_of_each_robot() -> None:
    """The arrows of the page: rules that are switched off are off for all robots."""
    simulation = Simulation(small("aziel_chen2025", 0.3, metrics=()))
    flight, params = simulation.flight, simulation.flight.params
    off = {rule.weight: 0.0 for rule in flight.model.rules}
    rng = np.random.default_rng(1)
    idle = velocities_after(flight, params._replace(**off), rng)
    most = own_of(simulation)["max_speed"]
    np.testing.assert_allclose(np.hypot(*idle), np.minimum(most, 5.0), rtol=1e-12)
    assert np.isfinite(accelerations(simulation)).all()
    assert own_of(simulation)["cohesion_weight"].min() > 0.0


@pytest.mark.parametrize(
    "model", slow_but(["nguyen2024"], ["nguyen2024", "aziel_chen2025"])
)
def test_robots_may_be_sorted_otherwise(model: str) -> None:
    """Sums have another order: by 1e-13 px they round differently, and a flock
    amplifies that to 1e-11 px.
    """
    a_job = small(model, 0.2, update="synchronous", wander_weight=0.0)
    first, second = Simulation(a_job), Simulation(a_job)
    order = np.random.default_rng(2).permutation(14)
    builders.place(second, *(one[order] for one in first.flock[:4]))
    (table,) = second.flight.work.robots.rows
    table[:] = table[order].copy()
    for simulation in (first, second):
        assert simulation.advance(20)
    np.testing.assert_allclose(
        builders.state(second.flock),
        builders.state(first.flock)[:, order],
        rtol=0,
        atol=1e-9,
    )


@pytest.mark.slow
def test_a_flock_of_such_robots_flies_the_same_elsewhere() -> None:
    """By a shift that all coordinates hold exactly, on an open plane; places round
    differently, as above.
    """
    changes: dict[str, Any] = {"map": "empty", "borders": "open", "wall_weight": 0.0}
    a_job = small("aziel_chen2025", 0.2, **changes, goal_weight=0.0)
    first, second = Simulation(a_job), Simulation(a_job)
    x, y, vx, vy = first.flock[:4]
    builders.place(second, x + 1024.0, y - 512.0, vx, vy)
    for simulation in (first, second):
        assert simulation.advance(20)
    shift = np.array([[1024.0], [-512.0], [0.0], [0.0]])
    np.testing.assert_allclose(
        builders.state(second.flock),
        builders.state(first.flock) + shift,
        rtol=0,
        atol=1e-9,
    )


@pytest.mark.parametrize(
    "call",
    [
        "by_grid_and_in_pairs('bounded', 2)",
        "by_grid_and_in_pairs('torus', 2)",
        "test_it_is_seen_whom_a_robot_sees_by_its_own_range()",
        "test_what_one_rule_does_is_that_of_each_robot()",
        "test_a_flock_of_such_robots_flies_the_same_elsewhere()",
    ],
)
def test_such_robots_do_in_the_interpreter(call: str) -> None:
    """Where aziel_chen2025 has not to be compiled for them."""
    interpreted(f"from tests.kernels import test_differing as t\nt.{call}")


def test_an_interrupted_flight_goes_on_with_the_same_robots() -> None:
    flight = Simulation(various())
    assert flight.advance(8)
    flight.take_frames()
    middle = flight.state().copied()
    assert not [name for name in middle.arrays if "rows" in name]
    assert flight.advance(12)
    again = Simulation(various())
    again.restore(middle)
    assert again.advance(12)
    there, here = (builders.state(one.flock) for one in (flight, again))
    assert there.tobytes() == here.tobytes()


def test_such_trials_fly_alone() -> None:
    assert all(len(group) == 1 for group in groups([various()] * AT_ONCE))
