"""Failures of boids: how many fail, when and how."""

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
"""Tolerance of times, in steps: times that differ by less are equal."""


class Failing(NamedTuple):
    """Failures of N boids.

    Attributes
    ----------
    fails_at : array of int, shape (N,)
        Number of steps done when each boid fails, or NEVER.
    how : int
        Kind of failure of all failed boids: STOP, DRIFT, SILENT or BLIND.
    """

    fails_at: NDArray[np.int64]
    how: int

    @property
    def moves(self) -> bool:
        """Return whether any boid stops or drifts against the model's commands."""
        return self.how in (STOP, DRIFT) and bool((self.fails_at < NEVER).any())

    @property
    def unheard(self) -> bool:
        """Return whether any boid becomes silent or blind."""
        return self.how in (SILENT, BLIND) and bool((self.fails_at < NEVER).any())

    def silent_from(self) -> NDArray[np.int64]:
        """Return the steps (N,) from which no boid perceives a boid, or NEVER.

        Steps count from 0.
        """
        return self._from(SILENT)

    def blind_from(self) -> NDArray[np.int64]:
        """Return the steps (N,) from which a boid perceives no boid, or NEVER.

        Steps count from 0.
        """
        return self._from(BLIND)

    def _from(self, how: int) -> NDArray[np.int64]:
        if self.how == how:
            return self.fails_at
        return never(self.fails_at.size)


def failing(settings: Breakdowns, key: ChanceKey, n: int, dt: float) -> Failing:
    """Draw the boids that fail, and the step of the failure.

    The number of failed boids is the fraction of all boids, rounded. The fraction is
    not a probability per boid, with which the number would vary from trial to trial.
    The boids with the smallest random numbers fail. So boids that fail at a smaller
    fraction also fail at a larger fraction. The first failed step is the first step
    that begins at `failing_time` or later.

    Parameters
    ----------
    settings : Breakdowns
        Fraction of boids that fail, time and kind of the failure.
    key : ChanceKey
        Key of the random numbers.
    n : int
        Number of boids.
    dt : float
        Time of a step.
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
    """Draw a uniform number for each boid, from the key and the index alone."""
    for i in range(drawn.size):
        drawn[i] = chance(key, i, 0, 0, FAILS)
