"""How boids follow what their model wants, against closed forms, and which fail.

Random numbers have fixed keys. Statistical checks are two-sided at Z standard errors: a
check of a normal number fails by chance once in 147,000 keys, and there are six.
"""

import math
from typing import Any

import numpy as np
import pytest

from kernels.chance import ChanceKey
from kernels.jit import jit
from kernels.near import EVERYBODY
from kernels.occupancy import no_occupancy
from kernels.robots.actuation import drive
from kernels.robots.breakdowns import Failing, failing
from kernels.robots.robots import ChanceKeys, build_robots, is_ideal
from kernels.robots.senses import NEVER
from kernels.state import Flock
from kernels.workspace import Workspace, build_workspace
from kernels.worlds import build_reach
from sweep.design.jobs import Job
from sweep.trial.lanes import AT_ONCE, groups
from sweep.trial.simulation import Simulation
from tests import builders
from tests.interpreter import interpreted

KEYS = ChanceKeys(ChanceKey(17, 4), ChanceKey(5, 23))
DT, Z, CLOSE = 0.1, 4.5, 1e-12
"""CLOSE is some thousand roundings of numbers about 1."""
STOPS = {"failing_share": 0.3, "failing_time": 0.5, "failing_how": "stop"}
ALL_ON = {
    "motor_lag": 0.3,
    "motor_acceleration": 2.0,
    "motor_turn_rate": 100.0,
    "motor_min_speed": 0.1,
    "motor_max_speed": 1.5,
    "motor_spread": 0.2,
}


@jit
def follow(work: Workspace, flock: Flock, x: Any, y: Any, steps: int) -> None:
    """Let all boids want the velocities (x, y) for so many steps."""
    for _ in range(steps):
        work.robots.clock[0] += 1
        for i in range(flock.x.size):
            flock.vx[i], flock.vy[i] = drive(
                work, i, flock.vx[i], flock.vy[i], x[i], y[i]
            )


class Fleet:
    """Boids with such motors, which begin with the velocities (vx, vy)."""

    def __init__(self, vx: Any, vy: Any, **changes: Any) -> None:
        x, y, vx, vy = np.broadcast_arrays(0.0, 0.0, vx, np.atleast_1d(vy))
        self.flock = builders.a_flock(*(np.array(one, float) for one in (x, y, vx, vy)))
        n, world = self.flock.x.size, builders.a_world()
        self.work = build_workspace(
            self.flock,
            world,
            math.inf,
            EVERYBODY,
            build_reach(world, 0.0),
            no_occupancy(),
            np.zeros((0, n)),
            np.zeros(n, np.int64),
            build_robots(builders.robots(**changes), KEYS, n, DT, world),
        )

    def want(self, x: Any, y: Any, steps: int = 1) -> np.ndarray:
        """The velocities (2, N) after steps in which all want (x, y)."""
        wanted = [np.array(np.broadcast_to(one, self.flock.x.shape)) for one in (x, y)]
        follow(self.work, self.flock, *wanted, steps)
        return self.velocity

    def fly_on(self, steps: int) -> np.ndarray:
        """The same, of boids that want what they have."""
        follow(self.work, self.flock, self.flock.vx, self.flock.vy, steps)
        return self.velocity

    @property
    def velocity(self) -> np.ndarray:
        return np.stack([self.flock.vx, self.flock.vy])


def test_boids_without_motors_have_no_layer_of_them() -> None:
    assert Fleet(0.0, 0.0).work.robots.motors is None
    blind = Fleet(0.0, 0.0, failing_share=1.0, failing_how="blind")
    assert blind.work.robots.motors is None
    assert is_ideal(builders.robots(), DT)
    for name, value in (ALL_ON | STOPS | {"wheels": True, "motor_noise": 0.1}).items():
        matters = name not in ("motor_spread", "failing_time", "failing_how")
        assert is_ideal(builders.robots(**{name: value}), DT) != matters, name


def test_the_step_response_of_the_lag_is_exact() -> None:
    fleet, lag = Fleet(0.0, 0.0, motor_lag=0.7), 0.7
    for k in range(1, 40):
        vx, vy = fleet.want(1.0, -2.0)[:, 0]
        share = -math.expm1(-k * DT / lag)
        assert vx == pytest.approx(share, abs=CLOSE)
        assert vy == pytest.approx(-2.0 * share, abs=CLOSE)


