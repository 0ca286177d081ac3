"""What each thread knows of the others, with which it advances one flock."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.coverage import N_SUMS
from kernels.events import N_EVENTS
from kernels.jit import jit
from kernels.recording import Record
from kernels.state import LINE

LINE_OF_NUMBERS = LINE // 8
ARRIVED, TURN, LOST = (LINE_OF_NUMBERS * k for k in range(3))
"""Places of the gate, each in a line of the cache that nobody else writes."""


class Team(NamedTuple):
    """One of `size` threads: it has the boids from `first` to before `last`.

    The rest is common to all. `gate` (3 lines,) says how many have arrived at the
    barrier, how often all of them had, and whether a thread is lost. `going` (1,) says
    whether all numbers are finite. `events` (size, >= N_EVENTS) has what each thread
    but the first has counted since the last step was observed, and `sums` (size, >= 3)
    the sums of Coverage over its rows.
    """

    rank: int
    size: int
    first: int
    last: int
    gate: NDArray[np.int64]
    going: NDArray[np.bool_]
    events: NDArray[np.int64]
    sums: NDArray[np.int64]


def build_teams(size: int, n: int) -> list[Team]:
    """`size` threads that share `n` boids, each about as many."""
    gate = np.zeros(3 * LINE_OF_NUMBERS, np.int64)
    going = np.ones(1, np.bool_)
    events, sums = (
        np.zeros((size, -(-count // LINE_OF_NUMBERS) * LINE_OF_NUMBERS), np.int64)
        for count in (N_EVENTS, N_SUMS)
    )
    return [
        Team(k, size, n * k // size, n * (k + 1) // size, gate, going, events, sums)
        for k in range(size)
    ]


@jit
def gather(record: Record, team: Team) -> None:
    """Add to the events and the sums of visits what the other threads have counted."""
    for rank in range(1, team.size):
        for k in range(N_EVENTS):
            record.watch.events[k] += team.events[rank, k]
            team.events[rank, k] = 0
        for k in range(N_SUMS):
            record.coverage.sums[k] += team.sums[rank, k]
            team.sums[rank, k] = 0
