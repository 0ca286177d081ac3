"""Every model with all layers at once: senses, motors, breakdowns, wind, robots
that differ, several goals, and obstacles of any shape that move.

What each layer does is tested where it is defined. Here is what lies between them: that
no two exclude each other, that a state has all of them, and that compiled code has the
bits of the interpreter.
"""

from hashlib import sha256
from typing import Any

import numpy as np
import pytest

from kernels.models import MODELS
from kernels.robots.abilities import abilities
from sweep.design.jobs import Job
from sweep.trial.simulation import Simulation
from sweep.trial.state import different
from tests import builders
from tests.interpreter import interpreted
from tests.kernels.test_differing import spreads
from tests.trial import test_obstacles, test_wind

STEPS, BEFORE = 6, 3
COMPILED = ("nguyen2024", "aziel_chen2025")
"""Models whose kernels for robots are compiled for other fast tests already; with goals
in turn that is another kernel, so only the last has them there.
"""


def layers(model: str) -> dict[str, dict[str, Any]]:
    """The settings of each layer by its name, in the units of a model and in its
    steps.
    """
    dt = float(builders.job(model).settings["dt"])
    one, width = builders.scale(model), float(builders.job(model).settings["width"])
    about: dict[str, dict[str, Any]] = {
        "senses": {
            "position_noise": one,
            "noise_time": 3.0 * dt,
            "sensing_delay": 2.0 * dt,
            "packet_loss": 0.2,
            "occlusion": "obstacles",
        },
        "motors": {"motor_lag": 2.0 * dt, "motor_spread": 0.1},
        "breakdowns": {
            "failing_share": 0.4,
            "failing_time": 3.0 * dt,
            "failing_how": "drift",
        },
        "wind": test_wind.storm(model),
        "spreads": spreads(model, 0.1),
    }
    if abilities(MODELS[model]).goals_in_turn:
        near = {"goal_x": 0.5 * width, "goal_y": 0.3 * width}
        after = f"{0.2 * width!r} {0.1 * width!r}; {0.3 * width!r} {0.3 * width!r}"
        reach = {"goal_radius": 0.3 * width, "goals_repeat": True}
        about["goals"] = near | reach | {"next_goals": after}
    return about


def a_job(model: str, without: str = "") -> Job:
    """A short trial with all layers but one."""
    given: dict[str, Any] = {}
    for name, settings in layers(model).items():
        given |= {} if name == without else settings
    speed = float(model in test_obstacles.MOVING)
    return test_obstacles.among(model, speed, steps=STEPS, **given)


def flown(simulation: Simulation, steps: int) -> np.ndarray:
    return test_obstacles.flown(simulation, steps)


@pytest.mark.slow
@pytest.mark.parametrize("model", builders.COMPILED_AS_ROBOTS)
def test_a_flight_with_all_layers_goes_on_from_its_state_with_the_same_bits(
    model: str,
) -> None:
    """As does a simulation that takes its place, and the one whose state was taken."""
    job = a_job(model)
    whole, part, again, other = (Simulation(job) for _ in range(4))
    flown(part, BEFORE)
    again.restore(part.state().copied())
    other.go_on_from(part)
    wanted = flown(whole, STEPS)
    assert np.isfinite(wanted).all()
    for one in (part, again, other):
        assert flown(one, STEPS - BEFORE).tobytes() == wanted.tobytes()
    assert different(again.state(), whole.state()) == ""
    work = whole.flight.work
    assert work.robots.rows
    assert work.robots.wind
    assert work.robots.motors
    assert work.near.senses
    assert (work.motion is not None) == (model in test_obstacles.MOVING)
    assert (work.goals is not None) == abilities(MODELS[model]).goals_in_turn


def test_every_layer_takes_part_in_the_interpreter() -> None:
    """A layer that another one hides would change nothing: each changes where boids
    are, by more than what rounding can do. And all models do what the test above says.
    Obstacles that move are left out of it: not all rules look at obstacles.
    """
    code = (
        "from tests.trial import test_all_layers as t\n"
        "for model in t.MODELS:\n"
        "    t.test_a_flight_with_all_layers_goes_on_from_its_state_with_the_same_bits("
        "model)\n"
        "    t.check_each_layer(model)"
    )
    interpreted(code)


def check_each_layer(model: str) -> None:
    wanted = flown(Simulation(a_job(model)), STEPS)
    for name in layers(model):
        found = flown(Simulation(a_job(model, name)), STEPS)
        away = np.abs(found - wanted).max()
        assert away > 1e-9 * builders.scale(model), (model, name)


def digests() -> str:
    """Where boids are after trials of models that are compiled, as hashes."""
    ends = (flown(Simulation(a_job(model)), STEPS).tobytes() for model in COMPILED)
    return " ".join(sha256(end).hexdigest() for end in ends)


@pytest.mark.slow
def test_the_interpreter_gives_the_same_bits() -> None:
    code = "from tests.trial import test_all_layers as t\nprint(t.digests())"
    assert interpreted(code).strip() == digests()