@pytest.mark.slow
def test_halving_the_time_step_leaves_the_step_response() -> None:
    """The lag is solved exactly: only what depends on the step's beginning may vary."""
    whole, half = Fleet(0.0, 0.0, motor_lag=0.7), Fleet(0.0, 0.0, motor_lag=0.7)
    motors = build_robots(
        builders.robots(motor_lag=0.7), KEYS, 1, DT / 2, builders.a_world()
    )
    half.work = half.work._replace(robots=motors)
    assert half.want(1.0, 1.0, 20) == pytest.approx(whole.want(1.0, 1.0, 10), abs=CLOSE)


def test_at_the_limit_of_the_acceleration_velocities_are_ramps() -> None:
    fleet = Fleet(0.0, 0.0, motor_acceleration=2.0)
    for k in range(1, 12):
        vx, vy = fleet.want(0.6, -0.8)[:, 0]
        reached = min(1.0, 2.0 * DT * k)
        assert (vx, vy) == pytest.approx((0.6 * reached, -0.8 * reached), abs=CLOSE)


@pytest.mark.parametrize("wheels", [False, True])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_quarter_turn_takes_90_degrees_by_the_rate(wheels: bool, side: float) -> None:
    fleet = Fleet(1.0, 0.0, motor_turn_rate=30.0, wheels=wheels)
    for k in range(1, 33):
        vx, vy = fleet.want(0.0, side)[:, 0]
        angle = min(3.0 * k, 90.0)
        assert math.degrees(math.atan2(vy, vx)) == pytest.approx(side * angle, abs=1e-9)
        speed = math.sin(math.radians(angle)) if wheels else 1.0
        assert math.hypot(vx, vy) == pytest.approx(speed, abs=CLOSE)


def test_a_boid_at_rest_turns_from_the_heading_that_it_had() -> None:
    fleet = Fleet(0.0, 1.0, motor_turn_rate=100.0)
    assert fleet.want(0.0, 0.0).tolist() == [[0.0], [0.0]]
    vx, vy = fleet.want(1.0, 0.0)[:, 0]
    assert math.degrees(math.atan2(vy, vx)) == pytest.approx(80.0, abs=1e-9)


def test_wheels_turn_on_the_spot_and_never_slip_sideways() -> None:
    """What lies behind is wanted: the first 90 degrees are turned at rest."""
    fleet = Fleet(0.0, 0.0, motor_turn_rate=45.0, wheels=True)
    for k in range(1, 45):
        vx, vy = fleet.want(-1.0, 0.0)[:, 0]
        x, y = float(fleet.work.heading_x[0]), float(fleet.work.heading_y[0])
        angle = min(4.5 * k, 180.0)
        assert abs(math.degrees(math.atan2(y, x))) == pytest.approx(angle, abs=1e-6)
        assert vx * y - vy * x == pytest.approx(0.0, abs=CLOSE)
        forward = max(0.0, -math.cos(math.radians(angle)))
        assert vx * x + vy * y == pytest.approx(forward, abs=1e-9)


def test_wheels_with_noise_and_limits_never_slip_nor_roll_back() -> None:
    fleet = Fleet(np.zeros(50), 0.0, wheels=True, motor_noise=0.5, **ALL_ON)
    for k in range(60):
        angle = 0.3 * k
        vx, vy = fleet.want(math.cos(angle), math.sin(angle))
        x, y = fleet.work.heading_x, fleet.work.heading_y
        assert vx * y - vy * x == pytest.approx(0.0, abs=CLOSE)
        assert (vx * x + vy * y >= 0.0).all()


def test_speeds_are_limited_and_the_least_one_needs_no_wish() -> None:
    limits = {"motor_min_speed": 0.5, "motor_max_speed": 2.0}
    fleet = Fleet(0.0, [1.0, 1.0, 1.0], **limits)
    vx, vy = fleet.want([0.0, 0.3, 6.0], [0.0, 0.4, 8.0])
    assert vx == pytest.approx([0.0, 0.3, 1.2], abs=CLOSE)
    assert vy == pytest.approx([0.5, 0.4, 1.6], abs=CLOSE)


def test_where_limits_contradict_each_other_the_later_one_holds() -> None:
    """A wing that may not fly slower gets its least speed at once, in spite of the
    limit of its acceleration, but turns no faster than it can.
    """
    wing = {"motor_acceleration": 1.0, "motor_turn_rate": 50.0, "motor_min_speed": 1.0}
    fleet = Fleet(0.01, 0.0, **wing)
    vx, vy = fleet.want(0.0, 9.0)[:, 0]
    assert math.hypot(vx, vy) == pytest.approx(1.0, abs=CLOSE)
    assert math.degrees(math.atan2(vy, vx)) == pytest.approx(5.0, abs=1e-9)


