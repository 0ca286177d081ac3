"""What a search asks for: statistics of a metric over the trials of a candidate, made
better or kept within bounds.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import nan
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sweep.analysis.mean_bounds import Declared
from sweep.spec.statistics import STATISTICS, USUAL, StatisticKind

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Statistic:
    """One number for many values: `kind` names an entry of STATISTICS, and `share` is
    its share, above 0 and at most 1, None where it takes none.
    """

    kind: str = USUAL
    share: float | None = None

    @property
    def about(self) -> StatisticKind:
        """What is known of statistics of this kind."""
        return STATISTICS[self.kind]

    @property
    def tail(self) -> float | None:
        """The part of the values that it rests on, None where that is all of them."""
        tail = self.about.tail
        return tail(self.share) if tail and self.share is not None else None

    def of(self, values: Floats, *, maximize: bool) -> float:
        """The statistic of all of `values`, any shape; NaN for none, and where one is
        NaN.

        `maximize` says which values are the worse ones: the smaller, else the larger.
        """
        return (
            float(self.along(values.reshape(-1), maximize=maximize))
            if values.size
            else np.nan
        )

    def along(self, values: Floats, *, maximize: bool) -> Floats:
        """The statistic along the last axis of `values` (..., n), n above zero, as `of`
        has it; shape (...).
        """
        share = nan if self.share is None else self.share
        found = self.about.formula(values, share, maximize)
        return np.where(np.isnan(values).any(axis=-1), np.nan, found)

    def named(self, column: str) -> str:
        """A column with its statistic in words: `CVaR 0.2 of speed`, and `speed` alone
        for the usual statistic.
        """
        return column if self == Statistic() else f"{self} of {column}"

    def __str__(self) -> str:
        words = self.about.words or self.kind
        return words if self.share is None else f"{words} {self.share:g}"


@dataclass(frozen=True)
class Objective:
    """A column of trials whose statistic is to be as large, or as small, as can be.

    `distribution` is that of its metric. It decides which interval a mean has, and
    where it ends; it is not stored, as the metric says it.
    """

    column: str
    maximize: bool
    statistic: Statistic
    distribution: Declared = "normal"

    def value(self, values: Floats) -> float:
        """The statistic of the trials of a candidate: `values` (blocks, scenarios)."""
        return self.statistic.of(values, maximize=self.maximize)

    def as_json(self) -> dict[str, Any]:
        """Plain values that `from_json` reads."""
        return {
            "column": self.column,
            "maximize": self.maximize,
            **_plain(self.statistic),
        }

    @classmethod
    def from_json(cls, stored: Mapping[str, Any]) -> "Objective":
        """The objective that `as_json` wrote."""
        return cls(
            stored["column"],
            stored["maximize"],
            Statistic(stored["statistic"], stored["share"]),
        )


@dataclass(frozen=True)
class Constraint:
    """A column of trials whose statistic may be at most, or at least, `bound`, in the
    unit of the column.
    """

    column: str
    bound: float
    at_most: bool
    statistic: Statistic

    def violation(self, values: Floats) -> float:
        """How far the statistic of `values` (blocks, scenarios) lies beyond the bound:
        above zero where violated.
        """
        found = self.statistic.of(values, maximize=not self.at_most)
        return found - self.bound if self.at_most else self.bound - found

    def as_json(self) -> dict[str, Any]:
        """Plain values that `from_json` reads."""
        return {
            "column": self.column,
            "bound": self.bound,
            "at_most": self.at_most,
            **_plain(self.statistic),
        }

    @classmethod
    def from_json(cls, stored: Mapping[str, Any]) -> "Constraint":
        """The constraint that `as_json` wrote."""
        statistic = Statistic(stored["statistic"], stored["share"])
        return cls(stored["column"], stored["bound"], stored["at_most"], statistic)


def _plain(statistic: Statistic) -> dict[str, Any]:
    return {"statistic": statistic.kind, "share": statistic.share}
