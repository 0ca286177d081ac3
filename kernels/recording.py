"""What a run remembers: snapshots of the flock, running counts, visited pixels."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.coverage import Coverage, mark
from kernels.jit import jit
from kernels.state import Flock, World
from kernels.worlds import Reach, inside_any

COVERED, VISITS, SQUARED_VISITS, ESCAPES, COLLISIONS = 0, 1, 2, 3, 4
N_COUNTS = 5
STEP, FILLED = 0, 1


class Frames(NamedTuple):
    """Up to F snapshots: `bodies` (F, 6, N) in the order of Flock's fields, `counts` (F, 5), `step` (F,).

    Where no metric looks at the bodies, `bodies` has no room for them: (F, 6, 0).
    """

    bodies: NDArray[np.float64]
    counts: NDArray[np.int64]
    step: NDArray[np.int64]


class Record(NamedTuple):
    """What to remember, and how far the run is.

    `progress` (2,) holds the steps done and the frames filled. A frame is kept every `every` steps and at the step
    `last`. `contact` is the Reach with margin 0; `outside` and `inside` (N,) say which boids were outside the world
    and inside an obstacle after the last step; `events` (2,) counts how often either began.
    """

    frames: Frames
    progress: NDArray[np.int64]
    every: int
    last: int
    covering: bool
    coverage: Coverage
    counting: bool
    contact: Reach
    outside: NDArray[np.bool_]
    inside: NDArray[np.bool_]
    events: NDArray[np.int64]


def build_frames(n_frames: int, n: int) -> Frames:
    """Room for `n_frames` snapshots of `n` bodies."""
    return Frames(np.zeros((n_frames, 6, n)), np.zeros((n_frames, N_COUNTS), np.int64), np.zeros(n_frames, np.int64))


@jit
def keep_frame(flock: Flock, record: Record) -> None:
    """Take a snapshot, where the steps done call for one."""
    step = record.progress[STEP]
    if step % record.every != 0 and step != record.last:
        return
    f = record.progress[FILLED]
    bodies = record.frames.bodies
    for i in range(bodies.shape[2]):
        bodies[f, 0, i] = flock.x[i]
        bodies[f, 1, i] = flock.y[i]
        bodies[f, 2, i] = flock.vx[i]
        bodies[f, 3, i] = flock.vy[i]
        bodies[f, 4, i] = flock.previous_vx[i]
        bodies[f, 5, i] = flock.previous_vy[i]
    for k in range(3):
        record.frames.counts[f, k] = record.coverage.sums[k]
    for k in range(2):
        record.frames.counts[f, 3 + k] = record.events[k]
    record.frames.step[f] = step
    record.progress[FILLED] = f + 1


@jit
def observe(flock: Flock, world: World, record: Record) -> bool:
    """Take note of one step done; return whether all positions and velocities are finite numbers."""
    record.progress[STEP] += 1
    for i in range(flock.x.size):
        if not math.isfinite(flock.x[i] + flock.y[i] + flock.vx[i] + flock.vy[i]):
            return False
    if record.covering:
        for i in range(flock.x.size):
            mark(record.coverage, flock.x[i], flock.y[i])
    if record.counting:
        _count_events(flock, world, record)
    keep_frame(flock, record)
    return True


@jit
def _count_events(flock: Flock, world: World, record: Record) -> None:
    """Count boids that left the world, and boids that entered an obstacle, in this step."""
    for i in range(flock.x.size):
        x, y = flock.x[i], flock.y[i]
        outside = x < 0.0 or x > world.width or y < 0.0 or y > world.height
        inside = inside_any(world, record.contact, x, y)
        record.events[0] += int(outside and not record.outside[i])
        record.events[1] += int(inside and not record.inside[i])
        record.outside[i] = outside
        record.inside[i] = inside
