"""Where the mean of a metric crosses a level: a grid that becomes finer there.

A grid of points is divided into cells, whose corners are points. Each look says of each
point on which side of the level its mean lies, by an interval that holds at all looks
together (`sweep.analysis.sequential`). A point whose interval includes the level gets
more trials. A cell that has points of both sides is halved along each of its axes, and
so is one that has points of one side and one that is still not known when it has had
its last trial. A cell whose points lie on one side is left as it is, whatever happens
within: the first grid must be as fine as the structures that are sought. So is a cell
of which no point is known: more points there would tell nothing but by chance.

So trials gather at the boundary: of a plane with cells of a share h of its sides, about
1 / h points are asked for and not 1 / h^2.

A point is a tuple of whole numbers, `Place`: the number of its group, and its place on
each axis, counted in the finest steps that there can be. Points of several groups never
share a cell. The cells follow from the points that there are: a cell counts as divided
where all corners of its parts are among them. So they are found again in what is
stored.
"""

import math
from bisect import bisect_right
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import pairwise, product
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sweep.analysis.mean_bounds import Declared
from sweep.analysis.sequential import looks, nominal_confidence

Floats = NDArray[np.float64]
Counts = NDArray[np.int64]
Place = tuple[int, ...]

ROUNDING = 1e-9
DIGITS = 12
"""To which values between others are rounded, as those of a grid are."""
MOST_HALVINGS = 20

STEEPEST = "steepest"
"""Stands in place of a level."""
BELOW, UNKNOWN, ABOVE = -1, 0, 1
"""On which side of the level a mean lies. It is unknown where the interval includes the
level, and where there are fewer than two values.
"""


@dataclass(frozen=True)
class RefinedAxis:
    """An axis that is refined: the ascending `values` of the spec, and between them
    their halves, `halvings` times.

    The halves of `geometric` ones are at equal ratios; `whole` ones are rounded to
    whole numbers.
    """

    values: tuple[float, ...]
    halvings: int
    geometric: bool = False
    whole: bool = False

    @classmethod
    def until(
        cls, values: Sequence[float], until: float, *, geometric: bool, whole: bool
    ) -> "RefinedAxis":
        """The scale in which the widest step between `values` is halved until it is at
        most the share `until` of their range.
        """
        at = np.log(values) if geometric else np.asarray(values, np.float64)
        widest = float(np.diff(at).max() / (at[-1] - at[0]))
        halvings = max(0, math.ceil(math.log2(widest / until) - ROUNDING))
        return cls(tuple(values), min(halvings, MOST_HALVINGS), geometric, whole)

    @property
    def step(self) -> int:
        """How many places lie between two values of the spec."""
        return 1 << self.halvings

    @property
    def last(self) -> int:
        """The last place."""
        return (len(self.values) - 1) * self.step

    def at(self, place: int) -> float:
        """The value at a place.

        >>> RefinedAxis((0.0, 1.0), halvings=2).at(3)
        0.75
        >>> RefinedAxis((1.0, 4.0), halvings=1, geometric=True).at(1)
        2.0
        """
        number, rest = divmod(place, self.step)
        if not rest:
            return self.values[number]
        low, high, part = *self.values[number : number + 2], rest / self.step
        between = (
            low * (high / low) ** part if self.geometric else low + (high - low) * part
        )
        return float(round(between)) if self.whole else float(f"{between:.{DIGITS}g}")

    def place(self, value: float) -> int | None:
        """The place with a value, None where there is none."""
        number = bisect_right(self.values, value) - 1
        if number < 0 or value > self.values[-1]:
            return None
        low, high = number * self.step, min((number + 1) * self.step, self.last)
        while high - low > 1:
            middle = (low + high) // 2
            low, high = (middle, high) if self.at(middle) <= value else (low, middle)
        return next((at for at in (low, high) if self.at(at) == value), None)

    def share(self, low: int, high: int) -> float:
        """Which share of the range lies between two places."""
        ends = (self.at(low), self.at(high), self.values[0], self.values[-1])
        first, last, least, most = np.log(ends) if self.geometric else ends
        return float((last - first) / (most - least))

    def middle(self, low: int, high: int, until: float) -> int | None:
        """The place half-way, None where two places are as close as they may be."""
        place = (low + high) // 2
        if high - low < 2 or self.share(low, high) <= until * (1.0 + ROUNDING):
            return None
        return place if self.at(low) < self.at(place) < self.at(high) else None


