"""The bounds of a mean: one entry in BOUNDS for each way in which values may be
distributed over trials.

A metric declares its distribution and the range of its values
(`kernels.metrics.Metric`), and everything that shows a mean takes the bounds from here.
All work on k samples at once, by their moments. A mean lies in the range of its values,
so what an interval has beyond is cut off (`Support.cut`), which leaves its coverage as
it is.

Per cent of 95 % intervals that cover the mean, for 3, 10, 40 and 200 values; the whole
table, and what Student's covers, stands in `docs/decisions/intervals-of-few-values.md`:

    normal                                      95   95   95   95
    skewed: lognormal with sigma 0.5            96   95   96   96
            lognormal with sigma 1              93   93   94   95
            exponential                         96   96   96   96
            normal                              97   96   96   95
    count:  Poisson, mean 0.3                   99   93   97   95
            Poisson, mean 3                     99   98   96   95
            clustered, mean 5, variance 88      90   94   95   96
            clustered, mean 1, variance 3       80   93   95   95
    share:  0 or 1 with chance 0.01             97  100   99   98
            0 or 1 with chance 0.3              97   96   94   95
            beta 0.9, a tenth of that variance  95   96   95   95
            beta 0.9, half of that variance     69   90   97   96

They cover less than 93 % where a sample cannot know what it has not seen: the long tail
of ten lognormal values (92.6 %), and what varies among 3 to 10 counts that come in
clusters, or proportions that pile up at an end, of which often all are equal; and 40
values of two regimes with noise, of which one is rare (87 %). They cover more than 97 %
where few means are possible, as of rare and few events, for counts that vary less than
Poisson's, and for 3 values of most kinds. Two to five values are too few to show a tail
that is longer: 86 % of four lognormal ones with sigma 1.5 (FEW).

Values that are equal, but for one at most, do not show how much they vary. Events have
a width all the same. Others are bounded by the range of the metric, or not at all: NaN.
Where more than half are equal they are taken as skewed ones. So zeros among lognormal
values, 80 to 97 % of all, are covered with 96 to 100 % where there is an interval; by
Student's with 8 to 94 %.
"""

import math
from collections.abc import Callable, Mapping
from functools import partial
from types import MappingProxyType
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Bounds = tuple[Floats, Floats]
Distribution = Literal["normal", "skewed", "count", "proportion", "percentage"]

ROUNDING = 1e-9


class Support(NamedTuple):
    """The least and the largest value that there can be."""

    low: float = -math.inf
    high: float = math.inf

    @property
    def words(self) -> str:
        """In words, as `0 to 1`; "any" without an end.

        >>> Support(0.0, 1.0).words, Support(low=1.0).words, Support(high=2.0).words
        ('0 to 1', 'from 1', 'up to 2')
        """
        if math.isinf(self.low) and math.isinf(self.high):
            return "any"
        if math.isinf(self.high):
            return f"from {self.low:g}"
        if math.isinf(self.low):
            return f"up to {self.high:g}"
        return f"{self.low:g} to {self.high:g}"

    @property
    def of_differences(self) -> "Support":
        """That of the difference of two values."""
        return Support(self.low - self.high, self.high - self.low)

    def within(self, other: "Support") -> "Support":
        """What lies in both."""
        return Support(max(self.low, other.low), min(self.high, other.high))

    def holds(
        self, least: Floats | float, largest: Floats | float
    ) -> NDArray[np.bool_]:
        """Whether samples with these extremes, (k,) each, lie in it, but for rounding.
        Where one does not, what was declared is wrong.
        """
        slack = ROUNDING * np.fmax(np.abs(least), np.abs(largest))
        return np.asarray((least >= self.low - slack) & (largest <= self.high + slack))

    def cut(self, value: ArrayLike, low: ArrayLike, high: ArrayLike) -> Bounds:
        """The interval of each `value` without what lies outside; (k,) each, or one
        number each.

        It always has the value, which may lie outside by a rounding error.
        """
        return (
            np.maximum(low, np.minimum(self.low, value)),
            np.minimum(high, np.maximum(self.high, value)),
        )


ANYWHERE = Support()
SUPPORTS: Mapping[Distribution, Support] = MappingProxyType(
    {
        "count": Support(low=0.0),
        "proportion": Support(0.0, 1.0),
        "percentage": Support(0.0, 100.0),
    }
)
"""What values of a distribution lie in, whatever the metric; else anywhere."""


