"""Notation of confidence intervals: `86.21 ± 0.28` and `86.21 (85.93 to 86.49)`.

A number is rounded to the second significant digit of the half-width, with at most nine
decimal places. If the interval is unknown, infinite or not wider than rounding errors,
the number has five digits. An interval not wider than rounding errors is written with a
half-width of 0.
"""

import math
from decimal import Decimal

DIGITS = 5
"""Significant digits of a number without a usable interval."""
ROUNDING_ERROR = 1e-12
"""Fraction of the numbers below which a half-width is a rounding error."""
MOST_PLACES = 9
"""Most decimal places; smaller numbers have an exponent."""
MOST_DIGITS = 15
"""Most digits before the decimal point; larger numbers have an exponent."""
UNKNOWN = "-"


def number(value: float, half: float = math.nan) -> str:
    """Write a value with the digits that the half-width of the interval justifies.

    NaN is written as `-`.

    >>> number(86.21234, 0.28), number(86.21234)
    ('86.21', '86.212')
    """
    return _written(value, half, _size(value))


def plus_minus(
    value: float, half: float, scale: float = 0.0, *, sign: bool = False
) -> str:
    """Write a value with the half-width of its confidence interval.

    Parameters
    ----------
    value : float
    half : float
        Half-width, in the unit of `value`. If NaN, only the value is written.
    scale : float, default 0
        Magnitude of the two numbers, if `value` is a difference. A difference that is
        small compared with `scale` is a rounding error and is written as 0.
    sign : bool, default False
        Write a sign before every value, also before a rounded zero.

    Returns
    -------
    str

    Examples
    --------
    >>> plus_minus(86.21234, 0.28), plus_minus(0.1 + 0.2, 5e-17)
    ('86.21 ± 0.28', '0.3 ± 0')
    """
    scale = max(_size(value), scale)
    text = _written(value, half, scale, sign=sign)
    if math.isnan(value) or math.isnan(half):
        return text
    return f"{text} ± {_written(half, half, max(scale, _size(half)))}"


def is_centred(value: float, low: float, high: float) -> bool:
    """Return whether a value is the centre of the interval, except for rounding.

    The half-width then describes the interval completely.

    Parameters
    ----------
    value, low, high : float
        Estimate and the bounds of the confidence interval.

    Returns
    -------
    bool

    Examples
    --------
    >>> is_centred(0.4, 0.1, 0.7), is_centred(0.4, 0.0, 1.0)
    (True, False)
    """
    rounding = ROUNDING_ERROR * max(map(_size, (value, low, high)))
    return math.isclose(value - low, high - value, rel_tol=1e-9, abs_tol=rounding)


def with_interval(
    value: float, low: float, high: float, scale: float = 0.0, *, sign: bool = False
) -> str:
    """Write a value with the two bounds of the confidence interval.

    Parameters
    ----------
    value, low, high : float
        Estimate and the bounds of the interval. If any of the three is NaN, only the
        value is written.
    scale : float, default 0
        Magnitude of the two numbers, if `value` is a difference; see `plus_minus`.
    sign : bool, default False
        Write a sign before every number.

    Returns
    -------
    str

    Examples
    --------
    >>> with_interval(86.21234, 85.93, 86.49)
    '86.21 (85.93 to 86.49)'
    """
    half = high / 2.0 - low / 2.0
    scale = max(scale, *map(_size, (value, low, high)))
    text, *bounds = (
        _written(end, half, scale, sign=sign) for end in (value, low, high)
    )
    if math.isnan(value) or math.isnan(low) or math.isnan(high):
        return text
    return f"{text} ({bounds[0]} to {bounds[1]})"


def percent(share: float) -> str:
    """Write a fraction above 0 as a percentage.

    >>> percent(0.48), percent(0.002), percent(0.998)
    ('48 %', '<1 %', '>99 %')
    """
    if share < 0.01:
        return "<1 %"
    return ">99 %" if 0.99 < share < 1.0 else f"{100.0 * share:.0f} %"


def _size(value: float) -> float:
    return abs(value) if math.isfinite(value) else 0.0


def _written(value: float, half: float, scale: float, *, sign: bool = False) -> str:
    """Write a number of size `scale` at most, rounded to the second digit of `half`."""
    if math.isnan(value):
        return UNKNOWN
    if abs(value) < ROUNDING_ERROR * scale:
        value = 0.0
    # Adding 0.0 turns -0.0 into 0.0; adding -0.0 keeps the sign.
    plus, positive = ("+", -0.0) if sign else ("", 0.0)
    if not (ROUNDING_ERROR * scale < half < math.inf and math.isfinite(value)):
        digits = "0f" if 10**DIGITS <= abs(value) < 10**MOST_DIGITS else f"{DIGITS}g"
        return f"{value + positive:{plus}.{digits}}"
    last = _exponent(half) - 1
    first = _exponent(max(scale, half))
    if last >= -MOST_PLACES and first < MOST_DIGITS:
        places = max(0, -last)
        return f"{round(value, places) + positive:{plus}.{places}f}"
    if -DIGITS <= first < MOST_DIGITS:
        readable = abs(value) >= 10.0**-MOST_PLACES or value == 0.0
        digits = f"{MOST_PLACES}f" if readable else "1e"
        return f"{value + positive:{plus}.{digits}}"
    mantissa = Decimal(value).scaleb(-first)
    return f"{mantissa:{plus}.{first - last}f}e{first:+03}"


def _exponent(value: float) -> int:
    return math.floor(math.log10(value))
