"""How often intervals of means cover the mean, and how often comparisons find what is
not there: `python -m tests.analysis.measured_coverage` prints the tables of
`docs/decisions/intervals-of-few-values.md` and `looks-hold-together.md`, or those of
the functions that are named behind it.

All values are drawn with fixed seeds, and asked for is 95 %.
"""

import sys
from collections.abc import Callable, Iterator, Mapping
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sweep.analysis import Distribution, mean_estimate, paired_estimate
from sweep.analysis.intervals import group_bounds
from sweep.analysis.mean_bounds import (
    Declaration,
    Declared,
    Samples,
    in_full,
    mean_bounds,
)
from sweep.analysis.sequential import Width
from sweep.methods.adaptive.rule import Until, look

Floats = NDArray[np.float64]
Draw = Callable[[np.random.Generator, tuple[int, ...]], Floats]

SIZES = (3, 10, 40, 200)
FIRST_LOOKS = (3, 10, 30)
HALF_WIDTHS = (1.0, 0.5, 0.25, 0.15)
"""In standard deviations."""
NORMAL: tuple[Distribution] = ("normal",)
MOST = 400
TAIL = 0.025
SAMPLES, POINTS, PAIRS, TOGETHER = 20_000, 500, 1_000, 2_000
SEED = 14


class Values(NamedTuple):
    """Values whose mean and standard deviation are known, and what their metric would
    declare.
    """

    draw: Draw
    mean: float
    deviation: float
    distribution: Declared

    @property
    def declared(self) -> str:
        """What their metric would declare, in words."""
        of, support = in_full(self.distribution)
        words = support.words
        return of if words in ("any", "from 0") else f"{of}, {words}"


def bernoulli(chance: float) -> Values:
    """0 or 1."""
    return Values(
        lambda rng, shape: (rng.random(shape) < chance).astype(np.float64),
        chance,
        (chance * (1.0 - chance)) ** 0.5,
        "proportion",
    )


def of_fifty(chance: float) -> Values:
    """The share of 50 boids, each for itself."""
    return Values(
        lambda rng, shape: rng.binomial(50, chance, shape) / 50.0,
        chance,
        (chance * (1.0 - chance) / 50.0) ** 0.5,
        "proportion",
    )


def beta(mean: float, size: float) -> Values:
    """Shares whose variance is that of a draw over 1 + `size`."""
    return Values(
        lambda rng, shape: rng.beta(mean * size, (1.0 - mean) * size, shape),
        mean,
        (mean * (1.0 - mean) / (1.0 + size)) ** 0.5,
        "proportion",
    )


def poisson(mean: float) -> Values:
    """Events that know nothing of each other."""
    return Values(
        lambda rng, shape: rng.poisson(mean, shape).astype(np.float64),
        mean,
        mean**0.5,
        "count",
    )


def clustered(mean: float, shape: float) -> Values:
    """Negative binomial: Poisson's, with a mean that varies as a gamma distribution of
    this shape.
    """
    return Values(
        lambda rng, size: rng.poisson(rng.gamma(shape, mean / shape, size)).astype(
            np.float64
        ),
        mean,
        (mean + mean * mean / shape) ** 0.5,
        "count",
    )


def normal(distribution: Distribution) -> Values:
    """About 10 with standard deviation 1."""
    return Values(
        lambda rng, shape: rng.normal(10.0, 1.0, shape), 10.0, 1.0, distribution
    )


def lognormal(sigma: float, distribution: Distribution = "skewed") -> Values:
    """Whose logarithm is normal."""
    mean = float(np.exp(sigma**2 / 2.0))
    return Values(
        lambda rng, shape: rng.lognormal(0.0, sigma, shape),
        mean,
        mean * float(np.expm1(sigma**2)) ** 0.5,
        distribution,
    )


def exponential(distribution: Distribution = "skewed") -> Values:
    """With mean 1."""
    return Values(
        lambda rng, shape: rng.exponential(1.0, shape), 1.0, 1.0, distribution
    )


