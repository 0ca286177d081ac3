"""Every edit can be undone and made again, and says what it is."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from sweep.errors import SpecError
from sweep.web import messages
from sweep.web.live_show import Live
from sweep.web.messages import Message
from sweep.web.state import begin

DISC: Mapping[str, Any] = {"disc": {"x": 100.0, "y": 200.0, "radius": 30.0}}
EDITS: list[tuple[Message, str]] = [
    (messages.Set("cohesion_weight", 0.9), "cohesion weight 0.213 → 0.9"),
    (messages.Set("n", 40), "n 100 → 40"),
    (messages.Set("seed", 7), "seed 1 → 7"),
    (messages.Set("map", "empty"), "map cafeteria → empty"),
    (messages.Shapes([DISC]), "obstacles"),
    (messages.Goal(100, 200), "goal"),
    (messages.Metrics(("speed",)), "plots"),
    (messages.Sweep("n", 10, 20, 3), "sweep of n"),
    (
        messages.ChooseModel("aziel_chen2025", "as_written"),
        "aziel_chen2025, as_written",
    ),
    (messages.ChooseModel("nanobot", "as_run"), "nanobot, as_run"),
    (messages.Continue(), "steps 3600 → 7200"),
    (messages.Reset(), "reset"),
]


def live(steps: int = 12) -> Live:
    """A run in the cafeteria, some steps after its start."""
    show = Live(begin("aziel_chen2025", "as_run"))
    go(show, steps)
    return show


def go(show: Live, steps: int) -> None:
    show.take_steps(steps)
    while show.going:
        show.advance(steps)


def shown(show: Live) -> list[Any]:
    """All that a page sees of a run but for what can be undone."""
    said = show.status() | {"undo": "", "redo": ""}
    steps = [row.step for row in show.history.rows]
    return [said, show.scene(), show.bodies.tolist(), steps]


@pytest.mark.parametrize(("message", "words"), EDITS, ids=lambda one: str(one)[:20])
def test_each_edit_is_undone_and_made_again_where_it_was_made(
    message: Message, words: str
) -> None:
    show = live()
    before = shown(show)
    show.handle(message)
    show.handle(messages.Pause())
    after = shown(show)
    assert after != before
    assert show.status()["undo"] == words
    show.handle(messages.Undo())
    assert shown(show) == before
    assert (show.status()["undo"], show.status()["redo"]) == ("", words)
    show.handle(messages.Redo())
    assert shown(show) == after
    assert (show.status()["undo"], show.status()["redo"]) == (words, "")


def test_an_edit_of_before_is_undone_from_here_on() -> None:
    show = live()
    show.handle(messages.Set("cohesion_weight", 0.9))
    go(show, 5)
    show.handle(messages.Undo())
    assert (show.step, show.exact) == (17, False)
    assert show.state.settings["cohesion_weight"] == pytest.approx(0.213)
    assert "last at step 17" in show.note


def test_the_map_has_its_name_again_and_boids_stay() -> None:
    """Long after the edit too, and the copied spec says so."""
    show = live()
    text = show.state.as_text()
    show.handle(messages.Shapes([DISC]))
    assert show.state.settings["map"] == "edited"
    go(show, 5)
    bodies = show.bodies.copy()
    show.handle(messages.Undo())
    assert (show.step, show.state.settings["map"]) == (17, "cafeteria")
    np.testing.assert_array_equal(show.bodies, bodies)
    assert show.state.as_text() == text


def test_all_edits_are_undone_one_after_the_other() -> None:
    """Only of the last one the run of before is remembered."""
    show = live()
    edits = [message for message, _ in EDITS[:8]]
    states = []
    for message in edits:
        states.append(show.state)
        show.handle(message)
    for state in reversed(states):
        show.handle(messages.Undo())
        assert show.state == state
    for _ in edits:
        show.handle(messages.Redo())
    assert show.state.sweeps.keys() == {"n"}
    with pytest.raises(SpecError, match="there is nothing to redo"):
        show.handle(messages.Redo())


def test_a_gesture_is_one_edit() -> None:
    show = live()
    for k in range(5):
        show.handle(messages.Set("cohesion_weight", 0.3 + k / 10, part=True))
    show.handle(messages.Set("cohesion_weight", 0.8, part=False))
    show.handle(messages.Set("cohesion_weight", 0.9))
    assert [edit.text for edit in show.edits.past] == [
        "cohesion weight 0.213 → 0.8",
        "cohesion weight 0.8 → 0.9",
    ]


def test_what_changes_nothing_is_no_edit() -> None:
    show = live(0)
    show.handle(messages.Set("n", show.n))
    show.handle(messages.Reset())
    for refused in (messages.Set("n", -1), messages.Set("nn", 1)):
        with pytest.raises(SpecError):
            show.handle(refused)
    with pytest.raises(SpecError, match="there is nothing to undo"):
        show.handle(messages.Undo())


def test_a_new_edit_forgets_those_that_were_undone() -> None:
    show = live()
    show.handle(messages.Set("n", 40))
    show.handle(messages.Undo())
    show.handle(messages.Set("n", 50))
    assert show.status()["redo"] == ""
