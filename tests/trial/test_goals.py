"""Trials whose boids go to several goals in turn."""

from hashlib import sha256
from typing import Any

import numpy as np
import pytest

from kernels.inspection import velocities_after
from kernels.models import MODELS
from sweep.design.jobs import Job
from sweep.spec.settings import places_of
from sweep.trial.lanes import AT_ONCE, groups
from sweep.trial.robots import flies_alone
from sweep.trial.simulation import Simulation, run
from sweep.trial.state import different
from sweep.trial.world import world_of
from tests import builders, naive
from tests.cases import slow_but
from tests.interpreter import interpreted

COURSES: dict[str, dict[str, Any]] = {
    "aziel_chen2025": {
        "map": "empty",
        "width": 200,
        "height": 150,
        "goal_x": 40,
        "goal_y": 40,
        "next_goals": "160 40; 160 110; 40 110",
        "goal_radius": 25,
        "goal_weight": 0.05,
        "borders": "bounded",
    },
    "rustamani2024": {
        "map": "empty",
        "width": 10,
        "height": 10,
        "goal_x": 3,
        "goal_y": 3,
        "next_goals": "7 3; 7 7; 3 7",
        "goal_radius": 1.5,
        "max_speed": 2.0,
        "leader_share": 0.75,
    },
}
GOING = [(model, repeat) for model in COURSES for repeat in (False, True)]
COMPILED = slow_but(GOING[:2], GOING)
"""Goals in turn are a kernel of their own. That of the other model is slow, and what it
does is tested in the interpreter.
"""
OTHER = "rustamani2024"
ARRIVALS = ("goals_reached", "share_arrived", "time_to_goal", "goal_distance")


def a_job(model: str = "aziel_chen2025", **changes: Any) -> Job:
    """A trial in which boids reach several goals, all updated at once."""
    small = {"n": 8, "steps": 240, "update": "synchronous"}
    return builders.job(model, "as_written", **(small | COURSES[model] | changes))


def goals_in(job: Job) -> np.ndarray:
    """All goals (G, 2) in their order."""
    first = job.settings["goal_x"], job.settings["goal_y"]
    return np.array([first, *(places_of(job.settings["next_goals"]) or ())])


def reached_at(frame: np.ndarray, before: np.ndarray, job: Job) -> np.ndarray:
    """How many goals each boid has reached at a frame (N,), of so many before."""
    goals, radius = goals_in(job), job.settings["goal_radius"]
    found = before.copy()
    for boid, reached in enumerate(before):
        if job.settings["goals_repeat"] or reached < len(goals):
            goal = goals[reached % len(goals)]
            found[boid] += np.hypot(*(frame[:2, boid] - goal)) < radius
    return found


def reached_by(frames: np.ndarray, job: Job) -> np.ndarray:
    """How many goals each boid has reached at each frame (F, N)."""
    found, reached = [], np.zeros(frames.shape[2], int)
    for frame in frames:
        reached = reached_at(frame, reached, job)
        found.append(reached)
    return np.array(found)


def flown(simulation: Simulation, steps: int) -> np.ndarray:
    assert simulation.advance(steps)
    simulation.take_frames()
    return builders.state(simulation.flock)


@pytest.mark.parametrize(("model", "repeat"), COMPILED)
def test_each_boid_goes_to_the_goal_that_a_slow_twin_says(
    model: str, repeat: bool
) -> None:
    """A step of a boid is that of a twin whose goal is the one that this boid has.
    Sums round differently, by 1e-13 of a place; a wrong goal is off by more than 1e-4.
    """
    job = a_job(model, goals_repeat=repeat, steps=100)
    simulation, goals = Simulation(job), goals_in(job)
    twin = getattr(naive, model)
    reached, seen = np.zeros(simulation.flock.x.size, int), set[int]()
    for _ in range(100):
        reached = reached_at(builders.state(simulation.flock), reached, job)
        kept = reached % len(goals) if repeat else reached.clip(max=len(goals) - 1)
        seen |= set(kept.tolist())
        before, moved = naive.birds(simulation.flock), {}
        for k in {*kept.tolist()}:
            own = job.settings | {"goal_x": goals[k][0], "goal_y": goals[k][1]}
            moved[k] = twin(own, simulation.world, before, np.random.default_rng(1))
        birds = [moved[k][boid] for boid, k in enumerate(kept.tolist())]
        wanted = [[*one.position, *one.velocity] for one in birds]
        found = flown(simulation, 1)
        np.testing.assert_allclose(found, np.array(wanted).T, rtol=0, atol=1e-9)
    assert len(seen) > 1


@pytest.mark.parametrize(("model", "repeat"), COMPILED)
def test_metrics_are_those_of_a_recount_from_all_frames(
    model: str, repeat: bool
) -> None:
    """To rounding of means: 1e-12. Some boids have reached all goals, so that all
    metrics have values.
    """
    job = a_job(model, goals_repeat=repeat, series=ARRIVALS, metrics=ARRIVALS)
    series = run(job).series
    frames = builders.trajectory(builders.to_end(Simulation(job)))
    reached, goals = reached_by(frames, job), goals_in(job)
    there = reached >= len(goals)
    first = np.where(there[-1], there.argmax(axis=0), np.iinfo(int).max)
    mean = [
        job.settings["dt"] * first[first <= f].mean() if (first <= f).any() else np.nan
        for f in range(len(frames))
    ]
    last = frames[:, :2] - goals[-1][:, None]
    for name, wanted in (
        ("goals_reached", reached.mean(axis=1)),
        ("share_arrived", 100 * there.mean(axis=1)),
        ("time_to_goal", mean),
        ("goal_distance", np.hypot(last[:, 0], last[:, 1]).mean(axis=1)),
    ):
        np.testing.assert_allclose(series[name], wanted, rtol=1e-12, err_msg=name)
    assert there[-1].any()
    assert (reached[-1] > len(goals)).any() == repeat