FIXED: dict[str, Values] = {
    "normal": normal("normal"),
    "normal, declared skewed": normal("skewed"),
    "exponential": exponential(),
    "lognormal, sigma 0.5": lognormal(0.5),
    "lognormal, sigma 1": lognormal(1.0),
    **{f"Bernoulli {p}": bernoulli(p) for p in (0.01, 0.02, 0.05, 0.1, 0.2, 0.3, 0.5)},
    "share of 50 boids, 0.99": of_fifty(0.99),
    "share of 50 boids, 0.5": of_fifty(0.5),
    "beta 0.9, size 10": beta(0.9, 10.0),
    "beta 0.9, size 1": beta(0.9, 1.0),
    **{f"Poisson {mean}": poisson(mean) for mean in (0.02, 0.1, 0.3, 1, 3, 30)},
    "clustered 0.3, shape 0.5": clustered(0.3, 0.5),
    "clustered 1, shape 0.5": clustered(1.0, 0.5),
    "clustered 5, shape 0.3": clustered(5.0, 0.3),
    "clustered 50, shape 1": clustered(50.0, 1.0),
}
STOPPED = {
    name: FIXED[name]
    for name in (
        *("normal", "exponential", "lognormal, sigma 1"),
        *("Bernoulli 0.01", "Bernoulli 0.05", "Bernoulli 0.3"),
        *("Poisson 0.1", "Poisson 3", "clustered 1, shape 0.5"),
    )
}
NARROW = Values(lambda rng, shape: rng.normal(0.0, 0.1, shape), 0.0, 0.1, "skewed")


def zero_inflated(zeros: float, declared: Declared) -> Values:
    """Zeros, with this chance, and else lognormal values with sigma 0.5, or uniform
    ones from 0 to 1 where such a range is declared.
    """
    ranged = in_full(declared).support.high == 1.0
    mean, square = (0.5, 1.0 / 3.0) if ranged else (np.exp(0.125), np.exp(0.5))

    def draw(rng: np.random.Generator, shape: tuple[int, ...]) -> Floats:
        others = rng.random(shape) if ranged else rng.lognormal(0.0, 0.5, shape)
        return np.where(rng.random(shape) < zeros, 0.0, others)

    rest = 1.0 - zeros
    deviation = float((rest * square - (rest * mean) ** 2) ** 0.5)
    return Values(draw, float(rest * mean), deviation, declared)


def regimes(noise: float, declared: Declared) -> Values:
    """About 0.95 with the chance 0.95, else about 0.05, with this normal noise."""
    return Values(
        lambda rng, shape: (
            np.where(rng.random(shape) < 0.95, 0.95, 0.05)
            + noise * rng.standard_normal(shape)
        ),
        0.905,
        (0.81 * 0.05 * 0.95 + noise**2) ** 0.5,
        declared,
    )


def changes(zeros: float) -> Values:
    """Differences of pairs: zeros, with this chance, else normal about 0.5."""
    return Values(
        lambda rng, shape: np.where(
            rng.random(shape) < zeros, 0.0, rng.normal(0.5, 1.0, shape)
        ),
        0.5 * (1.0 - zeros),
        (1.25 * (1.0 - zeros) - 0.25 * (1.0 - zeros) ** 2) ** 0.5,
        "normal",
    )


