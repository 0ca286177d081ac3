"""What was edited on the page, to be undone and done again."""

from typing import NamedTuple

from sweep.design.points import SIDES
from sweep.errors import SpecError
from sweep.spec.settings import Value
from sweep.web.course import Course
from sweep.web.history import History
from sweep.web.state import ViewState

MOST_EDITS = 100
GOAL = {"goal_x", "goal_y"}
MAP = {"map", *SIDES}


class Moment(NamedTuple):
    """A run at a step: what is on the screen, and what has led to it. Only of the
    latest moments this is remembered; of others it is None.
    """

    state: ViewState
    step: int
    course: Course | None
    history: History | None


class Edit(NamedTuple):
    """One edit in words, and the moment to which the way back leads."""

    words: str
    moment: Moment


class EditStack:
    """The edits that can be undone, and those that were undone, the latest last."""

    def __init__(self) -> None:
        self.past: list[Edit] = []
        self.future: list[Edit] = []
        self.going = ""

    def add(self, before: Moment, after: Moment, subject: str, *, part: bool) -> None:
        """Take note of what has changed, if anything has. EditStack of one `subject` of
        which each but the last is a `part` are one edit.
        """
        if self.going == subject and self.past:
            before = self.past.pop().moment
        self.going = subject if part else ""
        if words := _between(before, after):
            self.past = [*_light(self.past), Edit(words, before)][-MOST_EDITS:]
            self.future = []

    def undo(self, now: Moment) -> Moment:
        """The moment before the last edit. Raises SpecError if there is none."""
        return _back("undo", self.past, self.future, now)

    def redo(self, now: Moment) -> Moment:
        """The moment after the edit that was undone last. Raises SpecError if there is
        none.
        """
        return _back("redo", self.future, self.past, now)


def _back(what: str, here: list[Edit], there: list[Edit], now: Moment) -> Moment:
    if not here:
        raise SpecError(f"there is nothing to {what}")
    words, moment = here.pop()
    there[:] = [*_light(there), Edit(words, now)]
    return moment


def _light(edits: list[Edit]) -> list[Edit]:
    """The same edits, without the runs that take memory."""
    return [
        Edit(words, moment._replace(course=None, history=None))
        for words, moment in edits
    ]


def differing(one: ViewState, other: ViewState) -> set[str]:
    """The settings in which two states of a model differ; `obstacles` stands for maps
    that were drawn, with their names and sizes.
    """
    names = {
        name
        for name, value in one.settings.items()
        if other.settings.get(name) != value
    }
    if one.own != other.own:
        names = names - MAP | {"obstacles"}
    return names | ({"seed"} if one.seed != other.seed else set())


def _between(before: Moment, after: Moment) -> str:
    """What lies between two moments, in words; "" for nothing."""
    one, other = before.state, after.state
    if (one.model, one.preset) != (other.model, other.preset):
        return f"{other.model}, {other.preset}"
    if _place(one) != _place(other):
        return "another trial"
    if names := sorted(differing(one, other)):
        return _change(one, other, names)
    if one.plots != other.plots:
        return "plots"
    if one.sweeps != other.sweeps:
        return "sweep of " + _spaced(min(one.sweeps.items() ^ other.sweeps.items())[0])
    anew = before.course and after.course and before.course.run != after.course.run
    return "reset" if anew and before.step > 0 else ""


def _change(one: ViewState, other: ViewState, names: list[str]) -> str:
    if {*names} <= GOAL:
        return "goal"
    if len(names) == 1 and names[0] in one.settings:
        (name,) = names
        values = (_short(state.settings[name]) for state in (one, other))
        return f"{_spaced(name)} {' → '.join(values)}"
    if "map" in names:
        return f"map {one.settings['map']} → {other.settings['map']}"
    if "seed" in names:
        return f"seed {one.seed} → {other.seed}"
    return ", ".join(map(_spaced, names))


def _place(state: ViewState) -> tuple[int, int] | None:
    return (state.opened.point, state.opened.replicate) if state.opened else None


def _spaced(name: str) -> str:
    return name.replace("_", " ")


def _short(value: Value) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)
