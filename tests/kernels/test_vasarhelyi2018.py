"""vasarhelyi2018: what is known of it without computing."""

import math
from typing import Any

import numpy as np
import pytest

from kernels.models import MODELS
from kernels.state import World
from sweep.trial.robots import keys_of
from sweep.trial.simulation import Simulation
from tests import builders, naive
from tests.naive.sensing import Knowledge

SIDE = 2000.0
FREE = {
    "speed_limit": "cut",
    "max_speed": math.inf,
    "walls": False,
    "motor_noise": 0.0,
    "motor_acceleration": math.inf,
    "interaction_range": math.inf,
    "width": SIDE,
    "height": SIDE,
}
"""A wanted velocity as it is, in a world whose walls are far away."""
SHILL_SPEED, SHILL_RANGE, SHILL_SLOPE, SHILL_ACCELERATION = 13.6, 0.3, 3.55, 3.02
FRICTION_RANGE, FRICTION_SLOPE, FRICTION_ACCELERATION = 85.3, 3.2, 4.16


def begun(start: Any, obstacles: Any = (), **changes: Any) -> Simulation:
    """A flight from a given start (4, N), among given obstacles."""
    start = np.array(start, float)
    a_job = builders.job(
        "vasarhelyi2018", metrics=(), n=start.shape[1], **(FREE | changes)
    )
    simulation = builders.place(Simulation(a_job), *start)
    if len(obstacles):
        world: World = builders.a_world(SIDE, SIDE, obstacles=obstacles)
        scenery = simulation.flight.scenery._replace(world=world)
        simulation.flight.scenery = scenery
    return simulation


def wanted(start: Any, obstacles: Any = (), **changes: Any) -> np.ndarray:
    """The velocities (2, N) that drones choose at a start (4, N)."""
    simulation = begun(start, obstacles, **changes)
    simulation.advance(1)
    return simulation.flight.work.state[:2]


def stopping(speed: float, acceleration: float, slope: float) -> float:
    """The way in which a speed is braked: all of it in proportion to the way, or down
    to a / p by a constant acceleration before.
    """
    if speed < acceleration / slope:
        return speed / slope
    return (speed**2 / acceleration + acceleration / slope**2) / 2


def at_a_wall(distance: float, speed: float, **changes: Any) -> float:
    """What a drone at rest but for `speed` towards the wall on its right wants of it,
    beyond its own velocity.
    """
    settings = {"walls": True, "flock_speed": 0.0} | changes
    start = [[SIDE - distance], [SIDE / 2], [speed], [0.0]]
    return float(wanted(start, **settings)[0, 0])


@pytest.mark.parametrize("speed", [0.0, 0.5, 4.0, 9.0])
def test_a_wall_acts_from_the_stopping_distance_on(speed: float) -> None:
    """Of the speed that the drone has against its shill agent, which is in the part of
    constant acceleration here; to 1e-9 of the way.
    """
    off = SHILL_SPEED + speed
    way = SHILL_RANGE + stopping(off, SHILL_ACCELERATION, SHILL_SLOPE)
    assert at_a_wall(way * (1 + 1e-9), speed) == 0.0
    nearer = at_a_wall(way * (1 - 1e-6), speed)
    assert -1e-3 < nearer < 0.0
    assert at_a_wall(SHILL_RANGE, speed) == pytest.approx(-off, rel=1e-12)
    assert at_a_wall(-20.0, speed) == pytest.approx(-off, rel=1e-12), "outside"


@pytest.mark.parametrize("share", [0.1, 0.9, 1.0, 1.1, 5.0])
def test_a_wall_leaves_the_speed_that_can_be_braked(share: float) -> None:
    """In both parts of the braking curve, and where they meet: at the way in which a
    speed is braked, the difference of velocities is cut by all but this speed.
    """
    left = share * SHILL_ACCELERATION / SHILL_SLOPE
    way = stopping(left, SHILL_ACCELERATION, SHILL_SLOPE)
    taken = at_a_wall(SHILL_RANGE + way, 2.0)
    assert taken == pytest.approx(-(SHILL_SPEED + 2.0 - left), rel=1e-10)


