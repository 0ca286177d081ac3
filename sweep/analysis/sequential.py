"""When a point has enough trials: repeated confidence intervals, which hold at all
looks together.

Whoever looks after every few trials and stops as soon as the interval is narrow takes
the moments at which the values happen to lie close together: the usual interval then
covers less often than it says. Here the intervals of all looks cover the mean together
with the stated confidence (Jennison and Turnbull 1984, Controlled Clinical Trials 5,
33-45; 1989, J. R. Stat. Soc. B 51, 305-361), so the one at which a point stops does,
whatever made it stop.

Each look takes the interval that holds for the distribution of the values, at one
common, higher confidence, the nominal one. That is Student's for normal values, and
those of others come to it with many trials. For independent normal values the sequence
of t statistics depends neither on their mean nor on their variance, so that confidence
is found by a simulation once for all. It is the price of looking: with a first look at
10, where the known standard deviation would ask for 31 trials, a point takes 2.2 times
as many on average with `max` 200 and 2.4 times with 1000; where for 123, 2.3 times with
1000. With a first look at 3 these are 2.4, 2.6 and 2.5.

Several metrics share what may go wrong: each has 1 - (1 - confidence) / M in place of
the confidence, with M metrics (Bonferroni), so that the intervals of all looks of all
of them hold together, however they depend on each other.

It buys more than is seen at the end: of the intervals at which normal points stop, 99 %
cover the mean (min 3: 98.7 %), as most of what could go wrong at other looks did not.
For others see `repeated_interval`. Values that depend on each other are not
covered; trials of one point never do, as each has random numbers of its own.
"""

import math
from collections.abc import Mapping, Sequence
from functools import lru_cache
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sweep.analysis.mean_bounds import Declared

if TYPE_CHECKING:
    from sweep.analysis.intervals import Interval

Floats = NDArray[np.float64]
Counts = NDArray[np.int64]

GROWTH = 1.25
"""By which factor the number of trials grows from one look to the next."""

PATHS = 400_000
SEED = 20240611
ALL_NORMAL: Mapping[str, Declared] = MappingProxyType({})
LEAST_LOOK = 3
"""The fewest trials of a point at its first look."""
MOST_METRICS = 10
"""The most metrics of a rule: of more, PATHS would be too few for each confidence."""
SAFETY = 2.0
"""Standard errors of the simulation by which the nominal confidence is on the safe
side: 0.07 % at 95 %.
"""


class Width(NamedTuple):
    """How wide the half of an interval may be: so much in the unit of the metric, or
    such a share of the mean, `relative`.
    """

    half: float
    relative: bool = False

    def allowed(self, means: Floats) -> Floats:
        """The half width that is allowed for each mean, in the unit of the metric."""
        return (
            self.half * np.abs(means)
            if self.relative
            else np.full_like(means, self.half)
        )

    def as_json(self) -> float | str:
        """As a spec has it: 0.02, or "5%"."""
        if not self.relative:
            return self.half
        return f"{100.0 * self.half:.9f}".rstrip("0").rstrip(".") + "%"

    @property
    def in_words(self) -> str:
        """How wide it may be, as a reader has it."""
        width = self.as_json()
        return f"{width} of its mean" if isinstance(width, str) else f"{width:g}"


def looks(least: int, most: int) -> tuple[int, ...]:
    """Numbers of trials from `least` to `most`, each a quarter more than the one
    before, and at least one more.
    """
    numbers = [least]
    while numbers[-1] < most:
        numbers.append(min(most, max(numbers[-1] + 1, math.ceil(GROWTH * numbers[-1]))))
    return tuple(numbers)


@lru_cache(maxsize=64)
def nominal_confidence(looks: tuple[int, ...], confidence: float) -> float:
    """The confidence at which Student's intervals of all `looks` cover the mean
    together with `confidence`.

    By a simulation of PATHS sequences of normal values with a fixed seed, rounded up to
    the safe side.
    """
    if len(looks) == 1:
        return confidence
    missing = 1.0 - confidence
    allowed = PATHS * missing - SAFETY * math.sqrt(PATHS * missing * confidence)
    level = float(np.partition(_smallest_p(looks, missing), int(allowed))[int(allowed)])
    digits = 2 - math.floor(math.log10(level))
    scale = 10.0**digits
    return 1.0 - math.floor(level * scale) / scale


def _smallest_p(looks: tuple[int, ...], largest: float) -> Floats:
    """The smallest two-sided p of Student's test of the true mean over the looks of
    each path; 1 above `largest`.

    Between two looks only the sum of the new values and the sum of their squares are
    drawn.
    """
    from scipy.special import stdtr, stdtrit

    rng = np.random.default_rng(SEED)
    total, squares, smallest = np.zeros(PATHS), np.zeros(PATHS), np.ones(PATHS)
    for before, n in zip((0, *looks), looks, strict=False):
        normal = rng.standard_normal(PATHS)
        total += math.sqrt(n - before) * normal
        squares += normal * normal
        if n - before > 1:
            squares += rng.chisquare(n - before - 1, PATHS)
        t = np.abs(total) / np.sqrt(n * (squares - total * total / n) / (n - 1))
        far = t > -stdtrit(n - 1, largest / 2)
        smallest[far] = np.minimum(smallest[far], 2.0 * stdtr(n - 1, -t[far]))
    return smallest


def repeated_interval(
    values: ArrayLike,
    looks: Sequence[int],
    confidence: float = 0.95,
    distribution: Declared = "normal",
) -> "Interval":
    """The mean of `values` (n,) and its repeated confidence interval, where n is one of
    `looks`.

    It is the interval that values of this `distribution` have, see
    `sweep.analysis.mean_bounds`, at the nominal confidence. Valid for independent
    values whichever look it is and why ever that one was chosen. NaN does not count
    among the values, and is taken to be missing whatever the value would have been.
    Raises ValueError where n is none of the looks.

    Per cent of 95 % intervals that cover the mean where points stop, the lowest of four
    half widths from 1 to 0.15 standard deviations, at most 400 trials, by the number of
    trials at first look; 500 points each, the whole table stands in
    `docs/decisions/looks-hold-together.md`:

        first look                      3     10     30
        normal                         98     99     99
        exponential                    99     99     99
        lognormal, sigma 1             96     95     98
        Bernoulli 0.01                 99     99     99
        Bernoulli 0.05                100    100    100
        Bernoulli 0.3                  99     99     99
        Poisson 0.1                   100     99     99
        Poisson 3                      99     99     99
        clustered 1, shape 0.5         97     97     99

    Most are above 97 %, as most of what could go wrong at other looks did not. Skewed
    values that are declared "normal" are covered with 89 % at worst, those that pile up
    at an end of their range with 58 %, and two regimes with noise, one of them rare,
    with 28 % (`docs/decisions/intervals-of-few-values.md`).
    """
    from sweep.analysis.intervals import mean_interval

    array = np.asarray(values, np.float64)
    if len(array) not in looks:
        raise ValueError(
            f"values: {len(array)} of them; allowed: as many as a look has,"
            f" {', '.join(map(str, looks))}"
        )
    nominal = nominal_confidence(tuple(looks), confidence)
    return mean_interval(array, nominal, distribution=distribution)
