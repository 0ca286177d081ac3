"""The metrics of a run by step, thinned to a number of steps that a plot can show."""

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

MOST = 4096


class Cursor(NamedTuple):
    """The news that a page already has.

    Attributes
    ----------
    era : int
        Era of the history.
    step : int
        Last step of the history.
    entered : int
        Number of times that a run has reached a change of parameters.
    each : tuple of Cursor
        The cursors of several runs.
    """

    era: int = 0
    step: int = -1
    entered: int = 0
    each: tuple["Cursor", ...] = ()


class History:
    """The values of the followed metrics.

    Beyond MOST steps every second step is dropped. Metrics that were followed before
    keep the values.
    """

    def __init__(self) -> None:
        self.era = 0
        self.begin(())

    def begin(self, names: tuple[str, ...]) -> None:
        """Forget everything and follow the named metrics."""
        self.every = 1
        self.steps: list[int] = []
        self.columns: dict[str, list[float]] = {}
        self.follow(names)

    def follow(self, names: tuple[str, ...]) -> None:
        """Follow the named metrics from here on."""
        self.era += 1
        self.names = names
        for name in names:
            self.columns.setdefault(name, [math.nan] * len(self.steps))

    def copied(self) -> "History":
        """Return an independent history with equal values."""
        other = History()
        other.era = self.era
        other.names = self.names
        other.every = self.every
        other.steps = list(self.steps)
        other.columns = {name: list(column) for name, column in self.columns.items()}
        return other

    def add(
        self, steps: NDArray[np.int64], values: Mapping[str, NDArray[np.float64]]
    ) -> None:
        """Add values of the followed metrics, and keep the values of known steps.

        Parameters
        ----------
        steps : array (F,)
            Steps done.
        values : mapping of str to array (F,)
            Values of each followed metric.
        """
        known = self.steps[-1] if self.steps else -1
        now = {name: values[name].tolist() for name in self.names}
        for index, step in enumerate(steps.tolist()):
            if step > known and step % self.every == 0:
                self.steps.append(step)
                for name, column in self.columns.items():
                    column.append(now[name][index] if name in now else math.nan)
        while len(self.steps) > MOST:
            self.every *= 2
            self._only(
                [i for i, step in enumerate(self.steps) if not step % self.every]
            )

    def cut(self, last: int) -> None:
        """Forget the values after the step `last`."""
        if self.steps and self.steps[-1] > last:
            self.era += 1
            self._only([i for i, step in enumerate(self.steps) if step <= last])

    def _only(self, indices: list[int]) -> None:
        self.steps = [self.steps[index] for index in indices]
        self.columns = {
            name: [column[index] for index in indices]
            for name, column in self.columns.items()
        }

    def since(self, cursor: Cursor) -> tuple[dict[str, object] | None, Cursor]:
        """Return the metrics message after `cursor`, and the next cursor.

        The message is None if there is no new value.
        """
        reset = cursor.era != self.era
        after = -1 if reset else cursor.step
        first = next(
            (
                index
                for index in range(len(self.steps), 0, -1)
                if self.steps[index - 1] <= after
            ),
            0,
        )
        steps = self.steps[first:]
        if not steps and not reset:
            return None, cursor
        values = {
            name: [_number(value) for value in self.columns[name][first:]]
            for name in self.names
        }
        message = {"type": "metrics", "steps": steps, "values": values, "reset": reset}
        return message, cursor._replace(era=self.era, step=steps[-1] if steps else -1)


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None
