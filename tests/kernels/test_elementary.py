"""Elementary functions against values of many digits, in the interpreter, and where
arguments are no ordinary numbers.
"""

import math
from collections.abc import Callable, Sequence
from hashlib import sha256
from itertools import product
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf

from kernels import elementary
from kernels.elementary import BOUND, BOUND_OF_EXP, BOUND_OF_LEAST, MOST_ANGLE
from tests import ROOT
from tests.cases import slow_but
from tests.interpreter import interpreted
from tests.naive.elementary import tables

BITS = 400
"""Of the values that are taken for exact. A sine of the least angles that are met has
their bits, and twice as many come from the argument.
"""
POINTS = 1500
DRAW = np.random.default_rng(20)
NEAR, FAR = DRAW.uniform(-1.0, 1.0, POINTS), DRAW.uniform(-1.0, 1.0, POINTS)
TINY = NEAR * 2.0 ** DRAW.uniform(-60.0, 0.0, POINTS)
WIDE = 2.0 ** DRAW.uniform(-1074.0, 1023.9, POINTS)
SIGNED = WIDE * np.sign(NEAR)
AROUND_1 = 1.0 + TINY[np.abs(TINY) > 0.0] / 4.0
LEAST, MOST, LEAST_NORMAL = 5e-324, 1.7976931348623157e308, 2.0**-1022
LESS = {"exp", "power"}
"""Which keep less of what is rounded away."""
HALF_TURNS = np.arange(1.0, POINTS) * 445.0 * (0.5 * math.pi)
"""The doubles next to multiples of pi / 2, up to MOST_ANGLE: what is left of them is
smallest.
"""
CASES: dict[str, list[tuple[Any, ...]]] = {
    "exp": [
        (30.0 * NEAR,),
        (TINY,),
        (DRAW.uniform(-745.1, -708.0, POINTS),),
        (DRAW.uniform(-708.0, 709.7, POINTS),),
        (np.array([709.782712893384, -708.3964185322641, -745.1332191019411]),),
        (np.arange(-500.0, 500.0) * math.log(2.0) / 128,),
    ],
    "expm1": [
        (3.0 * NEAR,),
        (TINY,),
        (DRAW.uniform(-50.0, 709.7, POINTS),),
        (np.array([LEAST, -LEAST, 1e-308, 709.782712893384, -1e-19]),),
    ],
    "log": [
        (NEAR + 1.0,),
        (AROUND_1,),
        (WIDE,),
        (np.array([LEAST, MOST, 2.0**-1022, math.nextafter(1, 0), 1 + 2.0**-52]),),
        (np.arange(182.0, 362.0) / 256.0 + 1 / 512,),
    ],
    "sin": [
        (7.0 * NEAR,),
        (TINY,),
        (SIGNED[WIDE < MOST_ANGLE],),
        (MOST_ANGLE * NEAR,),
        (HALF_TURNS,),
        (np.array([LEAST, 2.0**-1022, MOST_ANGLE, 0.25 * math.pi]),),
    ],
    "atan2": [
        (NEAR, FAR),
        (SIGNED, WIDE[::-1] * np.sign(FAR)),
        (NEAR, FAR * 2.0**-30),
        (TINY, FAR),
        (NEAR, NEAR * (1.0 + 2.0**-52)),
        (np.array([LEAST, LEAST, MOST, MOST]), np.array([MOST, LEAST, LEAST, -MOST])),
        (np.array([3e-310, -7e-312]), np.array([-5e-310, 9e-309])),
    ],
    "power": [
        (50.0 * (NEAR + 1.0), 2.0 * FAR),
        (WIDE, FAR),
        (1.0 + 0.01 * NEAR, 7e4 * FAR),
        (AROUND_1, np.full(AROUND_1.size, 1e15)),
        (
            np.array([LEAST, MOST, 2.0, 2.0, 9.0]),
            np.array([0.5, -1.0, -1074, 1e3, 0.5]),
        ),
    ],
}
CASES["cos"] = CASES["sin"]


def units_apart(found: float, exact: Any) -> float:
    """How far a double is from an exact value, in units in the last place of this. A
    value that is not below half a unit above the largest double is infinite.
    """
    if (exact >= mpf(MOST) + mpf(2) ** 970) != math.isinf(found):
        return math.inf
    if math.isinf(found):
        return 0.0
    _, exponent = mp.frexp(exact)
    unit = mpf(2) ** max(int(exponent) - 53, -1074)
    return float(abs(mpf(found) - exact) / unit)


