"""What the layers between a model and its boids share."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.chance import NO_KEY, ChanceKey


class ChanceKeys(NamedTuple):
    """Of the random numbers of a trial's robots: of who is made how, and of what
    happens to them under way.
    """

    made: ChanceKey
    flown: ChanceKey


NO_KEYS = ChanceKeys(NO_KEY, NO_KEY)


class Robots(NamedTuple):
    """The layers of one flight.

    `clock` (1,) counts the steps that have begun. Random numbers of the flight have an
    address that begins with it, so that none depends on those before.
    """

    clock: NDArray[np.int64]
    keys: ChanceKeys


def build_robots(keys: ChanceKeys) -> Robots:
    """The layers at the start of a flight."""
    return Robots(np.zeros(1, np.int64), keys)
