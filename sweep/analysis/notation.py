"""A number with its interval as text: `86.21 ± 0.28`, or `86.21 (85.93 to 86.49)`.

All are rounded to the second significant digit of half the width of the interval, but
to no more than nine decimal places. They have five digits if the interval is unknown or
infinite, or if it is no wider than the rounding errors of a computer: then its width is
said to be 0.
"""

import math
from decimal import Decimal

DIGITS = 5
ROUNDING_ERROR = 1e-12
"""Half widths that are a smaller part of the numbers than this are rounding errors."""
MOST_PLACES = 9
MOST_DIGITS = 15
"""So many decimal places are written, and so many digits before them. Numbers that are
all smaller, or larger, have an exponent.
"""
UNKNOWN = "-"


def number(value: float, half: float = math.nan) -> str:
    """A value to the place that half the width of its interval allows; `-` where it is
    not known.

    >>> number(86.21234, 0.28), number(86.21234)
    ('86.21', '86.212')
    """
    return _written(value, half, _size(value))


def plus_minus(
    value: float, half: float, scale: float = 0.0, *, sign: bool = False
) -> str:
    """A value with half the width of its interval; alone where that is NaN.

    A difference is a rounding error where it is one of numbers of size `scale`. With
    `sign` every value has one, even where it is rounded to zero.

    >>> plus_minus(86.21234, 0.28), plus_minus(0.1 + 0.2, 5e-17)
    ('86.21 ± 0.28', '0.3 ± 0')
    """
    scale = max(_size(value), scale)
    text = _written(value, half, scale, sign=sign)
    if math.isnan(value) or math.isnan(half):
        return text
    return f"{text} ± {_written(half, half, max(scale, _size(half)))}"


def is_centred(value: float, low: float, high: float) -> bool:
    """Whether a value is the middle of its interval, but for rounding, so that half the
    width says all.

    >>> is_centred(0.4, 0.1, 0.7), is_centred(0.4, 0.0, 1.0)
    (True, False)
    """
    rounding = ROUNDING_ERROR * max(map(_size, (value, low, high)))
    return math.isclose(value - low, high - value, rel_tol=1e-9, abs_tol=rounding)


def with_interval(
    value: float, low: float, high: float, scale: float = 0.0, *, sign: bool = False
) -> str:
    """A value with both bounds of its interval; alone where one of them is NaN. `scale`
    and `sign` as of `plus_minus`.

    >>> with_interval(86.21234, 85.93, 86.49)
    '86.21 (85.93 to 86.49)'
    """
    half, scale = high / 2.0 - low / 2.0, max(scale, *map(_size, (value, low, high)))
    text, *bounds = (
        _written(one, half, scale, sign=sign) for one in (value, low, high)
    )
    if math.isnan(value) or math.isnan(low) or math.isnan(high):
        return text
    return f"{text} ({bounds[0]} to {bounds[1]})"


def percent(share: float) -> str:
    """A share above 0 in per cent.

    >>> percent(0.48), percent(0.002), percent(0.998)
    ('48 %', '<1 %', '>99 %')
    """
    if share < 0.01:
        return "<1 %"
    return ">99 %" if 0.99 < share < 1.0 else f"{100.0 * share:.0f} %"


def _size(value: float) -> float:
    return abs(value) if math.isfinite(value) else 0.0


def _written(value: float, half: float, scale: float, *, sign: bool = False) -> str:
    """A number of size `scale` at most, rounded to the second digit of `half`."""
    if math.isnan(value):
        return UNKNOWN
    if abs(value) < ROUNDING_ERROR * scale:
        value = 0.0
    plus, positive = ("+", -0.0) if sign else ("", 0.0)  # adding 0.0 makes -0.0 be 0.0
    if not (ROUNDING_ERROR * scale < half < math.inf and math.isfinite(value)):
        digits = "0f" if 10**DIGITS <= abs(value) < 10**MOST_DIGITS else f"{DIGITS}g"
        return f"{value + positive:{plus}.{digits}}"
    last, first = _exponent(half) - 1, _exponent(max(scale, half))
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
