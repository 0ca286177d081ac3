"""Distributions from which the values of a parameter are drawn.

To add a distribution, write a function and an entry of DISTRIBUTIONS.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from sweep.spec.sampling import Unit
from sweep.spec.settings import NotAllowedError, Setting, Values

LEAST = 2.0**-54
"""Least probability that is inverted; the inverse at 0 may be infinite."""

MOST = 1e100
"""Bound of the arguments of continuous distributions, far below an overflow."""


@dataclass(frozen=True)
class Distribution:
    """A way to draw values of a parameter, written in a spec as `{name: arguments}`.

    Attributes
    ----------
    values : callable
        `values(unit, setting, arguments)` returns the values for draws from the unit
        interval. The function applies the inverse of the distribution, so that every
        sampler can draw. It raises NotAllowedError if the parameter does not allow the
        arguments, or values that could be drawn.
    text : str
        Description of the values for users.
    kind : {"continuous", "whole", "listed"}, default "continuous"
        The arguments are two numbers, two integers, or a list of values.
    bounded : bool, default True
        True if no value is beyond the arguments. A search needs bounded distributions.
    logarithmic : bool, default False
        True if values are uniform on a logarithmic scale.
    """

    values: Callable[[Unit, Setting, Sequence[Any]], Values]
    text: str
    kind: Literal["continuous", "whole", "listed"] = "continuous"
    bounded: bool = True
    logarithmic: bool = False


def uniform(unit: Unit, setting: Setting, arguments: Sequence[Any]) -> Values:
    """Return values that are uniform between two numbers.

    Parameters
    ----------
    unit : array, shape (n,)
        Draws from the unit interval.
    setting : Setting
        A parameter of the kind float.
    arguments : sequence
        Low and high.

    Returns
    -------
    array, shape (n,)

    Raises
    ------
    NotAllowedError
        If the arguments are not two numbers in order that the parameter allows.
    """
    low, high = _bounds(setting, arguments)
    values: Values = low + unit * (high - low)
    return values.clip(low, high)


def loguniform(unit: Unit, setting: Setting, arguments: Sequence[Any]) -> Values:
    """Return values whose logarithm is uniform between two positive numbers.

    Parameters
    ----------
    unit : array, shape (n,)
        Draws from the unit interval.
    setting : Setting
        A parameter of the kind float.
    arguments : sequence
        Low and high.

    Returns
    -------
    array, shape (n,)

    Raises
    ------
    NotAllowedError
        If the arguments are not two positive numbers in order that the parameter
        allows.
    """
    low, high = _bounds(setting, arguments)
    if low <= 0:
        raise NotAllowedError("needs numbers above 0")
    values: Values = np.exp(math.log(low) + unit * (math.log(high) - math.log(low)))
    return values.clip(low, high)


def normal(unit: Unit, setting: Setting, arguments: Sequence[Any]) -> Values:
    """Return normal values, truncated to the range of the parameter.

    Parameters
    ----------
    unit : array, shape (n,)
        Draws from the unit interval.
    setting : Setting
        A parameter of the kind float.
    arguments : sequence
        Mean and standard deviation.

    Returns
    -------
    array, shape (n,)

    Raises
    ------
    NotAllowedError
        If the parameter does not allow the mean, or the deviation is not positive.
    """
    from scipy.special import ndtr, ndtri

    mean, deviation = _pair(arguments, "[mean, standard deviation]")
    _continuous(setting, mean, deviation)
    setting.coerce(mean)
    if deviation <= 0:
        raise NotAllowedError("the standard deviation must be above 0")
    low = ndtr((setting.low - mean) / deviation)
    high = ndtr((setting.high - mean) / deviation)
    truncated = np.clip(low + unit * (high - low), LEAST, 1 - LEAST)
    values: Values = mean + deviation * ndtri(truncated)
    return values.clip(setting.low, setting.high)


def integers(unit: Unit, setting: Setting, arguments: Sequence[Any]) -> Values:
    """Return integers from the first to the last, equally likely, bounds included.

    Parameters
    ----------
    unit : array, shape (n,)
        Draws from the unit interval.
    setting : Setting
    arguments : sequence
        First and last.

    Returns
    -------
    array of float, shape (n,)

    Raises
    ------
    NotAllowedError
        If the arguments are not two integers in order that the parameter allows.
    """
    first, last = _pair(arguments, "[first, last]")
    for bound in (first, last):
        setting.coerce(bound)
    if not all(abs(bound) < 2**53 and bound % 1 == 0 for bound in (first, last)):
        raise NotAllowedError("needs integers")
    if first > last:
        raise NotAllowedError(f"needs the smaller number first, not [{first}, {last}]")
    return np.minimum(np.floor(first + unit * (last - first + 1)), last)


def choice(unit: Unit, setting: Setting, arguments: Sequence[Any]) -> Values:
    """Return listed values, equally likely.

    Parameters
    ----------
    unit : array, shape (n,)
        Draws from the unit interval.
    setting : Setting
        A parameter of any kind.
    arguments : sequence
        The values.

    Returns
    -------
    array, shape (n,)

    Raises
    ------
    NotAllowedError
        If the parameter does not allow a value, or a value is listed twice.
    """
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
        "Uniform on a logarithmic scale between two positive numbers.",
        logarithmic=True,
    ),
    "normal": Distribution(
        normal,
        "Normal with a mean and a standard deviation, truncated to the range of"
        " the parameter.",
        bounded=False,
    ),
    "integers": Distribution(
        integers,
        "Integers from the first to the last, equally likely, bounds included.",
        kind="whole",
    ),
    "choice": Distribution(
        choice,
        "Listed values, equally likely.",
        kind="listed",
    ),
}
"""Distributions by their names in specs."""


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
