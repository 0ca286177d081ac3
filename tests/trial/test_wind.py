"""Trials in a medium that moves.

Random numbers have fixed keys. Statistical checks are two-sided at Z standard errors: a
check of a normal number fails by chance once in 147,000 keys. A sample variance of M
numbers is about normal, with the standard error sqrt(2 / (M - 1)) of itself. There are
18 checks.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from hashlib import sha256
from typing import Any

import numpy as np
import pytest

from kernels.chance import ChanceKey
from kernels.flight import rebuild_grid
from kernels.inspection import seen_by
from kernels.models import MODELS
from kernels.neighbours import all_pairs
from kernels.robots.wind import blow, build_wind
from kernels.settings import BOUNDED, TORUS, Medium
from sweep.design.jobs import Job
from sweep.trial.lanes import AT_ONCE, groups
from sweep.trial.robots import flies_alone, keys_of
from sweep.trial.simulation import Simulation
from sweep.trial.state import different
from tests import builders, naive
from tests.cases import slow_but
from tests.interpreter import interpreted
from tests.naive.wind import carried, way_of_step

Z = 4.5
STORM = {"wind_x": 3.0, "wind_y": -2.0, "gust": 1.5, "gust_time": 4.0}
"""In px and steps."""


def a_job(model: str = "nguyen2024", **changes: Any) -> Job:
    return builders.job(model, "as_written", **(builders.ALL_FORCES | changes))


def storm(model: str) -> dict[str, float]:
    """The same storm in the units of a model, in its steps."""
    dt = float(builders.job(model).settings["dt"])
    one = builders.scale(model) / dt
    return {
        "wind_x": STORM["wind_x"] * one,
        "wind_y": STORM["wind_y"] * one,
        "gust": STORM["gust"] * one,
        "gust_time": STORM["gust_time"] * dt,
    }


def flown(simulation: Simulation, steps: int) -> np.ndarray:
    assert simulation.advance(steps)
    simulation.take_frames()
    return builders.state(simulation.flock)


def test_a_medium_at_rest_is_no_layer() -> None:
    calm = a_job(gust_time=3.0)
    assert not flies_alone(calm)
    assert Simulation(calm).flight.work.robots.wind is None
    for name in ("wind_x", "wind_y", "gust"):
        job = a_job(**{name: 1e-300})
        assert flies_alone(job)
        assert Simulation(job).flight.work.robots.wind is not None


# ---- closed forms


@pytest.mark.parametrize("model", builders.COMPILED_AS_ROBOTS)
def test_a_wind_moves_boids_by_its_velocity_times_the_time(model: str) -> None:
    """In an open world, where nothing else acts; velocities stay what they are without
    a wind, since they are relative to the medium.

    A place is a sum of twenty numbers below 1e4 px, each rounded to 1e-16 of itself.
    """
    calm = {"map": "empty", "borders": "open", "n": 9, "steps": 20, "metrics": ()}
    calm |= builders.weightless(model) | {"wheels": False, "motor_lag": 0.0}
    wind = storm(model) | {"gust": 0.0}
    still = flown(Simulation(builders.job(model, "as_written", **calm)), 20)
    job = builders.job(model, "as_written", **calm, **wind)
    found = flown(Simulation(job), 20)
    time = 20 * float(job.settings["dt"])
    way = np.array([[wind["wind_x"]], [wind["wind_y"]]]) * time
    wanted = still[:2] + way
    close = 1e-10 * builders.scale(model)
    np.testing.assert_allclose(found[:2], wanted, rtol=0, atol=close)
    np.testing.assert_allclose(found[2:], still[2:], rtol=0, atol=close)


@pytest.mark.parametrize("model", slow_but(["rustamani2024", "couzin2002"], MODELS))
def test_every_model_does_in_the_interpreter(model: str) -> None:
    """Nothing is compiled there."""
    code = (
        "from tests.trial import test_wind as t\n"
        f"t.test_a_wind_moves_boids_by_its_velocity_times_the_time({model!r})\n"
        f"t.test_every_model_has_the_same_bits_in_any_grid({model!r})"
    )
    interpreted(code)


def test_metrics_see_the_ground_and_speed_the_medium() -> None:
    """Boids that stand in the medium are carried round the world, and visit it."""
    settings = builders.weightless("nguyen2024") | {
        "map": "empty",
        "start_speed": 0.0,
        "max_speed": 0.0,
        "borders": "torus",
        "wind_x": 10.0,
        "n": 1,
        "steps": 128,
        "metrics": ("speed", "coverage"),
    }
    result = Simulation(builders.job("nguyen2024", **settings)).result(began=0.0)
    assert result.last["speed"] == 0.0
    calm = Simulation(builders.job("nguyen2024", **settings | {"wind_x": 0.0}))
    assert result.last["coverage"] > 50 * calm.result(began=0.0).last["coverage"]


def gusts_of(medium: Medium, steps: int, trials: int) -> np.ndarray:
    """The ways (steps, 2, trials) by which trials carry a boid, in steps of DT."""
    flock, world = builders.a_flock([0.0], [0.0]), builders.a_world()
    grid, clock = all_pairs(1), np.zeros(1, np.int64)
    ways = np.zeros((steps, 2, trials))
    for trial in range(trials):
        wind = build_wind(medium, ChanceKey(trial, 5), DT, world)
        for clock[0] in range(steps):
            flock.x[0] = flock.y[0] = 0.0
            blow(wind, flock, grid, ChanceKey(trial, 9), clock)
            ways[clock[0], :, trial] = flock.x[0], flock.y[0]
    return ways


DT = 0.5
TRIALS, STEPS = 2000, 12


@pytest.mark.parametrize("time", [0.0, 0.2, 3.0, math.inf])
def test_gusts_have_the_variances_of_their_process(time: float) -> None:
    """From the first step on, and for their sum: of an Ornstein-Uhlenbeck process that
    is looked at each dt, with the correlation q = exp(-dt / gust_time) of two looks, n
    steps move the medium with the variance gust^2 dt^2 (n + 2 sum_k (n - k) q^k), k
    from 1 to n - 1. The components are independent.
    """
    gust = 1.7
    ways = gusts_of(Medium(0.0, 0.0, gust, time), STEPS, TRIALS)
    q = math.exp(-DT / time) if time > 0 else 0.0
    summed = STEPS + 2 * sum((STEPS - k) * q**k for k in range(1, STEPS))
    size = (gust * DT) ** 2
    error = Z * math.sqrt(2 / (2 * TRIALS))
    for found, wanted in (
        (ways[0], size),
        (ways[-1], size),
        (ways.sum(axis=0), size * summed),
    ):
        assert abs(np.mean(found**2) / wanted - 1) < error
    across = np.mean(ways[0, 0] * ways[0, 1]) / size
    assert abs(across) < Z / math.sqrt(TRIALS)
    if math.isinf(time):
        assert (ways == ways[0]).all()


def test_the_mean_of_gusts_is_the_wind() -> None:
    ways = gusts_of(Medium(3.0, -1.0, 1.7, 0.0), 3, TRIALS) / DT
    off = ways.mean(axis=(0, 2)) - np.array([3.0, -1.0])
    assert (np.abs(off) < Z * 1.7 / math.sqrt(3 * TRIALS)).all()


@pytest.mark.parametrize("gust_time", [0.0, 4.0])
@pytest.mark.parametrize("borders", ["open", "torus", "bounded"])
def test_a_flock_is_carried_as_a_slow_twin_says(borders: str, gust_time: float) -> None:
    """Gusts are sums of all random numbers so far there: 20 of them, each rounded to
    1e-16 of itself, at places below 1e3 px.
    """
    settings = STORM | {"borders": borders, "gust_time": gust_time}
    nothing = builders.weightless("nguyen2024") | {"map": "empty"}
    job = a_job(**(nothing | settings))
    simulation, keys = Simulation(job), keys_of(job)
    for k in range(20):
        way = way_of_step(job.settings, keys, k)
        wanted = carried(naive.birds(simulation.flock), simulation.world, way)
        twin = naive.nguyen2024(
            job.settings, simulation.world, wanted, np.random.default_rng(1)
        )
        found = flown(simulation, 1)
        rows = np.array([[*one.position, *one.velocity] for one in twin]).T
        np.testing.assert_allclose(found, rows, rtol=0, atol=1e-11)


STEERING = ("nguyen2024", "aziel_chen2025")


@pytest.mark.parametrize("update", builders.UPDATES)
@pytest.mark.parametrize("model", slow_but(["nguyen2024"], STEERING))
def test_boids_steer_by_where_the_medium_has_carried_them(
    model: str, update: str
) -> None:
    """A step is that of the model from where all are after the wind: as of a slow twin,
    with all forces, on a torus that is seen across its borders. Sums round differently,
    by 1e-13 px at 300 px; a wrong rule is off by more than 1e-3 px.
    """
    torus = {"borders": "torus", "minimum_image": True, "update": update}
    job = a_job(model, **torus, **STORM)
    simulation, keys = Simulation(job), keys_of(job)
    for k in range(20):
        way = way_of_step(job.settings, keys, k)
        there = carried(naive.birds(simulation.flock), simulation.world, way)
        twin = getattr(naive, model)(
            job.settings, simulation.world, there, np.random.default_rng(1)
        )
        found = flown(simulation, 1)
        rows = np.array([[*one.position, *one.velocity] for one in twin]).T
        np.testing.assert_allclose(found, rows, rtol=0, atol=1e-10)


def test_others_do_in_the_interpreter() -> None:
    code = (
        "from tests.trial import test_wind as t\n"
        "for update in t.builders.UPDATES:\n"
        "    t.test_boids_steer_by_where_the_medium_has_carried_them("
        "t.STEERING[1], update)"
    )
    interpreted(code)


def test_borders_act_on_what_is_carried() -> None:
    """A torus wraps a place; a bounded world mirrors it and the velocity."""
    grid, clock = all_pairs(2), np.zeros(1, np.int64)
    for borders, places, speeds in (
        (TORUS, [1.0, 5.0], [2.0, 2.0]),
        (BOUNDED, [9.0, 5.0], [-2.0, 2.0]),
    ):
        world = builders.a_world(10.0, 10.0, borders)
        flock = builders.a_flock([8.0, 2.0], [5.0, 5.0], [2.0, 2.0])
        wind = build_wind(Medium(3.0, 0.0, 0.0, 0.0), ChanceKey(1, 2), 1.0, world)
        blow(wind, flock, grid, ChanceKey(1, 3), clock)
        assert flock.x.tolist() == places
        assert flock.vx.tolist() == speeds
        assert flock.y.tolist() == [5.0, 5.0]


# ---- in flights


@pytest.mark.parametrize("model", builders.COMPILED_AS_ROBOTS)
def test_every_model_has_the_same_bits_in_any_grid(model: str) -> None:
    """Boids that the wind has carried into other cells are found there; and a flight
    that was interrupted goes on to the same bits, with the same gusts.
    """
    job = builders.job(model, n=40, steps=12, **storm(model))
    one, other = Simulation(job), Simulation(replace(job, all_pairs=True))
    rebuild_grid(one.flight, room=2)
    found = flown(one, 12)
    assert np.isfinite(found).all()
    assert (found == flown(other, 12)).all()
    part, again = Simulation(job), Simulation(job)
    flown(part, 5)
    again.restore(part.state().copied(), room=3)
    assert (flown(again, 7) == found).all()
    gusts = [each.flight.work.robots.wind.now for each in (one, again)]
    assert gusts[0].tobytes() == gusts[1].tobytes()
    assert (found != flown(Simulation(builders.job(model, n=40, steps=12)), 12)).any()


@pytest.mark.slow
@pytest.mark.parametrize("update", builders.UPDATES)
def test_robots_are_carried_too(update: str) -> None:
    """With messages that are under way, motors, and one who stands: it moves with the
    medium. What a boid hears of is shown as of the flock that is seen.
    """
    robots = {
        "position_noise": 1.0,
        "sensing_delay": 3.0,
        "sensing_period": 2.0,
        "motor_lag": 2.0,
        "failing_share": 0.1,
        "update": update,
        "borders": "open",
    }
    job = a_job(**robots, **STORM)
    one, other = Simulation(job), Simulation(replace(job, all_pairs=True))
    rebuild_grid(one.flight, room=2)
    failed = one.flight.work.robots.failing.fails_at == 0
    assert failed.sum() == 1
    before = builders.state(one.flock).copy()
    found = flown(one, 7)
    assert (found == flown(other, 7)).all()
    keys = keys_of(job)
    ways = [way_of_step(job.settings, keys, k) for k in range(7)]
    np.testing.assert_allclose(
        found[:2, failed],
        before[:2, failed] + np.sum(ways, axis=0)[:, None],
        rtol=0,
        atol=1e-10,
    )
    state = one.state().copied()
    seen = [seen_by(one.flight, boid) for boid in range(14)]
    assert different(state, one.state()) == ""
    assert sum(len(each.neighbours) for each in seen) > 0
    part, again = Simulation(job), Simulation(job)
    flown(part, 4)
    again.restore(part.state().copied())
    assert (flown(again, 3) == found).all()


def test_a_flight_that_goes_on_with_another_wind_keeps_its_gust() -> None:
    """As a part of its standard deviation. One that had no wind begins with a gust."""
    job = a_job(**STORM)
    part, same = Simulation(job), Simulation(job)
    flown(part, 7)
    same.go_on_from(part)
    stronger = Simulation(a_job(**(STORM | {"gust": 4.0, "gust_time": 9.0})))
    stronger.go_on_from(part)
    now = part.flight.work.robots.wind.now
    assert stronger.flight.work.robots.wind.now.tolist() == now.tolist()
    assert (flown(same, 13) == flown(Simulation(job), 20)).all()
    fresh, calm = Simulation(job), Simulation(a_job())
    begun = fresh.flight.work.robots.wind.now.tolist()
    flown(calm, 3)
    fresh.go_on_from(calm)
    assert fresh.flight.work.robots.wind.now.tolist() == begun


def digests() -> str:
    """Where boids are after trials in a storm, as hashes."""
    found = []
    for update in builders.UPDATES:
        for borders in ("open", "torus", "bounded"):
            job = a_job(update=update, borders=borders, **STORM)
            found.append(sha256(flown(Simulation(job), 8).tobytes()).hexdigest())
    return " ".join(found)


def test_the_interpreter_gives_the_same_bits() -> None:
    code = "from tests.trial import test_wind as t\nprint(t.digests())"
    assert interpreted(code).strip() == digests()


def test_trials_in_a_wind_fly_alone() -> None:
    jobs = [a_job(**STORM, seed=k) for k in range(AT_ONCE)]
    assert all(len(group) == 1 for group in groups(jobs))


def without_publish(advance: Callable[..., bool], clock: Any) -> Callable[..., bool]:
    """An `advance` that seems not to have published one of its steps."""

    def forgetful(*given: Any) -> bool:
        going = advance(*given)
        clock[0] -= 1
        return going

    return forgetful


def test_a_model_that_does_not_publish_is_noticed_by_its_clock() -> None:
    simulation = Simulation(a_job(wind_x=1.0))
    flight = simulation.flight
    advance = without_publish(flight.model.advance, flight.work.robots.clock)
    flight.model = flight.model._replace(advance=advance)
    with pytest.raises(RuntimeError, match="called publish in 4 of 5 steps"):
        simulation.advance(5)


def test_gusts_depend_on_the_key_of_a_trial() -> None:
    ways = [
        way_of_step(job.settings, keys_of(job), 3)
        for job in (a_job(**STORM), a_job(**STORM, seed=2))
    ]
    assert (ways[0] != ways[1]).all()
