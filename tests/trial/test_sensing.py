"""Trials whose boids measure and hear."""

from dataclasses import replace
from hashlib import sha256
from typing import Any

import numpy as np
import pytest

from kernels.flight import rebuild_grid
from kernels.inspection import seen_by
from kernels.models import MODELS
from kernels.neighbours import all_pairs
from sweep.design.jobs import Job
from sweep.trial.lanes import groups
from sweep.trial.robots import flies_alone, keys_of
from sweep.trial.simulation import Simulation
from sweep.trial.state import different
from tests import builders, naive
from tests.cases import slow_but
from tests.interpreter import interpreted
from tests.naive.sensing import Knowledge

REAL = {
    "position_noise": 2.0,
    "velocity_noise": 0.2,
    "noise_time": 5.0,
    "own_noise": "shared",
    "sensing_delay": 3.0,
    "sensing_period": 2.0,
    "radio_range": 150.0,
    "packet_loss": 0.3,
    "packet_loss_range": 100.0,
    "occlusion": "both",
    "body_radius": 3.0,
}
ALL_HEARD = {"radio_range": 1e12}
"""Boids have senses, and know all that they see."""
TWINS: dict[str, dict[str, Any]] = {
    "white": {"position_noise": 1.0, "velocity_noise": 0.5, "packet_loss": 0.2},
    "correlated": REAL | {"own_noise": "none"},
    "coupled": REAL | {"noise_form": "coupled", "own_noise": "none"},
    "own": REAL | {"noise_form": "coupled", "own_noise": "independent"},
    "shared": REAL,
    "hidden": {"occlusion": "both", "body_radius": 8.0},
}


def a_job(model: str = "nguyen2024", **changes: Any) -> Job:
    """A short trial in which all forces act, and nothing is random but what is sensed;
    a step takes the time 1.
    """
    small = builders.ALL_FORCES | {"update": "synchronous"}
    return builders.job(model, "as_written", **(small | changes))


def flown(simulation: Simulation, steps: int) -> np.ndarray:
    simulation.advance(steps)
    simulation.take_frames()
    return builders.state(simulation.flock)


WITH_TWINS = [
    "nguyen2024",
    pytest.param("aziel_chen2025", marks=pytest.mark.slow),
]
"""The second is tried in the interpreter: its kernel for robots is another one."""


@pytest.mark.parametrize("case", TWINS)
@pytest.mark.parametrize("model", WITH_TWINS)
def test_boids_react_to_what_a_slow_twin_says_that_they_know(
    model: str, case: str
) -> None:
    """For 12 steps, each from where the flight is. Each boid flies as in a flock of
    itself, as it knows itself, and of those whom it hears of. What that adds to its
    velocity and to its place by it is added to the true ones. Sums round differently,
    by 1e-13 px at 300 px; a wrong rule is off by more than 1e-3 px.

    The speed of aziel_chen2025 is limited after that, so that it is tried without
    errors of a boid's own.
    """
    changes = TWINS[case]
    if model == "aziel_chen2025":
        changes = changes | {"own_noise": "none", "perception_range": 150.0}
    job = a_job(model, **changes)
    simulation, settings = Simulation(job), job.settings
    knowledge = Knowledge(settings, simulation.world, keys_of(job).flown)
    twin, rng = getattr(naive, model), np.random.default_rng(1)
    for _ in range(12):
        before = naive.birds(simulation.flock)
        wanted = []
        knows = knowledge.own_and_heard(before)
        for bird, (own, heard) in zip(before, knows, strict=True):
            moved = twin(settings, simulation.world, [own, *heard], rng)[0]
            velocity = bird.velocity + (moved.velocity - own.velocity)
            position = bird.position + settings["dt"] * velocity
            wanted.append([*position, *velocity])
        found = flown(simulation, 1)
        np.testing.assert_allclose(found, np.array(wanted).T, rtol=0, atol=1e-10)


def test_they_do_in_the_interpreter() -> None:
    code = (
        "from tests.trial import test_sensing as t\n"
        "for case in ('shared', 'hidden'):\n"
        "    t.test_boids_react_to_what_a_slow_twin_says_that_they_know("
        "'aziel_chen2025', case)"
    )
    interpreted(code)


@pytest.mark.parametrize("update", builders.UPDATES)
def test_a_blind_boid_flies_as_if_it_were_alone(update: str) -> None:
    simulation = Simulation(a_job(update=update, **ALL_HEARD))
    alone = Simulation(a_job(update=update, n=1))
    builders.place(alone, *(row[[5]] for row in simulation.flock[:4]))
    simulation.flight.work.near.senses.blind_from[5] = 0
    assert (flown(simulation, 20)[:, [5]] == flown(alone, 20)).all()
    free = flown(Simulation(a_job(update=update, **ALL_HEARD)), 20)
    assert (flown(simulation, 0) != free).any()


def test_others_fly_as_if_a_silent_boid_were_not_there() -> None:
    """All at once, and nobody hears of it; it hears of the others."""
    simulation = Simulation(a_job(**ALL_HEARD))
    without = Simulation(a_job(n=13, **ALL_HEARD))
    builders.place(without, *(row[:13] for row in simulation.flock[:4]))
    simulation.flight.work.near.senses.silent_from[13] = 0
    assert (flown(simulation, 20)[:, :13] == flown(without, 20)).all()


def test_boids_who_know_all_that_they_see_fly_as_without_senses() -> None:
    """To the bit, where all are updated at once."""
    with_senses = Simulation(a_job(**ALL_HEARD))
    assert with_senses.flight.work.near.senses is not None
    assert (flown(with_senses, 20) == flown(Simulation(a_job()), 20)).all()