WITHIN = Declaration.of("normal", 0.0, 1.0)
FEW_SIZES = (3, 5, 10, 40, 200)
FEW_DISTINCT: dict[str, Values] = {
    **{f"zeros {p}": zero_inflated(p, "normal") for p in (0.8, 0.9, 0.95, 0.97)},
    **{f"zeros {p}, skewed": zero_inflated(p, "skewed") for p in (0.8, 0.95)},
    **{f"zeros {p}, range": zero_inflated(p, WITHIN) for p in (0.8, 0.9, 0.95, 0.97)},
    "two regimes": regimes(0.0, "normal"),
    "two regimes, range": regimes(0.0, WITHIN),
    "two regimes, noise 0.01": regimes(0.01, "normal"),
    **{f"changes, zeros {p}": changes(p) for p in (0.8, 0.95)},
    "negative binomial, mean 5, variance 88": clustered(5.0, 25.0 / 83.0),
    "beta 0.9, size 1, normal": beta(0.9, 1.0)._replace(distribution=WITHIN),
    "beta 0.9, size 1, share": beta(0.9, 1.0),
    "lognormal, sigma 1, normal": lognormal(1.0, "normal"),
    "lognormal, sigma 1, skewed": lognormal(1.0),
    "lognormal, sigma 1.5, skewed": lognormal(1.5),
}
"""Values of which few are distinct, or which a few values do not show."""
AGAINST: dict[str, tuple[Values, Values]] = {
    **{name: (one, one) for name, one in FEW_DISTINCT.items()},
    "zeros 0.95, against normal": (
        FEW_DISTINCT["zeros 0.95"],
        Values(lambda rng, shape: rng.normal(0.0, 0.1, shape), 0.0, 0.1, "normal"),
    ),
    "negative binomial, against Poisson 5": (
        FEW_DISTINCT["negative binomial, mean 5, variance 88"],
        poisson(5.0),
    ),
}
PAIRS_OF_SIZES = (*((n, n) for n in FEW_SIZES), (5, 40))


COMPARED: dict[str, tuple[Values, Values]] = {
    name: (FIXED[name], FIXED[name])
    for name in (
        *("normal", "normal, declared skewed", "lognormal, sigma 1"),
        *("Bernoulli 0.05", "Bernoulli 0.3", "Poisson 0.1", "Poisson 3"),
        "clustered 5, shape 0.3",
    )
} | {
    "lognormal, sigma 1, against narrow": (FIXED["lognormal, sigma 1"], NARROW),
    "exponential, against narrow": (FIXED["exponential"], NARROW),
}
"""Two kinds of values with one mean, to which the narrow ones are moved."""


def covered(
    values: Values, n: int, samples: int, distribution: Declared | None = None
) -> float:
    """The per cent of `samples` samples of `n` values whose interval has the mean."""
    rng = np.random.default_rng(SEED)
    drawn = values.draw(rng, (samples, n))
    least, largest = drawn.min(axis=1), drawn.max(axis=1)
    varies = least < largest
    mean = drawn.mean(axis=1, keepdims=True)
    second, third = (((drawn - mean) ** power).mean(axis=1) for power in (2, 3))
    skewness = np.divide(third, second**1.5, where=varies, out=np.zeros(samples)) * (
        np.sqrt(n * (n - 1.0)) / (n - 2.0)
    )
    low, high = mean_bounds(
        in_full(distribution or values.distribution).distribution,
        Samples(
            mean[:, 0],
            np.where(varies, drawn.var(axis=1, ddof=1), 0.0),
            np.full(samples, n),
            skewness,
            least,
            largest,
        ),
        TAIL,
    )
    slack = 1e-12 * abs(values.mean)
    inside = (low <= values.mean + slack) & (values.mean <= high + slack)
    return 100.0 * float(inside.mean())


class Found(NamedTuple):
    """What is found of many samples: the per cent that have an interval, and the per
    cent of these that have the mean.
    """

    known: float
    covered: float


def _found(low: Floats, high: Floats, mean: float) -> Found:
    known, slack = np.isfinite(low), 1e-12 * abs(mean)
    inside = (low <= mean + slack) & (mean - slack <= high)
    among = 100.0 * float(inside[known].mean()) if known.any() else np.nan
    return Found(100.0 * float(known.mean()), among)


def found_of_few(values: Values, n: int, samples: int) -> Found:
    """What `sweep table` finds of so many samples of `n` values."""
    drawn = values.draw(np.random.default_rng(SEED), (samples, n))
    groups = pd.Series(drawn.ravel()).groupby(np.repeat(np.arange(samples), n))
    return _found(*group_bounds(groups, 0.95, values.distribution), values.mean)


