"""Elementary functions from arithmetic alone.

The functions are sine, cosine, arctangent, exponential, logarithm and power.

Mathematics libraries round in different ways, so the last bits of results differ
between systems, and on a GPU. IEEE 754 defines the result of each addition,
multiplication and division. So these functions are bitwise identical in compiled
kernels on all systems and in the interpreter. The condition is that no compiler fuses a
multiplication with an addition.

The error of each result is below BOUND units in the last place (ulp) of the exact
value, and the result is nearly always the double next to this value. All functions use
one method. A table entry near the argument leaves a small remainder. The function of
the remainder is a short polynomial. The result is the sum of two numbers until the end;
the second number holds the rounding of the first. Models compute exponentials and
powers most often, and their error is larger: BOUND_OF_EXP.

Sources: P. T. P. Tang (1989), Table-driven implementation of the exponential function
in IEEE floating-point arithmetic, ACM TOMS 15, 144-157, and (1990) of the logarithm
function, ACM TOMS 16, 378-400; W. J. Cody, W. Waite (1980), Software manual for the
elementary functions, for constants in parts; T. J. Dekker (1971), A floating-point
technique for extending the available precision, Numerische Mathematik 18, 224-242, for
products; D. E. Knuth, The art of computer programming 2, 4.2.2, for sums; J.-M. Muller
et al. (2018), Handbook of floating-point arithmetic.
"""

import math
from typing import Any

import numpy as np

from kernels.elementary_tables import (
    ATAN_HIGH,
    ATAN_LOW,
    COSINE_HIGH,
    COSINE_LOW,
    EXP_HIGH,
    EXP_LOW,
    EXP_STEP,
    FACTOR,
    HALF_PI,
    LN2,
    LOG_HIGH,
    LOG_LOW,
    POWERS,
    SINE_HIGH,
    SINE_LOW,
)
from kernels.jit import jit
from kernels.state import Floats

BOUND, BOUND_OF_EXP, BOUND_OF_LEAST = 0.501, 0.51, 0.76
"""Bounds of errors, in units in the last place.

The second bound is for `exp` and `power`. The third bound is for subnormal results of
`exp` and `power`, which have fewer bits.
"""
MOST_ANGLE = 2.0**20
"""Largest angle with a sine and a cosine, in radians.

The constants hold a quarter of a turn to 152 bits, which suffice up to this angle.
"""
SPLITTER = 2.0**27 + 1.0
SHIFT = 1.5 * 2.0**52
"""Number whose neighbouring doubles are integers.

Adding this number rounds to an integer, and the last bits of the sum are the bits of
the integer.
"""
SHIFT_BITS = 0x4338000000000000
SHIFT_22 = 1.5 * 2.0**30
"""Number whose addition rounds to multiples of 2^-22."""
EXP_PARTS, SINE_PARTS, ATAN_PARTS, LOG_PARTS = 128, 64.0, 128.0, 256.0
FIRST_LOG = 181
PER_EXP_STEP, PER_HALF_PI = EXP_PARTS / (LN2[0] + LN2[1]), 2.0 / math.pi
ROOT_HALF_BITS, EXPONENT, BIAS = 0x3FE6A09E667F3BCD, 52, 1023
"""Bits of the square root of 1/2, position of the exponent, and its bias."""
LEAST_WITH_ALL_BITS, LIFTED = 2.0**-1022, 64.0
LIFT = 2.0**LIFTED
EXP_ENTRY = EXP_HIGH + EXP_LOW
EXP_REST = ((EXP_HIGH - EXP_ENTRY) + EXP_LOW) / EXP_ENTRY
"""Relative errors of EXP_ENTRY, the doubles next to powers of 2."""
LOG_FACTORS, LOGS, LOG_RESTS = (
    np.concatenate([np.zeros(FIRST_LOG), one]) for one in (FACTOR, LOG_HIGH, LOG_LOW)
)
"""Tables from index 0 on, so that compilers see that no index is negative."""
MOST_EXP, LEAST_EXP = 710.0, -746.0
"""Arguments beyond which the exponential is infinite and zero."""
LEAST_NORMAL, MOST_EXPONENT = -1022, 1023
"""The least and the largest exponent of numbers with all of their bits."""
EIGHTH = 0.25 * math.pi
"""An eighth of a turn."""
FLAT = 2.0**-60
"""Number below which the arctangent equals its argument."""
MOST_POWER = 2.0**65
"""Exponent beyond which any power is 0, 1 or infinite."""


