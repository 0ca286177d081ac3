"""Two runs side by side are at the same step, whatever is done with them."""

import random
import struct
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from sweep.errors import SpecError
from sweep.web import messages
from sweep.web.history import Cursor
from sweep.web.live_show import Live
from sweep.web.messages import Message
from sweep.web.replaying import Replay
from sweep.web.state import begin
from sweep.web.twin import Twin
from tests.cases import slow_but
from tests.studies import launched

SPEC = """
study: twins
model: nguyen2024
preset: as_run
fixed: {n: 8, map: empty}
sweep: {cohesion_weight: [0.5, 2.0], steps: [20, 30]}
replicates: 1
record: {metrics: [speed], series: [speed]}
"""


def live(steps: int = 40) -> Live:
    show = Live(begin("nguyen2024", "as_run"))
    show.change({"n": 12, "steps": steps})
    return show


def presets() -> Twin:
    first = live()
    return Twin(first, first.beside("as_written"))


def steps_of(twin: Twin) -> tuple[int, int]:
    """The steps in the two frames of a picture, and in nothing else."""
    picture = twin.picture()
    magic, size = struct.unpack_from("<4sI", picture)
    assert magic == b"BSF2"
    first, second = picture[8 : 8 + size], picture[8 + size :]
    assert (first[:4], second[:4]) == (b"BSF1", b"BSF1")
    return struct.unpack_from("<I", first, 8)[0], struct.unpack_from("<I", second, 8)[0]


def go(twin: Twin, steps: int) -> None:
    twin.handle(messages.Step(steps))
    while twin.going:
        twin.advance(7)
        assert len(set(steps_of(twin))) == 1


def test_presets_start_together_with_the_same_seed_and_their_own_bits() -> None:
    twin = presets()
    go(twin, 25)
    assert steps_of(twin) == (25, 25)
    for side, preset in zip(twin.sides, ("as_run", "as_written"), strict=True):
        assert isinstance(side, Live)
        assert (side.state.preset, side.state.seed) == (preset, 1)
        alone = Live(begin("nguyen2024", preset).with_settings({"n": 12, "steps": 40}))
        alone.take_steps(25)
        while alone.going:
            alone.advance(25)
        np.testing.assert_array_equal(side.bodies, alone.bodies)


def test_a_copy_goes_on_from_here_and_one_of_them_is_changed() -> None:
    first = live()
    first.take_steps(10)
    while first.going:
        first.advance(10)
    twin = Twin(first, first.beside(""))
    assert steps_of(twin) == (10, 10)
    go(twin, 5)
    one, other = twin.sides
    assert isinstance(one, Live)
    assert isinstance(other, Live)
    np.testing.assert_array_equal(one.bodies, other.bodies)
    twin.handle(messages.Set("cohesion_weight", 4.0, side=1))
    go(twin, 5)
    assert not np.array_equal(one.bodies, other.bodies)
    assert (one.exact, other.exact) == (True, False)
    twin.handle(messages.Seek(12))
    assert steps_of(twin) == (12, 12)
    np.testing.assert_array_equal(one.bodies, other.bodies)


def some_message(chance: random.Random) -> Message:
    side = chance.randrange(2)
    return chance.choice(
        [
            messages.StartRun(side=side),
            messages.Pause(side=side),
            messages.Step(chance.randrange(9), side=side),
            messages.Reset(side=side),
            messages.Seek(chance.randrange(50), side=side),
            messages.Speed(30, side=side),
            messages.Continue(side=side),
            messages.Set("cohesion_weight", chance.random(), side=side),
            messages.Set("n", 5 + chance.randrange(9), side=side),
            messages.Set("steps", 5 + chance.randrange(60), side=side),
            messages.Undo(side=side),
            messages.Redo(side=side),
            messages.ChooseModel("nguyen2024", "as_written", side=side),
            messages.Shapes([], side=side),
        ]
    )


@pytest.mark.parametrize("seed", slow_but([0], range(3)))
def test_both_frames_have_the_same_step_after_whatever_is_done(seed: int) -> None:
    chance, twin = random.Random(seed), presets()
    for _ in range(60):
        with suppress(SpecError):
            twin.handle(some_message(chance))
        assert len(set(steps_of(twin))) == 1
        states = twin.states()
        for key in ("step", "steps", "running", "speed", "past"):
            assert states[0][key] == states[1][key], key
        for _ in range(chance.randrange(4)):
            if twin.going:
                twin.advance(1 + chance.randrange(9))
                assert len(set(steps_of(twin))) == 1


def test_where_one_ends_both_stop_and_going_on_makes_both_longer() -> None:
    twin = presets()
    twin.handle(messages.Set("steps", 15, side=1))
    twin.handle(messages.StartRun())
    while twin.going:
        twin.advance(4)
    assert steps_of(twin) == (15, 15)
    assert [state["ended"] for state in twin.states()] == ["", "ended at step 15"]
    assert not any(side.running for side in twin.sides)
    with pytest.raises(SpecError, match="has ended after 15 steps"):
        twin.handle(messages.StartRun())
    assert not any(side.running for side in twin.sides)
    twin.handle(messages.Continue())
    while twin.going:
        twin.advance(4)
    assert steps_of(twin) == (30, 30)


@pytest.mark.parametrize("side", [0, 1])
def test_where_one_diverges_both_show_its_last_finite_step(side: int) -> None:
    twin = presets()
    go(twin, 9)
    wild = twin.sides[side]
    assert isinstance(wild, Live)
    wild.simulation.flock.x[3] = np.nan
    twin.handle(messages.StartRun())
    while twin.going:
        twin.advance(5)
    assert steps_of(twin) == (9, 9)
    ended = [state["ended"] for state in twin.states()]
    assert "diverged at step 10" in ended[side]
    assert ended[1 - side] == ""
    twin.handle(messages.Reset())
    assert [state["ended"] for state in twin.states()] == ["", ""]


def test_what_is_asked_of_one_is_answered_by_it() -> None:
    twin = presets()
    (spec,) = [
        reply for reply in twin.handle(messages.Spec(side=1)) if reply["type"] == "spec"
    ]
    assert (spec["side"], "as_written" in spec["yaml"]) == (1, True)
    news, cursor = twin.news(Cursor())
    told = [reply["side"] for reply in news if reply["type"] == "metrics"]
    assert told == [0, 1]
    assert not [one for one in twin.news(cursor)[0] if one["type"] == "metrics"]
    with pytest.raises(SpecError, match="there is no run 2"):
        twin.handle(messages.Spec(side=2))


def test_stored_trials_are_played_on_one_clock(tmp_path: Path) -> None:
    study = launched(SPEC, tmp_path)
    trials = {
        (row["cohesion_weight"], row["steps"]): str(row["trial_id"])
        for row in study.trials.to_dict("records")
    }
    twin = Twin(Replay(study, trials[0.5, 20]), Replay(study, trials[2.0, 30]))
    assert [state["replay"]["frames"] for state in twin.states()] == [[0, 20, 1]] * 2
    for step in (13, 4, 20, 29):
        twin.handle(messages.Seek(step))
        assert steps_of(twin) == (min(step, 20),) * 2
    assert [state["ended"] for state in twin.states()] == ["ended at step 20", ""]
    twin.handle(messages.StartRun())
    assert (steps_of(twin), twin.running) == ((0, 0), True)
    while twin.going:
        twin.advance(6)
    assert steps_of(twin) == (20, 20)
    with pytest.raises(SpecError, match="cannot be changed"):
        twin.handle(messages.Set("n", 3, side=1))