def test_walls_along_both_axes_add_up_and_point_inwards() -> None:
    settings = {"walls": True, "flock_speed": 0.0}
    start = [[1.0, SIDE + 5.0], [1.0, SIDE - 1.0], [0.0, 0.0], [0.0, 0.0]]
    found = wanted(start, **settings, interaction_range=0.0)
    assert (found[:, 0] > 0.0).all()
    assert (found[:, 1] < 0.0).all()
    assert found[0, 0] == found[1, 0]


@pytest.mark.parametrize("distance", [0.5, 10.0, 25.0, 25.6, 40.0])
def test_near_drones_go_apart_in_proportion_to_what_is_missing(distance: float) -> None:
    start = [[900.0, 900.0], [900.0, 900.0 + distance], [0.0, 0.0], [0.0, 0.0]]
    push = 0.13 * max(25.6 - distance, 0.0)
    assert wanted(start)[1] == pytest.approx([-push, push], rel=1e-12)
    assert (wanted(start)[0] == 0.0).all()


@pytest.mark.parametrize("distance", [50.0, 85.9, 86.0, 88.0, 95.0])
def test_friction_takes_what_is_beyond_the_braking_curve(distance: float) -> None:
    """A drone flies past one at rest; only what friction adds to the speed v_flock of
    the first, and to none of the second.
    """
    start = [[900.0, 900.0], [900.0, 900.0 + distance], [6.0, 0.0], [0.0, 0.0]]
    way = distance - FRICTION_RANGE
    due = 0.63
    for step in np.linspace(0.0, 12.0, 120_001) if way > 0 else ():
        if stopping(step, FRICTION_ACCELERATION, FRICTION_SLOPE) >= way:
            due = max(due, step)
            break
    pull = 0.05 * max(6.0 - due, 0.0)
    found = wanted(start)
    assert found[0] == pytest.approx([4.0 - pull, pull], abs=1e-5)
    assert (found[1] == 0.0).all()


def test_nobody_beyond_the_range_is_heard() -> None:
    start = [[900.0, 900.0], [900.0, 920.0], [0.0, 0.0], [0.0, 0.0]]
    for reach, acts in ((20.0, True), (20.0 - 1e-9, False)):
        assert wanted(start, interaction_range=reach).any() == acts


DISC, WALL = [500.0, 500.0, 20.0, 20.0, 1.0], [800.0, 500.0, 40.0, 10.0, 0.0]


@pytest.mark.parametrize(
    ("obstacle", "x", "y", "way", "distance"),
    [
        (DISC, 500.0, 522.0, (0.0, 1.0), 2.0),
        (DISC, 512.0, 516.0, (0.6, 0.8), 0.0),
        (DISC, 491.0, 488.0, (-0.6, -0.8), -5.0),
        (WALL, 790.0, 489.0, (0.0, -1.0), 1.0),
        (WALL, 843.0, 514.0, (0.6, 0.8), 5.0),
        (WALL, 835.0, 502.0, (1.0, 0.0), -5.0),
        (WALL, 790.0, 503.0, (0.0, 1.0), -7.0),
    ],
)
def test_an_obstacle_acts_from_the_nearest_point_of_its_border(
    obstacle: list[float],
    x: float,
    y: float,
    way: tuple[float, float],
    distance: float,
) -> None:
    """On a drone at rest, away from there, or towards it inside: D by the part of
    constant acceleration.
    """
    found = wanted([[x], [y], [0.0], [0.0]], [obstacle])[:, 0]
    turn = SHILL_ACCELERATION / SHILL_SLOPE
    due = math.sqrt(
        2 * SHILL_ACCELERATION * max(distance - SHILL_RANGE, turn / SHILL_SLOPE)
        - turn**2
    )
    size = SHILL_SPEED - (due if distance > SHILL_RANGE else 0.0)
    assert found == pytest.approx(size * np.array(way), rel=1e-9, abs=1e-9)


