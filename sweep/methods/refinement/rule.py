"""A grid that becomes finer where the mean of a metric crosses a level.

A grid of points is divided into cells, whose corners are points. Each look decides on
which side of the level the mean of each point is, by a confidence interval that is
simultaneous for all looks (`sweep.analysis.sequential`). A point whose interval
includes the level gets more trials.

A cell with points on the two sides is halved along each axis. A cell with points on one
side, and a point that is not known after its last trial, is also halved. A cell whose
points are on one side is not divided, whatever happens within: the first grid must be
as fine as the structures of interest. A cell without a known point is not divided
either: chance alone would decide more points there.

So trials gather at the boundary. In a plane whose cells are a fraction h of its sides,
the rule adds about 1 / h points, not 1 / h^2.

A point is a tuple of integers, `Place`: the number of the group, and the position on
each axis, counted in the finest possible steps. Points of different groups never share
a cell. Cells follow from the present points: a cell is divided if all corners of the
parts are present. So cells can be computed again from stored points.
"""

import math
from bisect import bisect_right
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise, product
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sweep.analysis import Declared, looks, nominal_confidence

Floats = NDArray[np.float64]
Counts = NDArray[np.int64]
Place = tuple[int, ...]

ROUNDING = 1e-9
DIGITS = 12
"""Significant digits of values between others, as in a grid."""
MOST_HALVINGS = 20

STEEPEST = "steepest"
"""The value of `at` for the position at which a mean changes most, without a level."""
BELOW = -1
"""The side of a mean below the level."""
UNKNOWN = 0
"""The side of a mean whose interval includes the level, or with fewer than 2 values."""
ABOVE = 1
"""The side of a mean above the level."""


@dataclass(frozen=True)
class RefinedAxis:
    """An axis that is refined by halving.

    Attributes
    ----------
    values : tuple of float
        The values of the spec, ascending.
    halvings : int
        Number of times that the steps between the values may be halved.
    geometric : bool, default False
        Halve at equal ratios, not at equal differences.
    integer : bool, default False
        Round the halves to integers.
    """

    values: tuple[float, ...]
    halvings: int
    geometric: bool = False
    integer: bool = False

    @classmethod
    def until(
        cls, values: Sequence[float], until: float, *, geometric: bool, integer: bool
    ) -> "RefinedAxis":
        """Return the axis whose widest step can be halved down to a fraction.

        Parameters
        ----------
        values : sequence of float
            The values of the spec, ascending.
        until : float
            The finest step, as a fraction of the range of the values.
        geometric, integer : bool
            As the attributes.

        Returns
        -------
        RefinedAxis
        """
        at = np.log(values) if geometric else np.asarray(values, np.float64)
        widest = float(np.diff(at).max() / (at[-1] - at[0]))
        halvings = max(0, math.ceil(math.log2(widest / until) - ROUNDING))
        return cls(tuple(values), min(halvings, MOST_HALVINGS), geometric, integer)

    @property
    def step(self) -> int:
        """The number of positions from a value of the spec to the next value."""
        return 1 << self.halvings

    @property
    def last(self) -> int:
        """The last position."""
        return (len(self.values) - 1) * self.step

    def at(self, place: int) -> float:
        """Return the value at a position.

        >>> RefinedAxis((0.0, 1.0), halvings=2).at(3)
        0.75
        >>> RefinedAxis((1.0, 4.0), halvings=1, geometric=True).at(1)
        2.0
        """
        number, rest = divmod(place, self.step)
        if not rest:
            return self.values[number]
        low, high = self.values[number : number + 2]
        part = rest / self.step
        between = (
            low * (high / low) ** part if self.geometric else low + (high - low) * part
        )
        return float(round(between)) if self.integer else float(f"{between:.{DIGITS}g}")

    def place(self, value: float) -> int | None:
        """Return the position of a value; None if the value has no position."""
        number = bisect_right(self.values, value) - 1
        if number < 0 or value > self.values[-1]:
            return None
        low = number * self.step
        high = min(low + self.step, self.last)
        while high - low > 1:
            middle = (low + high) // 2
            low, high = (middle, high) if self.at(middle) <= value else (low, middle)
        return next((at for at in (low, high) if self.at(at) == value), None)

    def share(self, low: int, high: int) -> float:
        """Return the distance of two positions, as a fraction of the range.

        Parameters
        ----------
        low, high : int
            The two positions.

        Returns
        -------
        float
        """
        ends = (self.at(low), self.at(high), self.values[0], self.values[-1])
        first, last, least, most = np.log(ends) if self.geometric else ends
        return float((last - first) / (most - least))

    def middle(self, low: int, high: int, until: float) -> int | None:
        """Return the position half-way between two positions.

        Parameters
        ----------
        low, high : int
            The two positions.
        until : float
            The finest step, as a fraction of the range.

        Returns
        -------
        int or None
            None if the two positions are close enough, or no value is between their
            values.
        """
        place = (low + high) // 2
        if high - low < 2 or self.share(low, high) <= until * (1.0 + ROUNDING):
            return None
        return place if self.at(low) < self.at(place) < self.at(high) else None


