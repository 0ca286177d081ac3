"""What is counted on the way, against a recount from all frames of the flight."""

import numpy as np
import pytest

from kernels.events import count
from kernels.worlds import build_reach
from sweep.trial.simulation import Simulation, run
from tests import builders

EVENTS = ("boid_collisions", "share_arrived", "time_to_goal", "equilibrium")
DENSE = {
    "n": 40,
    "steps": 60,
    "width": 200,
    "height": 150,
    "map": "empty",
    "start_margin": 0,
}
DENSE |= {
    "contact_distance": 6,
    "flock_range": 25,
    "goal_x": 90,
    "goal_y": 70,
    "goal_radius": 12,
}
DENSE |= {"equilibrium_tolerance": 0.6, "equilibrium_steps": 4}


def recount(frames: np.ndarray, settings: dict[str, float]) -> dict[str, list[float]]:
    """The event metrics of frames (F, 6, N), the first of which is the start, pair by
    pair.
    """
    n, apart = (
        frames.shape[2],
        np.hypot(*(frames[:, :2, :, None] - frames[:, :2, None, :]).swapaxes(0, 1)),
    )
    np.einsum("fii->fi", apart)[...] = np.inf
    speed = np.hypot(frames[:, 2], frames[:, 3])
    change = np.hypot(
        *(frames[:, 2:4, :, None] - frames[:, 2:4, None, :]).swapaxes(0, 1)
    )
    alike = change < settings["equilibrium_tolerance"] * np.maximum(
        speed[:, :, None], speed[:, None, :]
    )
    company = apart < settings["flock_range"]
    in_step = company.any(axis=2) & (alike | ~company).all(axis=2)
    touching = (apart < settings["contact_distance"]).any(axis=2)
    there = (
        np.hypot(frames[:, 0] - settings["goal_x"], frames[:, 1] - settings["goal_y"])
        < settings["goal_radius"]
    )
    in_step[0] = False
    came, window = (
        np.maximum.accumulate(there, axis=0),
        int(settings["equilibrium_steps"]),
    )
    first = np.where(came[-1], came.argmax(axis=0), np.iinfo(int).max)
    rows: dict[str, list[float]] = {name: [] for name in EVENTS}
    for f in range(len(frames)):
        arrived = first <= f
        settled = (
            in_step[f - window + 1 : f + 1].all(axis=0)
            if f >= window
            else np.zeros(n, bool)
        )
        begun = touching[1 : f + 1] & ~touching[:f]
        rows["boid_collisions"].append(int(begun.sum()))
        rows["share_arrived"].append(100 * arrived.mean())
        rows["time_to_goal"].append(
            settings["dt"] * first[arrived].mean() if arrived.any() else np.nan
        )
        rows["equilibrium"].append(100 * settled.mean())
    return rows


@pytest.mark.parametrize("model", ["nguyen2024", "aziel_chen2025"])
def test_events_are_those_of_a_recount_from_all_frames(model: str) -> None:
    """To rounding of means: 1e-12. The flight is such that all four happen, or the test
    would show nothing.
    """
    a_job = builders.job(
        model, series=EVENTS, metrics=("speed", *EVENTS), dt=0.7, **DENSE
    )
    series = run(a_job).series
    slow = recount(
        builders.trajectory(builders.to_end(Simulation(a_job))), a_job.settings
    )
    for name in EVENTS:
        np.testing.assert_allclose(series[name], slow[name], rtol=1e-12, err_msg=name)
        assert np.nanmax(series[name]) > 0


def watched(
    flocks: list[tuple[list[float], list[float]]], **changes: float
) -> list[int]:
    """The events after steps in which the boids are at the given x with the given vx,
    all on one line.
    """
    world = builders.a_world(100.0, 100.0)
    simulation = Simulation(
        builders.job(
            "nguyen2024", n=len(flocks[0][0]), steps=1, metrics=("boid_collisions",)
        )
    )
    seen = builders.OBSERVATION._replace(equilibrium_steps=2, **changes)
    watch = simulation.flight.record.watch._replace(
        observation=seen, contact=build_reach(world, 0.0)
    )
    for step, (x, vx) in enumerate(flocks):
        count(builders.a_flock(x, [50.0] * len(x), vx), world, watch, step + 1)
    return watch.events.tolist()


def test_a_contact_counts_once_for_each_boid_until_it_ends() -> None:
    apart, close = ([10.0, 40.0, 44.9], [0.0] * 3), ([38.0, 40.0, 90.0], [0.0] * 3)
    assert watched([close])[2] == 2
    assert watched([close, close])[2] == 2
    assert watched([close, apart])[2] == 3, (
        "boid 1 went from one contact to another without a step alone"
    )
    assert watched([close, ([0.0, 40.0, 90.0], [0.0] * 3), close])[2] == 4


def test_a_contact_may_be_farther_than_company() -> None:
    far = {"contact_distance": 20.0, "flock_range": 5.0}
    assert watched([([10.0, 25.0, 60.0], [0.0] * 3)], **far)[2] == 2
    assert watched([([10.0, 30.0, 60.0], [0.0] * 3)], **far)[2] == 0


def test_a_lone_boid_is_in_no_equilibrium_and_a_pair_in_step_is() -> None:
    alone, pair = ([10.0, 90.0], [1.0, 1.0]), ([10.0, 30.0], [1.0, 1.05])
    assert watched([alone, alone])[5] == 0
    assert watched([pair])[5] == 0
    assert watched([pair, pair])[5] == 2
    assert watched([pair, pair, ([10.0, 30.0], [1.0, 1.5])])[5] == 0


def test_what_boids_start_in_has_not_begun() -> None:
    """Two in contact, one outside, one in the obstacle, one at the goal: only the
    arrival counts, at time 0.
    """
    names = (
        "escapes",
        "collisions",
        "boid_collisions",
        "share_arrived",
        "time_to_goal",
    )
    settings = {
        "n": 5,
        "steps": 3,
        "goal_x": 700,
        "goal_y": 500,
        "map": "cafeteria",
        "width": 800,
        "height": 600,
    }
    still = builders.weightless("nguyen2024") | {
        "start_velocities": "components",
        "start_speed": 0,
    }
    simulation = Simulation(
        builders.job("nguyen2024", metrics=names, **settings, **still)
    )
    builders.place(
        simulation,
        [10.0, 12.0, -5.0, 200.0, 700.0],
        [10.0, 10.0, 300.0, 200.0, 500.0],
        0.0,
        0.0,
    )
    values = builders.to_end(simulation).take_frames().values
    assert values[:, -1].tolist() == [0.0, 0.0, 0.0, 20.0, 0.0]
