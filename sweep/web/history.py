"""The metrics of a run by step. They are thinned where there are too many for a
plot.
"""

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

MOST = 4096


class Cursor(NamedTuple):
    """What a page has been told: of a history its era and the last step; how often a
    run has come to other settings by itself; and the same of each of several runs.
    """

    era: int = 0
    step: int = -1
    entered: int = 0
    each: tuple["Cursor", ...] = ()


class History:
    """The values of the followed metrics. Whenever there are more than MOST steps,
    every second one is dropped. What was followed before keeps its values.
    """

    def __init__(self) -> None:
        self.era = 0
        self.begin(())

    def begin(self, names: tuple[str, ...]) -> None:
        """Forget everything and follow these metrics."""
        self.every = 1
        self.steps: list[int] = []
        self.columns: dict[str, list[float]] = {}
        self.follow(names)

    def follow(self, names: tuple[str, ...]) -> None:
        """Follow these metrics from here on."""
        self.era += 1
        self.names = names
        for name in names:
            self.columns.setdefault(name, [math.nan] * len(self.steps))

    def copied(self) -> "History":
        """A history of its own with the same values."""
        other = History()
        other.era, other.names, other.every = self.era, self.names, self.every
        other.steps = list(self.steps)
        other.columns = {name: list(column) for name, column in self.columns.items()}
        return other

    def add(
        self, steps: NDArray[np.int64], values: Mapping[str, NDArray[np.float64]]
    ) -> None:
        """Add `values`, (F,) of each followed metric, at `steps` (F,). Steps that are
        known stay.
        """
        known = self.steps[-1] if self.steps else -1
        now = {name: values[name].tolist() for name in self.names}
        for place, step in enumerate(steps.tolist()):
            if step > known and step % self.every == 0:
                self.steps.append(step)
                for name, column in self.columns.items():
                    column.append(now[name][place] if name in now else math.nan)
        while len(self.steps) > MOST:
            self.every *= 2
            self._only(
                [
                    place
                    for place, step in enumerate(self.steps)
                    if not step % self.every
                ]
            )

    def cut(self, last: int) -> None:
        """Forget what lies after the step `last`."""
        if self.steps and self.steps[-1] > last:
            self.era += 1
            self._only([i for i, step in enumerate(self.steps) if step <= last])

    def _only(self, places: list[int]) -> None:
        self.steps = [self.steps[place] for place in places]
        self.columns = {
            name: [column[place] for place in places]
            for name, column in self.columns.items()
        }

    def since(self, cursor: Cursor) -> tuple[dict[str, object] | None, Cursor]:
        """The metrics message with everything after `cursor`, None where nothing is
        new, and the next cursor.
        """
        anew = cursor.era != self.era
        after = -1 if anew else cursor.step
        first = next(
            (
                place
                for place in range(len(self.steps), 0, -1)
                if self.steps[place - 1] <= after
            ),
            0,
        )
        steps = self.steps[first:]
        if not steps and not anew:
            return None, cursor
        values = {
            name: [_number(value) for value in self.columns[name][first:]]
            for name in self.names
        }
        message = {"type": "metrics", "steps": steps, "values": values, "reset": anew}
        return message, cursor._replace(era=self.era, step=steps[-1] if steps else -1)


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None
