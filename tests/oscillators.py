"""A made-up model whose boids have state and kinds: oscillators that fly in circles.

Each boid has a phase, which is its heading too, and a frequency. Followers pull their
phase towards those that they see; pacemakers do not. It is Kuramoto's model on boids
that see some others only.
"""

import math
from typing import Annotated, Any, NamedTuple

from numpy.random import Generator

from kernels.jit import jit
from kernels.metrics.ground import FIRST_STATE, Ground, Metric
from kernels.model import Model, Sight
from kernels.neighbours import ALL_ROUND, move, move_all, search, square_range
from kernels.recording import Frames, Record, observe
from kernels.rules.borders import confine
from kernels.settings import COMMON, SEQUENTIAL, UPDATE, About, Observation
from kernels.state import Floats, Flock, Kinds, World, remember
from kernels.workspace import Workspace

SPEC = """
study: circles
model: oscillators
preset: as_run
fixed: {steps: 9}
sweep: {coupling: [0.1, 0.4]}
replicates: 2
seed: 5
record: {metrics: [order], series: [order], every: 2, trajectories: true}
"""
"""Twelve boids; six frames a trial."""
PHASE, FREQUENCY = 0, 1
PACEMAKER, FOLLOWER = 0, 1


class Params(NamedTuple):
    """The settings of an oscillator."""

    coupling: Annotated[float, About("pull of the phases of others", "1/time", low=0)]
    spread: Annotated[float, About("deviation of frequencies", "1/time", low=0)]
    jitter: Annotated[float, About("most noise of a phase in a step", "radians", low=0)]
    pacemakers: Annotated[int, About("boids that listen to nobody", low=0)]
    perception_range: Annotated[
        float, About("radius within which others are heard", "length", low=0)
    ]
    speed_of_flight: Annotated[float, About("speed of boids", "length/time", low=0)]
    update: Annotated[int, UPDATE]
    dt: Annotated[float, About("time of one update", "time", low=0, exclusive=True)]


AS_RUN = COMMON | {
    "coupling": 0.3,
    "spread": 0.05,
    "jitter": 0.01,
    "pacemakers": 3,
    "perception_range": 60.0,
    "speed_of_flight": 2.0,
    "update": "synchronous",
    "n": 12,
    "steps": 20,
    "dt": 1.0,
    "map": "empty",
    "width": 240.0,
    "height": 180.0,
    "borders": "torus",
    "minimum_image": False,
    "start_speed": 2.0,
}


def sight(params: Params) -> Sight:
    """All round."""
    return Sight(params.perception_range)


def begin_state(
    params: Params, flock: Flock, kind: Kinds, rng: Generator, state: Floats
) -> None:
    """Phases are the headings of the flock; pacemakers have the frequency 0.1."""
    for i in range(flock.x.size):
        state[PHASE, i] = math.atan2(flock.vy[i], flock.vx[i])
        drawn = rng.normal(0.0, params.spread)
        state[FREQUENCY, i] = 0.1 if kind[i] == PACEMAKER else drawn


def count_kinds(params: Params, n: int) -> tuple[int, int]:
    """So many pacemakers, as far as there are boids."""
    pacemakers = min(params.pacemakers, n)
    return pacemakers, n - pacemakers


@jit
def advance(
    flock: Flock,
    world: World,
    params: Params,
    work: Workspace,
    record: Record,
    rng: Generator,
    steps: int,
) -> bool:
    """Phases first, then each boid flies where its phase points."""
    sequential = params.update == SEQUENTIAL
    range2 = square_range(params.perception_range, False)
    seen = flock if sequential else work.before
    phases = work.state if sequential else work.state_before
    for _ in range(steps):
        remember(flock, seen)
        for i in range(flock.x.size):
            found = search(
                seen, world, work.grid, i, range2, ALL_ROUND, 0.0, 0.0, work.near
            )
            pull = 0.0
            if work.kind[i] == FOLLOWER:
                for k in range(found):
                    other = phases[PHASE, work.near.boid[k]]
                    pull += math.sin(other - phases[PHASE, i]) / found
            turn = work.state[FREQUENCY, i] + params.coupling * pull
            noise = rng.uniform(-params.jitter, params.jitter)
            phase = work.state[PHASE, i] + turn * params.dt + noise
            work.state[PHASE, i] = phase
            vx = params.speed_of_flight * math.cos(phase)
            vy = params.speed_of_flight * math.sin(phase)
            x, vx = confine(flock.x[i] + vx * params.dt, vx, world.width, world.borders)
            y, vy = confine(
                flock.y[i] + vy * params.dt, vy, world.height, world.borders
            )
            flock.x[i], flock.y[i], flock.vx[i], flock.vy[i] = x, y, vx, vy
            if sequential:
                move(work.grid, i, x, y)
        if not sequential:
            move_all(work.grid, flock)
        if not observe(flock, world, record):
            return False
    return True


@jit
def order(
    frames: Frames,
    filled: int,
    ground: Ground,
    _observation: Observation,
    values: Floats,
) -> None:
    """The length of the mean of exp(i phase) over followers."""
    for f in range(filled):
        x, y, followers = 0.0, 0.0, 0
        for i in range(frames.bodies.shape[2]):
            if ground.kind[i] == FOLLOWER:
                x += math.cos(frames.bodies[f, FIRST_STATE + PHASE, i])
                y += math.sin(frames.bodies[f, FIRST_STATE + PHASE, i])
                followers += 1
        values[f] = math.sqrt(x * x + y * y) / followers if followers else math.nan


MODEL = Model(
    name="oscillators",
    source="Y. Kuramoto (1975), on boids",
    params=Params,
    presets={"as_written": AS_RUN, "as_run": AS_RUN},
    metrics=("order", "speed"),
    sight=sight,
    advance=advance,
    state={
        "phase": About("phase of the oscillator", "radians"),
        "frequency": About("its own frequency", "1/time"),
    },
    begin_state=begin_state,
    kinds=("pacemaker", "follower"),
    count_kinds=count_kinds,
)
ORDER: Any = Metric(
    order,
    unit="",
    text="order of the phases of followers",
    source="Y. Kuramoto (1975)",
    state=("phase",),
    kinds=("pacemaker", "follower"),
)