@pytest.mark.parametrize("update", builders.UPDATES)
def test_a_trial_that_goes_on_from_its_state_has_the_same_bits(update: str) -> None:
    """And with any grid. The state between has messages that are still under way."""
    job = a_job(update=update, n=60, cohesion_range=40.0, **REAL)
    whole, part, again = (Simulation(job) for _ in range(3))
    flown(part, 7)
    state = part.state().copied()
    again.restore(state, room=3)
    everyone = Simulation(replace(job, all_pairs=True))
    wanted = flown(whole, 20)
    assert (flown(again, 13) == wanted).all()
    senses, resumed = (one.flight.work.near.senses for one in (whole, again))
    for row, other in zip(senses, resumed, strict=True):
        if isinstance(row, np.ndarray):
            assert (row == other).all()
    assert (flown(everyone, 20) == wanted).all()
    rebuild_grid(part.flight, room=2)
    assert not part.flight.work.grid.everyone
    assert (flown(part, 13) == wanted).all()


def test_a_flight_that_goes_on_with_other_settings_begins_its_senses_anew() -> None:
    """Unless it remembers the same: then no bit changes, as of the range of radios that
    nobody is beyond.
    """
    job = a_job(**REAL)
    long = a_job(**{**REAL, "sensing_delay": 6.0})
    whole, part, same, other = map(Simulation, (job, job, job, long))
    flown(part, 7)
    same.go_on_from(part)
    assert (flown(same, 13) == flown(whole, 20)).all()
    other.go_on_from(part)
    before = builders.state(other.flock)
    flown(other, 1)
    senses = other.flight.work.near.senses
    assert senses.times.tolist() == [7, 7, 7, 7]
    off = np.abs(np.stack(other.flight.work.before[:2]) - before[:2])
    assert (off < 6 * REAL["position_noise"]).all()


def digests() -> str:
    """Where boids are after a trial of each kind of senses, as hashes."""
    jobs = (a_job(steps=8, **changes) for changes in TWINS.values())
    ends = (flown(Simulation(job), 8).tobytes() for job in jobs)
    return " ".join(sha256(end).hexdigest() for end in ends)


def test_the_interpreter_gives_the_same_bits() -> None:
    code = "from tests.trial import test_sensing as t\nprint(t.digests())"
    assert interpreted(code).strip() == digests()


@pytest.mark.parametrize("model", slow_but(["patel2023", "vicsek1995"], MODELS))
def test_every_model_has_them_in_the_interpreter(model: str) -> None:
    """Nothing is compiled there."""
    code = (
        "from tests.trial import test_sensing as t\n"
        f"t.test_every_model_has_the_same_bits_in_any_grid({model!r})"
    )
    interpreted(code)


@pytest.mark.parametrize("model", builders.COMPILED_AS_ROBOTS)
def test_every_model_has_the_same_bits_in_any_grid(model: str) -> None:
    """And flies otherwise than without senses."""
    lengths = ("position_noise", "velocity_noise", "body_radius", "packet_loss_range")
    dt = float(builders.job(model).settings["dt"])
    senses = (
        REAL
        | builders.scaled(model, **{name: REAL[name] for name in lengths})
        | {"sensing_delay": 3 * dt, "sensing_period": 2 * dt, "radio_range": 1e9}
    )
    job = builders.job(model, n=40, steps=8, **senses)
    one, other = Simulation(job), Simulation(replace(job, all_pairs=True))
    rebuild_grid(one.flight, room=2)
    found = flown(one, 8)
    assert np.isfinite(found).all()
    assert (found == flown(other, 8)).all()
    assert (found != flown(Simulation(builders.job(model, n=40, steps=8)), 8)).any()


def test_what_a_boid_hears_of_is_shown() -> None:
    """As in the next step, which it does not change."""
    simulation = Simulation(a_job(**REAL))
    flown(simulation, 7)
    state = simulation.state().copied()
    seen = [seen_by(simulation.flight, boid) for boid in range(14)]
    assert different(state, simulation.state()) == ""
    senses = simulation.flight.work.near.senses
    flown(simulation, 1)
    heard = [len(one.neighbours) for one in seen]
    assert 0 < sum(heard) < 14 * 13
    sent = np.stack(simulation.flight.work.before[:2], axis=1)
    for one in seen:
        assert one.known == sent[one.neighbours].tolist()
    assert seen_by(Simulation(a_job()).flight, 0).known == []
    assert senses.times.tolist() == [0, 7, 6, 3]


def test_a_model_that_does_not_publish_is_noticed_by_its_clock() -> None:
    """As one of users that builds its call from parts, which no check can read."""
    simulation = Simulation(a_job(**ALL_HEARD))
    flight = simulation.flight
    real, clock = flight.model.advance, flight.work.robots.clock

    def advance(*given: Any) -> bool:
        going = real(*given)
        clock[0] -= 1
        return going

    flight.model = flight.model._replace(advance=advance)
    with pytest.raises(RuntimeError, match="called publish in 4 of 5 steps"):
        simulation.advance(5)


def test_trials_with_senses_fly_alone() -> None:
    jobs = [a_job(**ALL_HEARD, seed=k) for k in range(16)]
    assert flies_alone(jobs[0])
    assert all(len(group) == 1 for group in groups(jobs))
    ideal = [a_job(body_radius=3.0, seed=k) for k in range(16)]
    assert not flies_alone(ideal[0])


def test_no_trial_among_all_has_a_grid() -> None:
    everyone = Simulation(replace(a_job(**REAL), all_pairs=True))
    assert everyone.flight.work.grid.everyone == all_pairs(14).everyone