@dataclass(frozen=True)
class Refinement:
    """Points get trials, and cells are halved, where the mean of the column `metric`
    crosses the level `at`, or, with STEEPEST in its place, where it changes most.

    Along each axis, by its name in `scales`, a cell is halved until it is at most the
    share `until` of the range. A point has `least` to `most` trials, and all points
    together at most `budget`. The intervals of all looks at all points along one axis
    hold together with `confidence`: so does the boundary that lies between them.
    """

    place: ClassVar = ("refine",)
    """The key of a spec that writes it."""
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
        """The most trials of a study, whatever the number of points at first."""
        return self.budget

    @property
    def counted(self) -> str:
        """Which trials of a spec are counted, in words."""
        return (
            "its first trials are counted; it adds others where the mean of"
            f" {self.metric} {self.where}"
        )

    @property
    def looks(self) -> tuple[int, ...]:
        """The numbers of trials after which a point is looked at."""
        return looks(self.least, self.most)

    @property
    def nominal(self) -> float:
        """The confidence of the interval of a point at each look; the first call takes
        about a second.

        All points along one axis share what may go wrong (Bonferroni): those of the
        grid, and two for each halving. Each errs on one side alone, so that it has
        twice its share.
        """
        missing = self._share * (1.0 - self.confidence)
        return nominal_confidence(self.looks, 1.0 - missing)

    @property
    def _share(self) -> float:
        """The share of a point of what may go wrong. Where the slope is looked at, a
        point can err on both sides, and all points of the finest grid can be asked for.
        """
        scales = self.scales.values()
        if self.steepest:
            return 1.0 / max(one.last + 1 for one in scales)
        points = max(len(one.values) + 2 * one.halvings for one in scales)
        return min(1.0, 2.0 / points)

    @property
    def steepest(self) -> bool:
        """Whether the place is sought where the mean changes most."""
        return self.at == STEEPEST

    @property
    def level(self) -> float:
        """The level that the mean crosses; NaN, on whose sides nothing lies, where no
        level is sought.
        """
        return math.nan if isinstance(self.at, str) else self.at

    @property
    def where(self) -> str:
        """What the mean does at the boundary, in words."""
        return "changes most" if self.steepest else f"crosses {self.level:g}"

    @property
    def in_words(self) -> str:
        """Where cells are halved, in words."""
        halved = max(scale.halvings for scale in self.scales.values())
        return (
            f"; cells are halved up to {halved} times where the mean of {self.metric}"
            f" {self.where}"
        )

    def as_json(self) -> dict[str, object]:
        """The rule by the keys of a spec, and its scales."""
        return {
            "metric": self.metric,
            "at": self.at,
            "until": self.until,
            "min": self.least,
            "max": self.most,
            "budget": self.budget,
            "confidence": self.confidence,
            "scales": {name: asdict(scale) for name, scale in self.scales.items()},
        }


def from_json(about: Mapping[str, Any]) -> Refinement:
    """The rule that `Refinement.as_json` has written."""
    return Refinement(
        metric=about["metric"],
        at=about["at"],
        scales={
            name: RefinedAxis(**{**scale, "values": tuple(scale["values"])})
            for name, scale in about["scales"].items()
        },
        until=about["until"],
        least=about["min"],
        most=about["max"],
        budget=about["budget"],
        confidence=about["confidence"],
    )


