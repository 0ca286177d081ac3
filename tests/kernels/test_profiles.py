"""Profiles against twins, closed forms and freud."""

import math
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import freud
import numpy as np
import pytest
from numpy.typing import NDArray

from kernels.profiles import PROFILES, Passage
from tests.naive import profiles as naive
from tests.naive.profiles import Way

Floats = NDArray[np.float64]
ROUNDING = 1e-9
"""Sums of up to 10^5 terms of order 1 in another order, and sines of angles to 100."""
EDGES = np.linspace(0.0, 4.0, 9)
WAVES = np.linspace(0.5, 6.0, 8)
LAGS = np.array([1.0, 2.0, 5.0, 9.0])
AXES = {
    "distance": EDGES,
    "wave number": WAVES,
    "lag": LAGS,
    "box side": np.array([7.0, 3.0, 2.0]),
    "individual": np.arange(5.0),
}
SQUARE = 10.0


def measured(name: str, way: Way, axis: Floats) -> Floats:
    profile = PROFILES[name]
    bodies = way.bodies
    size = len(axis) - (profile.axis in ("distance", "wave number"))
    values = np.full(bodies.shape[2] if profile.axis == "individual" else size, 7.0)
    x, y, vx, vy = np.ascontiguousarray(bodies.transpose(1, 0, 2))
    passage = Passage(x, y, vx, vy, way.width, way.height, way.periodic)
    profile.measure(passage, axis, values)
    return values


def wandering(
    seed: int,
    *,
    absent: float = 0.0,
    periodic: bool = True,
    shape: tuple[int, int] = (12, 20),
) -> Way:
    """Boids that walk at random, some of them at rest or without a position."""
    random = np.random.default_rng(seed)
    frames, n = shape
    velocity = random.normal(0.0, 0.4, (frames, 2, n))
    velocity[random.random((frames, 1, n)).repeat(2, axis=1) < 0.05] = 0.0
    sides = np.array([SQUARE, 0.7 * SQUARE])
    start = random.random((2, n)) * sides[:, None]
    position = start + velocity.cumsum(axis=0)
    if periodic:
        position %= sides[:, None]
    bodies = np.concatenate([position, velocity], axis=1)
    bodies[(random.random((frames, 1, n)) < absent).repeat(4, axis=1)] = np.nan
    return Way(bodies, *sides.tolist(), periodic)


@pytest.mark.parametrize("absent", [0.0, 0.2])
@pytest.mark.parametrize("periodic", [False, True])
@pytest.mark.parametrize("name", list(PROFILES))
def test_a_profile_equals_its_twin(name: str, periodic: bool, absent: float) -> None:
    axis = AXES[PROFILES[name].axis]
    twin: Callable[..., Floats] = getattr(naive, name)
    for seed in range(3):
        way = wandering(seed, absent=absent, periodic=periodic)
        np.testing.assert_allclose(
            measured(name, way, axis),
            twin(way, axis),
            rtol=ROUNDING,
            atol=ROUNDING,
            err_msg=f"seed {seed}",
        )


@pytest.mark.parametrize("name", list(PROFILES))
def test_nobody_gives_no_value(name: str) -> None:
    way = wandering(1)
    nobody = way._replace(bodies=np.full_like(way.bodies, np.nan))
    values = measured(name, nobody, AXES[PROFILES[name].axis])
    assert np.isnan(values).all()


def independent(frames: int, n: int, seed: int = 3) -> Way:
    """Boids anywhere in a square, at any time."""
    random = np.random.default_rng(seed)
    bodies = random.random((frames, 4, n)) * SQUARE
    return Way(bodies, SQUARE, SQUARE, periodic=True)


