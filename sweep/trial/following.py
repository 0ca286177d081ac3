"""Flocks followed from frame to frame of a trajectory."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.metrics.flocks import labels

Numbers = NDArray[np.int64]


class Followed(NamedTuple):
    """Flocks of N boids in F frames.

    Attributes
    ----------
    flock : array of int, shape (F, N)
        Number of the flock of each boid.
    fissions, fusions : array of int, shape (F,)
        Number of fissions and fusions up to each frame, as counted by the metrics
        `fissions` and `fusions`.
    """

    flock: Numbers
    fissions: Numbers
    fusions: Numbers


def followed(bodies: NDArray[np.float64], reach: float) -> Followed:
    """Return the flocks of a trajectory (F, 4, N): groups connected within `reach`.

    A flock continues as the flock of the next frame that has most of its members, if
    most members of the later flock come from it. Among equally large parts, the part of
    the flock with the smallest index of a boid counts. Any other flock is new and gets
    the next number. So each number has consecutive frames.

    Palla et al. match groups by their overlap too: G. Palla, A.-L. Barabasi, T. Vicsek
    (2007), Quantifying social group evolution, Nature 446, 664.
    """
    frames = len(bodies)
    n = bodies.shape[2]
    flock = np.zeros((frames, n), np.int64)
    events = np.zeros((2, frames), np.int64)
    next_number = 0
    for f in range(frames):
        now = _in_order(labels(bodies[f, 0], bodies[f, 1], reach))
        numbers = np.full(now.max() + 1, -1)
        if f > 0:
            before = _in_order(flock[f - 1])
            shared = _shared(before, now)
            events[:, f] = (shared > 0).sum() - np.array(shared.shape)
            old, new = _going_on(shared)
            first = np.unique(before, return_index=True)[1]
            numbers[new] = flock[f - 1][first[old]]
        is_new = numbers < 0
        numbers[is_new] = next_number + np.arange(is_new.sum())
        next_number += int(is_new.sum())
        flock[f] = numbers[now]
    return Followed(flock, *events.cumsum(axis=1))


def _in_order(label: Numbers) -> Numbers:
    """Return labels (N,) from 0, in the order of the smallest index of a member."""
    _, first, place = np.unique(label, return_index=True, return_inverse=True)
    return np.argsort(np.argsort(first))[place]


def _shared(before: Numbers, now: Numbers) -> Numbers:
    """Return how many boids each previous flock shares with each current flock."""
    rows = before.max() + 1
    columns = now.max() + 1
    counts = np.bincount(before * columns + now, minlength=rows * columns)
    return counts.reshape(rows, columns)


def _going_on(shared: Numbers) -> tuple[Numbers, Numbers]:
    """Return the labels of previous flocks that continue, and their current labels."""
    heir = shared.argmax(axis=1)
    origin = shared.argmax(axis=0)
    old = np.flatnonzero(origin[heir] == np.arange(len(heir)))
    return old, heir[old]
