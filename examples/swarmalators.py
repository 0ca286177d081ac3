"""Oscillators that swarm: like phases attract boids, and near boids couple phases.

K. P. O'Keeffe, H. Hong, S. H. Strogatz (2017), Oscillators that sync and swarm, Nature
Communications 8, 1504, Eqs. (3) and (4), for identical oscillators at rest. Velocities
follow from places and phases, and all see all.
"""

import math
from typing import Annotated, NamedTuple

from numpy.random import Generator

from kernels.arbitration import limit
from kernels.elementary import sine_cosine
from kernels.jit import jit
from kernels.model import Model, Sight
from kernels.near import Near
from kernels.neighbours import ALL_ROUND, move_all, search
from kernels.recording import Record, observe
from kernels.robots.actuation import drive
from kernels.robots.sensing import others_of, publish
from kernels.rules.borders import confine
from kernels.settings import COMMON, About, InParts
from kernels.state import Floats, Flock, Kinds, World
from kernels.workspace import Workspace

PHASE = 0
"""The row of the state."""


class Params(NamedTuple):
    """The two couplings of the paper; a swarm and its phases may ignore each other."""

    likeness: Annotated[
        float, About("J: how much like phases attract each other", low=-1, high=1)
    ]
    coupling: Annotated[
        float,
        About("K: how strongly near phases meet; below 0 they part", low=-10, high=10),
    ]
    max_speed: Annotated[float, About("upper limit of the speed", "length/time", low=0)]
    dt: Annotated[
        float,
        About("time of one update", "time", low=0, exclusive=True),
        InParts("time"),
    ]


STATIC_SYNC = COMMON | {
    "likeness": 0.1,
    "coupling": 1.0,
    "max_speed": 10.0,
    "dt": 0.1,
    "n": 100,
    "steps": 1000,
    "map": "empty",
    "width": 10.0,
    "height": 10.0,
    "start_speed": 0.0,
    "start_center_x": 5.0,
    "start_center_y": 5.0,
    "start_radius": 1.0,
    "flock_range": 0.5,  # ranges of metrics: a part of the swarm's radius, about 1
    "contact_distance": 0.01,
    "goal_radius": 0.5,
    "pixel": 0.1,
}
STATIC_ASYNC = STATIC_SYNC | {"likeness": 0.1, "coupling": -1.0}
STATIC_PHASE_WAVE = STATIC_SYNC | {"likeness": 1.0, "coupling": 0.0}
SPLINTERED_PHASE_WAVE = STATIC_SYNC | {"likeness": 1.0, "coupling": -0.1}
ACTIVE_PHASE_WAVE = STATIC_SYNC | {"likeness": 1.0, "coupling": -0.75}


def sight(_params: Params) -> Sight:
    """Everyone."""
    return Sight(math.inf)


def begin_state(
    _params: Params, _flock: Flock, _kind: Kinds, rng: Generator, state: Floats
) -> None:
    """Phases all over the circle."""
    state[PHASE] = rng.uniform(-math.pi, math.pi, state.shape[1])


@jit
def rates(
    params: Params, phases: Floats, i: int, near: Near, found: int
) -> tuple[float, float, float]:
    """The velocity of boid `i` by Eq. (3), with A = B = 1, and the rate of its phase by
    Eq. (4): means over all N boids.
    """
    x, y, turn = 0.0, 0.0, 0.0
    for k in range(found):
        ahead = phases[near.boid[k]] - phases[i]
        distance = math.sqrt(near.distance2[k])
        inverse = 1.0 / distance if distance > 0.0 else 0.0
        sine, cosine = sine_cosine(ahead)
        pull = (1.0 + params.likeness * cosine) * inverse - inverse * inverse
        x += near.dx[k] * pull
        y += near.dy[k] * pull
        turn += sine * inverse
    return x / (found + 1), y / (found + 1), params.coupling * turn / (found + 1)


@jit
def advance(
    flock: Flock,
    world: World,
    params: Params,
    work: Workspace,
    record: Record,
    _rng: Generator,
    steps: int,
) -> bool:
    """Take `steps` steps; False after the first one that is not finite."""
    others = others_of(flock, work, False)
    near, phases = work.near, work.state_before[PHASE]
    for _ in range(steps):
        publish(flock, others, work)
        for i in range(flock.x.size):
            found = search(
                others, world, work.grid, i, math.inf, ALL_ROUND, 0.0, 0.0, near
            )
            vx, vy, turn = rates(params, phases, i, near, found)
            vx, vy = limit(vx, vy, params.max_speed)
            vx, vy = drive(work, i, flock.vx[i], flock.vy[i], vx, vy)
            x, y = flock.x[i] + vx * params.dt, flock.y[i] + vy * params.dt
            flock.x[i], flock.vx[i] = confine(x, vx, world.width, world.borders)
            flock.y[i], flock.vy[i] = confine(y, vy, world.height, world.borders)
            work.state[PHASE, i] = phases[i] + turn * params.dt
        move_all(work.grid, flock)
        if not observe(flock, world, record):
            return False
    return True


MODEL = Model(
    name="swarmalators",
    source="K. P. O'Keeffe, H. Hong, S. H. Strogatz (2017), Nat. Commun. 8, 1504",
    params=Params,
    presets={
        "static_sync": STATIC_SYNC,
        "static_async": STATIC_ASYNC,
        "static_phase_wave": STATIC_PHASE_WAVE,
        "splintered_phase_wave": SPLINTERED_PHASE_WAVE,
        "active_phase_wave": ACTIVE_PHASE_WAVE,
    },
    metrics=("speed", "flock_radius"),
    sight=sight,
    advance=advance,
    state={"phase": About("phase of its oscillator", "radians")},
    begin_state=begin_state,
    update_order="all boids at once, from the flock as it was before the step",
    symmetries={
        "translation": {},
        "rotation": {},
        "quarter_turn": {},
        "reflection": {},
        "permutation": {},
    },
    length="length",
    time="time",
    publishes=True,
    drives=True,
    goals_in_turn=False,
    shared=("likeness", "coupling", "max_speed", "dt"),
)