def test_with_one_goal_nothing_is_added() -> None:
    """Whatever `goals_repeat` says; the goals reached are the boids that arrived."""
    job = a_job(next_goals="", goals_repeat=True, metrics=ARRIVALS, steps=60)
    assert not flies_alone(job)
    assert Simulation(job).flight.work.goals is None
    last = run(job).last
    assert last["goals_reached"] == last["share_arrived"] / 100 > 0.0


def test_goals_are_passed_whatever_is_recorded() -> None:
    jobs = [a_job(metrics=metrics) for metrics in (ARRIVALS, ("speed",), ())]
    ends = [flown(Simulation(job), 240).tobytes() for job in jobs]
    assert len(set(ends)) == 1
    assert flown(Simulation(a_job(next_goals="")), 240).tobytes() != ends[0]


def test_who_is_at_a_goal_from_the_start_goes_on_at_once() -> None:
    """At most one goal in a step, also where all goals are one place."""
    changes = {"next_goals": "100 75; 100 75; 100 75", "goal_x": 100, "goal_y": 75}
    job = a_job(goal_radius=1000, **changes)
    simulation = Simulation(job)
    reached = simulation.flight.work.goals.reached
    for wanted in (1, 2, 3, 4, 4):
        assert (reached == wanted).all()
        flown(simulation, 1)


@pytest.mark.parametrize("model", slow_but(["aziel_chen2025"], COURSES))
def test_a_trial_that_goes_on_from_its_state_has_the_same_bits(model: str) -> None:
    """And one that goes on with other settings keeps the goals of its boids."""
    job = a_job(model, goals_repeat=True)
    whole, part, again = (Simulation(job) for _ in range(3))
    wanted = flown(whole, 200)
    flown(part, 120)
    assert part.flight.work.goals.reached.any()
    again.restore(part.state().copied())
    assert (flown(again, 80) == wanted).all()
    reached = [one.flight.work.goals.reached.tolist() for one in (whole, again)]
    assert reached[0] == reached[1]
    same, fresh = Simulation(job), Simulation(a_job(model, next_goals=""))
    same.go_on_from(part)
    assert (flown(same, 80) == wanted).all()
    fresh.go_on_from(part)
    assert flown(fresh, 1).shape == (4, 8)
    bad = part.state().copied()
    bad.arrays["work.goals.reached"][0] = -1
    with pytest.raises(ValueError, match="the state is impossible for a trial"):
        again.restore(bad)


def test_a_look_at_one_step_passes_no_goal() -> None:
    simulation = Simulation(a_job())
    flown(simulation, 60)
    state = simulation.state().copied()
    with simulation.noise.lent() as rng:
        for _ in range(40):
            velocities_after(simulation.flight, simulation.flight.params, rng)
    assert different(state, simulation.state()) == ""


def digests(model: str) -> str:
    """Where boids are after trials with several goals, as hashes."""
    found = []
    for repeat in (False, True):
        for update in builders.UPDATES:
            job = a_job(model, goals_repeat=repeat, update=update)
            found.append(sha256(flown(Simulation(job), 90).tobytes()).hexdigest())
    return " ".join(found)


@pytest.mark.parametrize("model", slow_but(["aziel_chen2025"], COURSES))
def test_the_interpreter_gives_the_same_bits(model: str) -> None:
    code = f"from tests.trial import test_goals as t\nprint(t.digests({model!r}))"
    assert interpreted(code).strip() == digests(model)


def test_the_other_model_goes_to_its_goals_in_the_interpreter() -> None:
    code = (
        "from tests.trial import test_goals as t\n"
        "for repeat in (False, True):\n"
        "    t.test_each_boid_goes_to_the_goal_that_a_slow_twin_says(t.OTHER, repeat)"
    )
    interpreted(code)


def test_trials_with_several_goals_fly_alone_in_one_thread() -> None:
    jobs = [a_job(seed=k) for k in range(AT_ONCE)]
    assert all(len(group) == 1 for group in groups(jobs))
    assert flies_alone(jobs[0])
    single = [a_job(seed=k, next_goals="") for k in range(AT_ONCE)]
    assert [len(group) for group in groups(single)] == [AT_ONCE]
    assert MODELS["aziel_chen2025"].advance is Simulation(jobs[0]).flight.model.advance


def test_the_world_of_a_trial_has_all_goals_that_are_sought() -> None:
    assert world_of(a_job()).goals == ((40, 40), (160, 40), (160, 110), (40, 110))
    assert world_of(a_job(goal_weight=0.0)).goals == ()
    assert world_of(a_job(next_goals="")).goals == ((40, 40),)
