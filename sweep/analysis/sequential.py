"""Repeated confidence intervals, which hold at all looks together.

A look after every few trials that stops as soon as the interval is narrow takes the
moments at which the values happen to be close together. The usual interval then covers
less often than stated. Here the intervals of all looks together cover the mean with the
stated confidence (Jennison and Turnbull 1984, Controlled Clinical Trials 5, 33-45;
1989, J. R. Stat. Soc. B 51, 305-361). So does the interval at which a point stops, for
whatever reason it stopped.

Each look takes the interval for the distribution of the values, at one common, higher
confidence, the nominal one. The interval is Student's for normal values; intervals for
other distributions approach it with many trials. For independent normal values the
sequence of t statistics depends neither on the mean nor on the variance. So one
simulation finds the nominal confidence. Looking has a price: with a first look at 10,
where the known standard deviation would ask for 31 trials, a point takes 2.2 times as
many on average with `max` 200 and 2.4 times with 1000; where for 123, 2.3 times with
1000. With a first look at 3 these are 2.4, 2.6 and 2.5.

Of M metrics each has 1 - (1 - confidence) / M in place of the confidence (Bonferroni).
So the intervals of all looks at all metrics hold together, however the metrics depend
on each other.

The coverage at the end is higher than stated: of the intervals at which normal points
stop, 99 % cover the mean (min 3: 98.7 %), as most errors at other looks did not happen.
See `repeated_interval` for other distributions. Values that depend on each other are
not covered; trials of one point are independent, as each has its own random numbers.
"""

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sweep.analysis.mean_bounds import Declared

if TYPE_CHECKING:
    from sweep.analysis.intervals import Interval

Floats = NDArray[np.float64]
Counts = NDArray[np.int64]

GROWTH = 1.25
"""Factor by which the number of trials grows from one look to the next."""
PATHS = 400_000
SEED = 20240611
LEAST_LOOK = 3
"""The fewest trials of a point at its first look."""
MOST_METRICS = 10
"""The most metrics of a rule: of more, PATHS would be too few for each confidence."""
SAFETY = 2.0
"""Standard errors of the simulation that the nominal confidence is on the safe side.

That is 0.07 % at 95 %.
"""


class Width(NamedTuple):
    """The largest half-width of a confidence interval.

    Attributes
    ----------
    half
        The half-width, in the unit of the metric, or as a fraction of the mean.
    relative
        Whether the half-width is a fraction of the mean.
    """

    half: float
    relative: bool = False

    def allowed(self, means: Floats) -> Floats:
        """Return the half-width allowed for each mean, in the unit of the metric."""
        return (
            self.half * np.abs(means)
            if self.relative
            else np.full_like(means, self.half)
        )

    def as_json(self) -> float | str:
        """Return the value that a spec has: 0.02, or "5%"."""
        if not self.relative:
            return self.half
        return f"{100.0 * self.half:.9f}".rstrip("0").rstrip(".") + "%"

    @property
    def in_words(self) -> str:
        """The half-width as text for a reader."""
        width = self.as_json()
        return f"{width} of its mean" if isinstance(width, str) else f"{width:g}"


def looks(least: int, most: int) -> tuple[int, ...]:
    """Return the numbers of trials of all looks, from `least` to `most`.

    Each is a quarter more than the one before, and at least one more.
    """
    numbers = [least]
    while numbers[-1] < most:
        numbers.append(min(most, max(numbers[-1] + 1, math.ceil(GROWTH * numbers[-1]))))
    return tuple(numbers)


@lru_cache(maxsize=64)
def nominal_confidence(looks: tuple[int, ...], confidence: float) -> float:
    """Return the confidence of the interval at each look that makes all looks hold.

    Student's intervals of all `looks` then cover the mean together with `confidence`.
    The value comes from PATHS simulated sequences of normal values with a fixed seed,
    and is rounded up to the safe side.
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
    """Return the smallest two-sided p of each path, shape (PATHS,).

    That is of Student's test of the true mean, over all looks; 1 above `largest`.
    Between two looks only the sum of the new values and the sum of their squares are
    drawn.
    """
    from scipy.special import stdtr, stdtrit

    rng = np.random.default_rng(SEED)
    total = np.zeros(PATHS)
    squares = np.zeros(PATHS)
    smallest = np.ones(PATHS)
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
    """Return the mean of independent values and its repeated confidence interval.

    Valid at whichever look, and for whatever reason that look was chosen.

    Parameters
    ----------
    values : array_like
        Independent values, shape (n,), where n is one of `looks`. NaN does not count,
        and is taken to be missing whatever the value would have been.
    looks : sequence of int
        The numbers of trials of all looks.
    confidence : float, default 0.95
        The confidence with which the intervals of all looks hold together.
    distribution : Declared, default "normal"
        Distribution and range of the values, see `sweep.analysis.mean_bounds`.

    Returns
    -------
    Interval

    Raises
    ------
    ValueError
        If n is not one of the looks.

    Notes
    -----
    Per cent of 95 % intervals that cover the mean where points stop, the lowest of four
    half widths from 1 to 0.15 standard deviations, at most 400 trials, by the number of
    trials at first look; 500 points each. The whole table is in
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