@pytest.mark.parametrize(
    ("name", "every"),
    slow_but([(name, 5) for name in CASES], list(product(CASES, (1, 5)))),
)
def test_errors_are_below_the_bound(name: str, every: int) -> None:
    """Of thousands of arguments: ordinary and tiny ones, those of all sizes, and those
    at which a result is next to what it is near: 1, a multiple of pi / 2, the least or
    the largest number. Of long lists, the fast suite takes each fifth.
    """
    function = getattr(elementary, name)
    exact: Callable[..., Any] = getattr(mp, name)
    bounds = (BOUND_OF_EXP, BOUND_OF_LEAST) if name in LESS else (BOUND, BOUND)
    with mp.workprec(BITS):
        for case in CASES[name]:
            columns = [one.tolist() for one in case]
            if len(columns[0]) > 100:
                columns = [one[::every] for one in columns]
            for given in zip(*columns, strict=True):
                value = exact(*map(mpf, given))
                bound = bounds[abs(value) < LEAST_NORMAL]
                assert units_apart(function(*given), value) < bound, given


WRONG: Sequence[float] = (math.inf, -math.inf, math.nan)


def same(one: float, other: float) -> bool:
    """Whether two numbers are equal, signs of zeros too, or none of them is one."""
    if math.isnan(one) or math.isnan(other):
        return math.isnan(one) and math.isnan(other)
    return one == other and math.copysign(1.0, one) == math.copysign(1.0, other)


@pytest.mark.parametrize(
    ("name", "given", "meant"),
    [
        ("exp", (0.0, -0.0, *WRONG, 1e300, -1e300, 709.8, -745.2), None),
        ("expm1", (0.0, -0.0, *WRONG, 1e300, -1e300, 709.8), None),
        ("log", (0.0, -0.0, 1.0, *WRONG, -1.0), None),
        ("sin", (0.0, -0.0), (0.0, -0.0)),
        ("cos", (0.0, -0.0), (1.0, 1.0)),
        ("sin", (*WRONG, 2.0**20 + 1.0, -1e300), (math.nan,) * 5),
        ("cos", (*WRONG, 2.0**20 + 1.0, -1e300), (math.nan,) * 5),
    ],
)
def test_what_is_no_ordinary_number(
    name: str, given: Sequence[float], meant: Sequence[float] | None
) -> None:
    """As NumPy has it, but for angles so large that turns are not known."""
    if meant is None:
        with np.errstate(all="ignore"):
            meant = getattr(np, name)(np.array(given)).tolist()
    for one, other in zip(given, meant, strict=True):
        assert same(getattr(elementary, name)(one), other), one


ODD = (0.0, -0.0, 1.0, -1.0, 0.5, -2.5, 1e-310, 1e300, -1e300, *WRONG)


@pytest.mark.parametrize("y", ODD)
@pytest.mark.parametrize("x", ODD)
def test_angles_and_powers_of_odd_numbers(x: float, y: float) -> None:
    """As NumPy has them; a negative number has no power but the one to 0."""
    with np.errstate(all="ignore"):
        angle, result = float(np.arctan2(y, x)), float(np.power(x, y))
    assert same(elementary.atan2(y, x), angle)
    if x < 0.0 and y != 0.0:
        result = math.nan
    result = abs(result)  # there is one zero here, the positive one
    with np.errstate(all="ignore"):
        assert elementary.power(x, y) == pytest.approx(result, rel=1e-15, nan_ok=True)


def test_functions_of_an_angle_are_those_of_both() -> None:
    for x in (7.0 * NEAR[:200]).tolist():
        both = elementary.sine_cosine(x)
        assert both == (elementary.sin(x), elementary.cos(x))


def digest() -> str:
    """Values of all functions, as a hash."""
    found = sha256()
    for name in sorted(CASES):
        function = getattr(elementary, name)
        for case in CASES[name]:
            for given in zip(*(one.tolist()[:150] for one in case), strict=True):
                found.update(np.float64(function(*given)).tobytes())
    return found.hexdigest()


def test_the_interpreter_has_the_same_bits() -> None:
    code = "from tests.kernels import test_elementary as t\nprint(t.digest())"
    assert interpreted(code).strip() == digest()


def test_the_tables_are_those_of_many_digits() -> None:
    assert (ROOT / "kernels/elementary_tables.py").read_text() == tables()