def test_noise_adds_its_variance_in_each_unit_of_time() -> None:
    """The components of a free boid walk at random: after the time t their variance is
    motor_noise^2 t. The standard error of a variance of M normal numbers is
    sqrt(2 / M) of it.
    """
    n, noise, steps = 4000, 0.3, 25
    velocity = Fleet(np.ones(n), 0.0, motor_noise=noise).fly_on(steps)
    off = (velocity - [[1.0], [0.0]]) / (noise * math.sqrt(steps * DT))
    size = off.size
    assert abs(off.mean()) < Z / math.sqrt(size)
    assert abs((off**2).mean() - 1.0) < Z * math.sqrt(2.0 / size)
    assert abs((off[0] * off[1]).mean()) < Z / math.sqrt(n)


def test_with_a_lag_noise_comes_to_a_stationary_variance() -> None:
    """v <- a v + noise sqrt(dt) g with a = exp(-dt / lag) has the variance
    noise^2 dt / (1 - a^2).
    """
    n, kept = 4000, math.exp(-DT / 0.4)
    fleet = Fleet(np.zeros(n), 0.0, motor_noise=0.3, motor_lag=0.4)
    velocity = fleet.want(0.0, 0.0, 60) / math.sqrt(0.09 * DT / (1.0 - kept**2))
    assert abs((velocity**2).mean() - 1.0) < Z * math.sqrt(2.0 / velocity.size)


def test_noise_depends_on_boid_and_step_alone() -> None:
    few, many = (Fleet(np.zeros(n), 0.0, motor_noise=0.3).fly_on(9) for n in (3, 8))
    assert few.tobytes() == many[:, :3].tobytes()
    assert len(set(many.ravel())) == many.size


def test_robots_differ_by_lognormal_factors() -> None:
    """Factors of one robot are independent, and their logarithms are normal."""
    n, spread = 4000, 0.25
    motors = Fleet(np.zeros(n), 0.0, **(ALL_ON | {"motor_spread": spread}))
    made = motors.work.robots.motors
    assert made is not None
    lag, most = np.log(-DT / np.log(made.kept) / 0.3), np.log(made.most / 1.5)
    for found in (lag, most):
        assert abs(((found / spread) ** 2).mean() - 1.0) < Z * math.sqrt(2.0 / n)
    assert abs((lag * most).mean()) / spread**2 < Z / math.sqrt(n)
    assert made.least / made.most == pytest.approx(np.full(n, 0.1 / 1.5), abs=CLOSE)


