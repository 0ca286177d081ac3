"""How often the promise of a pilot is kept: `python -m
tests.analysis.measured_replication` prints the tables of
`docs/decisions/replicates-from-a-pilot.md`.

All values are drawn with fixed seeds, and promised are 80 %.
"""

import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.random import Generator
from numpy.typing import NDArray

from sweep.analysis import Contrast, independent_contrast, paired_contrast
from sweep.analysis.intervals import group_bounds
from sweep.analysis.mean_bounds import Distribution
from sweep.analysis.replication import (
    MOST,
    values_for_difference,
    values_for_width,
)
from sweep.analysis.sequential import Width

Floats = NDArray[np.float64]
Draw = Callable[[Generator, int], Floats]
DrawTwo = Callable[[Generator, int], tuple[Floats, Floats]]

PILOTS = (5, 10, 20, 40)
REPEATS = 2000
SEED = 15


class Narrow(NamedTuple):
    """Values, what their metric would declare, and a half width."""

    draw: Draw
    distribution: Distribution
    width: Width


class Apart(NamedTuple):
    """Values of two sides, what their metric would declare, by how much their means
    differ, and whether they are pairs.
    """

    draw: DrawTwo
    distribution: Distribution
    size: float
    paired: bool = False


def _normal(rng: Generator, n: int) -> Floats:
    return rng.normal(5.0, 1.0, n)


def _lognormal(sigma: float) -> Draw:
    return lambda rng, n: rng.lognormal(0.0, sigma, n)


def _bernoulli(chance: float) -> Draw:
    return lambda rng, n: (rng.random(n) < chance).astype(np.float64)


def _poisson(mean: float) -> Draw:
    return lambda rng, n: rng.poisson(mean, n).astype(np.float64)


def _clustered(rng: Generator, n: int) -> Floats:
    return rng.poisson(rng.gamma(1.0, 3.0, n)).astype(np.float64)


def _exponential(rng: Generator, n: int) -> Floats:
    return rng.exponential(1.0, n)


def _beta(rng: Generator, n: int) -> Floats:
    return rng.beta(9.0, 1.0, n)


def _two(first: Draw, second: Draw, by: float = 0.0) -> DrawTwo:
    """Independent sides, the first moved by so much."""
    return lambda rng, n: (first(rng, n) + by, second(rng, n))


def _scaled(sigma: float) -> DrawTwo:
    """Lognormal sides, the mean of the first larger by half."""
    draw = _lognormal(sigma)
    return lambda rng, n: (1.5 * draw(rng, n), draw(rng, n))


def _normal_pairs(rng: Generator, n: int) -> tuple[Floats, Floats]:
    common = rng.normal(0.0, 1.0, n)
    first, second = (common + rng.normal(5.0, 0.5, n) for _ in range(2))
    return first + 0.3, second


def _lognormal_pairs(rng: Generator, n: int) -> tuple[Floats, Floats]:
    common = rng.normal(0.0, 0.5, n)
    first, second = (np.exp(common + rng.normal(0.0, 0.5, n)) for _ in range(2))
    return first + 0.4, second


def _event_pairs(rng: Generator, n: int) -> tuple[Floats, Floats]:
    common = rng.random(n)
    first, second = (np.where(rng.random(n) < 0.5, common, rng.random(n)) for _ in "ab")
    return (first < 0.5).astype(np.float64), (second < 0.3).astype(np.float64)


NARROW: Mapping[str, Narrow] = {
    "normal": Narrow(_normal, "normal", Width(0.3)),
    "normal, share of the mean": Narrow(_normal, "normal", Width(0.06, True)),
    "normal, declared skewed": Narrow(_normal, "skewed", Width(0.3)),
    "lognormal, sigma 0.5": Narrow(_lognormal(0.5), "skewed", Width(0.2)),
    "the same, share of the mean": Narrow(_lognormal(0.5), "skewed", Width(0.15, True)),
    "lognormal, sigma 1": Narrow(_lognormal(1.0), "skewed", Width(0.5)),
    "lognormal, sigma 1, share of the mean": Narrow(
        _lognormal(1.0), "skewed", Width(0.25, True)
    ),
    "exponential": Narrow(_exponential, "skewed", Width(0.3)),
    "Bernoulli 0.05": Narrow(_bernoulli(0.05), "proportion", Width(0.04)),
    "Bernoulli 0.5": Narrow(_bernoulli(0.5), "proportion", Width(0.1)),
    "beta 0.9, size 10": Narrow(_beta, "proportion", Width(0.03)),
    "Poisson 0.3": Narrow(_poisson(0.3), "count", Width(0.12)),
    "Poisson 3": Narrow(_poisson(3.0), "count", Width(0.4)),
    "Poisson 3, share of the mean": Narrow(_poisson(3.0), "count", Width(0.15, True)),
    "clustered 3, shape 1": Narrow(_clustered, "count", Width(0.8)),
}
APART: Mapping[str, Apart] = {
    "normal": Apart(_two(_normal, _normal, 0.5), "normal", 0.5),
    "normal pairs": Apart(_normal_pairs, "normal", 0.3, True),
    "lognormal, sigma 0.5": Apart(_scaled(0.5), "skewed", 0.5 * np.exp(0.125)),
    "lognormal, sigma 1": Apart(_scaled(1.0), "skewed", 0.5 * np.exp(0.5)),
    "lognormal pairs": Apart(_lognormal_pairs, "skewed", 0.4, True),
    "Bernoulli 0.05 and 0.15": Apart(
        _two(_bernoulli(0.15), _bernoulli(0.05)), "proportion", 0.1
    ),
    "Bernoulli 0.5 and 0.7": Apart(
        _two(_bernoulli(0.7), _bernoulli(0.5)), "proportion", 0.2
    ),
    "Bernoulli pairs": Apart(_event_pairs, "proportion", 0.2, True),
    "Poisson 0.3 and 0.6": Apart(_two(_poisson(0.6), _poisson(0.3)), "count", 0.3),
    "Poisson 3 and 4": Apart(_two(_poisson(4.0), _poisson(3.0)), "count", 1.0),
}