@dataclass(frozen=True)
class Refinement:
    """The rule of a refined study, see `sweep.spec.section.GrowthRule`.

    Attributes
    ----------
    metric : str
        Column of the trials.
    at : float or str
        The level that the mean crosses, or STEEPEST for the position at which the mean
        changes most.
    scales : mapping
        The refined axes by name.
    until : float
        The largest size of a cell, as a fraction of the range of each axis. Larger
        cells are halved.
    least, most : int
        Fewest and most trials of a point.
    budget : int
        Most trials of all points together.
    confidence : float
        Simultaneous confidence of the intervals of all looks at all points along one
        axis, and so of a boundary between these points.
    """

    place: ClassVar = ("refine",)
    """The key of a spec that writes the rule."""
    adds_points: ClassVar = True

    metric: str
    at: float | str
    scales: Mapping[str, RefinedAxis]
    until: float
    least: int
    most: int
    budget: int
    confidence: float

    def most_trials(self, _points: int) -> int:
        """Return the most trials of a study, whatever the number of points at first."""
        return self.budget

    @property
    def counted(self) -> str:
        """The trials of a spec that are counted, in words."""
        return (
            "the first trials are counted; the rule adds trials where the mean of"
            f" {self.metric} {self.where}"
        )

    @property
    def looks(self) -> tuple[int, ...]:
        """The numbers of trials at each look at a point."""
        return looks(self.least, self.most)

    @property
    def nominal(self) -> float:
        """The confidence of the interval of a point at each look.

        All points along one axis share the probability of error (Bonferroni): points of
        the grid, and two for each halving. A point can err on one side only, so its
        part of the probability doubles. The first call takes about a second.
        """
        missing = self._share * (1.0 - self.confidence)
        return nominal_confidence(self.looks, 1.0 - missing)

    @property
    def _share(self) -> float:
        """The fraction of the probability of error that a point has.

        With STEEPEST a point can err on either side, and all points of the finest grid
        may get trials.
        """
        scales = self.scales.values()
        if self.steepest:
            return 1.0 / max(scale.last + 1 for scale in scales)
        points = max(len(scale.values) + 2 * scale.halvings for scale in scales)
        return min(1.0, 2.0 / points)

    @property
    def steepest(self) -> bool:
        """True if the boundary is the position at which the mean changes most."""
        return self.at == STEEPEST

    @property
    def level(self) -> float:
        """The level that the mean crosses.

        With STEEPEST the level is NaN, and so no mean is above or below.
        """
        return math.nan if isinstance(self.at, str) else self.at

    @property
    def where(self) -> str:
        """The behaviour of the mean at the boundary, in words."""
        return "changes most" if self.steepest else f"crosses {self.level:g}"

    @property
    def in_words(self) -> str:
        """The condition on which cells are halved, in words."""
        halved = max(scale.halvings for scale in self.scales.values())
        return (
            f"; cells are halved up to {halved} times where the mean of {self.metric}"
            f" {self.where}"
        )

    def as_json(self) -> dict[str, object]:
        """Return the rule by the keys of a spec, with its scales."""
        scales = {
            name: {
                "values": scale.values,
                "halvings": scale.halvings,
                "geometric": scale.geometric,
                "whole": scale.integer,
            }
            for name, scale in self.scales.items()
        }
        return {
            "metric": self.metric,
            "at": self.at,
            "until": self.until,
            "min": self.least,
            "max": self.most,
            "budget": self.budget,
            "confidence": self.confidence,
            "scales": scales,
        }


