"""What a search asks for: statistics of a metric over the trials of a candidate, made
better or kept within bounds.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Statistic:
    """One number for many values: "mean", "worst", "quantile" or "cvar".

    `share` is the probability of a quantile, whichever direction is better, or the part
    of the values, from the worst on, that a CVaR averages: above 0 and at most 1. The
    others have none.
    """

    kind: str
    share: float | None = None

    def of(self, values: Floats, *, maximize: bool) -> float:
        """The statistic of all of `values`, any shape; NaN for none, and where one is
        NaN.

        `maximize` says which values are the worse ones: the smaller, else the larger. A
        quantile is interpolated linearly, as numpy does it. A CVaR weighs the last of
        the worst values by the fraction of it that belongs to the share (Rockafellar
        and Uryasev 2000, Journal of Risk 2, 21-41).
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
        if self.kind == "mean":
            return np.asarray(values.mean(axis=-1))
        if self.kind == "worst":
            return np.asarray(values.min(axis=-1) if maximize else values.max(axis=-1))
        assert self.share is not None
        if self.kind == "quantile":
            return np.asarray(np.quantile(values, self.share, axis=-1))
        ordered = np.sort(values, axis=-1) if maximize else -np.sort(-values, axis=-1)
        # Sorting puts NaN last, where it may have no weight.
        return np.where(
            np.isnan(values).any(axis=-1), np.nan, _mean_of_first(ordered, self.share)
        )

    def __str__(self) -> str:
        return (
            self.kind
            if self.share is None
            else f"{'CVaR' if self.kind == 'cvar' else self.kind} {self.share:g}"
        )


@dataclass(frozen=True)
class Objective:
    """A column of trials whose statistic is to be as large, or as small, as can be."""

    column: str
    maximize: bool
    statistic: Statistic

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


def _mean_of_first(ordered: Floats, share: float) -> Floats:
    """The mean of the first `share` of `ordered` (..., n), the last of them weighed by
    its fraction.
    """
    whole = share * ordered.shape[-1]
    weights = np.clip(whole - np.arange(ordered.shape[-1]), 0.0, 1.0)
    return np.asarray(ordered @ weights / whole)


def _plain(statistic: Statistic) -> dict[str, Any]:
    return {"statistic": statistic.kind, "share": statistic.share}
