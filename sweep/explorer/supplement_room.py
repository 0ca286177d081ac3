"""How many frames of each run a supplement has room for."""

import math
from collections.abc import Sequence
from typing import NamedTuple

from sweep.design.jobs import Job
from sweep.errors import ChoiceError
from sweep.text import so_many

MOST_BYTES = 16 * 2**20
"""The most bytes of a supplement. Such a page can still be mailed, and opens at
once.
"""
FEWEST_FRAMES = 100
"""If the page has no room for so many frames of a longer run, it is refused."""
HEAD_BYTES, BOID_BYTES = 35, 5
NUMBERS_BYTES = 32
"""Of a frame: its step and its value of the metric, as JSON."""
WORDS_BYTES = 600
"""Of a run: what is said of it, at most."""


class RunLength(NamedTuple):
    """How long a run is, as far as its size in a page goes."""

    boids: int
    steps: int

    @classmethod
    def of(cls, job: Job) -> "RunLength":
        """That of the run of `job`."""
        return cls(int(job.settings["n"]), int(job.settings["steps"]))

    @property
    def frame_bytes(self) -> int:
        """Of one frame in the page, of which four stand for three."""
        frame = HEAD_BYTES + BOID_BYTES * self.boids
        return math.ceil(frame * 4 / 3) + NUMBERS_BYTES

    def frames(self, most: int) -> int:
        """How many frames there are, if there are at most so many."""
        return min(most, self.steps + 1)

    def every(self, most: int) -> int:
        """Steps between two of at most so many frames, the first and the last among
        them.
        """
        return max(1, math.ceil(self.steps / (most - 1)))


def most_frames(runs: Sequence[RunLength], wanted: int, room: int) -> int:
    """The most frames, up to `wanted`, that each of these runs may have in `room`
    bytes. Raises ChoiceError where that is too few of them to show a run.
    """
    low, high = 1, wanted
    while low < high:
        middle = (low + high + 1) // 2
        low, high = (middle, high) if _size(runs, middle) <= room else (low, middle - 1)
    fewest = min(FEWEST_FRAMES, wanted)
    if low < fewest and _size(runs, fewest) > room:
        least = _size(runs, fewest)
        raise ChoiceError(
            f"{so_many(len(runs), 'run')} with {fewest} frames each take"
            f" {least / 2**20:.1f} MiB, and the page has room for {room / 2**20:.1f};"
            " choose fewer points with --where, or one of their trials with --trials"
        )
    return low


def _size(runs: Sequence[RunLength], most: int) -> int:
    return sum(run.frames(most) * run.frame_bytes + WORDS_BYTES for run in runs)