def from_json(record: Mapping[str, Any]) -> Refinement:
    """Return the rule that `Refinement.as_json` has written."""
    return Refinement(
        metric=record["metric"],
        at=record["at"],
        scales={
            name: RefinedAxis(
                values=tuple(scale["values"]),
                halvings=scale["halvings"],
                geometric=scale["geometric"],
                integer=scale["whole"],
            )
            for name, scale in record["scales"].items()
        },
        until=record["until"],
        least=record["min"],
        most=record["max"],
        budget=record["budget"],
        confidence=record["confidence"],
    )


class Cell(NamedTuple):
    """A cell of the grid, by the lowest and the highest corner on all axes."""

    low: Place
    high: Place

    @property
    def corners(self) -> list[Place]:
        """All corners of the cell, without repetition."""
        pairs = zip(self.low, self.high, strict=True)
        return [*product(*(dict.fromkeys(pair) for pair in pairs))]

    def parts(self, rule: Refinement) -> "list[Cell]":
        """Return the parts of the cell, halved along all axes on which it is wide.

        Empty if the cell is as small as the rule allows.
        """
        edges = [[(self.low[0], self.low[0])]]
        halved = False
        axes = zip(rule.scales.values(), self.low[1:], self.high[1:], strict=True)
        for scale, low, high in axes:
            middle = scale.middle(low, high, rule.until)
            halved |= middle is not None
            edges.append(
                [(low, high)] if middle is None else [(low, middle), (middle, high)]
            )
        if not halved:
            return []
        return [Cell(*zip(*part, strict=True)) for part in product(*edges)]

    def shares(self, rule: Refinement) -> list[float]:
        """Return the width of the cell, as a fraction of each axis."""
        axes = zip(rule.scales.values(), self.low[1:], self.high[1:], strict=True)
        return [scale.share(low, high) for scale, low, high in axes]


def first_cells(rule: Refinement, groups: int) -> Iterator[Cell]:
    """Yield the cells of the grid of the spec, group after group."""
    scales = rule.scales.values()
    steps = [range(0, scale.last, scale.step) for scale in scales]
    for group in range(groups):
        for low in product(*steps):
            high = (at + scale.step for at, scale in zip(low, scales, strict=True))
            yield Cell((group, *low), (group, *high))


def leaves(rule: Refinement, groups: int, present: Collection[Place]) -> list[Cell]:
    """Return the cells that are not divided further, in order.

    Parameters
    ----------
    rule : Refinement
    groups : int
        Number of groups of points.
    present : collection of Place
        Positions of all points. A cell with a missing corner is left out.

    Returns
    -------
    list of Cell
    """
    undivided = list[Cell]()
    waiting = [*first_cells(rule, groups)][::-1]
    while waiting:
        cell = waiting.pop()
        parts = cell.parts(rule)
        if parts and _all_present(parts, present):
            waiting += parts[::-1]
        elif _all_present([cell], present):
            undivided.append(cell)
    return undivided


def _all_present(cells: Iterable[Cell], present: Collection[Place]) -> bool:
    return all(corner in present for cell in cells for corner in cell.corners)


class SeenPoints(NamedTuple):
    """The result of a look at P points, (P,) each.

    Attributes
    ----------
    values : array of int
        Number of values of each point.
    mean : array
    low, high : array
        Bounds of the confidence interval of the mean, simultaneous for all looks.
    side : array of int
        BELOW, UNKNOWN or ABOVE.
    further : array of int
        Number of trials of the point after the next round. The number does not change
        if the point has had its last trial.
    """

    values: Counts
    mean: Floats
    low: Floats
    high: Floats
    side: Counts
    further: Counts


