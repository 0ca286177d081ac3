"""Cells, sides and crossings of refined grids, against functions whose boundary is
known.
"""

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sweep.analysis.mean_bounds import Declaration
from sweep.methods.refinement.rule import (
    ABOVE,
    UNKNOWN,
    Cell,
    Place,
    RefinedAxis,
    Refinement,
    crossings,
    first_cells,
    from_json,
    leaves,
    look,
    next_trials,
    sides_of,
)
from tests.refined import Draw, line, refined, rule, settings

RINGS = {"x": line([-1, -0.5, 0, 0.5, 1], 0.02), "y": line([-1, -0.5, 0, 0.5, 1], 0.02)}


def nearly(value: float, number: int) -> list[float]:
    """So many values that are almost equal: equal ones would tell nothing."""
    return [value + 1e-9 * trial for trial in range(number)]


def exactly(function: Callable[..., float]) -> Draw:
    """Trials with hardly any noise."""
    return lambda at, number: nearly(function(*at), number)


@pytest.mark.parametrize(
    ("scale", "place", "value"),
    [
        (RefinedAxis((0.0, 1.0, 3.0), 2), 6, 2.0),
        (RefinedAxis((0.0, 1.0, 3.0), 2), 8, 3.0),
        (RefinedAxis((1.0, 100.0), 2, geometric=True), 1, 3.16227766017),
        (RefinedAxis((10.0, 15.0), 3, integer=True), 4, 12.0),
        (RefinedAxis((0.1, 0.2), 1), 1, 0.15),
    ],
)
def test_values_lie_between_those_of_the_spec(
    scale: RefinedAxis, place: int, value: float
) -> None:
    assert scale.at(place) == value
    assert scale.place(value) == place


ASCENDING = st.lists(st.integers(1, 10**6), min_size=2, max_size=6, unique=True)


@given(ASCENDING, st.integers(0, 9), st.booleans(), st.booleans())
def test_a_value_leads_back_to_a_place_with_it(
    values: list[int], halvings: int, geometric: bool, whole: bool
) -> None:
    scale = RefinedAxis(tuple(map(float, sorted(values))), halvings, geometric, whole)
    every = {place: scale.at(place) for place in range(scale.last + 1)}
    assert [*every.values()] == sorted(every.values())
    for place, value in every.items():
        found = scale.place(value)
        assert found is not None
        assert scale.at(found) == value
        assert found == place or whole
    assert scale.place(min(values) - 1) is None
    assert scale.place(max(values) + 1) is None


@pytest.mark.parametrize(
    ("scale", "until", "halvings"),
    [
        ([0.0, 1.0], 0.5, 1),
        ([0.0, 1.0], 0.1, 4),
        ([0.0, 0.5, 1.0], 0.125, 2),
        ([0.0, 0.9, 1.0], 0.45, 1),
        ([0.0, 1.0], 0.99, 1),
        ([0.0, 1.0, 2.0], 0.5, 0),
    ],
)
def test_steps_are_halved_until_they_are_short(
    scale: list[float], until: float, halvings: int
) -> None:
    assert line(scale, until).halvings == halvings


def test_whole_numbers_are_halved_until_they_are_neighbours() -> None:
    scale = RefinedAxis((10.0, 13.0), 20, integer=True)
    asked = rule({"n": scale}, until=0.001)
    trials, _ = refined(asked, exactly(lambda n: n > 11.5))
    assert [settings(asked, place)[0] for place in trials] == [10, 11, 12, 13]


def test_the_boundary_of_one_axis_costs_the_logarithm_of_its_precision() -> None:
    edge, found = 0.3141, {}
    for until in (0.01, 0.0001):
        asked = rule({"x": line([0, 0.5, 1], until)}, until=until)
        trials, seen = refined(asked, exactly(lambda x: float(x > edge)))
        (one,) = crossings(asked, [*trials], seen)
        low, high = (asked.scales["x"].at(at) for at in (one.low, one.high))
        assert low <= edge <= high
        assert high - low <= until
        assert one.rises
        found[until] = len(trials)
    assert found[0.0001] - found[0.01] == 7  # halvings: 13 and 6


def test_the_cells_at_a_circle_are_those_that_it_goes_through() -> None:
    """Whether a convex curve goes through a small cell is seen at its corners, but for
    cells that it enters and leaves by one side.
    """
    number = {}
    for until in (0.08, 0.02):
        asked = rule(
            {"x": line([-1, 0, 1], until), "y": line([-1, 0, 1], until)}, until=until
        )
        trials, seen = refined(
            asked, exactly(lambda x, y: float(math.hypot(x, y) < 0.7))
        )
        cells = leaves(asked, 1, trials)
        counts = np.array([*trials.values()])
        crossed = sides_of(cells, [*trials], seen, counts).crossed
        assert all(
            not cell.parts(asked)
            for cell, one in zip(cells, crossed, strict=True)
            if one
        )
        for cell, one in zip(cells, crossed, strict=True):
            inside = [math.hypot(*settings(asked, at)) < 0.7 for at in cell.corners]
            assert one == (0 < sum(inside) < 4)
        number[until] = len(trials)
    # Four times as fine: 16 times the points of a grid, and 4 to 6 of these.
    assert number[0.02] < 6 * number[0.08]


def test_cells_are_found_again_in_the_points() -> None:
    asked = rule(RINGS, until=0.02)
    trials, _ = refined(asked, exactly(lambda x, y: float(x + y * y > 0.2)))
    cells = leaves(asked, 1, trials)
    area = sum(math.prod(cell.shares(asked)) for cell in cells)
    assert area == pytest.approx(1.0)
    assert {corner for cell in cells for corner in cell.corners} == set(trials)


