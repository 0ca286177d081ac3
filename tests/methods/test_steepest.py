"""Where a mean changes most: made-up sigmoids whose steepest place is known."""

import math

import numpy as np
import pytest

from sweep.methods.refinement.rule import STEEPEST, Refinement, SeenPoints
from sweep.methods.refinement.steepest import Peak, next_trials, peaks, remaining
from tests.cases import slow_but
from tests.methods.measured_boundaries import EDGE, logistic
from tests.methods.measured_steepest import measured
from tests.refined import line, refined, rule

GRID = [0.0, 0.25, 0.5, 0.75, 1.0]


def asked(most: int = 40, until: float = 0.01, budget: int = 100_000) -> Refinement:
    """A rule that seeks the steepest place on a line of five points."""
    scales = {"x": line(GRID, until)}
    return rule(scales, at=STEEPEST, until=until, least=5, most=most, budget=budget)


def seen(means: list[float], half: float, values: int = 9) -> SeenPoints:
    """Points with these means and intervals, which may get more trials."""
    mean, count = np.array(means), np.full(len(means), values)
    sides = np.zeros(len(means), np.int64)
    return SeenPoints(count, mean, mean - half, mean + half, sides, count + 5)


def sigmoid(x: np.ndarray, edge: float) -> np.ndarray:
    return np.asarray(1.0 / (1.0 + np.exp(-20.0 * (x - edge))))


@pytest.mark.parametrize("edge", np.linspace(0.05, 0.95, 19).tolist())
@pytest.mark.parametrize("off", [0.0, 0.01])
def test_known_means_leave_the_cell_and_those_beside_it(
    edge: float, off: float
) -> None:
    """Without noise: of a place within a cell at most three cells, of one that is a
    point the two on either side of it, as no triple tells these apart.
    """
    edge += off
    x = np.linspace(0.0, 1.0, 41)
    mean = sigmoid(x, edge)
    found = remaining(x, mean, mean)
    assert found
    first, last = found
    assert x[first] <= edge <= x[last]
    assert last - first <= (3 if off else 4)


def test_wide_intervals_leave_everything() -> None:
    x = np.linspace(0.0, 1.0, 9)
    mean = sigmoid(x, 0.5)
    assert remaining(x, mean - 1.0, mean + 1.0) == (0, 8)


def test_two_steps_contradict_each_other() -> None:
    x = np.linspace(0.0, 1.0, 21)
    mean = sigmoid(x, 0.25) + sigmoid(x, 0.75)
    assert remaining(x, mean, mean) is None
    places = [(0, at) for at in range(0, 4 * 32 + 1, 32)]
    (peak,) = peaks(asked(), places, seen([0.0, 1.0, 1.0, 1.0, 2.0], 0.01))
    assert peak.several
    assert (peak.low, peak.high) == (0, 128)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_falling_mean_is_as_a_rising_one(sign: float) -> None:
    places = [(0, at) for at in range(0, 4 * 32 + 1, 32)]
    means = [0.0, 0.05, 0.95, 1.0, 1.0]
    (peak,) = peaks(asked(), places, seen([sign * one for one in means], 0.01))
    assert peak == Peak(0, 0, 96, 0.375, sign > 0, several=False)


def test_ends_that_do_not_differ_are_looked_at_longer() -> None:
    places = {(0, at): 9 for at in range(0, 4 * 32 + 1, 32)}
    flat = seen([0.5, 0.5, 0.52, 0.5, 0.51], 0.1)
    (peak,) = peaks(asked(), [*places], flat)
    assert peak.rises is None
    more = next_trials(asked(), 1, places, flat, lambda some: some)
    assert more == dict.fromkeys(places, 14)


def test_few_cells_are_halved_and_many_are_looked_at_longer() -> None:
    places = {(0, at): 9 for at in range(0, 4 * 32 + 1, 32)}
    sure = seen([0.0, 0.05, 0.95, 1.0, 1.0], 0.01)
    more = next_trials(asked(), 1, places, sure, lambda some: some)
    assert more == {(0, 16): 5, (0, 48): 5, (0, 80): 5}
    assert next_trials(asked(), 1, places, sure, lambda some: some[:2]) == {}
    assert next_trials(asked(budget=59), 1, places, sure, lambda some: some) == {}


def test_groups_are_apart_and_points_without_values_are_left_out() -> None:
    places = [(group, at) for group in (0, 1) for at in range(0, 4 * 32 + 1, 32)]
    means = [0.0, 0.05, 0.95, 1.0, 1.0, 0.0, 0.0, 0.05, 0.95, 1.0]
    both = seen(means, 0.01)
    assert [one.group for one in peaks(asked(), places, both)] == [0, 1]
    lost = both._replace(values=np.array([9] * 5 + [1] * 4 + [9]))
    assert [one.group for one in peaks(asked(), places, lost)] == [0]


@pytest.mark.parametrize("seed", slow_but([0], range(3)))
def test_the_place_is_found_as_finely_as_asked(seed: int) -> None:
    """With noise of 0.002 of the height of a sigmoid: cells of 1/32, at most four."""
    one = asked(until=1 / 32)
    trials, found = refined(one, logistic(EDGE, 20.0, 0.002, [seed]))
    (peak,) = peaks(one, [*trials], found)
    low, high = (one.scales["x"].at(place) for place in (peak.low, peak.high))
    assert low <= EDGE <= high
    assert high - low <= 4 / 32
    assert peak.estimate == pytest.approx(EDGE, abs=2 / 32)
    assert peak.rises


def test_intervals_of_the_slope_err_on_both_sides_of_all_points() -> None:
    """Of the 129 points of the finest grid each has its share of 5 %."""
    level, slope = rule({"x": line(GRID, 0.01)}, most=3), asked(most=5)
    assert len(slope.looks) == 1
    assert slope.nominal == pytest.approx(1.0 - 0.05 / 129, rel=1e-12)
    assert level.nominal < slope.nominal
    assert math.isnan(slope.level)
    assert (level.where, slope.where) == ("crosses 0.5", "changes most")


@pytest.mark.slow
def test_the_interval_holds_the_place() -> None:
    """More than 8 wrong ones of 40, where 5 % are allowed, have a chance of 2e-5."""
    none, wrong, _, _ = measured(40, 20.0, 0.1, 10)
    assert none == 0
    assert wrong <= 8
