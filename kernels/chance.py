"""Random numbers by address, and normal numbers of an address or of any generator.

A random number is a hash of a key and of the purpose, so the number of earlier draws
has no effect.

The generator is Philox4x32-10: J. K. Salmon, M. A. Moraes, R. O. Dror, D. E. Shaw
(2011), Parallel random numbers: as easy as 1, 2, 3, SC'11. Normal numbers come from the
inverse of their distribution: M. J. Wichura (1988), Algorithm AS 241: the percentage
points of the normal distribution, Applied Statistics 37, 477-484 (PPND16). Normal
numbers are bitwise identical on all systems; `Generator.normal` of NumPy calls
functions of the system.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.random import Generator

from kernels.elementary import log
from kernels.jit import jit

ROUNDS = 10
LOW = np.uint64(2**32 - 1)
HALF = np.uint64(32)
FACTORS = np.uint64(0xD2511F53), np.uint64(0xCD9E8D57)
STEPS = np.uint64(0x9E3779B9), np.uint64(0xBB67AE85)
"""Increments of the two words of the key from round to round."""
DROPPED = np.uint64(5), np.uint64(6)
"""Numbers of low bits that are dropped from two words of 32 bits.

The remaining 27 and 26 bits make the 53 bits of a number.

"""
UNIT, UPPER = 2.0**-53, 2.0**26
BELOW_1 = 1.0 - UNIT
CENTRE, TAIL = 0.425, 5.0


class ChanceKey(NamedTuple):
    """Two integers in [0, 2^32) that identify a trial."""

    first: int
    second: int


NO_KEY = ChanceKey(0, 0)


@jit
def words(key: ChanceKey, a: int, b: int, c: int, d: int) -> tuple[Any, Any, Any, Any]:
    """Return four random words of 32 bits at an address.

    Parameters
    ----------
    key : ChanceKey
        Key of the trial.
    a, b, c, d : int
        Address: four integers in [0, 2^32).

    Returns
    -------
    tuple of numpy.uint64
        Four numbers below 2^32.
    """
    w, x, y, z = np.uint64(a), np.uint64(b), np.uint64(c), np.uint64(d)
    k, m = np.uint64(key.first), np.uint64(key.second)
    for _ in range(ROUNDS):
        p, q = FACTORS[0] * w, FACTORS[1] * y
        w, x, y, z = (q >> HALF) ^ x ^ k, q & LOW, (p >> HALF) ^ z ^ m, p & LOW
        k, m = (k + STEPS[0]) & LOW, (m + STEPS[1]) & LOW
    return w, x, y, z


@jit
def uniform(one: Any, other: Any) -> float:
    """Return the number in (0, 1) that two random words represent.

    The number is the middle of one of 2^53 parts of equal length, rounded to a double
    below 1.
    """
    high, low = one >> DROPPED[0], other >> DROPPED[1]
    return min((float(high) * UPPER + float(low) + 0.5) * UNIT, BELOW_1)


@jit
def chance(key: ChanceKey, a: int, b: int, c: int, d: int) -> float:
    """Return a uniform random number in (0, 1) at an address.

    Parameters
    ----------
    key : ChanceKey
        Key of the trial.
    a, b, c, d : int
        Address: four integers in [0, 2^32).

    Returns
    -------
    float
    """
    w, x, _, _ = words(key, a, b, c, d)
    return uniform(w, x)


@jit
def normals(key: ChanceKey, a: int, b: int, c: int, d: int) -> tuple[float, float]:
    """Return two independent standard normal numbers at an address.

    Parameters
    ----------
    key : ChanceKey
        Key of the trial.
    a, b, c, d : int
        Address: four integers in [0, 2^32).

    Returns
    -------
    tuple of float
    """
    w, x, y, z = words(key, a, b, c, d)
    return quantile(uniform(w, x)), quantile(uniform(y, z))


@jit
def normal(rng: Generator) -> float:
    """Return a standard normal number that `rng` draws.

    The next uniform number of the generator is in one of 2^53 parts of (0, 1) of equal
    length. The normal number is the quantile of the middle of this part. The
    computation is exact until the quantile: the distance of the middle from 1/2, and
    from the nearer end, has at most 53 bits. So the distribution is symmetric, and the
    largest number is 8.29.
    """
    q = (rng.random() - 0.5) + 0.5 * UNIT
    return _quantile(q, 0.5 - abs(q))


@jit
def quantile(p: float) -> float:
    """Return the standard normal quantile of `p` in (0, 1), to 1 part in 10^16."""
    return _quantile(p - 0.5, min(p, 1.0 - p))


@jit
def _quantile(q: float, tail: float) -> float:
    """Return the quantile of 1/2 + q, which is `tail` from the nearer end of (0, 1)."""
    if abs(q) <= CENTRE:
        r = CENTRE * CENTRE - q * q
        return q * _ratio(r, NEAR_MIDDLE, UNDER_MIDDLE)
    r = math.sqrt(-log(tail))
    if r <= TAIL:
        z = _ratio(r - 1.6, NEAR_TAIL, UNDER_TAIL)
    else:
        z = _ratio(r - 5.0, FAR_TAIL, UNDER_FAR_TAIL)
    return -z if q < 0.0 else z


@jit
def _ratio(r: float, over: tuple[float, ...], under: tuple[float, ...]) -> float:
    """Return the ratio of two polynomials of degree 7 at `r`.

    The coefficients begin with the highest power.
    """
    a, b = over[0], under[0]
    for k in range(1, 8):
        a, b = a * r + over[k], b * r + under[k]
    return a / b


NEAR_MIDDLE = (
    *(2.5090809287301226727e3, 3.3430575583588128105e4, 6.7265770927008700853e4),
    *(4.5921953931549871457e4, 1.3731693765509461125e4, 1.9715909503065514427e3),
    *(1.3314166789178437745e2, 3.3871328727963666080e0),
)
UNDER_MIDDLE = (
    *(5.2264952788528545610e3, 2.8729085735721942674e4, 3.9307895800092710610e4),
    *(2.1213794301586595867e4, 5.3941960214247511077e3, 6.8718700749205790830e2),
    *(4.2313330701600911252e1, 1.0),
)
NEAR_TAIL = (
    *(7.74545014278341407640e-4, 2.27238449892691845833e-2, 2.41780725177450611770e-1),
    *(1.27045825245236838258e0, 3.64784832476320460504e0, 5.76949722146069140550e0),
    *(4.63033784615654529590e0, 1.42343711074968357734e0),
)
UNDER_TAIL = (
    *(1.05075007164441684324e-9, 5.47593808499534494600e-4, 1.51986665636164571966e-2),
    *(1.48103976427480074590e-1, 6.89767334985100004550e-1, 1.67638483018380384940e0),
    *(2.05319162663775882187e0, 1.0),
)
FAR_TAIL = (
    *(2.01033439929228813265e-7, 2.71155556874348757815e-5, 1.24266094738807843860e-3),
    *(2.65321895265761230930e-2, 2.96560571828504891230e-1, 1.78482653991729133580e0),
    *(5.46378491116411436990e0, 6.65790464350110377720e0),
)
UNDER_FAR_TAIL = (
    *(2.04426310338993978564e-15, 1.42151175831644588870e-7),
    *(1.84631831751005468180e-5, 7.86869131145613259100e-4, 1.48753612908506148525e-2),
    *(1.36929880922735805310e-1, 5.99832206555887937690e-1, 1.0),
)