class Declaration(NamedTuple):
    """What is declared of the values of a metric: how they are distributed over trials,
    and what they lie in.
    """

    distribution: Distribution = "normal"
    support: Support = ANYWHERE

    @classmethod
    def of(cls, distribution: Distribution, low: float, high: float) -> "Declaration":
        """Those between `low` and `high`, and within the support of the distribution.

        >>> Declaration.of("skewed", 0.0, math.inf).support
        Support(low=0.0, high=inf)
        """
        always = SUPPORTS.get(distribution, ANYWHERE)
        return cls(distribution, always.within(Support(low, high)))

    @property
    def of_differences(self) -> "Declaration":
        """What holds of the differences of two such values."""
        return self._replace(support=self.support.of_differences)


Declared = Distribution | Declaration
"""What is said by the name of a distribution alone needs no range."""


def in_full(declared: Declared) -> Declaration:
    """What is declared, in full."""
    if isinstance(declared, Declaration):
        return declared
    return Declaration.of(declared, *ANYWHERE)


FEW = 5
"""So few values, or fewer, do not show how long the tail of skewed ones is."""
ONE_APART = 1
"""Where no more values than that differ from all others, a sample does not show how
much its values vary.
"""
HALVINGS = 40
EQUAL = 1e-12
"""Values that are nearer to each other than this part of them are equal, but for
rounding.
"""


NONE: Floats = np.zeros(())
ENDLESS: Floats = np.full((), np.inf)


class Samples(NamedTuple):
    """What is known of k samples of independent values, (k,) each, or one number each:
    the mean, variance (of n - 1), number, skewness (adjusted, G1), least and largest;
    how many values equal their median, `alike`; and between which ends there can be
    values, `low` and `high`.
    """

    mean: Floats
    variance: Floats
    n: Floats
    skewness: Floats
    least: Floats
    largest: Floats
    alike: Floats = NONE
    low: Floats = -ENDLESS
    high: Floats = ENDLESS

    @property
    def mostly_alike(self) -> NDArray[np.bool_]:
        """Whether more than half of the values are equal, so that they are not about
        normal.
        """
        return np.asarray(2.0 * self.alike > self.n)

    @property
    def constant(self) -> NDArray[np.bool_]:
        """Whether at least two values are equal, and at most ONE_APART is not."""
        return np.asarray((self.alike > 1.0) & (self.n - self.alike <= ONE_APART))

    @property
    def bounded(self) -> NDArray[np.bool_]:
        """Whether the range of the values has both ends."""
        return np.isfinite(self.low) & np.isfinite(self.high)


def equal(least: ArrayLike, largest: ArrayLike) -> NDArray[np.bool_]:
    """Whether values, (k,) each or one number, are equal, but for rounding. The error
    of their sums would pass for a variance.
    """
    return np.asarray(np.isclose(least, largest, rtol=EQUAL, atol=0.0))


def mean_bounds(
    distribution: Distribution, samples: Samples, tail: ArrayLike
) -> Bounds:
    """The two bounds of the mean of each sample, each of which is missed with the
    chance `tail`, above 0 and at most 0.5: a number, or (k,).

    NaN for samples of fewer than two values, and for `constant` ones whose values have
    no range and are no events.
    """
    known = Samples(*(np.asarray(one, np.float64) for one in samples))
    several = known._replace(n=np.where(known.n > 1, known.n, np.nan))
    with np.errstate(all="ignore"):
        return BOUNDS[distribution](several, np.asarray(tail, np.float64))


def _normal(samples: Samples, tail: Floats) -> Bounds:
    """Student's: for means that are about normal. Where more than half of the values
    are equal they are not, whatever is declared.
    """
    found = _where(
        samples.mostly_alike, _widest(samples, tail), _student(samples, tail)
    )
    return _where(samples.constant, _within_range(samples, tail), found)


def _skewed(samples: Samples, tail: Floats) -> Bounds:
    """The widest of three, or what the range says of constant samples."""
    found = _widest(samples, tail)
    return _where(samples.constant, _within_range(samples, tail), found)


def _within_range(samples: Samples, tail: Floats) -> Bounds:
    """What the range of the values says of the mean of a constant sample; NaN where the
    range has not both ends.

    As many values may differ from the commonest one as the exact upper bound of their
    share allows (Clopper and Pearson 1934, Biometrika 26, 404-413), and all of these
    may lie at one end of the range.
    """
    from scipy.special import betaincinv

    apart = samples.n - samples.alike
    share = betaincinv(apart + 1.0, samples.alike, 1.0 - tail)
    nearer = samples.mean - samples.least < samples.largest - samples.mean
    commonest = np.where(nearer, samples.least, samples.largest)
    share = np.where(samples.bounded, share, np.nan)
    # A value may lie outside by a rounding error.
    below = np.maximum(commonest - samples.low, 0.0)
    above = np.maximum(samples.high - commonest, 0.0)
    return commonest - share * below, commonest + share * above