class Cell(NamedTuple):
    """The corners of a cell that lie lowest and highest on all axes."""

    low: Place
    high: Place

    @property
    def corners(self) -> list[Place]:
        """All of its corners, once each."""
        pairs = zip(self.low, self.high, strict=True)
        return [*product(*(dict.fromkeys(pair) for pair in pairs))]

    def parts(self, rule: Refinement) -> "list[Cell]":
        """What it is halved into, along all axes on which it is wide; nothing where it
        is as small as it may be.
        """
        edges, halved = [[(self.low[0], self.low[0])]], False
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
        """Which share of each axis it takes."""
        axes = zip(rule.scales.values(), self.low[1:], self.high[1:], strict=True)
        return [scale.share(low, high) for scale, low, high in axes]


def first_cells(rule: Refinement, groups: int) -> Iterator[Cell]:
    """The cells of the grid of the spec, group after group."""
    scales = rule.scales.values()
    steps = [range(0, scale.last, scale.step) for scale in scales]
    for group in range(groups):
        for low in product(*steps):
            high = (at + scale.step for at, scale in zip(low, scales, strict=True))
            yield Cell((group, *low), (group, *high))


def leaves(rule: Refinement, groups: int, present: Collection[Place]) -> list[Cell]:
    """The cells that are not divided further, in their order; those of which a corner
    is not present are left out.
    """
    found, waiting = list[Cell](), [*first_cells(rule, groups)][::-1]
    while waiting:
        cell = waiting.pop()
        parts = cell.parts(rule)
        if parts and _all_present(parts, present):
            waiting += parts[::-1]
        elif _all_present([cell], present):
            found.append(cell)
    return found


def _all_present(cells: Iterable[Cell], present: Collection[Place]) -> bool:
    return all(corner in present for cell in cells for corner in cell.corners)


