"""Axes that are continued: trials along them are links of chains, each of which begins
where the link before it has ended.

    noise: {linspace: [0, 5, 51], continue: both, hold: 2000}

What they cannot stand beside is in sweep.spec.continued_checks.
"""

from dataclasses import dataclass

from sweep.spec.axis_keys import CONTINUE, HOLD
from sweep.spec.document import Entry
from sweep.spec.mistakes import Mistakes

UP, DOWN = "up", "down"
DIRECTION, PARENT = "direction", "parent"
"""The columns of tables that say where a link stands in its chain."""
WAYS = {"up": (UP,), "down": (DOWN,), "both": (UP, DOWN)}
"""The directions of a chain, one after the other, by what stands under `continue`."""


@dataclass(frozen=True)
class Continuation:
    """How the trials along an axis are linked: `way` is a key of WAYS, and each link
    takes `hold` steps, or those of the study where that is None.
    """

    way: str
    hold: int | None = None

    @property
    def directions(self) -> tuple[str, ...]:
        """The directions of a chain, one after the other."""
        return WAYS[self.way]


def read_continuation(entry: Entry) -> Continuation | None:
    """How an axis is continued; None where it is not."""
    if not isinstance(entry.value, dict):
        return None
    if CONTINUE.name not in entry.value:
        if hold := entry.get(HOLD.name):
            raise hold.error('"hold" is for an axis with "continue"')
        return None
    mistakes, hold = Mistakes(), entry.get(HOLD.name)
    way = mistakes.read(CONTINUE.content.read, entry.child(CONTINUE.name))
    held = mistakes.read(HOLD.content.read, hold) if hold else None
    mistakes.check()
    assert way
    return Continuation(way, held)