def found_at_stopping(
    values: Values, least: int, half_width: float, points: int
) -> tuple[Found, float]:
    """What is found of points where `until` stops them, and the per cent of them that
    stop before the most trials. `half_width` is in standard deviations of a value.
    """
    trials, had, until = _stopped(
        values, least, half_width, points, values.distribution
    )
    groups = pd.Series(had).groupby(np.repeat(np.arange(points), trials))
    bounds = group_bounds(groups, until.nominal, values.distribution)
    early = 100.0 * float((trials < MOST).mean())
    return _found(*bounds, values.mean), early


def covered_at_stopping(
    values: Values,
    least: int,
    half_width: float,
    points: int,
    distribution: Declared | None = None,
) -> float:
    """The per cent of `points` points whose interval has the mean when they stop, by
    the look at which `until` stops them; those that have an interval.

    `half_width` is in standard deviations of a value.
    """
    declared = distribution or values.distribution
    trials, had, until = _stopped(values, least, half_width, points, declared)
    groups = pd.Series(had).groupby(np.repeat(np.arange(points), trials))
    bounds = group_bounds(groups, until.nominal, declared)
    return _found(*bounds, values.mean).covered


def _stopped(
    values: Values, least: int, half_width: float, points: int, declared: Declared
) -> tuple[NDArray[np.int64], Floats, Until]:
    """The numbers of trials of points where `until` stops them, and their values."""
    until = Until({"x": Width(half_width * values.deviation)}, 0.95, least, MOST)
    drawn = values.draw(np.random.default_rng(SEED), (points, MOST))
    trials, open_ = np.full(points, least), True
    while open_:
        had = np.concatenate([row[:n] for row, n in zip(drawn, trials, strict=True)])
        seen = look(until, until.nominal, trials, {"x": had}, {"x": declared})
        open_, trials = bool((seen.further > trials).any()), seen.further
    return trials, had, until


def covered_together_at_stopping(
    widths: Mapping[str, Width], correlation: float, least: int, points: int
) -> tuple[float, NDArray[np.int64]]:
    """The per cent of `points` points of which all intervals have their means when they
    stop, and the numbers of their trials.

    The metrics are normal values with mean 2 and standard deviation 1, which share
    `correlation` of their variance.
    """
    until, rng = Until(widths, 0.95, least, MOST), np.random.default_rng(SEED)
    shape = (points, MOST)
    common = rng.standard_normal(shape)
    drawn = {
        name: 2.0
        + np.sqrt(correlation) * common
        + np.sqrt(1.0 - correlation) * rng.standard_normal(shape)
        for name in widths
    }
    trials, open_ = np.full(points, least), True
    while open_:
        had = {
            name: np.concatenate([row[:n] for row, n in zip(one, trials, strict=True)])
            for name, one in drawn.items()
        }
        found = look(until, until.nominal, trials, had)
        open_, trials = bool((found.further > trials).any()), found.further
    ends = np.cumsum(trials)
    covered = np.ones(points, np.bool_)
    for name, one in found.metrics.items():
        sums = np.add.reduceat(had[name], ends - trials)
        covered &= np.abs(sums / trials - 2.0) <= one.half_width
    return 100.0 * float(covered.mean()), trials


def together_table() -> Iterator[str]:
    """Coverage of one to four metrics together, and trials on average."""
    for correlation in (0.0, 0.5, 0.9):
        for count in (1, 2, 4):
            names = [f"m{k}" for k in range(count)]
            absolute, relative = Width(0.25), Width(0.125, relative=True)
            widths = dict(zip(names, [relative, absolute] * 2, strict=False))
            for least in (3, 10, 30):
                rate, trials = covered_together_at_stopping(
                    widths, correlation, least, TOGETHER
                )
                about = (str(correlation), str(least), rate, float(trials.mean()))
                yield _row(str(count), *about)


