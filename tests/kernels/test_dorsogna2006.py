"""dorsogna2006: what is known of it without computing."""

import math
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

from sweep.trial.simulation import Simulation, run
from tests import builders

SPEED = math.sqrt(1.6 / 0.5)
"""sqrt(alpha / beta) of the presets."""


def job(preset: str = "as_written", **changes: Any) -> builders.Job:
    return builders.job("dorsogna2006", preset, metrics=(), **changes)


def flown(start: np.ndarray, **changes: Any) -> np.ndarray:
    """The state (4, N) at the end of a flight from a given one."""
    simulation = Simulation(job(n=start.shape[1], every=1000, **changes))
    return builders.state(builders.to_end(builders.place(simulation, *start)).flock)


def pulls(n: int, radius: float) -> float:
    """The force towards the centre on each of `n` boids on a ring, by Eq. (3) with the
    constants of preset as_written.
    """
    sines = np.sin(math.pi * np.arange(1, n) / n)
    r = 2 * radius * sines
    slope = np.exp(-r) - np.exp(-r / 0.5)
    return float((slope * sines).sum())


def balance(n: int, radius: float) -> float:
    """By how much this force is more than what holds a boid on the ring."""
    return pulls(n, radius) - SPEED**2 / radius


def roots(n: int) -> list[float]:
    """The radii of the rings on which `n` boids can circle, in ascending order."""
    radii = np.linspace(0.02, 20, 20_000)
    above = np.array([balance(n, radius) > 0 for radius in radii])
    return [
        float(brentq(lambda radius: balance(n, radius), radii[k], radii[k + 1]))
        for k in np.flatnonzero(above[1:] != above[:-1])
    ]


RINGS = {20: [], 40: [0.5434047438, 1.772076586], 60: [0.3584112772, 2.626223294]}
"""As an independent program finds them."""


def ring(n: int, radius: float, dt: float, senses: Any = 1) -> np.ndarray:
    """`n` boids on a ring, each with its velocity of half a step before: along the
    chord by which it came to its place. In `senses` 1 is counter-clockwise.
    """
    angle = 2 * math.pi * np.arange(n) / n
    half = math.asin(SPEED * dt / (2 * radius))
    course = angle + senses * (math.pi / 2 - half)
    places = radius * np.array([np.cos(angle), np.sin(angle)]) + 10
    return np.array([*places, SPEED * np.cos(course), SPEED * np.sin(course)])


def radii(state: np.ndarray) -> np.ndarray:
    """Distances from the centre of mass."""
    return np.hypot(*(state[:2] - state[:2].mean(axis=1, keepdims=True)))


@pytest.mark.parametrize("n", RINGS)
def test_rings_are_where_force_and_circling_balance(n: int) -> None:
    assert roots(n) == pytest.approx(RINGS[n], rel=1e-9)


@pytest.mark.parametrize("dt", [0.01, 0.05])
@pytest.mark.parametrize("n", [40, 60])
def test_a_ring_keeps_its_radius_with_any_step(n: int, dt: float) -> None:
    """Both roots, for a time in which rounding does not grow. The chord of a step is
    v dt, and the force turns it: so the radius of the ring is exactly the root, to the
    11 digits to which that is found.
    """
    for radius in roots(n):
        end = flown(ring(n, radius, dt), dt=dt, steps=20)
        assert radii(end) == pytest.approx(radius, rel=1e-8)
        assert np.hypot(*end[2:]) == pytest.approx(SPEED, rel=1e-8)


def moved(state: np.ndarray, share: float, seed: int) -> np.ndarray:
    """A state whose coordinates are moved by Gaussians of a share of the radius."""
    rng = np.random.default_rng(seed)
    noise = rng.normal(0, share * radii(state).mean(), (2, state.shape[1]))
    return np.array([*(state[:2] + noise), *state[2:]])


def test_the_small_ring_is_stable_and_the_large_one_is_not() -> None:
    """A ring that is moved by 1 % comes back to the small root to 0.1 %, with one sense
    of rotation or both, and leaves the large one by more than a tenth. Independent
    programs found that with all seeds that they tried.
    """
    small, large = roots(60)
    both = np.where(np.arange(60) % 2 == 0, 1, -1)
    for senses in (1, both):
        start = moved(ring(60, small, 0.02, senses), 0.01, 1)
        end = radii(flown(start, dt=0.02, steps=5000))
        assert end.mean() == pytest.approx(small, rel=1e-3)
    start = moved(ring(60, large, 0.02), 0.01, 1)
    end = radii(flown(start, dt=0.02, steps=5000))
    assert abs(end.mean() / large - 1) > 0.1


def test_from_a_random_box_boids_come_to_the_small_ring() -> None:
    """An independent program, fourth order Runge-Kutta, gives 0.54343 with both senses
    at once, 2e-5 from one seed to the next.
    """
    names = ("flock_radius", "speed", "dispersion")
    a_job = job(dt=0.02, steps=15_000, seed=3, series=names, every=1000)
    last = {name: float(values[-1]) for name, values in run(a_job).series.items()}
    assert last["flock_radius"] == pytest.approx(0.54343, rel=2e-4)
    assert last["speed"] == pytest.approx(SPEED, rel=1e-4)
    assert last["dispersion"] < 2e-3


