"""Number of values that a goal needs, estimated from a pilot study.

A goal is a half-width of the confidence interval of a mean, or the detection of a
difference between two means. A goal is reached if a ratio is at most 1: half-width /
allowed half-width, or detectable difference / true difference. The parts of the
uncertainty are the spread, the mean and the random draw. Each part alone is moved to a
quantile of the predictive distribution (`sweep.analysis.futures`). The squared changes
of the logarithm of the ratio are added up (Zou and Donner 2008, Stat. Med. 27,
1693-1702). With a single part the method is exact: normal values and a half-width.

The measured probability of reaching a goal is in
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
"""Default probability of reaching a goal."""
FEWEST = 5
"""Fewest values of a pilot that show its spread."""
SMALL = 10
"""Pilot size below which goals for values that are not normal may fail more often."""
CAVEATS = ("too few values", "all equal", "not seen", "small pilot")
"""Reasons why a number is unknown or uncertain; the first that applies is reported.

In this order:

- fewer than FEWEST values;
- all values but at most one are equal, so the pilot does not show the spread;
- no event, or only events;
- fewer than SMALL values that are not normal.
"""
MOST = 1e6
"""Largest number of values; larger results are infinite."""
RANGE = (0.025, 0.975)
"""Probabilities of the ends of the range of a number."""
FIRST = 16.0
"""Number of values with which the search begins."""
ROUNDS = 60
PREDICTED = 12
"""Rounds that predict the next number from the last number; later rounds bisect."""
STEP = 0.002
"""Relative precision of a number; below 500 it is exact."""
ROUGH_STEP = 0.02
"""Relative precision of the ends of a range."""


class Needed(NamedTuple):
    """Numbers of values that reach a goal, for k pilots, (k,) each.

    `low` and `high` bound the 95 % range of `n` due to the errors of the pilot. NaN
    means unknown, and infinity means more than MOST. `caveat` contains elements of
    CAVEATS, or "".
    """

    n: Floats
    low: Floats
    high: Floats
    caveat: NDArray[np.object_]


class PilotGoal(Protocol):
    """A goal for k pilots."""

    @property
    def parts(self) -> int:
        """Number of parts of the uncertainty."""

    @property
    def drawn(self) -> int:
        """Number of leading parts that are due to the random draw alone.

        The random draw does not depend on the pilot.
        """

    @property
    def known(self) -> Sequence[Floats]:
        """All numbers of the pilots, (k,) each."""

    def at(self, rows: Rows) -> Self:
        """Return the goal of the pilots at some indices."""

    def ratio(self, n: Floats, chances: Sequence[float]) -> Floats:
        """Return the ratio of each pilot, (k,); at most 1 if the goal is reached.

        Parameters
        ----------
        n : array
            Number of values for each pilot, (k,).
        chances : sequence of float
            Probability of the quantile of each part.

        Returns
        -------
        array
        """


@dataclass(frozen=True, eq=False)
class WidthGoal:
    """Goal of a `width` of the confidence interval of a mean.

    `tail` is the probability with which each bound is missed. The parts are the mean
    and the spread.
    """

    pilots: Pilots
    distribution: Distribution
    width: Width
    tail: float
    support: Support

    parts = 2
    drawn = 0

    @property
    def known(self) -> Sequence[Floats]:
        """All numbers of the pilots, (k,) each."""
        return self.pilots.known

    def at(self, rows: Rows) -> Self:
        """Return the goal of the pilots at some indices."""
        return replace(self, pilots=self.pilots.at(rows))

    def ratio(self, n: Floats, chances: Sequence[float]) -> Floats:
        """Return half-width / allowed half-width, (k,).

        Parameters
        ----------
        n : array
            Number of values for each pilot, (k,).
        chances : sequence of float
            Probabilities of the mean, towards the widest interval, and of the spread.

        Returns
        -------
        array
        """
        prediction = PREDICTIONS[self.distribution]
        spread = prediction.spread(self.pilots, n, chances[1], 1.0)
        worst = 0.0 if self.width.relative else prediction.widest
        mean = _mean(
            self.pilots,
            self.distribution,
            n,
            spread,
            chance=chances[0],
            worst=worst,
        )
        samples = prediction.moments(self.pilots, n, mean, spread)
        bounds = mean_bounds(self.distribution, samples, self.tail)
        low, high = self.support.cut(mean, *bounds)
        return np.asarray((high - low) / 2.0 / self.width.allowed(mean))


@dataclass(frozen=True, eq=False)
class DifferenceGoal:
    """Goal that a comparison detects a difference of `size`, (k,).

    The difference is between two means, or the mean difference within pairs. `sides`
    are two pilots, or a single pilot of differences. Gains and losses of paired events
    are two pilots with a `correlation`, (k,). `tail` is the probability with which each
    bound of the difference is missed. The parts are the random draw, the means and the
    spreads.
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
        """All numbers of the pilots, (k,) each."""
        sides = [numbers for side in self.sides for numbers in side.known]
        common = [] if self.correlation is None else [self.correlation]
        return [*sides, self.size, *common]

    def at(self, rows: Rows) -> Self:
        """Return the goal of the pilots at some indices."""
        return replace(
            self,
            sides=tuple(side.at(rows) for side in self.sides),
            size=self.size[rows],
            correlation=None if self.correlation is None else self.correlation[rows],
        )

    def ratio(self, n: Floats, chances: Sequence[float]) -> Floats:
        """Return detectable difference / true difference, (k,).

        Parameters
        ----------
        n : array
            Number of values per side, or of pairs, for each pilot, (k,).
        chances : sequence of float
            Probabilities of the random draw, the means and the spreads.

        Returns
        -------
        array
        """
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
        """Ratio of the degrees of freedom: all sides together / a single side.

        Satterthwaite (1946, Biometrics Bull. 2, 110-114).
        """
        errors = [side.samples.variance / side.samples.n for side in self.sides]
        total = np.sum(errors, axis=0)
        squares = np.sum(np.square(errors), axis=0)
        return np.where(total > 0.0, total**2 / squares, 1.0)

    def _means(
        self, n: Floats, spreads: Sequence[Floats], chance: float
    ) -> Sequence[Floats]:
        """Return the means of the sides, which differ by `size`.

        The means are centred at the average of the pilot means, within the possible
        range.
        """
        if len(self.sides) == 1:
            return [self.size]
        prediction = PREDICTIONS[self.distribution]
        middle = np.mean(
            [
                _mean(
                    side,
                    self.distribution,
                    n,
                    spread,
                    chance=chance,
                    worst=prediction.widest,
                )
                for side, spread in zip(self.sides, spreads, strict=True)
            ],
            axis=0,
        )
        half = self.size / 2.0
        middle = np.clip(middle, prediction.least + half, prediction.most - half)
        return [middle + half, middle - half]

    def _variance(self, samples: Sequence[Samples]) -> Floats:
        """Return the variance of the difference."""
        variance = np.sum([side.variance / side.n for side in samples], axis=0)
        if self.correlation is not None:
            first, second = (np.sqrt(side.variance / side.n) for side in samples)
            variance = variance - 2.0 * self.correlation * first * second
        return np.asarray(np.maximum(variance, 0.0))

    def _below(self, samples: Sequence[Samples]) -> Floats:
        """Return the distance between the difference and the lower bound."""
        if self.distribution == "normal":
            return self._welchs(samples)
        tail = np.asarray(self.tail)
        squares, _ = squared_arms(samples, self.distribution, tail, self.correlation)
        return np.asarray(np.sqrt(np.maximum(squares, 0.0)))

    def _welchs(self, samples: Sequence[Samples]) -> Floats:
        from scipy.special import stdtrit

        errors = [side.variance / side.n for side in samples]
        total = np.sum(errors, axis=0)
        spread = np.sum(
            [
                error**2 / (side.n - 1.0)
                for error, side in zip(errors, samples, strict=True)
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
    """Return how many independent values a confidence interval of a width needs.

    Parameters
    ----------
    pilots : sequence of array
        Values of each of k pilots, (m,) each. Values that are not finite do not count.
    width : Width
        Allowed half-width of the interval of the mean.
    declared : Declared, default "normal"
        Distribution and range of the values, which determine the interval
        (`sweep.analysis.mean_bounds`).
    confidence : float, default 0.95
    chance : float, default 0.8
        Probability that the half-width is at most `width`.

    Returns
    -------
    Needed
        NaN for fewer than FEWEST values. NaN also if all values but at most one are
        equal and not events, and if the mean is 0 and the width is relative to the
        mean.
    """
    distribution, support = in_full(declared)
    moments = pilots_of(pilots, distribution)
    tail = (1.0 - confidence) / 2.0
    samples = moments.samples
    if not np.all(support.holds(samples.least, samples.largest) | (samples.n == 0.0)):
        support = ANYWHERE
    goal = WidthGoal(
        pilots=moments,
        distribution=distribution,
        width=width,
        tail=tail,
        support=support,
    )
    caveat = _caveats([moments], distribution)
    hopeless = (samples.mean == 0.0) & width.relative
    return _needed(goal, chance, caveat, hopeless)


def values_for_difference(
    contrasts: Sequence[Contrast],
    sizes: Floats,
    *,
    confidence: float = CONFIDENCE,
    chance: float = CHANCE,
) -> Needed:
    """Return how many values per side, or pairs, a comparison needs.

    The comparison detects a difference if the confidence interval of the contrast
    excludes zero.

    Parameters
    ----------
    contrasts : sequence of Contrast
        k pilots of one distribution, all paired or all unpaired.
    sizes : array
        True differences to detect, (k,), above zero.
    confidence : float, default 0.95
    chance : float, default 0.8
        Probability of detecting the difference (statistical power).

    Returns
    -------
    Needed
        NaN for fewer than FEWEST values of a side, and if all values of a side but at
        most one are equal and not events.
    """
    first = contrasts[0]
    distribution = first.estimate.distribution
    if first.paired:
        sides = _paired([pilot.b - pilot.a for pilot in contrasts], distribution)
    else:
        sides = (
            pilots_of([pilot.b for pilot in contrasts], distribution),
            pilots_of([pilot.a for pilot in contrasts], distribution),
        )
    correlation = (
        np.array([pilot.estimate.correlation or 0.0 for pilot in contrasts])
        if first.paired and len(sides) > 1
        else None
    )
    goal = DifferenceGoal(
        sides=sides,
        distribution=distribution,
        size=sizes,
        tail=(1.0 - confidence) / 2.0,
        correlation=correlation,
    )
    return _needed(goal, chance, _caveats(sides, distribution), ~(sizes > 0.0))


def _paired(
    changes: Sequence[Floats], distribution: Distribution
) -> tuple[Pilots, ...]:
    """Return the sides of pairs: gains and losses of events, else the differences.

    Future differences and the true difference may have either sign, even if all
    differences of the pilot have one sign. Therefore the skewness is on the side on
    which a difference is harder to detect.
    """
    if distribution in EVENTS:
        gains = [np.maximum(change, 0.0) for change in changes]
        losses = [np.maximum(-change, 0.0) for change in changes]
        return pilots_of(gains, distribution), pilots_of(losses, distribution)
    pilots = pilots_of(changes, distribution)
    either = pilots.samples._replace(
        least=np.full_like(pilots.samples.n, -np.inf),
        skewness=-np.abs(pilots.samples.skewness),
    )
    return (replace(pilots, samples=either),)


def _caveats(
    sides: Sequence[Pilots], distribution: Distribution
) -> NDArray[np.object_]:
    """Return the caveat of each pilot (k,), an element of CAVEATS or ""."""
    largest = SUPPORTS.get(distribution, ANYWHERE).high
    least = np.min([side.samples.n for side in sides], axis=0)
    equal = np.logical_or.reduce([side.samples.constant for side in sides])
    unseen = np.logical_and.reduce(
        [np.isin(side.samples.mean, (0.0, largest)) for side in sides]
    )
    events = distribution in EVENTS
    conditions = (
        least < FEWEST,
        equal & (not events),
        unseen & events,
        (least < SMALL) & (distribution != "normal"),
    )
    return np.select(conditions, np.array(CAVEATS, object), "")


def _mean(
    pilots: Pilots,
    distribution: Distribution,
    n: Floats,
    spread: Floats,
    chance: float,
    worst: float,
) -> Floats:
    """Return the mean that is nearest to the `worst` mean, at a probability `chance`.

    For a `chance` below 0.5, return the farthest mean.
    """
    prediction = PREDICTIONS[distribution]
    tail = min(chance, 1.0 - chance)
    low = prediction.mean(pilots, n, spread, tail)
    high = prediction.mean(pilots, n, spread, 1.0 - tail)
    if chance >= 0.5:
        return np.asarray(np.clip(worst, low, high))
    return np.where(worst - low > high - worst, low, high)


def _needed(
    goal: PilotGoal,
    chance: float,
    caveat: NDArray[np.object_],
    hopeless: NDArray[np.bool_],
) -> Needed:
    """Return the numbers of values that reach a goal, and the ranges of the numbers.

    For a number, all parts are at the probability `chance`. For the ends of a range,
    the random draw is at `chance`, and the remaining parts are at the probabilities of
    RANGE. Results are NaN for `hopeless` pilots, too few values and equal values.
    """
    blind = hopeless | np.isin(caveat, CAVEATS[:2])
    # Equal pilots are computed once: pilots of events are often equal, and slowest.
    _, rows, back = np.unique(
        np.nan_to_num(np.column_stack([*goal.known, blind])),
        axis=0,
        return_index=True,
        return_inverse=True,
    )
    goal = goal.at(rows)
    drawn = [chance] * goal.drawn + [0.5] * (goal.parts - goal.drawn)
    start = np.where(blind[rows], np.nan, FIRST)
    n = _smallest(_MovedParts(goal, [0.5] * goal.parts, chance, 0), start, STEP)
    low, high = (
        _smallest(_MovedParts(goal, drawn, end, goal.drawn), n, ROUGH_STEP)
        for end in RANGE
    )
    high = np.fmax(high, n)
    back = np.ravel(back)
    return Needed(n[back], np.fmin(low, n)[back], high[back], caveat)


class _MovedParts(NamedTuple):
    """A goal with all parts from index `first` on at the probability `chance`.

    The parts before `first` are at the probabilities in `middle`.
    """

    goal: PilotGoal
    middle: Sequence[float]
    chance: float
    first: int

    def ratio(self, n: Floats, rows: Rows) -> Floats:
        """Return the ratio of the pilots at some indices, for `n` values.

        Each part alone is moved to the probability `chance`. The squared changes of the
        logarithm of the ratio are added up.

        Parameters
        ----------
        n : array
            Number of values for each index.
        rows : array of int
            Indices of pilots.

        Returns
        -------
        array
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


def _smallest(goal: _MovedParts, start: Floats, step: float) -> Floats:
    """Return the smallest numbers (k,) with a ratio of at most 1.

    `step` is the relative precision. Results are NaN where the `start` of the search is
    NaN. Ratios fall about with the square root of the number, which predicts the next
    number to try.
    """
    low = np.where(np.isnan(start), np.nan, 1.0)
    high = np.full_like(start, np.inf)
    guess = np.clip(start, 2.0, MOST)
    for round_ in range(ROUNDS):
        apart = high - low > np.maximum(1.0, step * low)
        rows = np.flatnonzero(apart & (low < MOST))
        if not len(rows):
            break
        n = guess[rows]
        with np.errstate(all="ignore"):
            square = np.nan_to_num(goal.ratio(n, rows), nan=np.inf) ** 2
        enough = square <= 1.0
        # A smaller number would miss the goal by less than the step.
        low[rows] = np.where(enough, low[rows], n)
        low[rows] = np.where(enough & (square > 1.0 - step), n - 1.0, low[rows])
        high[rows] = np.where(enough, n, high[rows])
        between = np.floor(np.sqrt(low[rows] * np.minimum(high[rows], 4.0 * MOST)))
        square = np.minimum(square, MOST)
        predicted = np.minimum(np.ceil(n * square * (1.0 + step / 4.0)), MOST)
        following = predicted if round_ < PREDICTED else between
        most = np.minimum(high[rows] - 1.0, MOST)
        guess[rows] = np.clip(following, np.minimum(low[rows] + 1.0, most), most)
    return np.where(np.isnan(start), np.nan, high)
