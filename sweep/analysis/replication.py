"""How many values reach a goal, by what a pilot knows: a half width of the interval of
a mean, or that a comparison of two means notices a difference.

A goal is reached where a ratio is at most 1: the half width over the allowed one, or
the difference that is noticed over the true one. What may be off, as the spread, the
mean and the chance of the draw, are parts. Each part alone is moved to the quantile of
its own predictive distribution (`sweep.analysis.futures`), and the squares of what that
does to the logarithm of the ratio are added up (Zou and Donner 2008, Stat. Med. 27,
1693-1702). With one part this is exact: normal values and a half width.

How often the promise is kept was measured: see
`docs/decisions/replicates-from-a-pilot.md`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from sweep.analysis.contrasting import Contrast
from sweep.analysis.estimate import CONFIDENCE, squared_arms
from sweep.analysis.futures import PREDICTIONS, Pilots, pilots_of
from sweep.analysis.mean_bounds import (
    ANYWHERE,
    EVENTS,
    SUPPORTS,
    Declared,
    Distribution,
    Samples,
    Support,
    in_full,
    mean_bounds,
)
from sweep.analysis.sequential import Width

Floats = NDArray[np.float64]
Rows = NDArray[np.intp]

CHANCE = 0.8
FEWEST = 5
"""Values of a pilot, below which its spread says next to nothing."""
SMALL = 10
"""Values of a pilot, below which the promise may fail where they are not normal."""
CAVEATS = ("too few values", "all equal", "not seen", "small pilot")
"""What makes an answer unknown or unsure, the first that holds: fewer than FEWEST
values; values that are equal, but for one at most, which say nothing of their spread;
no event, or nothing else; fewer than SMALL values that are not normal.
"""
MOST = 1e6
"""More values than that are told as infinitely many."""
RANGE = (0.025, 0.975)
FIRST = 16.0
ROUNDS = 60
PREDICTED = 12
"""So often the next number is predicted from the last one, then halved to."""
STEP = 0.002
"""Numbers are found to this part of them, so below 500 to the last one."""
ROUGH_STEP = 0.02
"""The same for the ends of ranges."""


class Needed(NamedTuple):
    """How many values reach a goal with the stated chance, for each of k pilots, (k,),
    and the 95 % range of that number by what a pilot leaves open.

    NaN is unknown, and infinite more than MOST. `caveat` has one of CAVEATS, or "".
    """

    n: Floats
    low: Floats
    high: Floats
    caveat: NDArray[np.object_]


class PilotGoal(Protocol):
    """What k pilots are to reach.

    `drawn` is how many parts, the first ones, are the chance of the draw alone, of
    which the pilot knows nothing.
    """

    @property
    def parts(self) -> int:
        """How many parts may be off."""

    @property
    def drawn(self) -> int:
        """How many of them, the first ones, the pilot leaves as they are."""

    @property
    def known(self) -> Sequence[Floats]:
        """All that is known of the pilots, (k,) each."""

    def at(self, rows: Rows) -> Self:
        """The goal of some pilots."""

    def ratio(self, n: Floats, chances: Sequence[float]) -> Floats:
        """The ratio for so many values (k,), with each part at the quantile of its
        chance.
        """


@dataclass(frozen=True, eq=False)
class WidthGoal:
    """The interval of a mean is so narrow. Its parts are the mean and the spread."""

    pilots: Pilots
    distribution: Distribution
    width: Width
    tail: float
    support: Support

    parts = 2
    drawn = 0

    @property
    def known(self) -> Sequence[Floats]:
        return self.pilots.known

    def at(self, rows: Rows) -> Self:
        return replace(self, pilots=self.pilots.at(rows))

    def ratio(self, n: Floats, chances: Sequence[float]) -> Floats:
        prediction = PREDICTIONS[self.distribution]
        spread = prediction.spread(self.pilots, n, chances[1], 1.0)
        worst = 0.0 if self.width.relative else prediction.widest
        mean = _mean(self.pilots, self.distribution, n, spread, chances[0], worst)
        samples = prediction.moments(self.pilots, n, mean, spread)
        bounds = mean_bounds(self.distribution, samples, self.tail)
        low, high = self.support.cut(mean, *bounds)
        return np.asarray((high - low) / 2.0 / self.width.allowed(mean))


@dataclass(frozen=True, eq=False)
class DifferenceGoal:
    """A comparison notices a difference of `size`, (k,), which is that of two means, or
    the mean of the differences of pairs.

    `sides` are two pilots, or that of the differences. Gains and losses of paired
    events are two that have a `correlation`, (k,). The parts are the chance of the
    draw, the means, and the spreads.
    """

    sides: tuple[Pilots, ...]
    distribution: Distribution
    size: Floats
    tail: float
    correlation: Floats | None = None

    parts = 3
    drawn = 1

    @property
    def known(self) -> Sequence[Floats]:
        sides = [one for side in self.sides for one in side.known]
        common = [] if self.correlation is None else [self.correlation]
        return [*sides, self.size, *common]

    def at(self, rows: Rows) -> Self:
        return replace(
            self,
            sides=tuple(side.at(rows) for side in self.sides),
            size=self.size[rows],
            correlation=None if self.correlation is None else self.correlation[rows],
        )

    def ratio(self, n: Floats, chances: Sequence[float]) -> Floats:
        from scipy.special import ndtri

        prediction = PREDICTIONS[self.distribution]
        spreads = [
            prediction.spread(side, n, chances[2], self._freedom) for side in self.sides
        ]
        means = self._means(n, spreads, chances[1])
        samples = [
            prediction.moments(side, n, mean, spread)
            for side, mean, spread in zip(self.sides, means, spreads, strict=True)
        ]
        noise = float(ndtri(chances[0])) * np.sqrt(self._variance(samples))
        return np.asarray((self._below(samples) + noise) / self.size)

    @property
    def _freedom(self) -> Floats:
        """How many times as many degrees of freedom both sides have together as one has
        (Satterthwaite 1946, Biometrics Bull. 2, 110-114).
        """
        errors = [side.samples.variance / side.samples.n for side in self.sides]
        total, squares = np.sum(errors, axis=0), np.sum(np.square(errors), axis=0)
        return np.where(total > 0.0, total**2 / squares, 1.0)

    def _means(
        self, n: Floats, spreads: Sequence[Floats], chance: float
    ) -> Sequence[Floats]:
        """The means of the sides, the difference apart: around the middle of those of
        the pilot, as far as there can be such means.
        """
        if len(self.sides) == 1:
            return [self.size]
        prediction = PREDICTIONS[self.distribution]
        middle = np.mean(
            [
                _mean(side, self.distribution, n, spread, chance, prediction.widest)
                for side, spread in zip(self.sides, spreads, strict=True)
            ],
            axis=0,
        )
        half = self.size / 2.0
        middle = np.clip(middle, prediction.least + half, prediction.most - half)
        return [middle + half, middle - half]

    def _variance(self, samples: Sequence[Samples]) -> Floats:
        """The variance of the difference."""
        variance = np.sum([one.variance / one.n for one in samples], axis=0)
        if self.correlation is not None:
            first, second = (np.sqrt(one.variance / one.n) for one in samples)
            variance = variance - 2.0 * self.correlation * first * second
        return np.asarray(np.maximum(variance, 0.0))

    def _below(self, samples: Sequence[Samples]) -> Floats:
        """What the lower bound of the difference is away from it."""
        if self.distribution == "normal":
            return self._welchs(samples)
        tail = np.asarray(self.tail)
        squares, _ = squared_arms(samples, self.distribution, tail, self.correlation)
        return np.asarray(np.sqrt(np.maximum(squares, 0.0)))

    def _welchs(self, samples: Sequence[Samples]) -> Floats:
        from scipy.special import stdtrit

        errors = [one.variance / one.n for one in samples]
        total = np.sum(errors, axis=0)
        spread = np.sum(
            [
                error**2 / (one.n - 1.0)
                for error, one in zip(errors, samples, strict=True)
            ],
            axis=0,
        )
        freedom = np.where(total > 0.0, total**2 / spread, 1.0)
        return np.asarray(-stdtrit(freedom, self.tail) * np.sqrt(total))


def values_for_width(
    pilots: Sequence[Floats],
    width: Width,
    declared: Declared = "normal",
    *,
    confidence: float = CONFIDENCE,
    chance: float = CHANCE,
) -> Needed:
    """How many independent values the interval of their mean needs to be as narrow as
    `width` with this `chance`, from the values of each of k `pilots`, (m,) each.

    What is not finite does not count. The interval is that of what is `declared` of the
    values at this `confidence` (`sweep.analysis.mean_bounds`). NaN for fewer than
    FEWEST values, where values that are no events are equal, but for one at most, and
    where no event was seen and the width is a share of the mean.
    """
    distribution, support = in_full(declared)
    found = pilots_of(pilots, distribution)
    tail = (1.0 - confidence) / 2.0
    known = found.samples
    if not np.all(support.holds(known.least, known.largest) | (known.n == 0.0)):
        support = ANYWHERE
    goal = WidthGoal(found, distribution, width, tail, support)
    caveat = _caveats([found], distribution)
    hopeless = (found.samples.mean == 0.0) & width.relative
    return _needed(goal, chance, caveat, hopeless)


def values_for_difference(
    contrasts: Sequence[Contrast],
    sizes: Floats,
    *,
    confidence: float = CONFIDENCE,
    chance: float = CHANCE,
) -> Needed:
    """How many independent values on either side, or pairs, a comparison needs to
    notice with this `chance` that the true difference is as large as `sizes`, (k,),
    with each of k `contrasts` as the pilot.

    It notices where the interval of the contrast at this `confidence` has no zero. All
    contrasts are of one distribution, and all paired or none. NaN for fewer than FEWEST
    values of a side, and where those of a side that are no events are equal, but for
    one at most.
    """
    first = contrasts[0]
    distribution = first.estimate.distribution
    if first.paired:
        sides = _paired([one.b - one.a for one in contrasts], distribution)
    else:
        sides = (
            pilots_of([one.b for one in contrasts], distribution),
            pilots_of([one.a for one in contrasts], distribution),
        )
    correlation = (
        np.array([one.estimate.correlation or 0.0 for one in contrasts])
        if first.paired and len(sides) > 1
        else None
    )
    tail = (1.0 - confidence) / 2.0
    goal = DifferenceGoal(sides, distribution, sizes, tail, correlation)
    return _needed(goal, chance, _caveats(sides, distribution), ~(sizes > 0.0))


def _paired(
    changes: Sequence[Floats], distribution: Distribution
) -> tuple[Pilots, ...]:
    """The sides of pairs: gains and losses of events, else the differences alone. These
    may have either sign though none of the pilot has, and so may the true difference:
    they are skewed to the side on which it is harder to notice.
    """
    if distribution in EVENTS:
        gains = [np.maximum(change, 0.0) for change in changes]
        losses = [np.maximum(-change, 0.0) for change in changes]
        return pilots_of(gains, distribution), pilots_of(losses, distribution)
    found = pilots_of(changes, distribution)
    either = found.samples._replace(
        least=np.full_like(found.samples.n, -np.inf),
        skewness=-np.abs(found.samples.skewness),
    )
    return (replace(found, samples=either),)


def _caveats(
    sides: Sequence[Pilots], distribution: Distribution
) -> NDArray[np.object_]:
    """What is to be said of each pilot (k,), one of CAVEATS or ""."""
    whole = SUPPORTS.get(distribution, ANYWHERE).high
    least = np.min([side.samples.n for side in sides], axis=0)
    equal = np.logical_or.reduce([side.samples.constant for side in sides])
    unseen = np.logical_and.reduce(
        [np.isin(side.samples.mean, (0.0, whole)) for side in sides]
    )
    events = distribution in EVENTS
    found = (
        least < FEWEST,
        equal & (not events),
        unseen & events,
        (least < SMALL) & (distribution != "normal"),
    )
    return np.select(found, np.array(CAVEATS, object), "")


def _mean(
    pilots: Pilots,
    distribution: Distribution,
    n: Floats,
    spread: Floats,
    chance: float,
    worst: float,
) -> Floats:
    """How far, with this chance, the mean is at most on its way to the `worst` one."""
    prediction = PREDICTIONS[distribution]
    tail = min(chance, 1.0 - chance)
    low, high = (prediction.mean(pilots, n, spread, one) for one in (tail, 1.0 - tail))
    if chance >= 0.5:
        return np.asarray(np.clip(worst, low, high))
    return np.where(worst - low > high - worst, low, high)


def _needed(
    goal: PilotGoal,
    chance: float,
    caveat: NDArray[np.object_],
    hopeless: NDArray[np.bool_],
) -> Needed:
    """Numbers for all parts at the chance, and the range with the draw at the chance
    and the others at either end; NaN for `hopeless` pilots, too few values and equal
    ones.

    Equal pilots are looked at once: those of events often are, and take longest.
    """
    blind = hopeless | np.isin(caveat, CAVEATS[:2])
    _, rows, places = np.unique(
        np.nan_to_num(np.column_stack([*goal.known, blind])),
        axis=0,
        return_index=True,
        return_inverse=True,
    )
    goal, blind = goal.at(rows), blind[rows]
    drawn = [chance] * goal.drawn + [0.5] * (goal.parts - goal.drawn)
    start = np.where(blind, np.nan, FIRST)
    n = _smallest(_Asked(goal, [0.5] * goal.parts, chance, 0), start, STEP)
    low, high = (
        _smallest(_Asked(goal, drawn, end, goal.drawn), n, ROUGH_STEP) for end in RANGE
    )
    high = np.fmax(high, n)
    back = np.ravel(places)
    return Needed(n[back], np.fmin(low, n)[back], high[back], caveat)


class _Asked(NamedTuple):
    """The parts of a goal from the `first` one on are at the chance, and the others at
    those in `middle`.
    """

    goal: PilotGoal
    middle: Sequence[float]
    chance: float
    first: int

    def ratio(self, n: Floats, rows: Rows) -> Floats:
        """Each part alone is moved to the chance, and the squares of what that does to
        the logarithm of the ratio are added up.
        """
        goal = self.goal.at(rows)
        typical = np.log(goal.ratio(n, self.middle))
        sign = 1.0 if self.chance >= 0.5 else -1.0
        squares = np.zeros_like(typical)
        for part in range(self.first, goal.parts):
            chances = [*self.middle]
            chances[part] = self.chance
            moved = np.log(goal.ratio(n, chances)) - typical
            squares += np.maximum(sign * np.nan_to_num(moved, nan=0.0), 0.0) ** 2
        return np.asarray(np.exp(typical + sign * np.sqrt(squares)))


def _smallest(asked: _Asked, start: Floats, step: float) -> Floats:
    """The smallest numbers (k,), to this part of them, whose ratio is at most 1; NaN
    where the `start` of the search is.

    Ratios fall about with the root of the number, which predicts the next one to try.
    """
    low, high = np.where(np.isnan(start), np.nan, 1.0), np.full_like(start, np.inf)
    guess = np.clip(start, 2.0, MOST)
    for round_ in range(ROUNDS):
        apart = high - low > np.maximum(1.0, step * low)
        rows = np.flatnonzero(apart & (low < MOST))
        if not len(rows):
            break
        n = guess[rows]
        with np.errstate(all="ignore"):
            square = np.nan_to_num(asked.ratio(n, rows), nan=np.inf) ** 2
        enough = square <= 1.0
        # Below it, a number would miss by less than the step allows.
        low[rows] = np.where(enough, low[rows], n)
        low[rows] = np.where(enough & (square > 1.0 - step), n - 1.0, low[rows])
        high[rows] = np.where(enough, n, high[rows])
        between = np.floor(np.sqrt(low[rows] * np.minimum(high[rows], 4.0 * MOST)))
        square = np.minimum(square, MOST)
        predicted = np.minimum(np.ceil(n * square * (1.0 + step / 4.0)), MOST)
        wanted = predicted if round_ < PREDICTED else between
        most = np.minimum(high[rows] - 1.0, MOST)
        guess[rows] = np.clip(wanted, np.minimum(low[rows] + 1.0, most), most)
    return np.where(np.isnan(start), np.nan, high)
