"""Samples of parameter space: samplers fill the unit cube, distributions stretch its
sides.

To add one, write a function and enter it in SAMPLERS or DISTRIBUTIONS.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.random import Generator, default_rng
from numpy.typing import NDArray

from sweep.spec.seeds import address, hashed
from sweep.spec.settings import NotAllowedError, Setting, Values

Unit = NDArray[np.float64]
"""Numbers from 0 to 1, shape (points,). Only a sample on levels, as that of Morris, has
1.
"""

LEAST = 2.0**-54
"""Stands for 0 where the inverse of a distribution would be infinite at 0."""

MOST = 1e100
"""Bound of the arguments of continuous distributions, far from where arithmetic
overflows.
"""


def random(points: int, names: Sequence[str], axis: str, seed: int) -> list[Unit]:
    """Independent draws. Each setting has its own stream, so that another setting or
    more points change no value.
    """
    return [generator(seed, axis, name).random(points) for name in names]


def latin_hypercube(
    points: int, names: Sequence[str], axis: str, seed: int
) -> list[Unit]:
    """One draw in each of `points` equal intervals of every setting.

    Another number of points gives other points altogether.
    """
    # The same numbers as those of scipy's LatinHypercube, with a quarter of its memory.
    # Its generator is spawned too.
    (rng,) = generator(seed, axis).spawn(1)
    sample = rng.uniform(size=(points, len(names)))
    for column in sample.T:
        interval = np.arange(1, points + 1)
        rng.shuffle(interval)
        column[:] = (interval - column) / points
    return list(sample.T)


def sobol(points: int, names: Sequence[str], axis: str, seed: int) -> list[Unit]:
    """The scrambled Sobol sequence. More points continue it; another number of settings
    changes all points.
    """
    from scipy.stats.qmc import Sobol

    # scipy warns where the number is no power of two: take the next power, and cut.
    sample = Sobol(d=len(names), seed=generator(seed, axis)).random_base2(
        math.ceil(math.log2(points))
    )
    return list(sample[:points].T)


def halton(points: int, names: Sequence[str], axis: str, seed: int) -> list[Unit]:
    """The scrambled Halton sequence. More points continue it; another number of
    settings changes all points.
    """
    from scipy.stats.qmc import Halton

    return list(Halton(d=len(names), seed=generator(seed, axis)).random(points).T)


SAMPLERS: dict[str, Callable[[int, Sequence[str], str, int], list[Unit]]] = {
    "random": random,
    "lhs": latin_hypercube,
    "sobol": sobol,
    "halton": halton,
}


def generator(seed: int, *names: str) -> Generator:
    """The random numbers of an axis, or of one of its settings."""
    return default_rng(
        address(seed, "design", *(number for name in names for number in hashed(name)))
    )


def uniform(unit: Unit, setting: Setting, arguments: Sequence[Any]) -> Values:
    """Uniform between two numbers."""
    low, high = _bounds(setting, arguments)
    values: Values = low + unit * (high - low)
    return values.clip(low, high)


def loguniform(unit: Unit, setting: Setting, arguments: Sequence[Any]) -> Values:
    """The logarithm is uniform between those of two positive numbers."""
    low, high = _bounds(setting, arguments)
    if low <= 0:
        raise NotAllowedError("needs numbers above 0")
    values: Values = np.exp(math.log(low) + unit * (math.log(high) - math.log(low)))
    return values.clip(low, high)


def normal(unit: Unit, setting: Setting, arguments: Sequence[Any]) -> Values:
    """Normal with a mean and a standard deviation, truncated to the range of the
    setting.
    """
    from scipy.special import ndtr, ndtri

    mean, deviation = _pair(arguments, "[mean, standard deviation]")
    _continuous(setting, mean, deviation)
    setting.coerce(mean)
    if deviation <= 0:
        raise NotAllowedError("the standard deviation must be above 0")
    low, high = (
        ndtr((setting.low - mean) / deviation),
        ndtr((setting.high - mean) / deviation),
    )
    truncated = np.clip(low + unit * (high - low), LEAST, 1 - LEAST)
    values: Values = mean + deviation * ndtri(truncated)
    return values.clip(setting.low, setting.high)


def integers(unit: Unit, setting: Setting, arguments: Sequence[Any]) -> Values:
    """Whole numbers from the first to the last, both included, equally likely."""
    first, last = _pair(arguments, "[first, last]")
    for bound in (first, last):
        setting.coerce(bound)
    if not all(abs(bound) < 2**53 and bound % 1 == 0 for bound in (first, last)):
        raise NotAllowedError("needs whole numbers")
    if first > last:
        raise NotAllowedError(f"needs the smaller number first, not [{first}, {last}]")
    return np.minimum(np.floor(first + unit * (last - first + 1)), last)


def choice(unit: Unit, setting: Setting, arguments: Sequence[Any]) -> Values:
    """Any of the listed values, equally likely."""
    values = setting.column(arguments)
    if len(set(values.tolist())) < len(values):
        raise NotAllowedError("lists a value twice")
    return values[np.minimum((unit * len(values)).astype(np.intp), len(values) - 1)]


DISTRIBUTIONS: dict[str, Callable[[Unit, Setting, Sequence[Any]], Values]] = {
    "uniform": uniform,
    "loguniform": loguniform,
    "normal": normal,
    "integers": integers,
    "choice": choice,
}
"""Functions from numbers between 0 and 1 to values of a setting. Each is the inverse of
its distribution, so that it suits every sampler.

Each raises NotAllowedError where its arguments or what it could draw are not allowed
for the setting.
"""


def _pair(arguments: Sequence[Any], meaning: str) -> tuple[float, float]:
    numbers = [
        value
        for value in arguments
        if isinstance(value, int | float) and not isinstance(value, bool)
    ]
    if len(arguments) != 2 or len(numbers) != 2:
        raise NotAllowedError(f"needs two numbers: {meaning}")
    return numbers[0], numbers[1]


def _bounds(setting: Setting, arguments: Sequence[Any]) -> tuple[float, float]:
    low, high = _pair(arguments, "[low, high]")
    _continuous(setting, low, high)
    for bound in (low, high):
        setting.coerce(bound)
    if low > high:
        raise NotAllowedError(f"needs the smaller number first, not [{low}, {high}]")
    return low, high


def _continuous(setting: Setting, *numbers: float) -> None:
    if setting.kind != "float":
        raise NotAllowedError(
            f"{setting.name} is {setting.allowed()}: use integers or choice"
        )
    if not all(abs(number) <= MOST for number in numbers):
        raise NotAllowedError(f"needs numbers of at most {MOST:g}")
