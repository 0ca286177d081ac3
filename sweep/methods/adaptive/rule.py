"""The rule of adaptive replicates.

A point gets trials until the repeated confidence intervals of the means are narrow. The
intervals of all looks are simultaneous, see `sweep.analysis.sequential`.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sweep.analysis import (
    Counts,
    Declared,
    Floats,
    Width,
    looks,
    nominal_confidence,
)

ALL_NORMAL: Mapping[str, Declared] = MappingProxyType({})


@dataclass(frozen=True)
class Until:
    """A rule that gives a point trials until the confidence intervals are narrow.

    A point with the largest number of trials gets no more trials.

    Attributes
    ----------
    widths : mapping
        Largest half-width of the confidence interval of a mean, by column of the
        trials.
    confidence : float
        Simultaneous confidence of the intervals of all looks and all metrics.
    least : int
        Number of trials of a point at the first look.
    most : int
        Largest number of trials of a point.
    """

    place: ClassVar = ("replicates", "until")
    adds_points: ClassVar = False
    counted: ClassVar = (
        "trials are counted at the maximum; a point stops earlier if its intervals are"
        " narrow"
    )
    where: ClassVar = ""

    widths: Mapping[str, Width]
    confidence: float
    least: int
    most: int

    def most_trials(self, points: int) -> int:
        """Return the largest number of trials of a study with a number of points."""
        return points * self.most

    @property
    def looks(self) -> tuple[int, ...]:
        """Numbers of trials of a point at each look."""
        return looks(self.least, self.most)

    @property
    def nominal(self) -> float:
        """Confidence of the interval of each metric at each look.

        The first call takes about a second.
        """
        missing = (1.0 - self.confidence) / len(self.widths)
        return nominal_confidence(self.looks, 1.0 - missing)

    @property
    def in_words(self) -> str:
        """Condition under which no more trials are added, in words."""
        widths = ", ".join(
            f"of {name} is {width.in_words}" for name, width in self.widths.items()
        )
        return f", until the half-width {widths}"

    def as_json(self) -> dict[str, object]:
        """Return the rule by the keys of a spec."""
        widths = {name: width.as_json() for name, width in self.widths.items()}
        keys = {"half_width": widths, "confidence": self.confidence}
        return keys | {"min": self.least, "max": self.most}


def from_json(record: Mapping[str, Any]) -> Until:
    """Return the rule that `Until.as_json` wrote.

    Up to 0.9 a rule had one `metric`, whose `half_width` was a number.
    """
    widths = record["half_width"]
    if not isinstance(widths, Mapping):
        widths = {record["metric"]: widths}
    return Until(
        {name: _width(width) for name, width in widths.items()},
        record["confidence"],
        record["min"],
        record["max"],
    )


def _width(stored: float | str) -> Width:
    if isinstance(stored, str):
        return Width(float(stored.removesuffix("%")) / 100.0, relative=True)
    return Width(stored)


class SeenMetric(NamedTuple):
    """One metric of P points at a look.

    Attributes
    ----------
    values : array of int
        Number of values of each point, (P,).
    half_width : array
        Half-widths of the confidence intervals of the means, (P,). NaN if unknown, such
        as for fewer than two values.
    allowed : array
        Largest half-widths that the rule allows, (P,), in the same unit.
    """

    values: Counts
    half_width: Floats
    allowed: Floats

    @property
    def narrow(self) -> NDArray[np.bool_]:
        """True for each interval that is narrow enough, (P,)."""
        return np.asarray(self.half_width <= self.allowed)

    @property
    def known(self) -> NDArray[np.bool_]:
        """True for each point with the two values that an interval needs, (P,)."""
        return np.asarray(self.values > 1)


class PointsSeen(NamedTuple):
    """P points at a look.

    Attributes
    ----------
    metrics : mapping of str to SeenMetric
        The metrics of the rule by name.
    further : array of int
        Number of trials of each point after the next round, (P,). The number does not
        change if the point has had its last trial.
    """

    metrics: Mapping[str, SeenMetric]
    further: Counts


def look(
    until: Until,
    nominal: float,
    trials: Counts,
    values: Mapping[str, ArrayLike],
    distributions: Mapping[str, Declared] = ALL_NORMAL,
) -> PointsSeen:
    """Look at P points, and return the number of trials that each point needs.

    No point waits for a metric with fewer than two values: the point might run to
    `most` without any value. The half-width is half of the distance between the bounds
    of the interval before the bounds are cut off at the ends of the support. A bound of
    the support does not show the precision of a mean. The half-width is NaN, and never
    narrow, if all values are equal, see `sweep.analysis.mean_bounds`.

    Parameters
    ----------
    until : Until
        The rule.
    nominal : float
        Confidence of each interval, `until.nominal`.
    trials : array of int
        Number of trials of each point, (P,).
    values : mapping of str to array_like
        Values of each metric, one point after another, (sum of `trials`,). Values that
        are not finite do not count.
    distributions : mapping, optional
        Distribution by metric; "normal" by default.

    Returns
    -------
    PointsSeen
    """
    numbers = np.asarray(until.looks)
    following = numbers[
        np.minimum(np.searchsorted(numbers, trials, side="right"), len(numbers) - 1)
    ]
    metrics = {
        name: _look_at_metric(
            width, nominal, trials, values[name], distribution=distributions.get(name)
        )
        for name, width in until.widths.items()
    }
    wide = [metric.known & ~metric.narrow for metric in metrics.values()]
    is_open = np.logical_or.reduce(wide)
    return PointsSeen(metrics, np.where(is_open, following, trials))


def _look_at_metric(
    width: Width,
    nominal: float,
    trials: Counts,
    values: ArrayLike,
    *,
    distribution: Declared | None,
) -> SeenMetric:
    # Here, because each command reads the section, and pandas takes 0.2 s to import.
    import pandas as pd

    from sweep.analysis import group_bounds

    array = np.asarray(values, np.float64)
    finite = pd.Series(np.where(np.isfinite(array), array, np.nan))
    groups = finite.groupby(np.repeat(np.arange(len(trials)), trials))
    # Not cut: the ends of the support do not show the precision of a mean.
    low, high = group_bounds(groups, nominal, distribution or "normal", cut=False)
    means = np.asarray(groups.mean(), np.float64)
    counts: Counts = np.asarray(groups.count(), np.int64)
    return SeenMetric(counts, (high - low) / 2.0, width.allowed(means))
