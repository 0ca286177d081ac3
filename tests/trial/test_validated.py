"""What `validate` changes in a trial: the search for neighbours, which changes no bit,
and the time step, whose flights come together as it gets shorter.
"""

from dataclasses import replace

import numpy as np
import pytest

from kernels.catalogue import BUILT_IN
from kernels.models import MODELS
from kernels.settings import COMMON
from sweep.design.jobs import Job
from sweep.methods.robustness.section import time_step
from sweep.spec.settings import settings_of
from sweep.trial.lanes import groups
from sweep.trial.simulation import Simulation, run
from tests.builders import job

CONTINUOUS = [name for name in MODELS if time_step(settings_of(name, BUILT_IN))]


def large(model: str) -> Job:
    """A job of a model that sees a thirtieth of its world, which so has a grid. Senses
    stay ideal: kernels of robots are others, which take seconds to be compiled.
    """
    unit = MODELS[model].length
    side = 4000.0 if unit == "px" else 60.0
    reach = {
        name: side / 30.0
        for name, setting in settings_of(model, BUILT_IN).items()
        if name.endswith(("_range", "_width"))
        and setting.unit == unit
        and name not in COMMON
    }
    world = {"width": side, "height": side, "map": "empty"}
    return job(model, every=30, n=60, steps=30, **{**reach, **world})


@pytest.mark.parametrize("model", MODELS)
def test_a_search_among_all_pairs_has_the_same_bits(model: str) -> None:
    one = large(model)
    other = replace(one, all_pairs=True)
    grids = [Simulation(each).flight.work.grid for each in (one, other)]
    assert [grid.everyone for grid in grids] == [False, True]
    first, second = run(one), run(other)
    assert first.status == second.status == "done"
    np.testing.assert_array_equal([*first.last.values()], [*second.last.values()])


def test_a_restart_still_searches_among_all() -> None:
    whole, again = (Simulation(replace(large("nanobot"), all_pairs=True)) for _ in "ab")
    whole.advance(7)
    whole.take_frames()
    again.restore(whole.state())
    assert again.flight.work.grid.everyone
    whole.advance(9)
    again.advance(9)
    assert whole.flock.x.tolist() == again.flock.x.tolist()


def test_trials_that_search_among_all_fly_alone() -> None:
    jobs = [replace(large("nanobot"), all_pairs=True, replicate=k) for k in range(8)]
    assert [*groups(jobs)] == [[k] for k in range(8)]


def with_parts(model: str, parts: int) -> Job:
    """A job of a few boids that start in sight of each other, without noise, whose
    steps are cut into so many parts; the flight takes two units of time.
    """
    settings, one = settings_of(model, BUILT_IN), job(model, n=8, map="empty", every=1)
    quiet = {
        name: 0.0
        for name, setting in settings.items()
        if setting.each_step == "noise" or name in ("wander_weight", "motor_noise")
    }
    step = float(one.settings["dt"])
    values = one.settings | quiet | {"steps": round(2.0 / step), "start_radius": 3.0}
    middle = {"start_center_x": values["width"] / 2, "update": "synchronous"}
    values |= middle | {"start_center_y": values["height"] / 2}
    cut = {
        name: setting.coerce(setting.in_parts(values[name], parts))
        for name, setting in settings.items()
        if setting.in_steps or setting.each_step
    }
    return replace(one, settings=values | cut)


@pytest.mark.parametrize("model", CONTINUOUS)
def test_flights_come_together_as_steps_get_shorter(model: str) -> None:
    """From 16 to 64 parts of a step places move by less than half of what they move by
    from 2 to 8: an error of the first order shrinks to an eighth, and forces that jump
    at a range shrink it less.
    """
    places = []
    for parts in (2, 8, 16, 64):
        flown = Simulation(with_parts(model, parts))
        while flown.steps_left:
            assert flown.advance(flown.steps_left)
            flown.take_frames()
        places.append(np.array([flown.flock.x, flown.flock.y]))
    coarse, fine = (np.abs(places[k + 1] - places[k]).max() for k in (0, 2))
    assert coarse > 0.0
    assert fine < coarse / 2.0


def test_maps_in_time_say_nothing_of_shorter_steps() -> None:
    assert "vicsek1995" not in CONTINUOUS
    assert {"nguyen2024", "nanobot"} <= {*CONTINUOUS}