def test_a_limit_scales_or_cuts() -> None:
    """Drones that are near push each other by 0.13 (25.6 - 5) = 2.678 m/s."""
    start = [[900.0, 905.0], [900.0, 900.0], [0.0, 0.0], [0.0, 0.0]]
    for limit, most, size in (
        ("scaled", 1.0, 4.0),
        ("cut", 1.0, 1.0),
        ("cut", 3.0, 2.678),
    ):
        found = wanted(start, speed_limit=limit, max_speed=most)
        assert found[0] == pytest.approx([-size, size], rel=1e-12)
    alone = wanted([[900.0], [900.0], [0.0], [0.0]], speed_limit="scaled")
    assert (alone == 0.0).all(), "a drone that nothing moves stays at rest"


@pytest.mark.parametrize("lag", [0.5, 2.0])
def test_a_velocity_comes_to_the_wanted_one_with_the_lag(lag: float) -> None:
    """A drone at 1 m/s wants 4: after k steps 4 - 3 exp(-k dt / lag), and it has gone
    the sum of the velocities before each step.
    """
    simulation = begun([[900.0], [900.0], [0.0], [1.0]], motor_lag=lag)
    simulation.advance(150)
    left = 3.0 * np.exp(-0.01 / lag * np.arange(151))
    assert simulation.flock.vy[0] == pytest.approx(4.0 - left[150], rel=1e-12)
    gone = 0.01 * (4.0 - left[:150]).sum()
    assert simulation.flock.y[0] - 900.0 == pytest.approx(gone, rel=1e-10)


def test_an_acceleration_is_cut() -> None:
    simulation = begun([[900.0], [900.0], [0.6], [0.8]], motor_acceleration=0.5)
    simulation.advance(100)
    speed = 1.0 + 0.5 * 100 * 0.01
    assert simulation.flock.vx[0] == pytest.approx(0.6 * speed, rel=1e-12)
    assert simulation.flock.vy[0] == pytest.approx(0.8 * speed, rel=1e-12)


def test_gusts_have_the_variance_of_the_simulator() -> None:
    """Of 2 x 4000 components after one step from rest: 2 0.2 dt. The standard error of
    a variance is sqrt(2 / 8000) of it; two-sided at 4.5 of them, and at as many of the
    mean, one of 70,000 seeds fails; it is fixed.
    """
    places = np.random.default_rng(1).uniform(0, SIDE, (2, 4000))
    start = [*places, *np.zeros((2, 4000))]
    gusts = MODELS["vasarhelyi2018"].presets["as_run"]["motor_noise"]
    settings = {"interaction_range": 0.0, "motor_noise": gusts}
    simulation = begun(start, **settings)
    simulation.advance(1)
    drawn = np.concatenate([simulation.flock.vx, simulation.flock.vy])
    variance = 2 * 0.2 * 0.01
    assert abs(drawn.var() / variance - 1) < 4.5 * math.sqrt(2 / 8000)
    assert abs(drawn.mean()) < 4.5 * math.sqrt(variance / 8000)


@pytest.mark.parametrize("dt", [0.01, 0.025, 0.2])
def test_a_wanted_velocity_is_held_for_the_control_period(dt: float) -> None:
    """Two drones in each other's way choose anew in each step that begins a period, and
    in no other: over 1000 periods, so that rounding does not add up.
    """
    start = [[900.0, 960.0], [900.0, 900.0], [3.0, -3.0], [0.0, 0.1]]
    simulation = begun(start, dt=dt, steps=10**6, every=10**6)
    steps, period = 0, round(0.2 / dt)
    before = np.zeros((2, 2))
    for _ in range(60):
        simulation.advance(1)
        now = simulation.flight.work.state[:2].copy()
        assert np.array_equal(now, before) == (steps % period != 0)
        before, steps = now, steps + 1
    simulation.advance(1000 * period - 60)
    assert abs(simulation.flight.work.state[2]).max() < 0.01 * dt


