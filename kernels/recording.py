"""Records of a run: snapshots of the flock, running counts, visited pixels."""

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
"""Columns of the counts of Frames, which are the sums of Coverage."""
FIRST_EVENT = N_SUMS
"""First column of the events of Watch in the counts of Frames."""
N_COUNTS = FIRST_EVENT + N_EVENTS
STEP, FILLED = 0, 1
"""Elements of the progress of Record: steps done, and frames filled."""
FIRST_STATE = len(Flock._fields)
"""First row of the state of the model in the bodies of Frames."""


class Frames(NamedTuple):
    """Storage for up to F snapshots.

    `bodies` (F, 6 + S, N) holds the fields of Flock in order, and from FIRST_STATE on
    the S state rows of the model. The shape is (F, 6 + S, 0) if no metric reads the
    bodies. `counts` (F, N_COUNTS) holds the sums of Coverage, and from FIRST_EVENT on
    the events of Watch. `step` (F,) holds the number of steps done, and `integrals` (F,
    N_INTEGRALS) the integrals of Watch.
    """

    bodies: NDArray[np.float64]
    counts: NDArray[np.int64]
    step: NDArray[np.int64]
    integrals: Floats


class Record(NamedTuple):
    """Selection of the recorded data, and the progress of the run.

    `progress` (2,) holds the steps done and the frames filled. A frame is kept every
    `every` steps and at the step `last`. With `covering` the run counts visits of
    pixels. `state` and `state_before` are the arrays of the Workspace.
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
    """Return storage for snapshots of a flock.

    Parameters
    ----------
    n_frames : int
        Number of snapshots F.
    n : int
        Number of boids N; 0 where no metric reads the bodies.
    states : int, default 0
        Number of rows S of the state of the model.
    """
    return Frames(
        np.zeros((n_frames, FIRST_STATE + states, n)),
        np.zeros((n_frames, N_COUNTS), np.int64),
        np.zeros(n_frames, np.int64),
        np.zeros((n_frames, N_INTEGRALS)),
    )


NEVER = 2**62
"""Step that no run reaches."""


def silent(record: Record, work: Workspace) -> Record:
    """Return a record of equal types that records almost nothing.

    The new record counts steps, and the events that a model counts itself. The record
    has the state and the goals of `work`. Equal types avoid a second compilation of the
    model.
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
    if f >= bodies.shape[0]:  # a model has observed too many steps
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
    """Copy the state to `state_before`; return whether all values are finite.

    The copy ends at the first value that is not finite.
    """
    for k in range(state.shape[0]):
        for i in range(state.shape[1]):
            if not math.isfinite(state[k, i]):
                return False
            state_before[k, i] = state[k, i]
    return True


@jit
def observe(flock: Flock, world: World, record: Record) -> bool:
    """Record one step done; return whether the flock and its state are finite.

    Parameters
    ----------
    flock : Flock
        Positions and velocities after the step.
    world : World
        World of the flock.
    record : Record
        Record that takes the step.

    Returns
    -------
    bool
        False if a position, a velocity or the state of the model is not finite. Then
        the step records no visits, no events and no frame.
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
    """Do the part of `observe` before visits are counted; return if all is finite."""
    record.progress[STEP] += 1
    for i in range(flock.x.size):
        if not math.isfinite(flock.x[i] + flock.y[i] + flock.vx[i] + flock.vy[i]):
            return False
    return keep_state(record.state, record.state_before)


@jit
def end_step(flock: Flock, world: World, record: Record) -> None:
    """Do the part of `observe` after visits are counted.

    Parameters
    ----------
    flock : Flock
        Positions and velocities after the step.
    world : World
        World of the flock.
    record : Record
        Record that takes the step.
    """
    count(flock, world, record.watch, record.progress[STEP])
    keep_frame(flock, record)