class Kept(NamedTuple):
    """The per cent of pilots after which the goal was reached, and how many values the
    median pilot asks for.
    """

    chance: float
    median: float


def kept_width(kind: Narrow, size: int, repeats: int, seed: int = SEED) -> Kept:
    """After pilots of so many values each. More than a million values are taken to
    reach any width, and a pilot without an answer keeps nothing.
    """
    rng = np.random.default_rng(seed)
    pilots = [kind.draw(rng, size) for _ in range(repeats)]
    needed = values_for_width(pilots, kind.width, kind.distribution).n
    reached = [_squared(kind, int(n), 1, rng)[0] <= 1.0 for n in needed if n <= MOST]
    return _kept(needed, reached)


def _squared(kind: Narrow, n: int, repeats: int, rng: Generator) -> Floats:
    """The squares of the half widths of samples over the allowed one (repeats,)."""
    values = pd.Series(kind.draw(rng, n * repeats))
    groups = values.groupby(np.repeat(np.arange(repeats), n))
    low, high = group_bounds(groups, 0.95, kind.distribution)
    allowed = kind.width.allowed(groups.mean().to_numpy(np.float64))
    return np.asarray(((high - low) / 2.0 / allowed) ** 2)


def enough_for_width(kind: Narrow) -> float:
    """About how many values reach the half width with 80 %, by simulation."""
    rng, n = np.random.default_rng(SEED), 50.0
    for _ in range(5):
        n *= float(np.quantile(_squared(kind, round(n), REPEATS, rng), 0.8))
    return n


def kept_difference(kind: Apart, size: int, repeats: int, seed: int = SEED) -> Kept:
    """The same of differences, noticed with the sign that they have."""
    rng = np.random.default_rng(seed)
    pilots = [_contrast(kind, size, rng) for _ in range(repeats)]
    needed = values_for_difference(pilots, np.full(repeats, kind.size)).n
    noticed = [_noticed(kind, int(n), rng) for n in needed if n <= MOST]
    return _kept(needed, noticed)


def _noticed(kind: Apart, n: int, rng: Generator) -> bool:
    return _contrast(kind, n, rng).interval()[0] > 0.0


def enough_for_difference(kind: Apart) -> float:
    """About how many values notice the difference with 80 %, by simulation."""
    rng, low, high = np.random.default_rng(SEED), 4.0, 1024.0
    while high > 1.03 * low:
        n = (low * high) ** 0.5
        share = np.mean([_noticed(kind, round(n), rng) for _ in range(REPEATS)])
        low, high = (low, n) if share > 0.8 else (n, high)
    return high


def _kept(needed: Floats, reached: Sequence[bool]) -> Kept:
    total = sum(reached) + int(np.isposinf(needed).sum())
    return Kept(100.0 * total / len(needed), float(np.nanmedian(needed)))


def _contrast(kind: Apart, n: int, rng: Generator) -> Contrast:
    first, second = kind.draw(rng, n)
    if not kind.paired:
        return independent_contrast(second, first, 0, kind.distribution)
    return paired_contrast(pd.Series(second), pd.Series(first), 0, kind.distribution)


def rows() -> Iterator[str]:
    """Both tables: per cent, and in brackets how many times as many values the median
    pilot asks for as reach the goal with 80 %, by the size of the pilot.
    """
    for name, narrow in NARROW.items():
        found = [kept_width(narrow, size, REPEATS) for size in PILOTS]
        yield _row(name, found, enough_for_width(narrow))
    yield ""
    for name, apart in APART.items():
        found = [kept_difference(apart, size, REPEATS) for size in PILOTS]
        yield _row(name, found, enough_for_difference(apart))


def _row(name: str, found: Sequence[Kept], enough: float) -> str:
    cells = [f"{one.chance:.0f} ({one.median / enough:.2g})" for one in found]
    return f"| {' | '.join([name, *cells])} |"


if __name__ == "__main__":
    for row in rows():
        print(row)
        sys.stdout.flush()