@jit
def bits_of(x: float) -> Any:
    """Return the 64 bits of a double as an integer."""
    return np.float64(x).view(np.int64)


@jit
def number_of(bits: Any) -> float:
    """Return the double that has these 64 bits."""
    return float(np.int64(bits).view(np.float64))


@jit
def entry_of(table: Floats, k: int) -> float:
    """Return entry `k` of a table; `k` is always in range.

    Vectorised batches compute the index even if a single trial does not need the entry.
    """
    return float(table[k])


@jit
def _sum(a: float, b: float) -> tuple[float, float]:
    """Return the sum of two numbers, and its rounding error."""
    s = a + b
    back = s - a
    return s, (a - (s - back)) + (b - back)


@jit
def _sum_to(a: float, b: float) -> tuple[float, float]:
    """Return the sum and its rounding error where |a| >= |b|, or a is 0."""
    s = a + b
    return s, b - (s - a)


@jit
def _halves(a: float) -> tuple[float, float]:
    """Return a number as the sum of two numbers with 26 bits each."""
    c = SPLITTER * a
    high = c - (c - a)
    return high, a - high


@jit
def _product(a: float, b: float) -> tuple[float, float]:
    """Return the product of two numbers, and its rounding error."""
    p = a * b
    (c, d), (e, f) = _halves(a), _halves(b)
    return p, ((c * e - p) + c * f + d * e) + d * f


@jit
def _exp(x: float, rest: float) -> float:
    """Return exp(x + rest), where |rest| < 2^-15, without a branch.

    The result is an entry a of a table, times a power of 2, times 1 + b, where |b| <
    2^-8. So the rounding before the last sum is below 2^-7 units of the result. Half of
    the power of 2 is added to the bits of the entry, and the second half is a factor.
    So results next to the least and the largest number are possible.
    """
    x = MOST_EXP if x > MOST_EXP else LEAST_EXP if x < LEAST_EXP else x
    shifted = x * PER_EXP_STEP + SHIFT
    steps = shifted - SHIFT
    bits = bits_of(shifted)  # the last bits are the steps
    k, half = bits & 127, bits >> 8
    r = (x - steps * EXP_STEP[0]) - (steps * EXP_STEP[1] - rest)
    square = r * r
    more = 0.5 + r * (1 / 6) + square * (1 / 24 + r * (1 / 120) + square * (1 / 720))
    b = r + (square * more + entry_of(EXP_REST, k))
    a = number_of(bits_of(entry_of(EXP_ENTRY, k)) + (half << EXPONENT))
    other = number_of(((bits >> 7) - half + BIAS) << EXPONENT)
    return (a + a * b) * other


@jit
def _scaled(y: float, low: float, exponent: int) -> float:
    """Return (y + low) 2^exponent, rounded once.

    `y` is between 1/2 and 2, and |low| is below 2^-6.
    """
    if LEAST_NORMAL < exponent <= MOST_EXPONENT:
        return (y + low) * float(POWERS[exponent - LEAST_NORMAL])
    y, low = _sum_to(y, low)
    if exponent > 0 or (exponent == LEAST_NORMAL and y >= 1.0):
        return math.ldexp(y, exponent)
    # Numbers near this number have the number of bits that the result keeps.
    near = math.ldexp(1.0, LEAST_NORMAL - exponent)
    rounded, kept = _sum_to(near, y)
    return math.ldexp((rounded + (kept + low)) - near, exponent)


@jit
def exp(x: float) -> float:
    """Return the exponential of `x`."""
    return _exp(x, 0.0)


@jit
def _grown(x: float) -> tuple[int, float, float]:
    """Return the parts of exp(x) from which 1 can be subtracted exactly.

    The parts are the number k of steps and, in two numbers, the difference of the
    remaining factor from 1. The two numbers have more bits than `_exp` computes.
    """
    shifted = x * PER_EXP_STEP + SHIFT
    steps = shifted - SHIFT
    high, low = _sum(x - steps * EXP_STEP[0], -(steps * EXP_STEP[1]))
    r, low = _sum_to(high, low)
    square, below = _product(r, r)
    more = 1 / 120 + r * (1 / 720 + r * (1 / 5040))
    cubed = r * square * (1 / 6 + r * (1 / 24 + r * more))
    p, kept = _sum_to(r, 0.5 * square)
    k = int(bits_of(shifted) - SHIFT_BITS)
    return k, p, kept + (0.5 * below + (low + low * r + cubed))