def naive(s: dict[str, Any], v: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """One step by complex numbers and angles, of a boid that moves."""
    old = complex(*v)
    new = old + (complex(*wanted) - old) * (1.0 - math.exp(-DT / s["motor_lag"]))
    change = new - old
    most = s["motor_acceleration"] * DT
    new = old + change * min(1.0, most / max(abs(change), 1e-300))
    turn = math.remainder(
        math.atan2(new.imag, new.real) - math.atan2(old.imag, old.real), math.tau
    )
    limit = math.radians(s["motor_turn_rate"]) * DT
    angle = math.atan2(old.imag, old.real) + max(-limit, min(turn, limit))
    speed = max(s["motor_min_speed"], min(abs(new), s["motor_max_speed"]))
    return speed * np.array([math.cos(angle), math.sin(angle)])


def test_all_motors_are_those_of_a_slow_twin() -> None:
    settings = ALL_ON | {"motor_spread": 0.0}
    rng, n = np.random.default_rng(3), 40
    fleet = Fleet(*rng.normal(size=(2, n)), **settings)
    for _ in range(30):
        before, wanted = fleet.velocity.copy(), 2.0 * rng.normal(size=(2, n))
        after = fleet.want(*wanted)
        for i in range(n):
            twin = naive(settings, before[:, i], wanted[:, i])
            assert after[:, i] == pytest.approx(twin, abs=1e-9)


# ---- breakdowns


def fails(n: int = 40, **changes: Any) -> Failing:
    found = builders.robots(**(STOPS | changes)).breakdowns
    return failing(found, KEYS.made, n, DT)


@pytest.mark.parametrize(("share", "count"), [(0.0, 0), (0.3, 12), (0.31, 12), (1, 40)])
def test_exactly_the_share_fails(share: float, count: int) -> None:
    found = fails(failing_share=share).fails_at
    assert (found == 5).sum() == count
    assert (found == NEVER).sum() == 40 - count


def test_who_fails_depends_on_nothing_else() -> None:
    """And those who fail at a smaller share do so at a larger one."""
    some = fails().fails_at < NEVER
    for changes in (
        {"failing_time": 3.0},
        {"failing_how": "drift"},
        {"motor_lag": 2.0, "sensing_delay": 0.5},
    ):
        assert ((fails(**changes).fails_at < NEVER) == some).all()
    assert (some <= (fails(failing_share=0.5).fails_at < NEVER)).all()
    assert len({fails(n).fails_at.tobytes() for n in (40, 41)}) == 2


@pytest.mark.parametrize(("time", "step"), [(0.0, 0), (0.1, 1), (0.3, 3), (0.31, 4)])
def test_the_first_failed_step_begins_at_the_time_or_later(
    time: float, step: int
) -> None:
    assert fails(failing_time=time, failing_share=1.0).fails_at.tolist() == [step] * 40


@pytest.mark.parametrize("how", ["stop", "drift"])
def test_failed_boids_stand_or_keep_their_velocity(how: str) -> None:
    """From their step on, whatever their motors, and without noise."""
    n = 20
    settings = ALL_ON | STOPS | {"failing_how": how, "motor_noise": 0.1}
    fleet = Fleet(np.ones(n), 0.0, **settings)
    failed = fleet.work.robots.failing.fails_at < NEVER
    before = fleet.want(0.0, 1.0, 5).copy()
    after = fleet.want(1.0, 0.0, 7)
    left = before if how == "drift" else np.zeros_like(before)
    assert after[:, failed].tobytes() == left[:, failed].tobytes()
    assert (after[:, ~failed] != before[:, ~failed]).all()


# ---- in models


@pytest.mark.parametrize("model", builders.COMPILED_AS_ROBOTS)
def test_stopped_boids_stand_in_every_model(model: str) -> None:
    """And an interrupted flight goes on to the same bits."""
    about = builders.job(model, "as_written")
    dt = float(about.settings["dt"])
    settings = STOPS | {
        "failing_time": 4 * dt,
        "motor_lag": 2 * dt,
        "motor_noise": 1e-3,
    }
    a_job = builders.job(model, "as_written", metrics=(), n=10, steps=9, **settings)
    flight = Simulation(a_job)
    assert flight.advance(5)
    flight.take_frames()
    middle = flight.state().copied()
    failed = flight.flight.work.robots.failing.fails_at < NEVER
    assert failed.sum() == 3
    there = np.stack(flight.flock[:2])[:, failed]
    assert flight.advance(4)
    after = np.stack(flight.flock[:4])
    assert not after[2:, failed].any()
    assert after[2:, ~failed].any(axis=0).all()
    assert after[:2, failed].tobytes() == there.tobytes()
    again = Simulation(a_job)
    again.restore(middle)
    assert again.advance(4)
    assert np.stack(again.flock[:4]).tobytes() == after.tobytes()


def test_they_do_in_the_interpreter() -> None:
    """In all models: nothing is compiled there."""
    code = (
        "from kernels.models import MODELS\n"
        "from tests.kernels import test_motors as t\n"
        "for model in MODELS: t.test_stopped_boids_stand_in_every_model(model)"
    )
    interpreted(code)


def robotic() -> Job:
    """A small trial with all motors and breakdowns."""
    on = ALL_ON | STOPS | {"motor_noise": 0.05, "failing_time": 3.0}
    return builders.job(n=12, steps=9, metrics=("speed",), series=("speed",), **on)


def test_compiled_or_not_the_bits_are_the_same() -> None:
    alone = (
        "from tests import builders\n"
        "from tests.kernels.test_motors import robotic\n"
        "print(builders.bits(robotic()))"
    )
    assert builders.bits(robotic()) == interpreted(alone).strip()


def test_such_trials_fly_alone() -> None:
    assert all(len(group) == 1 for group in groups([robotic()] * AT_ONCE))


def test_a_model_that_does_not_drive_all_boids_is_noticed() -> None:
    a_job = builders.job(metrics=(), n=4, steps=3, motor_lag=5.0)
    simulation = Simulation(a_job)
    advance = simulation.flight.model.advance

    def forgetful(*given: Any) -> bool:
        going = advance(*given)
        simulation.flight.work.robots.driven[0] -= 1
        return bool(going)

    simulation.flight.model = simulation.flight.model._replace(advance=forgetful)
    with pytest.raises(RuntimeError, match="called drive 11 times in 3 steps of 4 boi"):
        simulation.advance(3)
