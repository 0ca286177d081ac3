"""The past of a live run is what was run, bit by bit, with the settings of then."""

import numpy as np
import pytest
from numpy.typing import NDArray

from sweep.web import course as courses
from sweep.web.history import Cursor
from sweep.web.session import Session
from sweep.web.state import begin

Frames = dict[int, NDArray[np.float64]]


def session(steps: int = 60, n: int = 30) -> Session:
    one = Session(begin("nguyen2024", "as_run"))
    one.change({"n": n, "steps": steps})
    return one


def go(one: Session, steps: int, seen: Frames) -> None:
    """Take steps one by one, and note each frame."""
    one.take_steps(steps)
    while one.going:
        one.advance(1)
        seen[one.step] = one.bodies.copy()


def changed_twice(n: int = 30) -> tuple[Session, Frames]:
    """A run of 40 steps that was changed after 15 and after 30, and its frames."""
    one, seen = session(n=n), Frames()
    go(one, 15, seen)
    one.change({"cohesion_weight": 3.0})
    go(one, 15, seen)
    one.place([{"disc": {"x": 300.0, "y": 200.0, "radius": 60.0}}])
    go(one, 10, seen)
    return one, seen


@pytest.mark.parametrize("most_bytes", [courses.MOST_BYTES, 1])
def test_every_step_of_the_past_is_shown_with_its_bits_and_its_settings(
    most_bytes: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In whatever order, and where memory is short too."""
    monkeypatch.setattr(courses, "MOST_BYTES", most_bytes)
    monkeypatch.setattr(courses, "steps_a_call", lambda _: 4)
    one, seen = changed_twice()
    for step in (40, 3, 31, 15, 30, 29, 14, 16, 39, 1):
        one.seek(step)
        assert (one.step, one.running) == (step, False)
        np.testing.assert_array_equal(one.bodies, seen[step])
        weight = one.state.settings["cohesion_weight"]
        assert weight == (3.0 if step >= 15 else 1.0)
        assert (one.state.own is not None) is (step >= 30)
        assert one.exact is (step < 15)
    assert "cohesion_weight, obstacles changed, last at step 30" not in one.note
    one.seek(35)
    assert "cohesion_weight, obstacles changed, last at step 30" in one.note


def test_states_take_no_more_memory_than_they_may(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(courses, "steps_a_call", lambda _: 1)
    one, seen = session(), Frames()
    go(one, 1, seen)
    (state,) = one.course.parts[0].checkpoints.values()
    size = sum(array.nbytes for array in state.arrays.values())
    monkeypatch.setattr(courses, "MOST_BYTES", 5 * size)
    go(one, 59, seen)
    assert 1 < len(one.course.parts[0].checkpoints) <= 5
    for step in (59, 2, 33):
        one.seek(step)
        np.testing.assert_array_equal(one.bodies, seen[step])


def test_going_on_from_the_past_repeats_what_came_after_with_its_changes() -> None:
    one, seen = changed_twice()
    before, _ = one.history.since(Cursor())
    one.seek(5)
    again = Frames()
    go(one, 35, again)
    assert all(np.array_equal(again[step], seen[step]) for step in range(6, 41))
    assert one.state.own is not None
    assert one.entered == 3
    after, _ = one.history.since(Cursor())
    assert after == before


def test_a_change_in_the_past_replaces_what_came_after() -> None:
    one, seen = changed_twice()
    one.seek(20)
    one.change({"cohesion_weight": 0.5})
    assert one.past == (0, 20)
    message, _ = one.history.since(Cursor())
    assert message is not None
    assert message["steps"] == list(range(21))
    other = Frames()
    go(one, 20, other)
    assert one.state.own is None
    assert not np.array_equal(other[40], seen[40])
    one.seek(15)
    np.testing.assert_array_equal(one.bodies, seen[15])


def test_a_change_that_is_taken_back_before_any_step_never_was() -> None:
    plain, one = session(), session()
    expected, seen = Frames(), Frames()
    go(plain, 40, expected)
    go(one, 10, seen)
    for weight in (3.0, 2.0, 1.0):
        one.change({"cohesion_weight": weight})
    assert (one.exact, one.note) == (True, "")
    go(one, 30, seen)
    np.testing.assert_array_equal(seen[40], expected[40])


def test_a_longer_run_has_the_same_past() -> None:
    one, seen = changed_twice()
    one.seek(10)
    one.change({"steps": 120})
    assert (one.past, one.exact) == ((0, 40), True)
    one.seek(40)
    np.testing.assert_array_equal(one.bodies, seen[40])
    go(one, 80, seen)
    assert one.simulation.steps_left == 0


def test_of_very_many_changes_the_later_half_stays(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(courses, "MOST_PARTS", 10)
    one, seen = session(steps=100), Frames()
    for k in range(25):
        go(one, 2, seen)
        one.change({"cohesion_weight": 1.0 + k / 10})
    first, last = one.past
    assert 0 < first < last == 50
    one.seek(0)
    assert (one.step, one.exact) == (first, False)
    for step in (first + 1, 49, first):
        one.seek(step)
        np.testing.assert_array_equal(one.bodies, seen[step])


def test_steps_before_a_run_diverged_can_be_gone_to() -> None:
    one, seen = session(), Frames()
    go(one, 8, seen)
    one.simulation.flock.x[3] = np.nan
    one.run()
    while one.going:
        one.advance(5)
    assert one.diverged
    one.seek(60)
    assert (one.step, one.diverged) == (8, False)
    np.testing.assert_array_equal(one.bodies, seen[8])