def false_alarms(
    sides: tuple[Values, Values],
    n: int,
    repeats: int,
    *,
    paired: bool,
    distribution: Declared | None = None,
    others: int | None = None,
) -> float:
    """The per cent of `repeats` differences of two samples of `n` values, or of one and
    `others`, with one mean whose interval has not the zero.
    """
    rng, (one, other) = np.random.default_rng(SEED), sides
    declared = distribution or one.distribution
    missed = 0
    for _ in range(repeats):
        first, second = one.draw(rng, (n,)), other.draw(rng, (others or n,))
        second = second + (one.mean - other.mean)
        estimate = (
            paired_estimate(second, first, declared)
            if paired
            else mean_estimate(second, first, distribution=declared)
        )
        if estimate.testable:
            low, high = estimate.interval()
            missed += not low <= 0.0 <= high
    return 100.0 * missed / repeats


def _row(name: str, *cells: float | str) -> str:
    written = [one if isinstance(one, str) else f"{one:.1f}" for one in cells]
    return f"| {' | '.join([name, *written])} |"


def fixed_table() -> Iterator[str]:
    """Coverage by the number of values, by Student's interval and by its own."""
    for name, values in FIXED.items():
        yield _row(
            name,
            values.declared,
            *(covered(values, n, SAMPLES, "normal") for n in SIZES),
            *(covered(values, n, SAMPLES) for n in SIZES),
        )


def stopped_table() -> Iterator[str]:
    """The lowest coverage of all half widths, by the first look."""
    for name, values in STOPPED.items():
        yield _row(
            name,
            values.declared,
            *(
                min(
                    covered_at_stopping(values, least, half, POINTS, declared)
                    for half in HALF_WIDTHS
                )
                for declared in (*NORMAL, None)
                for least in FIRST_LOOKS
            ),
        )


def compared_table() -> Iterator[str]:
    """False alarms of independent samples by Welch, of these, and of pairs."""
    for name, sides in COMPARED.items():
        yield _row(
            name,
            sides[0].declared,
            *(
                false_alarms(sides, n, PAIRS, paired=paired, distribution=declared)
                for declared, paired in ((*NORMAL, False), (None, False), (None, True))
                for n in SIZES[:3]
            ),
        )


def few_table() -> Iterator[str]:
    """Per cent of intervals that cover, of those that there are, and per cent of
    samples that have one, by the number of values.
    """
    for name, values in FEW_DISTINCT.items():
        found = [found_of_few(values, n, SAMPLES) for n in FEW_SIZES]
        yield _row(name, values.declared, *map(_in_short, found))


def few_stopped_table() -> Iterator[str]:
    """The same where `until` stops a point, by half width and first look, and per cent
    of the points that stop before the most trials.
    """
    for name, values in FEW_DISTINCT.items():
        found = [
            found_at_stopping(values, least, half, POINTS)
            for half in (1.0, 0.25)
            for least in FIRST_LOOKS
        ]
        cells = [f"{_in_short(one)}, {early:.0f}" for one, early in found]
        yield _row(name, values.declared, *cells)


def few_compared_table() -> Iterator[str]:
    """False alarms of independent samples of equal means, by the numbers of values."""
    for name, sides in AGAINST.items():
        cells = [
            false_alarms(sides, n, PAIRS, paired=False, others=others)
            for n, others in PAIRS_OF_SIZES
        ]
        yield _row(name, sides[0].declared, *cells)


def _in_short(found: Found) -> str:
    covered = "-" if np.isnan(found.covered) else f"{found.covered:.1f}"
    return f"{covered} ({found.known:.0f})"


TABLES = (
    *(fixed_table, stopped_table, together_table, compared_table),
    *(few_table, few_stopped_table, few_compared_table),
)


if __name__ == "__main__":
    named = {table.__name__: table for table in TABLES}
    for table in [named[name] for name in sys.argv[1:]] or TABLES:
        for row in table():
            print(row, flush=True)
        print()
