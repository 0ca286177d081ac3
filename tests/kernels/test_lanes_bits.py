"""What is written for lanes computes the bits of its text, or is refused."""

from functools import cache
from typing import Any

import numba
import numpy as np
import pytest
from numba.core.errors import TypingError
from numpy.random import PCG64, Generator

from kernels.coverage import build_coverage, heatmap, mark, unvisited
from kernels.indices import PIECE
from kernels.lanes.conversion import converted
from kernels.lanes.facts import NotForLanesError
from kernels.lanes.kernel import LanesWatch
from kernels.lanes.marks import (
    MOST,
    Marks,
    free_obstacles,
    mark_step,
    narrow_marks,
    room_left,
    wide_marks,
    widened,
)
from kernels.lanes.rows import Each, found, rows
from kernels.lanes.stubs import LANE_BY_LANE
from kernels.lanes.vectors import OPTIONS, WIDTH
from kernels.near import EVERYBODY, Near
from kernels.settings import STAMP
from kernels.worlds import build_reach
from tests.builders import OBSERVATION, a_world
from tests.cases import slow_but
from tests.kernels import rules_for_lanes as rules
from tests.kernels.test_lanes import roots_are_wide

N = 6
RNG = np.random.default_rng(3)
NUMBERS = RNG.normal(0.0, 2.0, (N, WIDTH))
NUMBERS[0] = np.round(NUMBERS[0])
MARKS = RNG.random((N, WIDTH)) < 0.6
MARKS[:, 2] = False
WAYS = RNG.normal(0.0, 2.0, (2, N, WIDTH))


def _alone(rule: Any, lane: int) -> tuple[np.ndarray, np.ndarray]:
    """The numbers and the events after a rule, for one lane."""
    row, events = NUMBERS[:, lane].copy(), np.zeros(3, np.int64)
    listed = np.flatnonzero(MARKS[:, lane])
    dx, dy, factor = np.zeros((3, N + PIECE))
    dx[: listed.size], dy[: listed.size] = WAYS[:, listed, lane]
    boid = np.zeros(N + 1, np.uint32)
    boid[: listed.size] = listed
    near = Near(
        boid, dx, dy, dx * dx + dy * dy, factor, np.zeros(N, np.bool_), EVERYBODY, None
    )
    rng = Generator(PCG64(lane))
    rule(row, near, listed.size, rng, LanesWatch(events))
    return row, events


@cache
def _compiled(rule: Any) -> Any:
    """A rule for all lanes at once, which takes seconds to be compiled."""
    advance = converted(rule)

    @numba.njit(**OPTIONS)
    def fly(row, boid, ways, marks, count, rngs, events):
        dx, dy, distance2, factor = ways
        near = Near(
            boid,
            rows(dx),
            rows(dy),
            rows(distance2),
            rows(factor),
            marks,
            EVERYBODY,
            None,
        )
        count_rows = rows(count)
        listed = found(count_rows[0], N, marks)
        watch = LanesWatch(rows(events))
        advance(rows(row), near, listed, rngs, watch)

    return fly


def _together(rule: Any) -> tuple[np.ndarray, np.ndarray]:
    """The numbers and the events after a rule, for all lanes."""
    row, events = NUMBERS.copy(), np.zeros((3, WIDTH), np.int64)
    dx, dy = np.zeros((2, N + 1, WIDTH))
    dx[:N], dy[:N] = WAYS
    marks = np.zeros(N + 1, np.uint8)
    marks[:N] = np.packbits(MARKS, axis=1, bitorder="little")[:, 0]
    boid = np.zeros(N + 1, np.uint32)
    boid[:N] = np.arange(N)
    count = MARKS.sum(axis=0).astype(np.int64)[None, :].copy()
    rngs = Each(*(Generator(PCG64(lane)) for lane in range(WIDTH)))
    ways = dx, dy, dx * dx + dy * dy, np.zeros((N + 1, WIDTH))
    _compiled(rule)(row, boid, ways, marks, count, rngs, events)
    return row, events


SAME = (
    rules.negative_places,
    rules.numbers_of_a_module,
    rules.powers,
    rules.names_of_parameters,
    rules.returns_within,
    rules.arithmetic,
    rules.special_numbers,
    rules.swaps,
    rules.events_that_are_counted,
    rules.truth_as_number,
    rules.factors_of_neighbours,
    rules.elementary_functions,
    rules.functions_of_neighbours,
)
REFUSED = (
    rules.keywords_of_draws,
    rules.or_of_counts,
    rules.draw_in_a_chain,
    rules.even_ones_and_what_follows,
    rules.helpers_of_a_module,
    rules.writes_by_a_module,
    rules.writes_deeper,
    rules.names_of_tools,
    rules.events_that_are_read,
    rules.events_that_are_set,
    rules.loops_that_need_their_test,
    rules.assigned_within,
    rules.kinds_written_by_a_helper,
    rules.whole_numbers_as_tests,
)


