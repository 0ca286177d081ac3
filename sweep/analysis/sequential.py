"""Repeated confidence intervals, which are simultaneous over all looks.

A rule that looks after every few trials, and stops as soon as the interval is narrow,
selects moments at which the values happen to be close together. The usual interval then
covers less often than stated. Here the intervals of all looks simultaneously cover the
mean with the stated confidence (Jennison and Turnbull 1984, Controlled Clinical Trials
5, 33-45; 1989, J. R. Stat. Soc. B 51, 305-361). The interval at which a point stops
therefore has at least the stated confidence, for any reason to stop.

Each look uses the interval for the distribution of the values, at a common, higher
confidence: the nominal confidence. The interval is Student's for normal values;
intervals for all other distributions approach Student's with many trials. For
independent normal values the sequence of t statistics depends neither on the mean nor
on the variance. So a single simulation finds the nominal confidence.

Looking costs trials. The example has a first look at 10. If the known standard
deviation requires 31 trials, a point takes on average 2.2 times as many with `max` 200,
and 2.4 times with `max` 1000. If 123 trials are required, the factor is 2.3 with `max`
1000. With a first look at 3, the factors are 2.4, 2.6 and 2.5.

With M metrics, each metric has the confidence 1 - (1 - confidence) / M (Bonferroni). So
the intervals of all looks at all metrics are simultaneous, for any dependence between
metrics.

The coverage at the end is higher than stated, because most possible errors at the
remaining looks did not happen. Of the intervals at which normal points stop, 99 % cover
the mean (min 3: 98.7 %). See `repeated_interval` for further distributions. The method
is not valid for dependent values. Trials of a point are independent, because each trial
has separate random numbers.
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
"""Fewest trials of a point at the first look."""
MOST_METRICS = 10
"""Most metrics of a rule; for more metrics PATHS would be too few."""
SAFETY = 2.0
"""Safety margin of the nominal confidence, in standard errors of the simulation.

The margin is 0.07 % at 95 %.
"""


class Width(NamedTuple):
    """The largest half-width of a confidence interval.

    Attributes
    ----------
    half : float
        The half-width, in the unit of the metric, or as a fraction of the mean.
    relative : bool, default False
        True if the half-width is a fraction of the mean.
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
        """Return the value as in a spec: 0.02, or "5%"."""
        if not self.relative:
            return self.half
        return f"{100.0 * self.half:.9f}".rstrip("0").rstrip(".") + "%"

    @property
    def in_words(self) -> str:
        """The half-width as a readable string."""
        width = self.as_json()
        return f"{width} of its mean" if isinstance(width, str) else f"{width:g}"


def looks(least: int, most: int) -> tuple[int, ...]:
    """Return the numbers of trials of all looks, from `least` to `most`.

    Each number is a quarter more than the previous number, and at least 1 more.
    """
    numbers = [least]
    while numbers[-1] < most:
        numbers.append(min(most, max(numbers[-1] + 1, math.ceil(GROWTH * numbers[-1]))))
    return tuple(numbers)


@lru_cache(maxsize=64)
def nominal_confidence(looks: tuple[int, ...], confidence: float) -> float:
    """Return the confidence at each look that makes the intervals simultaneous.

    Student's intervals of all `looks` then cover the mean simultaneously with
    `confidence`. The value comes from PATHS simulated sequences of normal values with a
    fixed seed, and is rounded up to the safe side.
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
    """Return the smallest two-sided p-value of each path, shape (PATHS,).

    The p-values are Student's, for the true mean, over all looks; values above
    `largest` are 1. Between two looks only the sum of the new values and the sum of
    their squares are drawn.
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
    """Return the mean of independent values and a repeated confidence interval.

    The interval is valid at any look, for any reason to choose the look.

    Parameters
    ----------
    values : array_like
        Independent values, shape (n,), where n is in `looks`. NaN does not count;
        values are assumed to be missing independently of their size.
    looks : sequence of int
        Numbers of trials of all looks.
    confidence : float, default 0.95
        Simultaneous confidence of the intervals of all looks.
    distribution : Declared, default "normal"
        Distribution and range of the values, see `sweep.analysis.mean_bounds`.

    Returns
    -------
    Interval

    Raises
    ------
    ValueError
        If n is not in `looks`.

    Notes
    -----
    Coverage in per cent of the 95 % intervals at which points stop, by the number of
    trials at the first look. Each number is the lowest coverage for four half-widths
    from 1 to 0.15 standard deviations, with at most 400 trials and 500 points each. The
    complete table is in `docs/decisions/looks-hold-together.md`:

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

    Most coverages are above 97 %, because most possible errors at the remaining looks
    did not happen. The lowest coverage is 89 % for skewed values that are declared
    "normal". The lowest coverage is 58 % for values that pile up at an end of the
    range, and 28 % for noise in two regimes, a common and a rare regime
    (`docs/decisions/intervals-of-few-values.md`).
    """
    from sweep.analysis.intervals import mean_interval

    array = np.asarray(values, np.float64)
    if len(array) not in looks:
        raise ValueError(
            f"values: {len(array)}; allowed: the number of trials of a look,"
            f" {', '.join(map(str, looks))}"
        )
    nominal = nominal_confidence(tuple(looks), confidence)
    return mean_interval(array, nominal, distribution=distribution)