def _student(samples: Samples, tail: Floats) -> Bounds:
    half = _quantile(samples, tail) * _error(samples)
    return samples.mean - half, samples.mean + half


def _widest(samples: Samples, tail: Floats) -> Bounds:
    """The widest of three: Student's, the same with the skewness taken out, and, where
    no value is below zero, Student's of the logarithm of the mean (by the delta
    method).

    The second needs some ten values to know the skewness; the third holds before. The
    first is for differences of skewed values, which are about symmetric and whose
    skewness is mostly noise.
    """
    everywhere = np.ones(np.shape(samples.mean), np.bool_)
    low, high = _wider(
        _student(samples, tail), _without_skewness(samples, tail), everywhere
    )
    ratio = np.exp(_quantile(samples, tail) * _error(samples) / samples.mean)
    positive = (samples.least >= 0.0) & (samples.mean > 0.0)
    return (
        np.where(positive, np.fmin(low, samples.mean / ratio), low),
        np.where(positive, np.fmax(high, samples.mean * ratio), high),
    )


def _without_skewness(samples: Samples, tail: Floats) -> Bounds:
    """Hall's (1992, J. R. Stat. Soc. B 54, 221-228): a cubic function of Student's t
    has no skewness, so its quantiles are taken back through that function.
    """
    root, quantile = np.sqrt(samples.n), _quantile(samples, tail)
    slope = samples.skewness / (3.0 * root)

    def back(corrected: Floats) -> Floats:
        moved = corrected - slope / 2.0
        return np.where(
            np.abs(slope) > ROUNDING,
            (np.cbrt(1.0 + 3.0 * slope * moved) - 1.0) / slope,
            moved,
        )

    error = _error(samples)
    return samples.mean - error * back(quantile), samples.mean - error * back(-quantile)


def _count(samples: Samples, tail: Floats) -> Bounds:
    """The mid-P interval of Poisson's distribution for all events together.

    Where values vary more, there are effectively fewer trials: by the variance over the
    mean (quasi-Poisson; McCullagh and Nelder 1989, section 6.2), and, as that is
    estimated, by the square of Student's quantile over the normal one. Where the
    variance alone is above the mean, it is the wider of this and Hall's. It is never
    narrower than Poisson's, so that equal counts, all zero too, have a width. Student's
    for values below zero, which are no counts.
    """
    widened = samples.variance * _widening(samples, tail)
    size = samples.n * np.where(
        widened > samples.mean, samples.mean / widened, np.ones_like(widened)
    )
    events = samples.mean * size
    low, high = _poisson(events, tail, upper=False), _poisson(events, tail, upper=True)
    hall = _without_skewness(samples, tail)
    found = _wider(
        (low / size, high / size),
        (np.fmax(hall[0], 0.0), hall[1]),
        samples.variance > samples.mean * (1.0 + ROUNDING),
    )
    return _where(samples.least >= 0.0, found, _normal(samples, tail))


def _share(samples: Samples, tail: Floats, whole: float) -> Bounds:
    """The mid-P interval of the binomial distribution, for values from 0 to `whole`.

    Values of 0 and `whole` alone are single draws. Others vary less, and there are
    effectively more draws: by the largest variance that values of this mean may have
    over their own, and by Student's quantile over the normal one (Korn and Graubard
    1998, Survey Methodology 24, 193-201). Then it is the wider of this and Hall's.
    Equal values say nothing of how they vary, so each is taken for one draw. Student's
    for values outside.
    """
    mean = samples.mean / whole
    largest = mean * (1.0 - mean)
    variance = samples.variance / whole**2
    widened = variance * _widening(samples, tail)
    narrower = (widened > 0.0) & (widened < largest)
    size = samples.n * np.where(narrower, largest / widened, np.ones_like(widened))
    low = _binomial(mean * size, size, tail)
    high = 1.0 - _binomial((1.0 - mean) * size, size, tail)
    of_n = variance * (samples.n - 1.0) / samples.n
    between = (variance > 0.0) & (of_n < largest * (1.0 - ROUNDING))
    hall = _without_skewness(samples, tail)
    found = _wider(
        (whole * low, whole * high),
        (np.fmax(hall[0], 0.0), np.fmin(hall[1], whole)),
        between,
    )
    inside = (samples.least >= 0.0) & (samples.largest <= whole)
    return _where(inside, found, _normal(samples, tail))


