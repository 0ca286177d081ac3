"""What is counted on the way, against a recount from all frames of the flight."""

from dataclasses import replace

import numpy as np
import pytest

from kernels.events import FISSIONS, FUSIONS, count, keep_flocks, regroup
from kernels.worlds import build_reach
from sweep.trial.simulation import Simulation, run
from tests import builders
from tests.naive.metrics import distances
from tests.naive.metrics import flocks as naive_flocks

EVENTS = (
    *("boid_collisions", "share_arrived", "time_to_goal", "equilibrium"),
    *("pair_collisions", "collision_rate", "fissions", "fusions"),
    *("path_length", "control_effort", "mechanical_work"),
)
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


def recount_of_pairs(
    frames: np.ndarray, settings: dict[str, float], every: int
) -> dict[str, list[float]]:
    """Pairs that came into contact by sets of pairs, and flocks from one to the next of
    `every` frames by sets of members. No obstacles.
    """
    rows: dict[str, list[float]] = {
        name: [] for name in ("pair_collisions", "collision_rate", *FLOCKS)
    }
    n, pairs, fissions, fusions = frames.shape[2], 0, 0, 0
    touching = close_pairs(frames[0], settings["contact_distance"])
    flocks = sets(frames[0], settings["flock_range"])
    for f, bodies in enumerate(frames):
        before, touching = (
            touching,
            close_pairs(bodies, settings["contact_distance"]),
        )
        pairs += len(touching - before)
        rows["pair_collisions"].append(pairs)
        rows["collision_rate"].append(pairs / n / (f * settings["dt"]) if f else np.nan)
        if f % every == 0:
            old, flocks = flocks, sets(bodies, settings["flock_range"])
            fissions += sum(sum(bool(a & b) for b in flocks) - 1 for a in old)
            fusions += sum(sum(bool(a & b) for a in old) - 1 for b in flocks)
            rows["fissions"].append(fissions)
            rows["fusions"].append(fusions)
    return rows


FLOCKS = "fissions", "fusions"


def close_pairs(bodies: np.ndarray, reach: float) -> set[tuple[int, int]]:
    near = np.triu(distances(bodies) < reach, 1)
    return set(zip(*(found.tolist() for found in np.nonzero(near)), strict=True))


def sets(bodies: np.ndarray, reach: float) -> list[set[int]]:
    return [set(members) for members in naive_flocks(bodies, reach)]


def recount_of_motion(
    frames: np.ndarray, settings: dict[str, float]
) -> dict[str, list[float]]:
    """By complex velocities, step after step; the first frame is the start."""
    dt, velocity = settings["dt"], frames[:, 2] + 1j * frames[:, 3]
    change = np.diff(velocity, axis=0) / dt
    gain = np.diff(np.abs(velocity) ** 2, axis=0) / 2
    steps = {
        "path_length": np.abs(velocity[1:]) * dt,
        "control_effort": np.abs(change) ** 2 * dt,
        "mechanical_work": np.where(gain > 0, gain, 0.0),
    }
    return {name: [0.0, *np.cumsum(each.mean(axis=1))] for name, each in steps.items()}


@pytest.mark.parametrize("model", ["nguyen2024", "aziel_chen2025"])
def test_events_are_those_of_a_recount_from_all_frames(model: str) -> None:
    """To rounding of means and sums: 1e-12, and as much of the largest value where a
    speed that stays is gained and lost by its last bits. The flight is such that all
    happen, or the test would show nothing.
    """
    a_job = builders.job(
        model, series=EVENTS, metrics=("speed", *EVENTS), dt=0.7, **DENSE
    )
    series, settings = run(a_job).series, a_job.settings
    frames = builders.trajectory(builders.to_end(Simulation(a_job)))
    slow = (
        recount(frames, settings)
        | recount_of_pairs(frames, settings, 1)
        | recount_of_motion(frames, settings)
    )
    assert slow.keys() == set(EVENTS)
    for name in EVENTS:
        most = np.nanmax(series[name])
        assert most > 0
        np.testing.assert_allclose(
            series[name], slow[name], rtol=1e-12, atol=1e-12 * most, err_msg=name
        )


def test_flocks_are_compared_from_recorded_frame_to_frame() -> None:
    """The last frame is recorded too, where it is not on time. Between recorded frames
    flocks part and join that nobody sees. The number of flocks follows from the counts.
    """
    names = ("flock_count", *FLOCKS)
    every_step = builders.job(
        "nguyen2024", series=names, dt=0.7, **DENSE | {"steps": 58}
    )
    seldom = replace(every_step, record=replace(every_step.record, every=8))
    frames = builders.trajectory(builders.to_end(Simulation(every_step)))
    on_time = [*range(0, 58, 8), 58]
    slow = recount_of_pairs(frames[on_time], every_step.settings, 1)
    series = run(seldom).series
    for name in FLOCKS:
        assert series[name].tolist() == slow[name]
        assert 0 < series[name][-1] < run(every_step).series[name][-1]
    changed = series["fissions"] - series["fusions"]
    np.testing.assert_array_equal(
        series["flock_count"][0] + changed, series["flock_count"]
    )