FAST = (
    rules.returns_within,
    rules.swaps,
    rules.events_that_are_counted,
    rules.elementary_functions,
    rules.functions_of_neighbours,
)
"""Of those above. Other fast tests compile the first and the last two as well."""


@pytest.mark.parametrize("rule", slow_but(FAST, SAME))
def test_a_rule_has_the_bits_of_its_text(rule: Any) -> None:
    row, events = _together(rule)
    for lane in range(WIDTH):
        numbers, counted = _alone(rule, lane)
        assert row[:, lane].tobytes() == numbers.tobytes()
        assert events[:, lane].tobytes() == counted.tobytes()


def test_exponentials_and_powers_are_of_all_lanes_at_once() -> None:
    """Not computed for one lane after the other: what they call is of vectors too."""
    _together(rules.functions_of_neighbours)
    _together(rules.elementary_functions)
    assert {"exp", "power", "_exp", "_log", "sine_cosine"}.isdisjoint(LANE_BY_LANE)


def test_a_rule_takes_roots_of_several_numbers_at_once() -> None:
    _together(rules.returns_within)
    fly = _compiled(rules.returns_within)
    [code], [machine] = fly.inspect_llvm().values(), fly.inspect_asm().values()
    roots = [line.split() for line in machine.splitlines() if "sqrt" in line]
    assert roots_are_wide("@llvm.sqrt.v8f64" in code, roots)


@pytest.mark.parametrize("rule", REFUSED)
def test_what_would_have_other_bits_is_refused(rule: Any) -> None:
    with pytest.raises((NotForLanesError, TypingError)):
        _together(rule)


def mark_once(marks: Marks, x: float, y: float) -> None:
    """Mark a step of one boid."""
    mark_step(marks, np.array([x]), np.array([y]))


def test_a_narrow_map_has_room_for_as_many_visits_as_it_says() -> None:
    world = a_world(12.0, 12.0)
    about = OBSERVATION._replace(footprint=STAMP, footprint_radius=1.0)
    coverage = build_coverage(world, build_reach(world, 0.0), about)
    marks = narrow_marks([coverage], alike=True)[0]
    for _ in range(100):
        mark_once(marks, 6.0, 6.0)
        mark_once(marks, 0.0, 0.0)
    assert room_left(marks) == MOST - 100


def test_an_obstacle_on_a_narrow_map_is_never_visited() -> None:
    world = a_world(12.0, 12.0, obstacles=(0.0, 0.0, 1.5, 1.5, 0))
    about = OBSERVATION._replace(footprint=STAMP, footprint_radius=1.0)
    coverage = build_coverage(world, build_reach(world, 0.0), about)
    assert coverage.visits[0] < 0
    marks = narrow_marks([coverage], alike=True)[0]
    seen, steps = np.zeros(1000), 2 * MOST // 1000 + 2
    for _ in range(steps):
        free_obstacles(marks, seen.size)
        mark_step(marks, seen, seen)
    assert marks.coverage.visits[marks.blocked].max() < 0
    assert marks.coverage.sums.tolist() == [0, 0, 0]


def test_sums_of_many_visits_are_exact() -> None:
    world = a_world(12.0, 12.0)
    about = OBSERVATION._replace(footprint=STAMP, footprint_radius=3.0)
    plain = build_coverage(world, build_reach(world, 0.0), about)
    plain.visits[:] = 2**30
    marks = wide_marks(unvisited(plain))
    for _ in range(5):
        mark(plain, 6.0, 6.0)
        mark_once(marks, 6.0, 6.0)
    assert plain.sums.tolist() == marks.coverage.sums.tolist()
    assert np.array_equal(plain.visits, marks.coverage.visits)


@pytest.mark.parametrize("radius", [0.5, 1.0, 2.0, 3.0])
@pytest.mark.parametrize("columns", [3, 5, 6, 7, 8, 20])
def test_rows_are_marked_as_pixels_one_by_one(radius: float, columns: int) -> None:
    """Also where a row of memory that is read goes on into the next row of the map."""
    world = a_world(float(columns), 17.0, obstacles=(2.0, 5.0, 1.0, 1.0, 0))
    about = OBSERVATION._replace(footprint=STAMP, footprint_radius=radius)
    plain = build_coverage(world, build_reach(world, 0.0), about)
    places = np.random.default_rng(1).uniform(-4.0, 21.0, (2, 500))
    kinds = [wide_marks(unvisited(plain)), *narrow_marks([unvisited(plain)], True)]
    for x, y in places.T:
        mark(plain, x, y)
    for marks in kinds:
        mark_step(marks, *places)
        found = widened(marks) if marks.is_narrow else marks.coverage
        assert found.sums.tolist() == plain.sums.tolist()
        assert np.array_equal(heatmap(found), heatmap(plain))


def test_a_footprint_wider_than_the_world_has_no_rows() -> None:
    world = a_world(1.0, 1.0)
    about = OBSERVATION._replace(footprint=STAMP)
    marks = wide_marks(build_coverage(world, build_reach(world, 0.0), about))
    assert marks.rows.shape[0] == 0
