"""The model that a new one begins as, and the metric: by laws of their motion."""

import math

import pytest
from scipy.optimize import brentq

from tests.examples.flown import flown, job


@pytest.mark.parametrize("swirl", [0.001, 0.01, 0.03])
def test_boids_circle_at_the_angle_and_radius_of_their_law(swirl: float) -> None:
    """With the weights c and s of cohesion and swirl, times N / (N - 1), boids at the
    speed limit turn by an angle a each step, with 4 sin(a/2)^2 = c - s tan(a/2). Their
    circle has the chord max_speed.
    """
    n, speed = 50, 3.0
    c, s = 0.01 * n / (n - 1), swirl * n / (n - 1)
    half = brentq(lambda a: 4 * math.sin(a) ** 2 - c + s * math.tan(a), 0, 1)
    start = {"start_radius": 60, "start_center_x": 200, "start_center_y": 200}
    metrics = ["speed", "flock_radius", "./rotation.py", "polarization"]
    last = flown(
        job("vortex", "standard", metrics, swirl_weight=swirl, steps=3000, **start)
    ).last
    assert last["speed"] == pytest.approx(speed, rel=1e-9)
    radius = speed / (2 * math.sin(half))
    assert last["flock_radius"] == pytest.approx(radius, rel=1e-9)
    # A velocity is the way that led to a place: a chord, half of `a` off the tangent.
    assert last["rotation"] == pytest.approx(math.cos(half), rel=1e-9)
    assert last["polarization"] == pytest.approx(0, abs=1e-9)