def test_a_longer_trial_has_no_frame_where_a_shorter_one_ended() -> None:
    """What flocks have become at the last frame, which is not on time, is in no later
    frame of a trial that goes on.
    """
    settings, ends, kept = {"dt": 0.7, **DENSE}, [], []
    recorded = {"metrics": FLOCKS, "series": FLOCKS, "every": 8}
    long = builders.job("nguyen2024", **recorded, **settings | {"steps": 63})
    for steps in range(56, 64):
        job = replace(long, settings={**long.settings, "steps": steps})
        flown = builders.to_end(Simulation(job))
        ends.append(flown.take_frames().values[:, -1].tolist())
        kept.append(flown.flight.record.watch.events[[FISSIONS, FUSIONS]].tolist())
    assert kept == [ends[0]] * 8
    assert ends[0] not in ends[4:], "nothing happened after the last frame on time"


def test_a_turn_at_constant_speed_has_the_effort_of_its_centripetal_acceleration() -> (
    None
):
    """v^2 w^2 T, less by the factor (sin(h) / h)^2 with h = w dt / 2: the chord of the
    turn of a step instead of its arc. To 1e-12, the rounding of 200 sums. A turn needs
    no work, and what stands has neither.
    """
    speed, rate, dt, steps = 3.0, 0.4, 0.25, 200
    at = rate * dt * np.arange(steps + 1)
    vx, vy = speed * np.cos(at), speed * np.sin(at)
    standing = np.zeros(2)
    sums = np.zeros(3)
    for k in range(1, steps + 1):
        sums += integrals(
            np.append(vx[k], standing),
            np.append(vy[k], standing),
            np.append(vx[k - 1], standing),
            np.append(vy[k - 1], standing),
        )
    half = rate * dt / 2
    exact = speed**2 * rate**2 * steps * dt
    assert sums[1] / dt == pytest.approx(exact * (np.sin(half) / half) ** 2, rel=1e-12)
    assert sums[1] / dt == pytest.approx(exact, rel=half**2 / 3)
    assert sums[0] * dt == pytest.approx(speed * steps * dt, rel=1e-12)
    assert sums[2] == pytest.approx(0.0, abs=1e-12 * speed**2 * steps)


def test_work_is_what_is_gained_and_slowing_down_gives_none_back() -> None:
    """From 1 to 3 and back to 0, on a line: (9 - 1) / 2. Both changes cost effort."""
    there = integrals([3.0], [0.0], [1.0], [0.0])
    back = integrals([0.0], [0.0], [3.0], [0.0])
    assert (there + back).tolist() == [3.0, 4.0 + 9.0, 4.0]


def integrals(vx: object, vy: object, before_x: object, before_y: object) -> np.ndarray:
    """What a step adds to the integrals that ends with these velocities."""
    x = np.zeros(len(np.atleast_1d(vx)))
    flock = builders.a_flock(x, x, vx, vy)
    flock.previous_vx[:], flock.previous_vy[:] = before_x, before_y
    record = builders.job("nguyen2024", n=x.size, steps=1, metrics=("control_effort",))
    watch = Simulation(record).flight.record.watch
    count(flock, builders.a_world(100.0, 100.0), watch, 1)
    return watch.integrals.copy()


def test_what_no_metric_asks_for_is_not_summed_up() -> None:
    flown = builders.to_end(
        Simulation(builders.job("nguyen2024", metrics=("escapes",), dt=0.7, **DENSE))
    )
    watch = flown.flight.record.watch
    assert not watch.integrals.any()
    assert not watch.events[[2, 5, 7, 8, 9]].any()
    assert not watch.before_x.any()


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


def test_a_contact_of_two_counts_once_for_the_pair() -> None:
    """Boid 1 goes from one contact to another: two pairs. Three that come together are
    three pairs, however close they were to others.
    """
    apart, close = ([10.0, 40.0, 44.9], [0.0] * 3), ([38.0, 40.0, 90.0], [0.0] * 3)
    together = ([40.0, 41.0, 42.0], [0.0] * 3)
    assert watched([close])[7] == 1
    assert watched([close, close])[7] == 1
    assert watched([close, apart])[7] == 2
    assert watched([close, apart, close])[7] == 3
    assert watched([together])[7] == 3
    assert watched([close, together])[7] == 3


def test_flocks_part_and_join_as_often_as_their_number_changes() -> None:
    """Of six boids: three flocks of two become one of three, one of two and one alone,
    which have parts of one, two and one of the old ones.
    """
    pairs = [0.0, 1.0, 200.0, 201.0, 400.0, 401.0]
    mixed = [0.0, 1.0, 2.0, 201.0, 400.0, 202.0]
    simulation = Simulation(builders.job("nguyen2024", n=6, steps=1, metrics=FLOCKS))
    watch = simulation.flight.record.watch

    def after(*places: list[float]) -> tuple[int, int]:
        for x in places:
            found = regroup(builders.a_flock(x, [50.0] * 6), watch)
            keep_flocks(watch, *found)
        return found

    after([0.0] * 6)
    assert after(pairs) == (2, 0)
    assert after(mixed) == (2, 2)
    assert after(pairs) == (2, 2)
    assert after([0.0] * 6) == (0, 2)
    assert after([float(k) for k in range(6)]) == (0, 0)
    assert after([1000.0 * k for k in range(6)]) == (5, 0)


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