def look(
    rule: Refinement, trials: Counts, values: ArrayLike, distribution: Declared
) -> SeenPoints:
    """Look at P points.

    A point with fewer than two values gets no more trials, because further trials
    might also lack values.

    Parameters
    ----------
    rule : Refinement
    trials : array of int
        Number of trials of each point, (P,).
    values : array_like
        Values of all trials, point after point, (sum of `trials`,). Values that are not
        finite do not count.
    distribution : Declared
        Distribution and range of the values.

    Returns
    -------
    SeenPoints
    """
    import pandas as pd

    from sweep.analysis import group_bounds

    array = np.asarray(values, np.float64)
    finite = pd.Series(np.where(np.isfinite(array), array, np.nan))
    groups: Any = finite.groupby(np.repeat(np.arange(len(trials)), trials))
    count: Counts = groups.count().to_numpy(np.int64)
    mean: Floats = groups.mean().to_numpy(np.float64)
    low, high = group_bounds(groups, rule.nominal, distribution)
    sure = count > 1
    above = sure & (low > rule.level)
    below = sure & (high < rule.level)
    side = np.select([above, below], [ABOVE, BELOW])
    numbers = np.asarray(rule.looks)
    at = np.searchsorted(numbers, trials, side="right")
    following = numbers[np.minimum(at, len(numbers) - 1)]
    further = np.where(sure & (side == UNKNOWN), following, trials)
    return SeenPoints(
        values=count,
        mean=mean,
        low=low,
        high=high,
        side=side.astype(np.int64),
        further=further,
    )


class Sides(NamedTuple):
    """Sides of the points of C cells, (C,) each: True if any point of a cell qualifies.

    Attributes
    ----------
    above, below : array of bool
        On this side of the level.
    unsure : array of bool
        Not known, although the point has values and has had its last trial.
    open : array of bool
        The point gets more trials.
    lacking : array of bool
        The point has fewer than two values.
    """

    above: NDArray[np.bool_]
    below: NDArray[np.bool_]
    unsure: NDArray[np.bool_]
    open: NDArray[np.bool_]
    lacking: NDArray[np.bool_]

    @property
    def crossed(self) -> NDArray[np.bool_]:
        """True for cells that the boundary goes through.

        A crossed cell has points on the two sides of the level, or on one side and not
        known.
        """
        unknown = self.unsure & ~self.open
        crossed: NDArray[np.bool_] = (self.above & self.below) | (
            (self.above | self.below) & unknown
        )
        return crossed


def sides_of(
    cells: Sequence[Cell], places: Sequence[Place], observed: SeenPoints, trials: Counts
) -> Sides:
    """Return the sides of all points in each cell.

    Points on the edges of a cell count, also corners of smaller neighbouring cells.

    Parameters
    ----------
    cells : sequence of Cell
    places : sequence of Place
        Positions of the points.
    observed : SeenPoints
        The last look, in the order of `places`.
    trials : array of int
        Number of trials of each point.

    Returns
    -------
    Sides
    """
    at = np.array(places, np.int64)
    more = observed.further > trials
    lacking = observed.values < 2
    unsure = (observed.side == UNKNOWN) & ~more & ~lacking
    kinds = np.stack(
        [observed.side == ABOVE, observed.side == BELOW, unsure, more, lacking]
    )
    present = np.zeros((len(kinds), len(cells)), np.bool_)
    for number, cell in enumerate(cells):
        inside = ((at >= cell.low) & (at <= cell.high)).all(axis=1)
        present[:, number] = kinds[:, inside].any(axis=1)
    return Sides(*present)


Allowed = Callable[[Sequence[Place]], Collection[Place]]
"""A function of new points that returns the points that the study can have."""


