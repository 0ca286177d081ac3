"""Objectives and constraints of a search.

The module has statistics of a metric over the trials of a candidate, which a search
improves or keeps within bounds.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import nan
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sweep.analysis import Declared
from sweep.methods.search.statistics import STATISTICS, USUAL, StatisticKind

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Statistic:
    """A single number for many values.

    Attributes
    ----------
    kind : str
        Name of an entry of STATISTICS.
    share : float or None
        Fraction of the values, above 0 and at most 1. None for a statistic without a
        fraction.
    """

    kind: str = USUAL
    share: float | None = None

    @property
    def about(self) -> StatisticKind:
        """The entry of STATISTICS of this kind."""
        return STATISTICS[self.kind]

    @property
    def tail(self) -> float | None:
        """The fraction of the values that the statistic rests on.

        None if the statistic rests on all values.
        """
        tail = self.about.tail
        return tail(self.share) if tail and self.share is not None else None

    def of(self, values: Floats, *, maximize: bool) -> float:
        """Return the statistic of all values.

        Parameters
        ----------
        values : array
            Any shape.
        maximize : bool
            Whether larger values are better, so that smaller values are worse.

        Returns
        -------
        float
            NaN for no values, and if a value is NaN.
        """
        return (
            float(self.along(values.reshape(-1), maximize=maximize))
            if values.size
            else np.nan
        )

    def along(self, values: Floats, *, maximize: bool) -> Floats:
        """Return the statistic along the last axis.

        Parameters
        ----------
        values : array
            (..., n), n above zero.
        maximize : bool
            Whether larger values are better, so that smaller values are worse.

        Returns
        -------
        array
            (...), NaN where a value is NaN.
        """
        share = nan if self.share is None else self.share
        statistic = self.about.formula(values, share, maximize)
        return np.where(np.isnan(values).any(axis=-1), np.nan, statistic)

    def named(self, column: str) -> str:
        """Return a column with its statistic in words, such as `CVaR 0.2 of speed`.

        The usual statistic is left out: `speed`.
        """
        return column if self == Statistic() else f"{self} of {column}"

    def __str__(self) -> str:
        label = self.about.label or self.kind
        return label if self.share is None else f"{label} {self.share:g}"


@dataclass(frozen=True)
class Objective:
    """A column of trials whose statistic is to be maximized or minimized.

    `distribution` is the distribution of the metric, which selects the confidence
    interval of a mean. The distribution is not stored, because the metric declares it.
    """

    column: str
    maximize: bool
    statistic: Statistic
    distribution: Declared = "normal"

    def value(self, values: Floats) -> float:
        """Return the statistic of the trials of a candidate.

        `values` has the shape (blocks, scenarios).
        """
        return self.statistic.of(values, maximize=self.maximize)

    def as_json(self) -> dict[str, Any]:
        """Return plain values that `from_json` reads."""
        return {
            "column": self.column,
            "maximize": self.maximize,
            **_plain(self.statistic),
        }

    @classmethod
    def from_json(cls, stored: Mapping[str, Any]) -> "Objective":
        """Return the objective that `as_json` wrote."""
        return cls(
            stored["column"],
            stored["maximize"],
            Statistic(stored["statistic"], stored["share"]),
        )


@dataclass(frozen=True)
class Constraint:
    """A column of trials whose statistic has a bound.

    The statistic may be at most, or at least, `bound`, in the unit of the column.
    """

    column: str
    bound: float
    at_most: bool
    statistic: Statistic

    def violation(self, values: Floats) -> float:
        """Return the distance of the statistic of a candidate beyond the bound.

        The distance is above zero if the constraint is violated. `values` has the shape
        (blocks, scenarios).
        """
        statistic = self.statistic.of(values, maximize=not self.at_most)
        return statistic - self.bound if self.at_most else self.bound - statistic

    def as_json(self) -> dict[str, Any]:
        """Return plain values that `from_json` reads."""
        return {
            "column": self.column,
            "bound": self.bound,
            "at_most": self.at_most,
            **_plain(self.statistic),
        }

    @classmethod
    def from_json(cls, stored: Mapping[str, Any]) -> "Constraint":
        """Return the constraint that `as_json` wrote."""
        statistic = Statistic(stored["statistic"], stored["share"])
        return cls(stored["column"], stored["bound"], stored["at_most"], statistic)


def _plain(statistic: Statistic) -> dict[str, Any]:
    return {"statistic": statistic.kind, "share": statistic.share}