def test_twenty_boids_fly_apart() -> None:
    a_job = job(n=20, dt=0.02, steps=5000, series=("flock_radius",), every=1000)
    assert run(a_job).series["flock_radius"][-1] > 20


@pytest.mark.parametrize("dt", [0.01, 0.5])
@pytest.mark.parametrize("start", [0.01, 0.5, SPEED, 4.0])
def test_a_free_boid_comes_to_its_speed_as_the_equation_says(
    start: float, dt: float
) -> None:
    """e' = 2 e (alpha - beta e) for e = |v|^2 is a logistic equation, and the step
    solves it: so its time makes no difference but for rounding.
    """
    steps = round(2 / dt)
    end = flown(
        np.array([[1.0], [1], [0.6 * start], [0.8 * start]]), dt=dt, steps=steps
    )
    most = SPEED**2
    square = most / (1 + (most / start**2 - 1) * math.exp(-2 * 1.6 * 2))
    assert np.hypot(*end[2:])[0] == pytest.approx(math.sqrt(square), rel=1e-12)
    assert end[3] / end[2] == pytest.approx([4 / 3], rel=1e-12)


def test_without_propulsion_friction_alone_brakes() -> None:
    """m v' = -beta |v|^2 v has 1 / |v|^2 grow by 2 beta t / m."""
    start = np.array([[1.0], [1], [2.0], [0.0]])
    end = flown(start, propulsion=0, mass=2, friction=0.8, dt=0.1, steps=30)
    assert end[2, 0] ** -2 == pytest.approx(0.25 + 2 * 0.8 / 2 * 3, rel=1e-12)


def potential(r: float, s: dict[str, float]) -> float:
    return s["repulsion_strength"] * math.exp(-r / s["repulsion_length"]) - s[
        "attraction_strength"
    ] * math.exp(-r / s["attraction_length"])


CONSTANTS = {
    "repulsion_strength": 0.9,
    "repulsion_length": 0.4,
    "attraction_strength": 0.7,
    "attraction_length": 1.5,
}
FREE = {"propulsion": 0.0, "friction": 0.0, "mass": 2.0} | CONSTANTS


@pytest.mark.parametrize("distance", [0.1, 0.4, 1.0, 3.0])
def test_two_boids_are_pushed_down_the_slope_of_the_potential(distance: float) -> None:
    """From rest, by a central difference of U: repelled when near, attracted when far,
    and equally.
    """
    dt = 1e-3
    start = np.array([[1.0, 1 + distance], [1.0, 1.0], [0.0, 0.0], [0.0, 0.0]])
    end = flown(start, **FREE, dt=dt, steps=1)
    h = 1e-5
    slope = (
        potential(distance + h, CONSTANTS) - potential(distance - h, CONSTANTS)
    ) / (2 * h)
    assert end[2] == pytest.approx([slope / 2 * dt, -slope / 2 * dt], rel=1e-7)
    assert (end[3] == 0).all()
    assert (slope < 0) == (distance < 0.5)


def test_boids_at_one_place_do_not_push_each_other() -> None:
    start = np.array([[1.0, 1.0], [2.0, 2.0], [0.1, -0.2], [0.3, 0.0]])
    end = flown(start, **FREE, steps=1)
    assert (end[2:] == start[2:]).all()


def free_flight(dt: float, time: float = 2.0) -> tuple[np.ndarray, np.ndarray]:
    """Boids without propulsion and friction for a time: start and end."""
    rng = np.random.default_rng(2)
    start = np.array([*rng.uniform(9, 11, (2, 12)), *rng.uniform(-0.3, 0.3, (2, 12))])
    return start, flown(start, **FREE, dt=dt, steps=round(time / dt))


def energy(state: np.ndarray, dt: float) -> float:
    """Kinetic and potential energy, with places of the middle of the step before."""
    x, y = state[:2] - 0.5 * dt * state[2:]
    pairs = (
        potential(math.hypot(x[i] - x[j], y[i] - y[j]), CONSTANTS)
        for i in range(x.size)
        for j in range(i)
    )
    return float((state[2:] ** 2).sum()) + sum(pairs)


def test_momentum_is_kept_to_rounding_and_energy_to_the_second_order() -> None:
    """Actions equal reactions. A step of half the length has a quarter of the error."""
    losses = []
    for dt in (0.04, 0.02, 0.01):
        start, end = free_flight(dt)
        assert end[2:].sum(axis=1) == pytest.approx(start[2:].sum(axis=1), abs=1e-13)
        losses.append(abs(energy(end, dt) - energy(start, dt)))
    assert losses[0] < 1e-2 * abs(energy(start, 0.01))
    assert 3 < losses[0] / losses[1] < 5.5
    assert 3 < losses[1] / losses[2] < 5.5


def test_nobody_beyond_the_range_acts() -> None:
    start = np.array([[1.0, 2.0], [1.0, 1.0], [0.0, 0.0], [0.0, 0.0]])
    for reach, moves in ((1.0, True), (1.0 - 1e-9, False)):
        end = flown(start, **FREE, interaction_range=reach, steps=1)
        assert (end[2, 0] > 0) == moves