def next_trials(
    rule: Refinement,
    groups: int,
    trials: Mapping[Place, int],
    observed: SeenPoints,
    allowed: Allowed,
) -> dict[Place, int]:
    """Return the next number of trials of points that get trials.

    More trials of points that are not known come first, then halved cells, the largest
    cells first.

    Parameters
    ----------
    rule : Refinement
    groups : int
        Number of groups of points.
    trials : mapping
        Present number of trials by position.
    observed : SeenPoints
        The last look at the points, in the order of `trials`.
    allowed : callable
        Selects the new points that the study can have, see `Allowed`.

    Returns
    -------
    dict
        Numbers of trials by position, of points that get more and of new points. Empty
        if the boundary is as precise as the rule demands, or the budget is spent.
    """
    left = rule.budget - sum(trials.values())
    counts = np.fromiter(trials.values(), np.int64, len(trials))
    requested = dict[Place, int]()
    for place, had, further in zip(trials, counts, observed.further, strict=True):
        if had < further and further - had <= left:
            requested[place] = int(further)
            left -= int(further - had)
    halved = _halved(rule, groups, trials, observed, counts=counts, allowed=allowed)
    for corners in halved:
        new = [place for place in corners if place not in requested]
        if len(new) * rule.least <= left:
            requested |= dict.fromkeys(new, rule.least)
            left -= len(new) * rule.least
    return requested


def _halved(
    rule: Refinement,
    groups: int,
    trials: Mapping[Place, int],
    observed: SeenPoints,
    counts: Counts,
    allowed: Allowed,
) -> Iterator[list[Place]]:
    """Yield the new points of each cell to halve, largest cells first.

    A cell is not halved if a new point is not allowed.
    """
    cells = leaves(rule, groups, trials)
    crossed = sides_of(cells, [*trials], observed, counts).crossed
    chosen = [
        cell for cell, is_crossed in zip(cells, crossed, strict=True) if is_crossed
    ]
    chosen.sort(key=lambda cell: -math.prod(cell.shares(rule)))
    new = [
        list(
            dict.fromkeys(
                corner
                for part in cell.parts(rule)
                for corner in part.corners
                if corner not in trials
            )
        )
        for cell in chosen
    ]
    every = list(dict.fromkeys(place for places in new for place in places))
    can = set(allowed(every)) if every else set()
    yield from (places for places in new if places and can.issuperset(places))


class Crossing(NamedTuple):
    """A crossing of the level by the mean along the axis of a group.

    Attributes
    ----------
    group : int
    low, high : int
        Positions of the nearest points that are known to be on either side of the
        level.
    estimate : float
        The estimated value of the axis at the crossing.
    rises : bool
        True if the mean rises at the crossing, False if the mean falls.
    """

    group: int
    low: int
    high: int
    estimate: float
    rises: bool


def crossings(
    rule: Refinement, places: Sequence[Place], observed: SeenPoints
) -> Iterator[Crossing]:
    """Yield the crossings of each group, in order, of a rule with one axis.

    The estimate is where a straight line through the means of the points from `low` to
    `high` reaches the level.

    Parameters
    ----------
    rule : Refinement
        A rule with one axis.
    places : sequence of Place
        Positions of the points, in any order.
    observed : SeenPoints
        The last look, in the order of `places`.

    Yields
    ------
    Crossing
    """
    (scale,) = rule.scales.values()
    order = np.array(sorted(range(len(places)), key=places.__getitem__), np.int64)
    sure = np.flatnonzero(observed.side[order] != UNKNOWN)
    for first, last in pairwise(sure):
        low = order[first]
        high = order[last]
        group, at = places[low]
        if places[high][0] != group or observed.side[low] == observed.side[high]:
            continue
        points = order[first : last + 1]
        along = [places[point][1] for point in points]
        yield Crossing(
            group=group,
            low=at,
            high=places[high][1],
            estimate=_estimate(rule, scale, along, observed.mean[points]),
            rises=bool(observed.side[high] == ABOVE),
        )


def _estimate(
    rule: Refinement, scale: RefinedAxis, at: list[int], means: Floats
) -> float:
    """Return the value at which a line through the means of points crosses the level.

    The value is always within the range of the points, even for noisy means.
    """
    values = np.array([scale.at(place) for place in at])
    x = np.log(values) if scale.geometric else values
    finite = np.isfinite(means)
    slope, offset = np.polyfit(x[finite] - x[0], means[finite] - rule.level, 1)
    crossing = x[0] - offset / slope if slope else x.mean()
    crossing = min(max(crossing, x[0]), x[-1])
    return float(np.exp(crossing) if scale.geometric else crossing)
