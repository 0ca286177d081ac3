"""A number with its interval is written in one way, and says no more than is known."""

import math
import re
from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sweep.analysis.notation import number, plus_minus, with_interval

NAN, INF = math.nan, math.inf
NUMBER = r"-?(?:\d+(?:\.\d+)?(?:e[+-]\d+)?)"
FINITE = st.floats(allow_nan=False, allow_infinity=False)
USUAL = st.floats(-1e6, 1e6)
WIDTHS = st.floats(1e-4, 1e4)


@pytest.mark.parametrize(
    ("value", "half", "text"),
    [
        (86.21234, 0.28, "86.21 ± 0.28"),
        (1.23456, 0.0996, "1.235 ± 0.100"),
        (1234.5, 200.0, "1234 ± 200"),
        (12345678.0, 123.4, "12345678 ± 123"),
        (-0.001, 0.5, "0.00 ± 0.50"),
        (0.99878664481, 1.2e-11, "0.998786645 ± 1.2e-11"),
        (-31.25, 4.4e-10, "-31.250000000 ± 4.4e-10"),
        (5.0, 0.0, "5 ± 0"),
        (0.0303333333333333614, 3.5e-18, "0.030333 ± 0"),
        (0.0, 0.0, "0 ± 0"),
        (3.03e-12, 2.1e-13, "3.03e-12 ± 0.21e-12"),
        (0.0, 3.5e-18, "0.0e-18 ± 3.5e-18"),
        (1e20, 3e18, "1.000e+20 ± 0.030e+20"),
        (1.5, NAN, "1.5"),
        (1.5, INF, "1.5 ± inf"),
        (NAN, 1.0, "-"),
    ],
)
def test_a_value_and_half_its_interval_stand_to_the_second_digit_of_that(
    value: float, half: float, text: str
) -> None:
    assert plus_minus(value, half) == text


@pytest.mark.parametrize(
    ("numbers", "text"),
    [
        ((86.21234, 85.93, 86.49), "86.21 (85.93 to 86.49)"),
        ((1234.5, 1000.0, 1400.0), "1234 (1000 to 1400)"),
        ((0.5, 0.4999, 0.9), "0.50 (0.50 to 0.90)"),
        ((2.0, 2.0, 2.0), "2 (2 to 2)"),
        ((4e-12, 1.516e-12, 6.484e-12), "4.0e-12 (1.5e-12 to 6.5e-12)"),
        ((3.1, -INF, 5.0), "3.1 (-inf to 5)"),
        ((3.1, -INF, INF), "3.1 (-inf to inf)"),
        ((86.21234, NAN, NAN), "86.212"),
        ((86.21234, 85.0, NAN), "86.212"),
        ((NAN, 1.0, 2.0), "-"),
    ],
)
def test_bounds_stand_to_the_same_place(
    numbers: tuple[float, float, float], text: str
) -> None:
    assert with_interval(*numbers) == text


@pytest.mark.parametrize(
    ("value", "half", "text"),
    [
        (86.21234, 0.3, "86.21"),
        (123456.7, NAN, "123457"),
        (0.00012345678, NAN, "0.00012346"),
        (5.0, 0.0, "5"),
        (0.0, NAN, "0"),
        (-0.0, NAN, "0"),
        (1e300, NAN, "1e+300"),
        (NAN, NAN, "-"),
        (INF, NAN, "inf"),
    ],
)
def test_a_number_alone_has_five_digits(value: float, half: float, text: str) -> None:
    assert number(value, half) == text


def test_a_difference_has_its_sign_and_is_zero_where_it_is_a_rounding_error() -> None:
    assert plus_minus(0.5, 0.1, sign=True) == "+0.50 ± 0.10"
    assert plus_minus(-0.004, 0.1, sign=True) == "-0.00 ± 0.10"
    assert plus_minus(-1e-17, 3e-18, 0.03, sign=True) == "+0 ± 0"


@given(FINITE, st.floats(0.0, allow_nan=False))
def test_whatever_is_written_is_short_and_can_be_read(
    value: float, half: float
) -> None:
    first, _, second = plus_minus(value, half).partition(" ± ")
    for text in (first, second):
        assert len(text) <= 27
        assert re.fullmatch(NUMBER, text) or text == "inf"
    assert first != "-0"


@given(USUAL, WIDTHS)
def test_what_is_read_is_the_number_but_for_its_rounding(
    value: float, half: float
) -> None:
    first, second = map(float, plus_minus(value, half).split(" ± "))
    rounding = max(0.0501 * half, 0.5 if half >= 10.0 else 0.0)
    assert abs(first - value) <= rounding
    assert abs(second - half) <= rounding


@given(USUAL, st.floats(0.0, 1e-13))
def test_half_widths_of_rounding_errors_are_none(value: float, part: float) -> None:
    half = abs(value) * part
    text = plus_minus(value, half)
    assert text.endswith(" ± 0")
    assert len(text) <= 16


@given(USUAL, WIDTHS)
def test_all_notations_agree(value: float, half: float) -> None:
    with_error = plus_minus(value, half)
    bounds = with_interval(value, value - half, value + half)
    assert with_error.partition(" ")[0] == number(value, half)
    width = (value + half) / 2 - (value - half) / 2
    if math.floor(math.log10(width)) == math.floor(math.log10(half)):
        assert bounds.partition(" ")[0] == number(value, half)


@pytest.mark.parametrize("write", [number, plus_minus])
@given(st.floats(), st.floats(0.0) | st.just(NAN))
def test_no_float_is_refused(
    write: Callable[[float, float], str], value: float, half: float
) -> None:
    assert write(value, half)


@given(st.floats(), st.floats(), st.floats())
def test_no_interval_is_refused(value: float, low: float, high: float) -> None:
    text = with_interval(value, low, high)
    assert (text == "-") == math.isnan(value)