def test_independent_boids_have_no_structure() -> None:
    """An ideal gas: g = 1, S = 1, and binomial numbers in boxes.

    Each of 24 values is within 4 standard errors of its expectation; a false alarm has
    a probability of 24 * 6.3e-5 = 0.0015, and the seed is fixed.
    """
    frames, n = 400, 50
    way = independent(frames, n)
    pairs = frames * n * (n - 1) / 2
    shares = math.pi * np.diff(EDGES**2) / SQUARE**2
    error = 1.0 / np.sqrt(pairs * shares)
    assert (np.abs(measured("pair_distribution", way, EDGES) - 1.0) < 4 * error).all()
    # |sum|^2 / N of one wave is exponential with mean 1.
    numbers = [len(_waves(low, high)) for low, high in pairwise(WAVES)]
    error = 1.0 / np.sqrt(frames * np.array(numbers))
    assert (np.abs(measured("structure_factor", way, WAVES) - 1.0) < 4 * error).all()
    across = np.array([8.0, 5.0, 3.0, 2.0])
    share = 1.0 / across**2
    expected = np.sqrt(n * share * (1.0 - share))
    values = measured("number_fluctuations", way, across)
    # The variance of a variance over independent frames is at most 2 / frames.
    assert (np.abs(values / expected - 1.0) < 4 * math.sqrt(0.5 / frames)).all()


def _waves(low: float, high: float) -> list[tuple[int, int]]:
    unit = 2.0 * math.pi / SQUARE
    return [
        (a, b)
        for a in range(-12, 13)
        for b in range(13)
        if (b > 0 or a > 0) and low <= unit * math.hypot(a, b) < high
    ]


def test_a_lattice_scatters_at_its_own_wave_number() -> None:
    side = 5
    x, y = (axis.ravel() * (SQUARE / side) for axis in np.mgrid[:side, :side])
    bodies = np.array([[x, y, 0 * x, 0 * x]])
    way = Way(bodies, SQUARE, SQUARE, periodic=True)
    unit = 2.0 * math.pi / SQUARE
    peak = measured("structure_factor", way, np.array([side - 0.4, side + 0.05]) * unit)
    waves = _waves((side - 0.4) * unit, (side + 0.05) * unit)
    at_peak = sum(a % side == 0 and b % side == 0 for a, b in waves)
    assert peak[0] == pytest.approx(side**2 * at_peak / len(waves), rel=1e-9)
    below = measured("structure_factor", way, np.array([0.5, side - 0.1]) * unit)
    assert below[0] < 1e-20


def straight(n: int = 8, frames: int = 30, speed: float = 0.7) -> Way:
    """Boids that move straight on across periodic borders, in their own directions."""
    random = np.random.default_rng(5)
    angle = random.random(n) * 2 * math.pi
    velocity = speed * np.array([np.cos(angle), np.sin(angle)])
    start = random.random((2, n)) * SQUARE
    position = start + np.arange(frames)[:, None, None] * velocity
    moving = np.broadcast_to(velocity, position.shape)
    bodies = np.concatenate([position % SQUARE, moving], axis=1)
    return Way(bodies, SQUARE, SQUARE, periodic=True)


def test_a_straight_way_covers_the_square_of_time() -> None:
    values = measured("mean_squared_displacement", straight(), LAGS)
    np.testing.assert_allclose(values, (0.7 * LAGS) ** 2, rtol=1e-12)


def test_a_random_walk_covers_time() -> None:
    """A variance of 2 s^2 per step, to 4 standard errors of 5,000 walks."""
    random = np.random.default_rng(7)
    steps = random.normal(0.0, 0.1, (20, 2, 5000))
    bodies = np.concatenate([steps.cumsum(axis=0), steps], axis=1)
    way = Way(bodies, SQUARE, SQUARE, periodic=False)
    values = measured("mean_squared_displacement", way, LAGS)
    assert (np.abs(values / (0.02 * LAGS) - 1.0) < 4 / math.sqrt(5000)).all()


def test_neighbours_of_a_frozen_flock_stay_and_of_a_shuffled_one_go() -> None:
    """A share of 6 / (N - 1) remains by chance, to 4 standard errors."""
    way = independent(60, 31)
    still = way._replace(bodies=way.bodies[:1].repeat(20, axis=0))
    assert (measured("neighbour_overlap", still, LAGS) == 1.0).all()
    chance = measured("neighbour_overlap", way, LAGS)
    error = math.sqrt(0.2 * 0.8 / (51 * 31))
    assert (np.abs(chance - 0.2) < 4 * error).all()