@jit
def expm1(x: float) -> float:
    """Return exp(x) - 1, with the full precision near zero."""
    if not -40.0 <= x <= MOST_EXP:
        return math.inf if x > 0.0 else -1.0 if x < 0.0 else x
    if abs(x) < FLAT:
        return x
    k, p, low = _grown(x)
    if k == 0:
        return p + low
    entry, kept = float(EXP_HIGH[k & 127]), float(EXP_LOW[k & 127])
    a, b = _product(entry, p)
    y, c = _sum_to(entry, a)
    y, c = _sum_to(y, c + (b + (kept + (entry * low + kept * (p + low)))))
    if k >> 7 > 60:
        return _scaled(y, c, k >> 7)
    scale = float(POWERS[(k >> 7) - LEAST_NORMAL])
    high, rest = _sum(y * scale, -1.0)
    return high + (rest + c * scale)


@jit
def _log(x: float) -> tuple[float, float]:
    """Return the natural logarithm of a positive, finite number in two parts.

    The second part is below 2^-16 times the first.

    The argument is m times a power of 2, with m near 1, so the logarithms differ by a
    multiple of ln 2. A table entry c of 11 bits is next to 1 / m. The first part of m
    is a multiple of 2^-22. So the two parts of r = c m - 1, and the square of the first
    part, are exact. The first parts in the table end in zeros, so that sums do not
    round.
    """
    has_all_bits = x >= LEAST_WITH_ALL_BITS
    bits = bits_of(x if has_all_bits else x * LIFT)
    steps = (bits - ROOT_HALF_BITS) >> EXPONENT
    m = number_of(bits - (steps << EXPONENT))
    e = number_of(steps + SHIFT_BITS) - SHIFT
    e = e if has_all_bits else e - LIFTED
    k = bits_of(m * LOG_PARTS + SHIFT) & 511
    c = entry_of(LOG_FACTORS, k)
    top = (m + SHIFT_22) - SHIFT_22
    high, low = c * top - 1.0, c * (m - top)
    r, half = high + low, 0.5 * high
    square = r * r
    more = square * ((1 / 7 - r * (1 / 8)) * square + (1 / 5 - r * (1 / 6)))
    cubed = r * square * ((1 / 3 - r * (1 / 4)) + more)
    y, lost = _sum_to((e * LN2[0] + entry_of(LOGS, k)) + high, -(half * high))
    y, left = _sum_to(y, low)
    rest = (cubed - low * (high + 0.5 * low)) + (e * LN2[1] + entry_of(LOG_RESTS, k))
    return y, rest + (lost + left)


@jit
def log(x: float) -> float:
    """Return the natural logarithm of `x`: -inf for 0, and NaN below."""
    if not 0.0 < x < math.inf:
        return -math.inf if x == 0.0 else math.nan if x < 0.0 else x
    y, low = _log(x)
    return y + low


@jit
def power(x: float, y: float) -> float:
    """Return `x` to the power `y`, for x >= 0; NaN for x < 0."""
    a, b = _log(x)
    by = MOST_POWER if y > MOST_POWER else -MOST_POWER if y < -MOST_POWER else y
    (c, d), (e, f) = _halves(a), _halves(by)
    p = c * e
    rest = c * f + (d + b) * by if abs(p) < -LEAST_EXP else 0.0
    at_end = math.inf if (x > 1.0) == (y > 0.0) else 0.0
    result = at_end if x == 0.0 or x == math.inf else _exp(p, rest)
    result = result if x >= 0.0 and y == y else math.nan
    return 1.0 if x == 1.0 or y == 0.0 else result


@jit
def _turned_back(x: float) -> tuple[int, float, float]:
    """Return the quarter of a turn of an angle, and the remainder.

    The quarter is 0 to 3. The remainder is the distance, in two parts, from the middle
    of the quarter; middles are at multiples of pi / 2.
    """
    shifted = x * PER_HALF_PI + SHIFT
    quarters = shifted - SHIFT
    a, b = x - quarters * HALF_PI[0], quarters * HALF_PI[1]
    high, low = _sum(a, -b)
    low, rest = _sum(low, -(quarters * HALF_PI[2]))
    high, low = _sum(high, low)
    high, low = _sum_to(high, low + (rest - quarters * HALF_PI[3]))
    return bits_of(shifted) & 3, high, low


