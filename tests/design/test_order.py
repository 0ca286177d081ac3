"""From coarse to fine: the whole picture is seen early, and nothing else changes."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sweep.design.design import expand
from sweep.design.jobs import Jobs
from sweep.design.order import ends_then_middles, fineness_of
from sweep.errors import SpecError
from sweep.spec.study import parse_spec
from tests.searches import TINY
from tests.specs import short_study

GRID = """
sweep: {n: [3, 4, 5, 6, 7], steps: [1, 2, 3, 4, 5]}
"""


def run_order(text: str) -> list[tuple[Any, ...]]:
    """The columns and the replicate of all trials in the order in which they run."""
    study = short_study(text)
    jobs = Jobs(study, expand(study))
    names = jobs.design.columns
    return [
        (*(job.settings[name] for name in names), job.replicate)
        for job in jobs.to_run(np.arange(len(jobs)))
    ]


@given(st.integers(1, 3000))
def test_every_place_of_an_axis_comes_once_and_the_ends_first(count: int) -> None:
    places = ends_then_middles(count).tolist()
    assert sorted(places) == list(range(count))
    assert places[:2] == [0, count - 1][:count]


@pytest.mark.parametrize("count", [65, 100, 1000])
def test_no_gap_is_more_than_twice_as_wide_as_it_must_be(count: int) -> None:
    places = ends_then_middles(count)
    for seen in (3, 5, 9, 17, 33, 40):
        gaps = np.diff(np.sort(places[:seen]))
        assert gaps.max() <= 2 * -(-(count - 1) // (seen - 1))


def test_corners_run_first_then_a_grid_of_three_then_all_of_the_next_replicate() -> (
    None
):
    order = run_order("order: coarse" + GRID)
    first, second = order[:25], order[25:]
    assert {replicate for *_, replicate in first} == {0}
    assert second == [(n, steps, 1) for n, steps, _ in first]
    assert {one[:2] for one in first[:4]} == {(n, s) for n in (3, 7) for s in (1, 5)}
    assert {one[:2] for one in first[:9]} == {
        (n, s) for n in (3, 5, 7) for s in (1, 3, 5)
    }


def test_a_sample_keeps_its_order_because_its_beginnings_are_spread_evenly() -> None:
    sample = """order: coarse
sweep:
  gains: {sample: sobol, points: 16, cohesion_weight: {uniform: [0, 1]}}
  map: [empty, random_obstacles]
"""
    study = short_study(sample)
    gains = study.axes[0]
    assert fineness_of(gains).tolist() == list(range(16))
    order = run_order(sample)
    listed = [gain for gain, _map, replicate in order if replicate == 0]
    found = [gain for place, gain in enumerate(listed) if gain not in listed[:place]]
    assert found == gains.columns["cohesion_weight"].tolist()


def test_points_that_conditions_leave_out_change_the_order_of_no_other() -> None:
    every = run_order("order: coarse" + GRID)
    fewer = run_order("order: coarse\nrequire: [n + steps != 5]" + GRID)
    assert fewer == [one for one in every if one[0] + one[1] != 5]


def test_where_an_axis_does_not_apply_its_one_point_is_coarse() -> None:
    order = run_order(
        """order: coarse
sweep:
  n: [3, 4]
  steps: {values: [1, 2, 3, 4, 5], when: n > 3}
"""
    )
    assert {one[0] for one in order[:3]} == {3, 4}
    assert len(order) == 12


def test_the_order_is_in_no_id() -> None:
    plain, coarse = short_study(GRID), short_study("order: coarse" + GRID)
    before, after = (Jobs(one, expand(one)) for one in (plain, coarse))
    assert before.table().equals(after.table())
    some = np.array([40, 3, 7])
    assert before.to_run(some).indices.tolist() == some.tolist()
    assert sorted(after.to_run(some).indices.tolist()) == sorted(some.tolist())


def test_a_search_has_no_order() -> None:
    with pytest.raises(SpecError, match='a study with "search" takes no "order"'):
        parse_spec(TINY + "order: coarse\n")
