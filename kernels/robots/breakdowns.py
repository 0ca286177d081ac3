"""Which boids fail, when and how."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.chance import ChanceKey, chance
from kernels.jit import jit
from kernels.robots.purposes import FAILS
from kernels.robots.senses import NEVER, never
from kernels.settings import FAILURES, Breakdowns
from kernels.state import Floats

STOP, DRIFT, SILENT, BLIND = range(len(FAILURES))
CLOSE = 1e-9
"""Times that differ by less, as parts of a step, are the same."""


class Failing(NamedTuple):
    """`fails_at` (N,) is for each boid the number of steps done when it fails, or
    NEVER, and `how` what all that fail do.
    """

    fails_at: NDArray[np.int64]
    how: int

    @property
    def moves(self) -> bool:
        """Whether some boid moves otherwise than its model wants."""
        return self.how in (STOP, DRIFT) and bool((self.fails_at < NEVER).any())

    @property
    def unheard(self) -> bool:
        """Whether some boid hears of nobody, or nobody of it."""
        return self.how in (SILENT, BLIND) and bool((self.fails_at < NEVER).any())

    def silent_from(self) -> NDArray[np.int64]:
        """The steps (N,), counted from 0, from which nobody sees a boid, or NEVER."""
        return self._from(SILENT)

    def blind_from(self) -> NDArray[np.int64]:
        """The steps (N,), counted from 0, from which a boid sees nobody, or NEVER."""
        return self._from(BLIND)

    def _from(self, how: int) -> NDArray[np.int64]:
        if self.how == how:
            return self.fails_at
        return never(self.fails_at.size)


def failing(settings: Breakdowns, key: ChanceKey, n: int, dt: float) -> Failing:
    """Which of `n` boids fail, and in which step of length `dt`.

    So many boids fail as the share of all says, rounded, and not each with a
    probability: then the number varies from trial to trial only if a study says so. It
    is the boids with the least random numbers, so that those who fail at a smaller
    share do so at a larger one. Their first failed step is the first one that begins at
    `failing_time` or later.
    """
    count = math.floor(settings.failing_share * n + 0.5)
    fails_at = never(n)
    steps = settings.failing_time / dt - CLOSE
    if count and steps < NEVER:
        drawn = np.zeros(n)
        _draw(key, drawn)
        fails_at[np.argsort(drawn, kind="stable")[:count]] = math.ceil(steps)
    return Failing(fails_at, settings.failing_how)


@jit
def _draw(key: ChanceKey, drawn: Floats) -> None:
    """A uniform number for each boid, which depends on nothing but its index."""
    for i in range(drawn.size):
        drawn[i] = chance(key, i, 0, 0, FAILS)