@jit
def _sine_cosine(high: float, low: float) -> tuple[float, float]:
    """Return sine and cosine of high + low.

    The angle is at most pi / 4 in absolute value.
    """
    size = abs(high)
    k = bits_of(min(EIGHTH, size) * SINE_PARTS + SHIFT) & 63
    d, rest = _sum(size - k / SINE_PARTS, low if high >= 0.0 else -low)
    square = d * d
    cubed = d * square * (-1 / 6 + square * (1 / 120 - square * (1 / 5040)))
    fallen = square * (-0.5 + square * (1 / 24 - square * (1 / 720)))
    s, s_low = entry_of(SINE_HIGH, k), entry_of(SINE_LOW, k)
    c, c_low = entry_of(COSINE_HIGH, k), entry_of(COSINE_LOW, k)
    a, b = _product(c, d)
    y, f = _sum_to(s, a)
    sine = y + (f + (b + (s_low + c_low * d + c * rest + (s * fallen + c * cubed))))
    a, b = _product(s, d)
    y, f = _sum_to(c, -a)
    part = c * fallen - s * cubed
    cosine = y + (f + (part + (c_low - b - s_low * d - s * rest)))
    return sine if high >= 0.0 else -sine, cosine


@jit
def sine_cosine(x: float) -> tuple[float, float]:
    """Return sine and cosine of an angle in radians; NaN beyond MOST_ANGLE."""
    if not abs(x) <= MOST_ANGLE:
        return math.nan, math.nan
    quarter, high, low = _turned_back(x)
    s, c = _sine_cosine(high, low)
    s, c = (c, -s) if quarter & 1 == 1 else (s, c)
    s, c = (-s, -c) if quarter & 2 == 2 else (s, c)
    return x if x == 0.0 else s, c


@jit
def sin(x: float) -> float:
    """Return the sine of an angle in radians; NaN beyond MOST_ANGLE."""
    return sine_cosine(x)[0]


@jit
def cos(x: float) -> float:
    """Return the cosine of an angle in radians; NaN beyond MOST_ANGLE."""
    return sine_cosine(x)[1]


@jit
def _slope(small: float, big: float) -> tuple[float, float]:
    """Return the arctangent of small / big in two parts.

    `small` is at most `big`; both are finite and not below 0.
    """
    ratio = small / big if small > 0.0 else 0.0
    if ratio < FLAT:
        return ratio, 0.0
    _, e = math.frexp(big)
    x, y = math.ldexp(big, -e), math.ldexp(small, -e)
    k = bits_of(min(1.0, ratio) * ATAN_PARTS + SHIFT) & 255
    a = k / ATAN_PARTS
    p, below = _product(a, x)
    over, low = _sum(y, -p)
    over, low = _sum(over, low - below)
    q, below = _product(a, y)
    under, rest = _sum_to(x, q)
    t = over / under
    r, lost = _product(t, under)
    left = (((over - r) - lost) + low - t * (rest + below)) / under
    square = t * t
    cubed = -1 / 3 + square * (1 / 5 - square * (1 / 7 - square * (1 / 9)))
    high, kept = _sum_to(entry_of(ATAN_HIGH, k), t)
    return _sum_to(high, kept + (entry_of(ATAN_LOW, k) + left + t * square * cubed))


@jit
def atan2(y: float, x: float) -> float:
    """Return the angle of the vector (x, y) from -pi to pi, radians.

    The angle has the sign of `y`. Zeros and infinite numbers follow IEEE 754.
    """
    if x != x or y != y:
        return math.nan
    across, along = abs(y), abs(x)
    steep, back = across > along, math.copysign(1.0, x) < 0.0
    small, big = (along, across) if steep else (across, along)
    if big == math.inf:  # two infinite numbers are equal, and finite ones negligible
        small, big = 1.0 if small == big else 0.0, 1.0
    high, low = _slope(small, big)
    turns = (1.0 if steep else 2.0) if back or steep else 0.0
    angle = high + low
    if turns > 0.0:
        sign = 1.0 if steep and back else -1.0
        a, b = _sum(turns * QUARTER, sign * high)
        angle = a + (b + (turns * BEYOND_QUARTER + sign * low))
    return math.copysign(angle, y)


QUARTER, BEYOND_QUARTER = 1.5707963267948966, 6.123233995736766e-17
"""A quarter of a turn in two parts."""
