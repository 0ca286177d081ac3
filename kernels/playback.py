"""Playback of a recording: boids follow positions and velocities that were measured.

A recording is a model without rules. The simulation loop, the metrics, the counts of
visits and the events are those of every model, so measured and simulated flocks have
one definition of each metric.
"""

from collections.abc import Iterable, Mapping
from typing import Annotated, Any, NamedTuple

from numpy.random import Generator

from kernels.jit import jit
from kernels.model import Event, Model, Sight
from kernels.neighbours import move_all
from kernels.recording import STEP, Record, observe
from kernels.settings import COMMON, TIME_STEP, About
from kernels.state import Floats, Flock, World, remember
from kernels.workspace import Workspace

Value = float | int | bool | str
PRESET = "recorded"
"""Name of the only preset of a recording."""
SHARES = 3
"""Number of the parameters of every recording, before the numbers of kinds."""


class Params(NamedTuple):
    """Time step of a recording, and the shares of positions that were not measured."""

    dt: Annotated[float, TIME_STEP]
    interpolated: Annotated[
        float,
        About("share of positions that were interpolated in gaps", low=0, high=1),
    ]
    absent: Annotated[
        float,
        About(
            "share of positions without a value: individuals that were not measured",
            low=0,
            high=1,
        ),
    ]


class Played(NamedTuple):
    """Measured frames that `advance` copies.

    Attributes
    ----------
    dt : float
        Time of a step.
    bodies : array of float, shape (F, 4, N)
        x, y, vx and vy of each boid; the last known values of an absent boid.
    first : int
        Step of the first of these frames.
    """

    dt: float
    bodies: Floats
    first: int


def sight(_params: Any) -> Sight:
    """Return a view without range: recorded boids search for no neighbours."""
    return Sight(0.0)


def count_kinds(params: Any, _n: int) -> tuple[int, ...]:
    """Return the number of individuals of each kind, from the parameters."""
    return tuple(int(count) for count in params[SHARES:])


@jit
def advance(
    flock: Flock,
    world: World,
    params: Played,
    work: Workspace,
    record: Record,
    _rng: Generator,
    steps: int,
) -> bool:
    """Copy the next `steps` measured frames into `flock`; return whether all is finite.

    Parameters
    ----------
    flock : Flock
        Positions and velocities of N boids, arrays (N,); changed in place.
    world : World
        World of the recording.
    params : Played
        Frames, which include the next `steps` frames.
    work : Workspace
        Workspace of the trial.
    record : Record
        Receives frames, counts and the number of steps done.
    _rng : Generator
        Unused: a recording has no random numbers.
    steps : int
        Number of frames.

    Returns
    -------
    bool
        False after the first frame that is not finite.
    """
    for _ in range(steps):
        remember(flock, work.before)
        frame = record.progress[STEP] + 1 - params.first
        for i in range(flock.x.size):
            flock.x[i] = params.bodies[frame, 0, i]
            flock.y[i] = params.bodies[frame, 1, i]
            flock.vx[i] = params.bodies[frame, 2, i]
            flock.vy[i] = params.bodies[frame, 3, i]
        move_all(work.grid, flock)
        if not observe(flock, world, record):
            return False
    return True


def parameters_of(event: Event, kinds: Iterable[str]) -> dict[str, Value]:
    """Return the parameters of a recording that differ from event to event."""
    numbers: dict[str, Value] = dict(zip(map(_count, kinds), event.kinds, strict=True))
    return numbers | {
        "n": event.boids,
        "steps": event.steps,
        "interpolated": event.interpolated,
        "absent": event.absent,
    }


def _count(kind: str) -> str:
    """Return the name of the parameter with the number of individuals of a kind."""
    return f"count_{kind}"


def recorded_model(
    name: str,
    source: str,
    events: tuple[Event, ...],
    preset: Mapping[str, Any],
    kinds: tuple[str, ...],
    length: str,
    time: str,
) -> Model:
    """Return the model of a recording.

    Parameters
    ----------
    name : str
        Name in tables.
    source : str
        Reference of the data.
    events : tuple of Event
        Events of the recording, each of which is a trial.
    preset : mapping
        Values that differ from the usual values of all models; `dt`, `width` and
        `height` at least.
    kinds : tuple of str
        Kinds of individuals; () if the individuals are of one kind.
    length : str
        Unit of length.
    time : str
        Unit of time.

    Returns
    -------
    Model
    """
    counts = [
        (_count(kind), Annotated[int, About(f"number of individuals: {kind}", low=0)])
        for kind in kinds
    ]
    shape = [*Params.__annotations__.items(), *counts]
    params: Any = NamedTuple("Params", shape)  # type: ignore[misc]
    return Model(
        name=name,
        source=source,
        params=params,
        presets={
            PRESET: COMMON
            | {"map": "empty", "minimum_image": False, "start_speed": 0.0}
            | parameters_of(events[0], kinds)
            | dict(preset)
        },
        metrics=("polarization", "speed", "flock_radius"),
        sight=sight,
        advance=advance,
        kinds=kinds,
        count_kinds=count_kinds if kinds else None,
        length=length,
        time=time,
        y_down=False,
        publishes=False,
        drives=False,
        goals_in_turn=False,
        shared=tuple(field for field, _ in shape),
        events=events,
    )
