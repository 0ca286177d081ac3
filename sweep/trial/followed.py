"""Flocks followed from frame to frame of a trajectory: which goes on as which, and what
becomes of their members.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.metrics.flocks import labels

Numbers = NDArray[np.int64]


class Followed(NamedTuple):
    """Of F frames of N boids: `flock` (F, N) has the number of the flock of each boid,
    `fissions` and `fusions` (F,) how often flocks have parted and joined up to there,
    as the metrics of these names count them.
    """

    flock: Numbers
    fissions: Numbers
    fusions: Numbers


def followed(bodies: NDArray[np.float64], reach: float) -> Followed:
    """The flocks of a trajectory (F, 4, N): groups connected within `reach`.

    A flock goes on as the one in the next frame to which most of its members belong, if
    most of that one's members come from it; of equally large parts the one counts whose
    flock has the smallest index of a boid. Any other flock is new, and gets the next
    number: so each number has one stretch of frames. G. Palla, A.-L. Barabasi, T.
    Vicsek (2007), Quantifying social group evolution, Nature 446, 664, match groups by
    their overlap too.
    """
    frames, n = len(bodies), bodies.shape[2]
    flock = np.zeros((frames, n), np.int64)
    events = np.zeros((2, frames), np.int64)
    next_number = 0
    for f in range(frames):
        found = _in_order(labels(bodies[f, 0], bodies[f, 1], reach))
        numbers = np.full(found.max() + 1, -1)
        if f > 0:
            before = _in_order(flock[f - 1])
            shared = _shared(before, found)
            events[:, f] = (shared > 0).sum() - np.array(shared.shape)
            old, new = _going_on(shared)
            first = np.unique(before, return_index=True)[1]
            numbers[new] = flock[f - 1][first[old]]
        is_new = numbers < 0
        numbers[is_new] = next_number + np.arange(is_new.sum())
        next_number += int(is_new.sum())
        flock[f] = numbers[found]
    return Followed(flock, *events.cumsum(axis=1))


def _in_order(label: Numbers) -> Numbers:
    """Labels (N,) from 0 on, in the order of the smallest index of a member."""
    _, first, place = np.unique(label, return_index=True, return_inverse=True)
    return np.argsort(np.argsort(first))[place]


def _shared(before: Numbers, now: Numbers) -> Numbers:
    """How many boids each flock of before shares with each of now."""
    shape = before.max() + 1, now.max() + 1
    return np.bincount(before * shape[1] + now, minlength=shape[0] * shape[1]).reshape(
        shape
    )


def _going_on(shared: Numbers) -> tuple[Numbers, Numbers]:
    """The places of the flocks of before that go on, and of those as which they do."""
    heir, origin = shared.argmax(axis=1), shared.argmax(axis=0)
    old = np.flatnonzero(origin[heir] == np.arange(len(heir)))
    return old, heir[old]
