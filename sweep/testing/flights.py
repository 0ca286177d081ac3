"""Small flights by which a model is tried, and the first bit in which two differ."""

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
from sweep.design.consistency import DEMANDS
from sweep.design.jobs import Job
from sweep.spec.copied_maps import Obstacles
from sweep.spec.expressions import parse
from sweep.spec.settings import Value, preset_settings, settings_tuple
from sweep.spec.study import RecordSpec, Streams
from sweep.testing.places import of_function
from sweep.testing.subject import Subject
from sweep.trial.simulation import Simulation
from sweep.trial.state import State, Taken, joined

SEED = 27
BOIDS, STEPS = 14, 10
SIDE = 6
"""Of the world, in ranges of sight: so there are cells that are no neighbours."""
BORDERS: tuple[dict[str, Any], ...] = (
    {"borders": "open", "minimum_image": False},
    {"borders": "torus", "minimum_image": False},
    {"borders": "torus", "minimum_image": True},
    {"borders": "bounded", "minimum_image": False},
)
BODIES = ("x", "y", "vx", "vy")
SCRATCH = ("work.near.", "work.before.")
"""Arrays in which something is left from the last boid, or the last step."""

Settings = Mapping[str, Any]
Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Flown:
    """A flight that is over: x, y, vx and vy of every frame (F, 4, N), the steps of the
    frames (F,), and the arrays that a model may change, as they are at the end.
    """

    bodies: Floats
    steps: NDArray[np.int64]
    last: dict[str, NDArray[Any]]


def params_of(job: Job, subject: Subject) -> Any:
    """The Params of a job."""
    return settings_tuple(subject.model.params, job.settings, subject.settings)


def sight_of(job: Job, subject: Subject) -> Sight:
    """Whom the boids of a job see."""
    return subject.model.sight(params_of(job, subject))


def a_job(subject: Subject, preset: str, obstacles: bool, **changes: Any) -> Job:
    """A trial of a preset in a square world that is as large as its boids can see six
    times, with or without three obstacles.

    Of `changes` those are made whose settings the model has.
    """
    about, settings = (
        subject.settings,
        preset_settings(subject.model.name, preset, subject.known),
    )
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
        name: about[name].coerce(value)
        for name, value in changes.items()
        if name in about
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
        known=subject.known,
    )


def together(job: Job) -> dict[str, Value]:
    """The settings of a start in the middle, where all boids are near each other."""
    side = float(job.settings["width"])
    return {
        "start_center_x": side / 2,
        "start_center_y": side / 2,
        "start_radius": side / SIDE,
    }


def _length(subject: Subject, settings: dict[str, Any]) -> float:
    """How far boids see, or a sixth of their world where that is no length."""
    params = settings_tuple(subject.model.params, settings, subject.settings)
    seen = float(subject.model.sight(params).range)
    world = min(settings["width"], settings["height"]) / SIDE
    return seen if 0.0 < seen < math.inf else world


def _obstacles(side: float) -> Obstacles:
    size = side / 48
    places = ((0.3, 0.3, 1.0), (0.7, 0.4, 0.0), (0.5, 0.75, 1.0))
    return tuple((x * side, y * side, size, size, disc) for x, y, disc in places)


def every_way(
    subject: Subject, obstacles: bool = True, **changes: Any
) -> Iterator[Job]:
    """A trial of each preset, update and kind of borders whose settings go together.

    Raises SkipTest where there is none.
    """
    update = subject.settings.get("update")
    updates = update.choices if update else ("",)
    presets, tried, broken = subject.model.presets, False, [""]
    for preset, name, borders in product(presets, updates, BORDERS):
        ways = borders | {"update": name} if name else borders
        job = a_job(subject, preset, obstacles, **(ways | changes))
        broken = broken_demands(subject, job.settings)
        if not broken:
            tried = True
            yield job
    if not tried:
        raise SkipTest(f"in the small worlds of this check {broken[0]}")


def broken_demands(subject: Subject, settings: Settings) -> list[str]:
    """What the conditions of a model, and of every study, say of settings, where they
    do not hold.
    """
    about = subject.settings
    return [
        demand.message
        for demand in (*DEMANDS, *subject.model.demands)
        if not parse(demand.condition, about).evaluate(dict(settings), 1).all()
    ]


def in_words(job: Job) -> str:
    """How the settings of a trial differ from those of others here."""
    names = ("update", "borders")
    said = [str(job.settings[name]) for name in names if name in job.settings]
    seen = ", seen across its borders" if job.settings["minimum_image"] else ""
    return f"preset {job.preset}, {' and '.join(said)}{seen}"


def go(simulation: Simulation, steps: int) -> bool:
    """Take steps in one call; False if the state is not finite.

    Raises AssertionError where `advance` takes another number of steps.
    """
    try:
        return simulation.advance(steps)
    except RuntimeError as error:
        place = of_function(simulation.flight.model.advance)
        raise AssertionError(f"{place}: {error}") from None


def fly(job: Job, calls: Sequence[int] = (STEPS,)) -> Flown:
    """Fly a job from its start, with these numbers of steps in a call."""
    simulation = Simulation(job)
    return _finish(simulation, calls, [simulation.take_frames()])


def begun(job: Job, steps: int = 1) -> State | None:
    """The state after the first steps; None if it is not finite."""
    simulation = Simulation(job)
    going = go(simulation, steps)
    simulation.take_frames()
    return simulation.state().copied() if going else None


def go_on(job: Job, state: State, calls: Sequence[int], room: int = 0) -> Flown:
    """Fly a job from a state of it, with so much room in a block of its grid."""
    simulation = Simulation(job)
    simulation.restore(state, room)
    return _finish(simulation, calls, [])


def _finish(simulation: Simulation, calls: Sequence[int], taken: list[Taken]) -> Flown:
    """Take steps, as many in a call, or fewer where the state is no longer finite."""
    for steps in calls:
        going = go(simulation, steps)
        taken.append(simulation.take_frames())
        if not going:
            break
    arrays = simulation.state().copied().arrays
    last = {name: one for name, one in arrays.items() if not name.startswith(SCRATCH)}
    whole = joined(taken)
    return Flown(whole.bodies, whole.steps, last)


def difference(one: Flown, other: Flown, first: str, second: str) -> str | None:
    """Where the bits of two flights differ first, in words; None where they are the
    same. `first` and `second` say how each flew.
    """
    frames = min(len(one.bodies), len(other.bodies))
    ours, theirs = one.bodies[:frames], other.bodies[:frames]
    unlike = np.argwhere(ours.view(np.uint64) != theirs.view(np.uint64))
    if len(unlike):
        frame, kind, boid = min(map(tuple, unlike.tolist()))
        mine, yours = (float(flown[frame, kind, boid]) for flown in (ours, theirs))
        return (
            f"after step {one.steps[frame]}, {BODIES[kind]} of boid {boid} is {mine!r}"
            f" {first} and {yours!r} {second}"
        )
    if len(one.bodies) != len(other.bodies):
        return (
            f"it goes on until step {one.steps[-1]} {first} and until step"
            f" {other.steps[-1]} {second}"
        )
    for name, array in one.last.items():
        if array.tobytes() != other.last[name].tobytes():
            return f"at the end, {name} is another one {first} than {second}"
    return None
