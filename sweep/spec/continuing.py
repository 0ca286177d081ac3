"""Continued axes, along which trials are links of chains.

Each link begins with the final flock of the link before.

    noise: {linspace: [0, 5, 51], continue: both, hold: 2000}

sweep.spec.continued_checks lists the keys that exclude a continued axis.
"""

from dataclasses import dataclass

from sweep.spec.axis_keys import CONTINUE, HOLD
from sweep.spec.document import Entry
from sweep.spec.mistakes import Mistakes

UP = "up"
DOWN = "down"
DIRECTION = "direction"
PARENT = "parent"
"""Columns of tables, DIRECTION and PARENT, with the position of a link in a chain."""
WAYS = {"up": (UP,), "down": (DOWN,), "both": (UP, DOWN)}
"""Directions of a chain, in order, by the value of `continue`."""


@dataclass(frozen=True)
class Continuation:
    """Direction and number of steps of the links along an axis.

    `way` is a key of WAYS. Each link takes `hold` steps. None means the `steps` of the
    study.
    """

    way: str
    hold: int | None = None

    @property
    def directions(self) -> tuple[str, ...]:
        """The directions of a chain, in order."""
        return WAYS[self.way]


def read_continuation(entry: Entry) -> Continuation | None:
    """Return the continuation of an axis; None without `continue`."""
    if not isinstance(entry.value, dict):
        return None
    if CONTINUE.name not in entry.value:
        if hold := entry.get(HOLD.name):
            raise hold.error('"hold" needs an axis with "continue"')
        return None
    mistakes = Mistakes()
    hold = entry.get(HOLD.name)
    way = mistakes.read(CONTINUE.content.read, entry.child(CONTINUE.name))
    held = mistakes.read(HOLD.content.read, hold) if hold else None
    mistakes.check()
    assert way
    return Continuation(way, held)
