"""Loops between way up and way down."""

import numpy as np
import pytest

from sweep.analysis import mean_interval
from sweep.analysis.hysteresis import loop
from tests.analysis.measured_loops import VALUES, covered

LINE = np.array([0.0, 1.0, 3.0])


def test_the_area_is_that_of_trapezia() -> None:
    """Over 0 to 1 the mean height is (0 + 2) / 2, over 1 to 3 it is (2 + 1) / 2. Chains
    that are equal would not say how much others vary.
    """
    down = np.array([[0.0, 2.0, 1.0]] * 2)
    apart = 1e-6 * np.array([[1.0, 1.0, 1.0], [-1.0, -1.0, -1.0]])
    found = loop(LINE, np.zeros((2, 3)), down + apart)
    assert found.area[:3] == pytest.approx((4.0, 4.0, 4.0), abs=1e-4)
    equal = loop(LINE, np.zeros((2, 3)), down)
    assert (equal.area.value, equal.area.n) == (4.0, 2)
    assert np.isnan(equal.area.low)
    assert not equal.apart.any()
    assert found.difference == pytest.approx([0.0, 2.0, 1.0])
    assert (found.apart.tolist(), found.width) == ([False, True, True], 2.0)


def test_directions_that_are_changed_change_the_sign() -> None:
    rng = np.random.default_rng(3)
    up, down = rng.normal(size=(2, 6, 3))
    one, other = loop(LINE, up, down), loop(LINE, down, up)
    assert one.area.value == -other.area.value
    assert one.area.low == pytest.approx(-other.area.high, rel=1e-12)


def test_chains_that_lack_a_link_take_no_part() -> None:
    rng = np.random.default_rng(4)
    up, down = rng.normal(size=(2, 6, 3))
    up[2, 1], down[4, 0] = np.nan, np.inf
    whole = [0, 1, 3, 5]
    found, asked = loop(LINE, up, down), loop(LINE, up[whole], down[whole])
    assert (found.chains, found.area) == (4, asked.area)


@pytest.mark.parametrize("chains", [0, 1])
def test_too_few_chains_have_no_interval(chains: int) -> None:
    found = loop(LINE, np.zeros((chains, 3)), np.ones((chains, 3)))
    assert np.isnan(found.area.low)
    assert not found.apart.any()
    assert found.width == 0.0


def test_intervals_are_students_over_chains() -> None:
    """Of the areas, and, at a confidence that holds for all values together, of the
    differences.
    """
    up, down = np.random.default_rng(5).normal(size=(2, 6, 3))
    found, gaps = loop(LINE, up, down, 0.9), down - up
    areas = (gaps[:, 0] + gaps[:, 1]) / 2 + (gaps[:, 1] + gaps[:, 2])
    assert found.area == pytest.approx(mean_interval(areas, 0.9))
    for place in range(3):
        expected = mean_interval(gaps[:, place], 1.0 - 0.1 / 3)
        one = (found.difference[place], found.low[place], found.high[place])
        assert one == pytest.approx(expected[:3])


def test_rounding_errors_are_no_difference() -> None:
    up = np.ones((5, 3))
    found = loop(LINE, up, up + 2e-16)
    assert not found.apart.any()


@pytest.mark.slow
def test_the_interval_covers_the_area() -> None:
    """400 made-up studies of 5 chains: 95 % of them cover. Fewer than 91.8 % or more
    than 98.0 % happen with a chance of 0.5 % (binomial, two-sided). Links that are
    taken for independent values do not: they depend on each other.
    """
    whole, apart = covered(400, 5, "normal", 0.2)
    assert 0.918 <= whole <= 0.98
    assert apart < 0.9
    assert len(VALUES) == 11
