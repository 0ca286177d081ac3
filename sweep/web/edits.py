"""Edits on the page, for undo and redo."""

from typing import NamedTuple

from sweep.design import SIDES
from sweep.errors import SpecError
from sweep.spec import Value
from sweep.web.course import Course
from sweep.web.history import History
from sweep.web.state import ViewState

MOST_EDITS = 100
GOAL = {"goal_x", "goal_y"}
MAP = {"map", *SIDES}


class Moment(NamedTuple):
    """A run at a step: the state on the screen, the past course and the past history.

    Only the latest moments keep course and history; in older moments the values are
    None.
    """

    state: ViewState
    step: int
    course: Course | None
    history: History | None


class Edit(NamedTuple):
    """An edit in words, and the moment to which undo or redo returns."""

    text: str
    moment: Moment


class EditStack:
    """Edits that can be undone, and edits that were undone, the latest last."""

    def __init__(self) -> None:
        self.past: list[Edit] = []
        self.future: list[Edit] = []
        self.going = ""

    def add(self, before: Moment, after: Moment, subject: str, *, part: bool) -> None:
        """Add the change between two moments, if any.

        Parts of one gesture have an equal `subject`, and become one edit.

        Parameters
        ----------
        before, after : Moment
            The run before and after the message.
        subject : str
            The kind and the target of the message.
        part : bool
            Whether further parts of the gesture follow.
        """
        if self.going == subject and self.past:
            before = self.past.pop().moment
        self.going = subject if part else ""
        if text := _between(before, after):
            self.past = [*_light(self.past), Edit(text, before)][-MOST_EDITS:]
            self.future = []

    def undo(self, now: Moment) -> Moment:
        """Return the moment before the last edit.

        Raises SpecError if there is no edit to undo.
        """
        return _back("undo", self.past, self.future, now)

    def redo(self, now: Moment) -> Moment:
        """Return the moment after the edit that was undone last.

        Raises SpecError if no edit was undone.
        """
        return _back("redo", self.future, self.past, now)


def _back(verb: str, edits: list[Edit], reverse: list[Edit], now: Moment) -> Moment:
    if not edits:
        raise SpecError(f"there is nothing to {verb}")
    text, moment = edits.pop()
    reverse[:] = [*_light(reverse), Edit(text, now)]
    return moment


def _light(edits: list[Edit]) -> list[Edit]:
    """Return the edits without the runs, which take memory."""
    return [
        Edit(text, moment._replace(course=None, history=None)) for text, moment in edits
    ]


def differing(before: ViewState, after: ViewState) -> set[str]:
    """Return the names of the parameters in which two states of a model differ.

    The name `obstacles` means custom maps, with names and sizes.
    """
    names = {
        name
        for name, value in before.settings.items()
        if after.settings.get(name) != value
    }
    if before.own != after.own:
        names = names - MAP | {"obstacles"}
    return names | ({"seed"} if before.seed != after.seed else set())


def _between(before: Moment, after: Moment) -> str:
    """Return the change between two moments, in words; "" for no change."""
    old = before.state
    new = after.state
    if (old.model, old.preset) != (new.model, new.preset):
        return f"{new.model}, {new.preset}"
    if _trial(old) != _trial(new):
        return "another trial"
    if names := sorted(differing(old, new)):
        return _change(old, new, names)
    if old.plots != new.plots:
        return "plots"
    if old.sweeps != new.sweeps:
        return "sweep of " + _spaced(min(old.sweeps.items() ^ new.sweeps.items())[0])
    restarted = before.course and after.course and before.course.run != after.course.run
    return "reset" if restarted and before.step > 0 else ""


def _change(old: ViewState, new: ViewState, names: list[str]) -> str:
    if {*names} <= GOAL:
        return "goal"
    if len(names) == 1 and names[0] in old.settings:
        (name,) = names
        values = (_short(state.settings[name]) for state in (old, new))
        return f"{_spaced(name)} {' → '.join(values)}"
    if "map" in names:
        return f"map {old.settings['map']} → {new.settings['map']}"
    if "seed" in names:
        return f"seed {old.seed} → {new.seed}"
    return ", ".join(map(_spaced, names))


def _trial(state: ViewState) -> tuple[int, int] | None:
    return (state.opened.point, state.opened.replicate) if state.opened else None


def _spaced(name: str) -> str:
    return name.replace("_", " ")


def _short(value: Value) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)