class SeenPoints(NamedTuple):
    """What is seen of P points, (P,) each: the number of values, their mean and its
    interval at all looks, the `side` on which it lies, and how many trials the point
    gets from now on: `further` is the present number where it has had its last.
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
    """Look at P points with `trials` (P,) each, whose `values` follow one another,
    point after point. What is not finite is no value.

    A point with fewer than two values gets no more trials: it might never have any.
    """
    import pandas as pd

    from sweep.analysis.intervals import group_bounds

    array = np.asarray(values, np.float64)
    known = pd.Series(np.where(np.isfinite(array), array, np.nan))
    groups: Any = known.groupby(np.repeat(np.arange(len(trials)), trials))
    count: Counts = groups.count().to_numpy(np.int64)
    mean: Floats = groups.mean().to_numpy(np.float64)
    low, high = group_bounds(groups, rule.nominal, distribution)
    sure = count > 1
    above, below = sure & (low > rule.level), sure & (high < rule.level)
    side = np.select([above, below], [ABOVE, BELOW])
    numbers = np.asarray(rule.looks)
    at = np.searchsorted(numbers, trials, side="right")
    following = numbers[np.minimum(at, len(numbers) - 1)]
    further = np.where(sure & (side == UNKNOWN), following, trials)
    return SeenPoints(count, mean, low, high, side.astype(np.int64), further)


class Sides(NamedTuple):
    """What the points of C cells say, (C,) each: whether any lies above, any below, any
    is not known though it has values and has had its last trial, any gets more trials,
    and any has no two values.
    """

    above: NDArray[np.bool_]
    below: NDArray[np.bool_]
    unsure: NDArray[np.bool_]
    open: NDArray[np.bool_]
    lacking: NDArray[np.bool_]

    @property
    def crossed(self) -> NDArray[np.bool_]:
        """Which cells reach from one side of the level to the other, or to points that
        are not known.
        """
        unknown = self.unsure & ~self.open
        crossed: NDArray[np.bool_] = (self.above & self.below) | (
            (self.above | self.below) & unknown
        )
        return crossed


def sides_of(
    cells: Sequence[Cell], places: Sequence[Place], seen: SeenPoints, trials: Counts
) -> Sides:
    """What all points in each cell say, with those on its edges, which may be corners
    of smaller cells beside it.
    """
    at = np.array(places, np.int64)
    more = seen.further > trials
    lacking = seen.values < 2
    unsure = (seen.side == UNKNOWN) & ~more & ~lacking
    kinds = np.stack([seen.side == ABOVE, seen.side == BELOW, unsure, more, lacking])
    found = np.zeros((len(kinds), len(cells)), np.bool_)
    for number, cell in enumerate(cells):
        inside = ((at >= cell.low) & (at <= cell.high)).all(axis=1)
        found[:, number] = kinds[:, inside].any(axis=1)
    return Sides(*found)


Allowed = Callable[[Sequence[Place]], Collection[Place]]
"""Of some new points, those that the study can have."""


def next_trials(
    rule: Refinement,
    groups: int,
    trials: Mapping[Place, int],
    seen: SeenPoints,
    allowed: Allowed,
) -> dict[Place, int]:
    """How many trials points get from now on, by place: those that get more, and new
    ones. Nothing where the boundary is known as well as it is asked for, or where the
    budget allows no more.

    `seen` is of the points with `trials`, in their order. First come more trials for
    points that are not known, then cells that are halved, the largest first.
    """
    left = rule.budget - sum(trials.values())
    counts = np.fromiter(trials.values(), np.int64, len(trials))
    asked = dict[Place, int]()
    for place, had, further in zip(trials, counts, seen.further, strict=True):
        if had < further and further - had <= left:
            asked[place] = int(further)
            left -= int(further - had)
    for new in _halved(rule, groups, trials, seen, counts, allowed):
        wanted = [place for place in new if place not in asked]
        if len(wanted) * rule.least <= left:
            asked |= dict.fromkeys(wanted, rule.least)
            left -= len(wanted) * rule.least
    return asked


def _halved(
    rule: Refinement,
    groups: int,
    trials: Mapping[Place, int],
    seen: SeenPoints,
    counts: Counts,
    allowed: Allowed,
) -> Iterator[list[Place]]:
    """The new points of each cell that is to be halved, the largest cells first. A cell
    of which one would not be allowed stays whole.
    """
    cells = leaves(rule, groups, trials)
    crossed = sides_of(cells, [*trials], seen, counts).crossed
    chosen = [cell for cell, one in zip(cells, crossed, strict=True) if one]
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
    """Where a mean crosses the level along the one axis of a group: between the places
    `low` and `high`, the nearest points that surely lie on either side, at about the
    value `estimate`. It `rises` or falls there.
    """

    group: int
    low: int
    high: int
    estimate: float
    rises: bool


def crossings(
    rule: Refinement, places: Sequence[Place], seen: SeenPoints
) -> Iterator[Crossing]:
    """The crossings of each group, in their order, of a rule with one axis.

    The estimate is where a straight line through the means of the points from `low` to
    `high` reaches the level.
    """
    (scale,) = rule.scales.values()
    order = np.array(sorted(range(len(places)), key=places.__getitem__), np.int64)
    sure = np.flatnonzero(seen.side[order] != UNKNOWN)
    for first, last in pairwise(sure):
        low, high = order[first], order[last]
        group, at = places[low]
        if places[high][0] != group or seen.side[low] == seen.side[high]:
            continue
        some = order[first : last + 1]
        yield Crossing(
            group,
            at,
            places[high][1],
            _estimate(rule, scale, [places[one][1] for one in some], seen.mean[some]),
            bool(seen.side[high] == ABOVE),
        )


def _estimate(
    rule: Refinement, scale: RefinedAxis, at: list[int], means: Floats
) -> float:
    """The value at which a line through the means of points crosses the level; within
    them, whatever their noise is.
    """
    values = np.array([scale.at(place) for place in at])
    x = np.log(values) if scale.geometric else values
    known = np.isfinite(means)
    slope, offset = np.polyfit(x[known] - x[0], means[known] - rule.level, 1)
    found = x[0] - offset / slope if slope else x.mean()
    found = min(max(found, x[0]), x[-1])
    return float(np.exp(found) if scale.geometric else found)
