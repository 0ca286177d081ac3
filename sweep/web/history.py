"""The metrics of a run by step, thinned to a number of steps that a plot can show."""

import math
from bisect import bisect_left, bisect_right
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
    serial : int
        Number of values that the history has got in all.
    entered : int
        Number of times that a run has reached a change of parameters.
    each : tuple of Cursor
        The cursors of several runs.
    """

    era: int = 0
    serial: int = 0
    entered: int = 0
    each: tuple["Cursor", ...] = ()


class StepValues(NamedTuple):
    """Values of metrics at a step.

    Attributes
    ----------
    step : int
        Steps done.
    serial : int
        Number of the row in the order of arrival, from 1.
    values : dict of str to float
        Values by metric, of the metrics that were measured at the step.
    """

    step: int
    serial: int
    values: dict[str, float]


class History:
    """The values of the followed metrics, at the steps that were measured.

    Rows are at least `every` steps apart, except the latest row. Beyond MOST rows
    `every` doubles, and rows between are dropped. Metrics that were followed before
    keep the values.
    """

    def __init__(self) -> None:
        self.era = self.serial = 0
        self.begin(())

    def begin(self, names: tuple[str, ...]) -> None:
        """Forget everything and follow the named metrics."""
        self.every = 1
        self.rows: list[StepValues] = []
        self.latest: StepValues | None = None
        self.follow(names)

    def follow(self, names: tuple[str, ...]) -> None:
        """Follow the named metrics from here on."""
        self.era += 1
        self.names = names

    def copied(self) -> "History":
        """Return an independent history with equal values."""
        other = History()
        other.era = self.era
        other.serial = self.serial
        other.names = self.names
        other.every = self.every
        other.rows = list(self.rows)
        other.latest = self.latest
        return other

    def add(
        self, steps: NDArray[np.int64], values: Mapping[str, NDArray[np.float64]]
    ) -> None:
        """Add values of the followed metrics, and keep known values.

        Parameters
        ----------
        steps : array (F,)
            Steps done, in any order.
        values : mapping of str to array (F,)
            Values of each followed metric.
        """
        columns = [values[name].tolist() for name in self.names]
        for index, step in enumerate(steps.tolist()):
            measured = zip(self.names, columns, strict=True)
            self._add(step, {name: column[index] for name, column in measured})

    def _add(self, step: int, values: dict[str, float]) -> None:
        place = bisect_left(self.rows, step, key=_step)
        earlier = self._at(step)
        if earlier and values.keys() <= earlier.values.keys():
            return
        self.serial += 1
        row = StepValues(
            step, self.serial, values | (earlier.values if earlier else {})
        )
        if place < len(self.rows) and self.rows[place].step == step:
            self.rows[place] = row
            return
        self.latest = row
        beside = self.rows[max(0, place - 1) : place + 1]
        if all(abs(other.step - step) >= self.every for other in beside):
            self.rows.insert(place, row)
        while len(self.rows) > MOST:
            self._thin()

    def _thin(self) -> None:
        """Keep rows that are twice as far apart."""
        self.every *= 2
        rows: list[StepValues] = []
        for row in self.rows:
            if not rows or row.step - rows[-1].step >= self.every:
                rows.append(row)
        self.rows = rows

    def knows(self, step: int) -> bool:
        """Return whether all followed metrics were measured at a step."""
        row = self._at(step)
        return row is not None and row.values.keys() >= {*self.names}

    def _at(self, step: int) -> StepValues | None:
        place = bisect_left(self.rows, step, key=_step)
        rows = self.rows[place : place + 1] + ([self.latest] if self.latest else [])
        return next((row for row in rows if row.step == step), None)

    def cut(self, last: int) -> None:
        """Forget the values after the step `last`."""
        if self.latest and self.latest.step > last:
            self.latest = None
            self.era += 1
        if self.rows and self.rows[-1].step > last:
            self.era += 1
            self.rows = self.rows[: bisect_right(self.rows, last, key=_step)]

    def since(self, cursor: Cursor) -> tuple[dict[str, object] | None, Cursor]:
        """Return the metrics message after `cursor`, and the next cursor.

        The message is None if there is no new value.
        """
        reset = cursor.era != self.era
        if not reset and cursor.serial == self.serial:
            return None, cursor
        latest = {self.latest.step: self.latest} if self.latest else {}
        by_step = latest | {row.step: row for row in self.rows}
        rows = [
            row
            for _, row in sorted(by_step.items())
            if reset or row.serial > cursor.serial
        ]
        message = {
            "type": "metrics",
            "steps": [row.step for row in rows],
            "values": {
                name: [_number(row.values.get(name, math.nan)) for row in rows]
                for name in self.names
            },
            "reset": reset,
        }
        return message, cursor._replace(era=self.era, serial=self.serial)


def _step(row: StepValues) -> int:
    return row.step


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None