def test_groups_are_refined_apart() -> None:
    asked = rule({"x": line([0, 1], 0.1)}, until=0.1)
    assert [cell.low[0] for cell in first_cells(asked, 2)] == [0, 1]

    def draw(at: tuple[float, ...], number: int) -> list[float]:
        return nearly(float(at[0] > 0.3), number)

    trials, seen = refined(asked, draw, groups=2)
    found = [*crossings(asked, [*trials], seen)]
    assert [one.group for one in found] == [0, 1]
    assert found[0][1:] == found[1][1:]


def test_a_point_that_cannot_be_leaves_its_cell_whole() -> None:
    asked = rule({"x": line([0, 1], 0.1)}, until=0.1)
    trials = {(0, 0): 3, (0, asked.scales["x"].last): 3}
    seen = look(asked, np.array([3, 3]), nearly(0.0, 3) + nearly(1.0, 3), "normal")
    assert next_trials(asked, 1, trials, seen, lambda _: []) == {}
    assert len(next_trials(asked, 1, trials, seen, lambda places: places)) == 1


def test_the_budget_is_never_exceeded_and_goes_to_large_cells_first() -> None:
    for budget in range(27, 400, 31):
        asked = rule(
            {"x": line([0, 0.5, 1], 0.02), "y": line([0, 0.5, 1], 0.02)},
            until=0.02,
            budget=budget,
        )
        trials, seen = refined(asked, exactly(lambda x, y: float(x * y > 0.2)))
        assert sum(trials.values()) <= budget
        cells = leaves(asked, 1, trials)
        counts = np.array([*trials.values()])
        crossed = sides_of(cells, [*trials], seen, counts).crossed
        open_ = [
            math.prod(cell.shares(asked))
            for cell, one in zip(cells, crossed, strict=True)
            if one and cell.parts(asked)
        ]
        # A cell has at most 5 new points of 3 trials.
        assert not open_ or sum(trials.values()) > budget - 15


def test_points_without_values_stop_nothing() -> None:
    asked = rule({"x": line([0, 0.5, 1], 0.1)}, until=0.1)

    def draw(at: tuple[float, ...], number: int) -> list[float]:
        return nearly(math.nan if at[0] == 0 else float(at[0] > 0.7), number)

    trials, seen = refined(asked, draw)
    assert trials[0, 0] == asked.least
    assert seen.values[0] == 0
    (one,) = crossings(asked, [*trials], seen)
    assert asked.scales["x"].at(one.high) - asked.scales["x"].at(one.low) <= 0.1


def test_equal_values_are_on_no_side_of_a_level_unless_they_have_a_range() -> None:
    """Nobody knows what else there may be: so such points get all of their trials."""
    asked, counts, values = rule(RINGS, at=0.3), np.array([10, 10]), np.ones(20)
    free = look(asked, counts, values, "normal")
    assert free.side.tolist() == [UNKNOWN, UNKNOWN]
    assert (free.further > counts).all()
    within = look(asked, counts, values, Declaration.of("normal", 0.0, 1.0))
    assert within.side.tolist() == [ABOVE, ABOVE]
    assert (within.further == counts).all()


def test_noise_brings_trials_to_the_boundary() -> None:
    asked = rule({"x": line([0, 0.25, 0.5, 0.75, 1], 0.05)}, until=0.05, most=40)
    trials, seen = refined(asked, noisy(np.random.default_rng(1)))
    near = [abs(settings(asked, place)[0] - EDGE) < 0.1 for place in trials]
    number = np.array([*trials.values()])
    assert number[near].mean() > 3 * number[~np.array(near)].mean()
    assert seen.side[-1] == ABOVE


EDGE = 0.37


def noisy(rng: np.random.Generator, spread: float = 0.3) -> Draw:
    """A mean that goes from 0 to 1, with normal noise; it is 0.5 at EDGE."""

    def draw(at: tuple[float, ...], number: int) -> list[float]:
        mean = 1.0 / (1.0 + math.exp(-8.0 * (at[0] - EDGE)))
        return rng.normal(mean, spread, number).tolist()

    return draw


@pytest.mark.slow
def test_a_crossing_holds_the_edge() -> None:
    """Of 60 made-up studies. Up to 5 % may err, 3 of them: more than 9 would with a
    chance of 0.06 %. `measured_boundaries` has more, with other noise.
    """
    scale = line([0, 0.25, 0.5, 0.75, 1], 0.02)
    asked = rule({"x": scale}, until=0.02)
    outside = 0
    for seed in range(60):
        trials, seen = refined(asked, noisy(np.random.default_rng([7, seed])))
        found = [*crossings(asked, [*trials], seen)]
        ends = [[scale.at(at) for at in (one.low, one.high)] for one in found]
        outside += not (len(ends) == 1 and ends[0][0] <= EDGE <= ends[0][1])
    assert outside <= 9


def test_a_rule_is_read_as_it_was_written() -> None:
    asked = rule(RINGS | {"n": RefinedAxis((10.0, 20.0), 2, integer=True)})
    assert from_json(asked.as_json()) == asked


def places(cells: list[Cell]) -> set[Place]:
    """All corners of some cells."""
    return {corner for cell in cells for corner in cell.corners}


@pytest.mark.parametrize("scales", [{"x": line([0, 1], 0.1)}, RINGS])
def test_a_whole_grid_has_its_first_cells(scales: dict[str, RefinedAxis]) -> None:
    asked: Refinement = rule(scales, until=0.1)
    first = [*first_cells(asked, 2)]
    assert leaves(asked, 2, places(first)) == first
