"""The metrics of a run by step. They are thinned where there are too many for a
plot.
"""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

MOST = 4096


class Cursor(NamedTuple):
    """How much of a history a page has been told: the era of the history, and the last
    step.
    """

    era: int = 0
    step: int = -1


class History:
    """The values of the followed metrics. Whenever there are more than MOST steps,
    every second one is dropped.
    """

    def __init__(self) -> None:
        self.era = 0
        self.begin(())

    def begin(self, names: tuple[str, ...]) -> None:
        """Forget everything and follow these metrics."""
        self.era += 1
        self.names = names
        self.every = 1
        self.steps: list[int] = []
        self.rows: list[NDArray[np.float64]] = []

    def add(self, steps: NDArray[np.int64], values: NDArray[np.float64]) -> None:
        """Add `values` (metrics, F) at `steps` (F,)."""
        for step, row in zip(steps.tolist(), values.T, strict=True):
            if step % self.every == 0:
                self.steps.append(step)
                self.rows.append(row)
        while len(self.steps) > MOST:
            self.every *= 2
            kept = [
                place for place, step in enumerate(self.steps) if step % self.every == 0
            ]
            self.steps, self.rows = (
                [self.steps[place] for place in kept],
                [self.rows[place] for place in kept],
            )

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
        steps, rows = self.steps[first:], self.rows[first:]
        if not steps and not anew:
            return None, cursor
        values = {
            name: [_number(row[place]) for row in rows]
            for place, name in enumerate(self.names)
        }
        message = {"type": "metrics", "steps": steps, "values": values, "reset": anew}
        return message, Cursor(self.era, steps[-1] if steps else -1)


def rows(
    values: Mapping[str, NDArray[np.float64]], names: Sequence[str]
) -> NDArray[np.float64]:
    """The values of these metrics, each (F,), as rows (metrics, F)."""
    return np.array([values[name] for name in names])


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
