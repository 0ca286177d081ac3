"""Continued axes: trials along them are links of chains.

Each link begins with the flock with which the link before it ended.

    noise: {linspace: [0, 5, 51], continue: both, hold: 2000}

sweep.spec.continued_checks has the keys that exclude such an axis.
"""

from dataclasses import dataclass

from sweep.spec.axis_keys import CONTINUE, HOLD
from sweep.spec.document import Entry
from sweep.spec.mistakes import Mistakes

UP = "up"
DOWN = "down"
DIRECTION = "direction"
PARENT = "parent"
"""Columns of tables, DIRECTION and PARENT, with the position of a link in its chain."""
WAYS = {"up": (UP,), "down": (DOWN,), "both": (UP, DOWN)}
"""Directions of a chain, one after the other, by the value of `continue`."""


@dataclass(frozen=True)
class Continuation:
    """Links between the trials along an axis.

    `way` is a key of WAYS. Each link takes `hold` steps; None means the `steps` of the
    study.
    """

    way: str
    hold: int | None = None

    @property
    def directions(self) -> tuple[str, ...]:
        """The directions of a chain, one after the other."""
        return WAYS[self.way]


def read_continuation(entry: Entry) -> Continuation | None:
    """Return how an axis is continued; None if it is not."""
    if not isinstance(entry.value, dict):
        return None
    if CONTINUE.name not in entry.value:
        if hold := entry.get(HOLD.name):
            raise hold.error('"hold" is for an axis with "continue"')
        return None
    mistakes = Mistakes()
    hold = entry.get(HOLD.name)
    way = mistakes.read(CONTINUE.content.read, entry.child(CONTINUE.name))
    held = mistakes.read(HOLD.content.read, hold) if hold else None
    mistakes.check()
    assert way
    return Continuation(way, held)