def test_a_boid_that_turns_first_leads() -> None:
    """Boid k turns 2 k frames after boid 0 on the same winding way."""
    random = np.random.default_rng(11)
    angle = random.normal(0.0, 0.5, 80).cumsum()
    delays = [0, 2, 4]
    headings = np.array([angle[10 - delay : 70 - delay] for delay in delays]).T
    velocity = np.stack([np.cos(headings), np.sin(headings)], axis=1)
    bodies = np.concatenate([velocity.cumsum(axis=0), velocity], axis=1)
    way = Way(bodies, 100.0, 100.0, periodic=False)
    values = measured("directional_delay", way, np.arange(9.0))
    np.testing.assert_array_equal(values, [3.0, 0.0, -3.0])


def test_correlation_of_two_halves_changes_its_sign() -> None:
    """Neighbours agree, and boids of the other half are opposite."""
    x = np.concatenate([np.arange(10.0), np.arange(20.0, 30.0)])
    vx = np.where(x < 15.0, 1.0, -1.0)
    way = Way(np.array([[x, 0 * x, vx, 0 * x]]), 30.0, 30.0, periodic=False)
    edges = np.array([0.0, 10.0, 30.0])
    values = measured("velocity_correlation_function", way, edges)
    np.testing.assert_array_equal(values, [1.0, -1.0])


def test_equal_velocities_have_no_correlation() -> None:
    """The rounding of the mean is no deviation that boids share."""
    way = wandering(3, shape=(4, 30))
    way.bodies[:, 2] = 0.1
    way.bodies[:, 3] = 0.3
    assert np.isnan(measured("velocity_correlation_function", way, EDGES)).all()


SINGLE = 2e-6
"""freud computes in single precision: relative errors of some 1e-7 per term."""


def _freud(way: Way) -> tuple[Any, list[Any]]:
    box = freud.box.Box(way.width, way.height, is2D=True)
    middle = np.array([way.width, way.height, 0.0])[:, None] / 2
    points = [
        (np.concatenate([frame[:2], frame[:1] * 0]) - middle).T for frame in way.bodies
    ]
    return box, points


def test_pair_distribution_equals_that_of_freud() -> None:
    way = wandering(2, shape=(5, 60))
    edges = np.linspace(0.0, 3.0, 11)
    box, points = _freud(way)
    rdf = freud.density.RDF(bins=10, r_max=3.0, normalization_mode="finite_size")
    for frame in points:
        rdf.compute((box, frame), reset=False)
    values = measured("pair_distribution", way, edges)
    np.testing.assert_allclose(values, rdf.rdf, rtol=SINGLE * 10)


def test_correlation_equals_that_of_freud() -> None:
    """freud correlates complex numbers; boids are correlated with themselves, too."""
    way = wandering(4, shape=(1, 60))
    edges = np.linspace(0.0, 3.0, 11)
    box, points = _freud(way)
    velocity = way.bodies[0, 2] + 1j * way.bodies[0, 3]
    deviation = velocity - velocity.mean()
    deviation /= np.sqrt((np.abs(deviation) ** 2).mean())
    correlation = freud.density.CorrelationFunction(bins=10, r_max=3.0)
    others = {"r_max": 3.0, "exclude_ii": True}
    correlation.compute((box, points[0]), deviation, neighbors=others)
    values = measured("velocity_correlation_function", way, edges)
    np.testing.assert_allclose(
        values, correlation.correlation.real, rtol=0.0, atol=SINGLE * 10
    )


def test_displacement_equals_that_of_freud() -> None:
    way = wandering(6, shape=(30, 20), periodic=False)
    box, points = _freud(way)
    displacement = freud.msd.MSD(box, mode="window")
    displacement.compute(np.array(points))
    values = measured("mean_squared_displacement", way, LAGS)
    expected = displacement.msd[LAGS.astype(int)]
    np.testing.assert_allclose(values, expected, rtol=SINGLE * 100)