def test_a_border_that_mirrors_a_drone_mirrors_what_it_wants() -> None:
    simulation = begun(
        [[0.005], [900.0], [-4.0], [3.0]], borders="bounded", flock_speed=5.0
    )
    simulation.advance(1)
    assert simulation.flock.x[0] == pytest.approx(0.035)
    assert simulation.flock.vx[0] > 0.0
    assert simulation.flight.work.state[:2, 0] == pytest.approx([4.0, 3.0])


@pytest.mark.parametrize("preset", ["real", "lossy"])
def test_drones_want_what_a_slow_twin_wants_of_what_they_know(preset: str) -> None:
    """At each choice of a flight with the senses of the simulator: each drone chooses
    as in a flock of itself, as it knows itself, and of those whom it hears of. Motors
    without a lag give the twin the velocity that it wants.

    What a step adds to an error has a covariance of 1e-10, as the difference of numbers
    of 0.5: its roots differ by 1e-7 of themselves between two ways to compute them, and
    errors by 1e-8 m/s after 200 steps. A wrong rule is off by more than 1e-3 m/s.
    """
    a_job = builders.job("vasarhelyi2018", preset, metrics=(), n=8, steps=200, seed=3)
    simulation, settings = Simulation(a_job), a_job.settings
    knowledge = Knowledge(settings, simulation.world, keys_of(a_job).flown)
    at_once = settings | {"motor_lag": 0.0, "motor_acceleration": math.inf}
    heard = 0
    for step in range(200):
        knows = knowledge.own_and_heard(naive.birds(simulation.flock))
        simulation.advance(1)
        simulation.take_frames()
        if step % 20:
            continue
        for i, (own, others) in enumerate(knows):
            flock = [own, *others]
            twin = naive.vasarhelyi2018(at_once, simulation.world, flock, None)[0]
            found = simulation.flight.work.state[:2, i]
            assert found == pytest.approx(twin.velocity, rel=0, abs=1e-6)
            heard += len(others)
    everyone = 10 * 8 * 7
    assert 0.05 * everyone < heard < 0.9 * everyone, "some are out of range, or lost"


def test_the_loop_of_the_motors_has_the_velocity_that_is_measured() -> None:
    """v + (w - u) (1 - exp(-dt / lag)) for 80 steps of drones whose own velocities u
    have errors of 0.3 m/s; with the true velocities steps would differ by 0.003 m/s.
    The slow twin computes errors in another way, to 1e-8 m/s (see above).
    """
    a_job = builders.job(
        "vasarhelyi2018",
        "real",
        metrics=(),
        n=4,
        steps=80,
        seed=5,
        velocity_noise=0.3,
        motor_noise=0.0,
        motor_acceleration=math.inf,
        motor_lag=1.0,
    )
    simulation = Simulation(a_job)
    knowledge = Knowledge(a_job.settings, simulation.world, keys_of(a_job).flown)
    come = -math.expm1(-a_job.settings["dt"])
    errors = []
    for _ in range(80):
        before = builders.state(simulation.flock)[2:].copy()
        knows = knowledge.own_and_heard(naive.birds(simulation.flock))
        measured = np.array([own.velocity for own, _ in knows]).T
        simulation.advance(1)
        simulation.take_frames()
        wanted = simulation.flight.work.state[:2]
        expected = before + (wanted - measured) * come
        found = builders.state(simulation.flock)[2:]
        assert found == pytest.approx(expected, rel=0, abs=1e-8)
        errors.append(measured - before)
    assert 0.1 < np.std(errors) < 0.5
