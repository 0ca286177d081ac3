"""Small trials of a model, and the first bit in which two trials differ."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any
from unittest import SkipTest

import numpy as np
from numpy.typing import NDArray

from kernels.model import Sight
from kernels.settings import COMMON
from sweep.design import DEMANDS, Job
from sweep.spec import (
    Obstacles,
    RecordSpec,
    Streams,
    Value,
    parse,
    preset_settings,
    settings_tuple,
)
from sweep.testing.places import of_function
from sweep.testing.subject import Subject
from sweep.trial import Simulation, State, Taken, joined

SEED = 27
BOIDS = 14
STEPS = 10
SIDE = 6
"""Side of the world, in ranges of sight: some cells are not adjacent."""
BORDERS: tuple[dict[str, Any], ...] = (
    {"borders": "open", "minimum_image": False},
    {"borders": "torus", "minimum_image": False},
    {"borders": "torus", "minimum_image": True},
    {"borders": "bounded", "minimum_image": False},
)
BODIES = ("x", "y", "vx", "vy")
SCRATCH = ("work.near.", "work.before.")
"""Arrays with leftover values of the last boid or the last step."""

Settings = Mapping[str, Any]
Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Flown:
    """A trial that has ended.

    `bodies` has x, y, vx and vy of every frame, shape (F, 4, N), and `steps` the steps
    of the frames, shape (F,). `last` has the final content of the arrays that a model
    may change.
    """

    bodies: Floats
    steps: NDArray[np.int64]
    last: dict[str, NDArray[Any]]


def params_of(job: Job, subject: Subject) -> Any:
    """Return the Params of a job."""
    return settings_tuple(subject.model.params, job.settings, subject.settings)


def sight_of(job: Job, subject: Subject) -> Sight:
    """Return the sight of the boids of a job."""
    return subject.model.sight(params_of(job, subject))


def a_job(subject: Subject, preset: str, obstacles: bool, **changes: Any) -> Job:
    """Return a trial of a preset in a small square world.

    The side of the world is SIDE times the range of sight.

    Parameters
    ----------
    subject : Subject
        The model.
    preset : str
        Name of the preset.
    obstacles : bool
        Whether the world has three obstacles.
    **changes
        Values of further parameters; parameters that the model lacks are ignored.
    """
    declared = subject.settings
    settings = preset_settings(subject.model.name, preset, subject.catalogue)
    length = _length(subject, settings)
    side = SIDE * length
    settings |= {
        "map": "empty",
        "width": side,
        "height": side,
        "goal_x": side / 2,
        "goal_y": side / 2,
        "n": BOIDS,
        "steps": STEPS,
        "start_draws": COMMON["start_draws"],
        "start_positions": "continuous",
        "start_margin": 0.0,
        "start_radius": 0.0,
    }
    settings |= {
        name: declared[name].coerce(value)
        for name, value in changes.items()
        if name in declared
    }
    return Job(
        trial_id="",
        point=f"{0:016x}",
        replicate=0,
        seed=SEED,
        literal=False,
        model=subject.model.name,
        preset=preset,
        settings=settings,
        record=RecordSpec((), trajectories=True),
        streams=Streams(),
        time_limit=None,
        obstacles=_obstacles(side) if obstacles else (),
        catalogue=subject.catalogue,
    )


def together(job: Job) -> dict[str, Value]:
    """Return parameters by which all boids start close together.

    The boids start in the middle of the world.
    """
    side = float(job.settings["width"])
    return {
        "start_center_x": side / 2,
        "start_center_y": side / 2,
        "start_radius": side / SIDE,
    }


def _length(subject: Subject, settings: dict[str, Any]) -> float:
    """Return the range of sight.

    An infinite or zero range is replaced by a sixth of the world of the preset.
    """
    params = settings_tuple(subject.model.params, settings, subject.settings)
    sight_range = float(subject.model.sight(params).range)
    world = min(settings["width"], settings["height"]) / SIDE
    return sight_range if 0.0 < sight_range < math.inf else world


def _obstacles(side: float) -> Obstacles:
    size = side / 48
    places = ((0.3, 0.3, 1.0), (0.7, 0.4, 0.0), (0.5, 0.75, 1.0))
    return tuple((x * side, y * side, size, size, disc) for x, y, disc in places)


def every_way(
    subject: Subject, obstacles: bool = True, **changes: Any
) -> Iterator[Job]:
    """Yield a trial of each preset, update and kind of borders.

    Combinations that break a condition of the model are left out.

    Parameters
    ----------
    subject : Subject
        The model.
    obstacles : bool, default True
        Whether the world has three obstacles.
    **changes
        Values of further parameters; see `a_job`.

    Raises
    ------
    SkipTest
        If no combination is possible.
    """
    update = subject.settings.get("update")
    updates = update.choices if update else ("",)
    presets = subject.model.presets
    tried = False
    broken = [""]
    for preset, name, borders in product(presets, updates, BORDERS):
        ways = borders | {"update": name} if name else borders
        job = a_job(subject, preset, obstacles, **(ways | changes))
        broken = broken_demands(subject, job.settings)
        if not broken:
            tried = True
            yield job
    if not tried:
        raise SkipTest(f"in the small test worlds, {broken[0]}")


def broken_demands(subject: Subject, settings: Settings) -> list[str]:
    """Return the messages of violated conditions, of all studies and of the model."""
    declared = subject.settings
    return [
        demand.message
        for demand in (*DEMANDS, *subject.model.demands)
        if not parse(demand.condition, declared).evaluate(dict(settings), 1).all()
    ]


def in_words(job: Job) -> str:
    """Return the varied parameters of a test trial in words."""
    names = ("update", "borders")
    choices = [str(job.settings[name]) for name in names if name in job.settings]
    across = ", perceived across borders" if job.settings["minimum_image"] else ""
    return f"preset {job.preset}, {' and '.join(choices)}{across}"


def go(simulation: Simulation, steps: int) -> bool:
    """Take steps in one call; return False if the state is not finite.

    Raises AssertionError if `advance` takes another number of steps.
    """
    try:
        return simulation.advance(steps)
    except RuntimeError as error:
        place = of_function(simulation.flight.model.advance)
        raise AssertionError(f"{place}: {error}") from None


def fly(job: Job, calls: Sequence[int] = (STEPS,)) -> Flown:
    """Run a job from the beginning, with given numbers of steps per call."""
    simulation = Simulation(job)
    return _finish(simulation, calls, [simulation.take_frames()])


def begun(job: Job, steps: int = 1) -> State | None:
    """Return the state after the first steps; None for a state that is not finite."""
    simulation = Simulation(job)
    going = go(simulation, steps)
    simulation.take_frames()
    return simulation.state().copied() if going else None


def resume(job: Job, state: State, calls: Sequence[int], room: int = 0) -> Flown:
    """Run a job from a state.

    Parameters
    ----------
    job : Job
    state : State
        State of the job.
    calls : sequence of int
        Numbers of steps per call.
    room : int, default 0
        Number of boids per block of the grid; 0 for the usual number.
    """
    simulation = Simulation(job)
    simulation.restore(state, room)
    return _finish(simulation, calls, [])


def _finish(simulation: Simulation, calls: Sequence[int], taken: list[Taken]) -> Flown:
    """Take steps, with given numbers per call.

    The steps end early if the state is no longer finite.
    """
    for steps in calls:
        going = go(simulation, steps)
        taken.append(simulation.take_frames())
        if not going:
            break
    arrays = simulation.state().copied().arrays
    last = {
        name: array for name, array in arrays.items() if not name.startswith(SCRATCH)
    }
    frames = joined(taken)
    return Flown(frames.bodies, frames.steps, last)


def difference(a: Flown, b: Flown, way_a: str, way_b: str) -> str | None:
    """Return the first difference between the bits of two trials, in words.

    Parameters
    ----------
    a, b : Flown
        The trials, of the same job.
    way_a, way_b : str
        The course of each trial in words, for the message.

    Returns
    -------
    str or None
        None if the trials are bitwise identical.
    """
    frames = min(len(a.bodies), len(b.bodies))
    bodies_a = a.bodies[:frames]
    bodies_b = b.bodies[:frames]
    unlike = np.argwhere(bodies_a.view(np.uint64) != bodies_b.view(np.uint64))
    if len(unlike):
        frame, kind, boid = min(map(tuple, unlike.tolist()))
        value_a = float(bodies_a[frame, kind, boid])
        value_b = float(bodies_b[frame, kind, boid])
        return (
            f"after step {a.steps[frame]}, {BODIES[kind]} of boid {boid} is {value_a!r}"
            f" {way_a}, but {value_b!r} {way_b}"
        )
    if len(a.bodies) != len(b.bodies):
        return (
            f"the trial runs until step {a.steps[-1]} {way_a}, but until step"
            f" {b.steps[-1]} {way_b}"
        )
    for name, array in a.last.items():
        if array.tobytes() != b.last[name].tobytes():
            return f"at the end, {name} differs {way_a} and {way_b}"
    return None
