"""The number of frames of each run that fit into a supplement.

Sizes are upper bounds: frames are compressed, and only a finished run shows how far.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

from sweep.design import Job
from sweep.errors import ChoiceError
from sweep.text import so_many

MOST_BYTES = 16 * 2**20
"""Maximum size of a supplement in bytes, so that the page can be mailed."""
FEWEST_FRAMES = 100
"""Minimum number of frames of a longer run; too little room is an error."""
HEAD_BYTES = 35
BOID_BYTES = 5
NUMBERS_BYTES = 32
"""Size of the step and the metric of a frame, as JSON."""
WORDS_BYTES = 600
"""Maximum size of the texts of a run."""


class RunLength(NamedTuple):
    """The length of a run, which decides the size of the run in a page."""

    boids: int
    steps: int

    @classmethod
    def of(cls, job: Job) -> "RunLength":
        """Return the length of the run of a job."""
        return cls(int(job.settings["n"]), int(job.settings["steps"]))

    @property
    def frame_bytes(self) -> int:
        """Size of a frame in the page before compression; 4 bytes represent 3."""
        frame = HEAD_BYTES + BOID_BYTES * self.boids
        return math.ceil(frame * 4 / 3) + NUMBERS_BYTES

    def frames(self, most: int) -> int:
        """Return the number of frames, if at most `most` are allowed."""
        return min(most, self.steps + 1)

    def every(self, most: int) -> int:
        """Return the number of steps between two frames, if at most `most` are allowed.

        The first and the last frame are included.
        """
        return max(1, math.ceil(self.steps / (most - 1)))


def most_frames(runs: Sequence[RunLength], limit: int, room: int) -> int:
    """Return the largest number of frames that each run of a page may have.

    Parameters
    ----------
    runs : sequence of RunLength
    limit : int
        Upper limit of the frames of each run.
    room : int
        Size of all runs together in bytes.

    Raises
    ------
    ChoiceError
        If the room is too small for FEWEST_FRAMES frames per run, or for `limit` frames
        if `limit` is smaller.
    """
    low = 1
    high = limit
    while low < high:
        middle = (low + high + 1) // 2
        low, high = (middle, high) if _size(runs, middle) <= room else (low, middle - 1)
    fewest = min(FEWEST_FRAMES, limit)
    if low < fewest and _size(runs, fewest) > room:
        least = _size(runs, fewest)
        raise ChoiceError(
            f"{so_many(len(runs), 'run')} with {fewest} frames each take up to"
            f" {least / 2**20:.1f} MiB; the page has room for {room / 2**20:.1f} MiB;"
            " select fewer points with --where, or fewer trials with --trials"
        )
    return low


def _size(runs: Sequence[RunLength], most: int) -> int:
    return sum(run.frames(most) * run.frame_bytes + WORDS_BYTES for run in runs)