BOUNDS: Mapping[Distribution, Callable[[Samples, Floats], Bounds]] = MappingProxyType(
    {
        "normal": _normal,
        "skewed": _skewed,
        "count": _count,
        "proportion": partial(_share, whole=1.0),
        "percentage": partial(_share, whole=100.0),
    }
)
EVENTS: tuple[Distribution, ...] = ("count", "proportion", "percentage")
"""Those whose variance follows from the mean, so that equal values have a width."""


def _error(samples: Samples) -> Floats:
    return np.asarray(np.sqrt(samples.variance / samples.n))


def _quantile(samples: Samples, tail: Floats) -> Floats:
    """Student's quantile that is exceeded with the chance `tail`."""
    from scipy.special import stdtrit

    return -np.asarray(stdtrit(samples.n - 1.0, tail), np.float64)


def _widening(samples: Samples, tail: Floats) -> Floats:
    """The square of Student's quantile over the normal one; 1 for the median."""
    from scipy.special import ndtri

    normal = -np.asarray(ndtri(tail), np.float64)
    ratio = np.where(normal > 0.0, _quantile(samples, tail) / normal, 1.0)
    return np.asarray(ratio * ratio)


def _wider(one: Bounds, other: Bounds, where: NDArray[np.bool_]) -> Bounds:
    both = np.fmin(one[0], other[0]), np.fmax(one[1], other[1])
    return _where(where, both, one)


def _where(where: NDArray[np.bool_], one: Bounds, other: Bounds) -> Bounds:
    return np.where(where, one[0], other[0]), np.where(where, one[1], other[1])


def _poisson(events: Floats, tail: Floats, *, upper: bool) -> Floats:
    """The mean at which so few (`upper`) or so many `events` have the chance `tail`,
    half of the chance of just so many taken (mid-P; Lancaster 1961, J. Am. Stat. Assoc.
    56, 223-234).
    """
    from scipy.special import gammainc, gammaincc, gammainccinv, gammaincinv

    some = events > 0.0
    shape = np.where(some, events, 1.0)
    if upper:
        first = np.where(some, gammainccinv(shape, tail), 0.0)
        return _halved(
            lambda mean: (
                gammaincc(events + 1.0, mean)
                + np.where(some, gammaincc(shape, mean), 0.0)
                < 2.0 * tail
            ),
            first,
            gammainccinv(events + 1.0, tail),
        )
    found = _halved(
        lambda mean: gammainc(events + 1.0, mean) + gammainc(shape, mean) > 2.0 * tail,
        gammaincinv(shape, tail),
        gammaincinv(events + 1.0, tail),
    )
    return np.where(some, found, np.where(np.isnan(events), np.nan, 0.0))


def _binomial(events: Floats, draws: Floats, tail: Floats) -> Floats:
    """The chance of one draw at which so many `events` of all `draws` have the chance
    `tail`, half of the chance of just so many taken (mid-P).
    """
    from scipy.special import betainc, betaincinv

    some, all_ = events > 0.0, events >= draws
    least = np.where(some, events, 1.0)
    most = np.where(all_, 1.0, draws - events)

    def as_many(chance: Floats) -> Floats:
        beyond = np.where(all_, 0.0, betainc(events + 1.0, most, chance))
        return np.asarray(
            betainc(least, np.where(all_, 0.0, draws - events) + 1.0, chance) + beyond
        )

    found = _halved(
        lambda chance: as_many(chance) > 2.0 * tail,
        betaincinv(least, np.where(all_, 0.0, draws - events) + 1.0, tail),
        np.where(all_, 1.0, betaincinv(events + 1.0, most, tail)),
    )
    return np.where(some, found, np.where(np.isnan(events), np.nan, 0.0))


def _halved(
    beyond: Callable[[Floats], NDArray[np.bool_]], low: ArrayLike, high: ArrayLike
) -> Floats:
    """Where `beyond` turns true between two arrays, by halving."""
    first, last = np.broadcast_arrays(
        np.asarray(low, np.float64), np.asarray(high, np.float64)
    )
    for _ in range(HALVINGS):
        middle = (first + last) / 2.0
        far = beyond(middle)
        first, last = np.where(far, first, middle), np.where(far, middle, last)
    return np.asarray((first + last) / 2.0)
