"""What a run remembers: snapshots of the flock, running counts, visited pixels."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.coverage import N_SUMS, Coverage, mark
from kernels.events import (
    FISSIONS,
    FUSIONS,
    N_EVENTS,
    N_INTEGRALS,
    Watch,
    count,
    keep_flocks,
    regroup,
)
from kernels.jit import jit
from kernels.state import Floats, Flock, World
from kernels.workspace import Workspace

COVERED, VISITS, SQUARED_VISITS = 0, 1, 2
FIRST_EVENT = N_SUMS
N_COUNTS = FIRST_EVENT + N_EVENTS
STEP, FILLED = 0, 1
FIRST_STATE = len(Flock._fields)


class Frames(NamedTuple):
    """Up to F snapshots: `bodies` (F, 6 + S, N), the fields of Flock in their order and
    from FIRST_STATE on the rows of the model's state, `counts` (F, N_COUNTS), `step`
    (F,), `integrals` (F, N_INTEGRALS).

    The counts are the sums of Coverage and, from FIRST_EVENT on, the events of Watch,
    whose integrals are the others.
    Where no metric looks at the bodies, `bodies` has no room for them: (F, 6 + S, 0).
    """

    bodies: NDArray[np.float64]
    counts: NDArray[np.int64]
    step: NDArray[np.int64]
    integrals: Floats


class Record(NamedTuple):
    """What to remember, and how far the run is.

    `progress` (2,) holds the steps done and the frames filled. A frame is kept every
    `every` steps and at the step `last`. `state` and `state_before` are those of the
    Workspace.
    """

    frames: Frames
    progress: NDArray[np.int64]
    every: int
    last: int
    covering: bool
    coverage: Coverage
    watch: Watch
    state: Floats
    state_before: Floats


def build_frames(n_frames: int, n: int, states: int = 0) -> Frames:
    """Room for `n_frames` snapshots of `n` bodies with so many rows of state."""
    return Frames(
        np.zeros((n_frames, FIRST_STATE + states, n)),
        np.zeros((n_frames, N_COUNTS), np.int64),
        np.zeros(n_frames, np.int64),
        np.zeros((n_frames, N_INTEGRALS)),
    )


NEVER = 2**62
"""A step that is not reached."""


def silent(record: Record, work: Workspace) -> Record:
    """A record of the same types, of boids with the state and the goals of `work`, in
    which nothing of a step is kept but its number and the events that a model counts
    itself.
    """
    watch = record.watch._replace(
        counting=False,
        pairing=False,
        integrating=False,
        following=False,
        events=record.watch.events.copy(),
        goals=work.goals,
    )
    return record._replace(
        progress=np.array([1, 0]),
        every=NEVER,
        last=NEVER,
        covering=False,
        watch=watch,
        state=work.state,
        state_before=work.state_before,
    )


@jit
def keep_frame(flock: Flock, record: Record) -> None:
    """Take a snapshot if one is due after the steps done."""
    step = record.progress[STEP]
    if step % record.every != 0 and step != record.last:
        return
    f = record.progress[FILLED]
    bodies = record.frames.bodies
    if f >= bodies.shape[0]:  # a model has observed more steps than it was to take
        return
    for i in range(bodies.shape[2]):
        bodies[f, 0, i] = flock.x[i]
        bodies[f, 1, i] = flock.y[i]
        bodies[f, 2, i] = flock.vx[i]
        bodies[f, 3, i] = flock.vy[i]
        bodies[f, 4, i] = flock.previous_vx[i]
        bodies[f, 5, i] = flock.previous_vy[i]
    for k in range(record.state.shape[0]):
        for i in range(bodies.shape[2]):
            bodies[f, FIRST_STATE + k, i] = record.state[k, i]
    for k in range(FIRST_EVENT):
        record.frames.counts[f, k] = record.coverage.sums[k]
    for k in range(N_EVENTS):
        record.frames.counts[f, FIRST_EVENT + k] = record.watch.events[k]
    for k in range(N_INTEGRALS):
        record.frames.integrals[f, k] = record.watch.integrals[k]
    if record.watch.following:
        parted, joined = regroup(flock, record.watch)
        record.frames.counts[f, FIRST_EVENT + FISSIONS] += parted
        record.frames.counts[f, FIRST_EVENT + FUSIONS] += joined
        if step % record.every == 0:  # a longer trial has no frame at the step `last`
            keep_flocks(record.watch, parted, joined)
    record.frames.step[f] = step
    record.progress[FILLED] = f + 1


@jit
def keep_state(state: Floats, state_before: Floats) -> bool:
    """Keep the state as that from before the next step; return whether all of it are
    finite numbers.
    """
    for k in range(state.shape[0]):
        for i in range(state.shape[1]):
            if not math.isfinite(state[k, i]):
                return False
            state_before[k, i] = state[k, i]
    return True


@jit
def observe(flock: Flock, world: World, record: Record) -> bool:
    """Take note of one step done; return whether all positions, velocities and states
    are finite numbers.
    """
    if not begin_step(flock, record):
        return False
    if record.covering:
        for i in range(flock.x.size):
            mark(record.coverage, flock.x[i], flock.y[i])
    end_step(flock, world, record)
    return True


@jit
def begin_step(flock: Flock, record: Record) -> bool:
    """The part of `observe` before visits are counted."""
    record.progress[STEP] += 1
    for i in range(flock.x.size):
        if not math.isfinite(flock.x[i] + flock.y[i] + flock.vx[i] + flock.vy[i]):
            return False
    return keep_state(record.state, record.state_before)


@jit
def end_step(flock: Flock, world: World, record: Record) -> None:
    """The part of `observe` after visits are counted."""
    count(flock, world, record.watch, record.progress[STEP])
    keep_frame(flock, record)
