"""The distributions from which the values of a setting are drawn.

To add one, write a function and enter it in DISTRIBUTIONS.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from sweep.spec.sampling import Unit
from sweep.spec.settings import NotAllowedError, Setting, Values

LEAST = 2.0**-54
"""Stands for 0 where the inverse of a distribution is infinite."""

MOST = 1e100
"""Bound of the arguments of continuous distributions, far from where arithmetic
overflows.
"""


@dataclass(frozen=True)
class Distribution:
    """A way to draw values of a setting, written in a spec as `{name: arguments}`.

    `values(unit, setting, arguments)` makes values of draws from the unit interval, by
    the inverse of the distribution, so that it suits every sampler. It raises
    NotAllowedError where the arguments, or what it could draw, are not allowed for the
    setting. `text` says what it draws.

    `kind` says what the arguments are: two numbers, two whole numbers, or a list of
    values. `bounded` says that it draws nothing beyond the numbers, as a search needs
    it, and `logarithmic` that it is even on a logarithmic scale.
    """

    values: Callable[[Unit, Setting, Sequence[Any]], Values]
    text: str
    kind: Literal["continuous", "whole", "listed"] = "continuous"
    bounded: bool = True
    logarithmic: bool = False


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


DISTRIBUTIONS: dict[str, Distribution] = {
    "uniform": Distribution(
        uniform,
        "Uniform between two numbers.",
    ),
    "loguniform": Distribution(
        loguniform,
        "The logarithm is uniform between those of two positive numbers.",
        logarithmic=True,
    ),
    "normal": Distribution(
        normal,
        "Normal with a mean and a standard deviation, truncated to the range of"
        " the setting.",
        bounded=False,
    ),
    "integers": Distribution(
        integers,
        "Whole numbers from the first to the last, both included, equally likely.",
        kind="whole",
    ),
    "choice": Distribution(
        choice,
        "Any of the listed values, equally likely.",
        kind="listed",
    ),
}
"""By their names in specs."""


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
