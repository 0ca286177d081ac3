"""The course of a live run since its start: which settings it had from which step on,
and states from which any of its steps is run again.
"""

from bisect import bisect_right
from itertools import count
from typing import NamedTuple

from sweep.trial.simulation import Simulation
from sweep.trial.state import State
from sweep.web.running import changed
from sweep.web.state import ViewState
from sweep.web.track import quiet, run_to, steps_a_call

MOST_BYTES = 128 * 2**20
"""The most memory that the kept states of a run may take. Beyond it every second one is
dropped, and reaching a step takes longer.
"""
MOST_PARTS = 1000
"""The most changes of a run that are remembered. Beyond it the earlier half of the run
is forgotten.
"""

RUNS = count()
"""A number for each run of this process, live or stored."""


class Part(NamedTuple):
    """Steps with the same settings: those of `state`, from the step `begin` on.

    `altered` names what differs from the part before. `kept` has states by their steps.
    """

    begin: int
    state: ViewState
    altered: frozenset[str]
    kept: dict[int, State]


class Course:
    """The parts of a run. Its steps from `first` to `last` can be reached.

    A change makes another course of the same `run`; a run that begins again has another
    number.
    """

    def __init__(self, state: ViewState) -> None:
        self.parts = [Part(0, state, frozenset(), {})]
        self.before: frozenset[str] = frozenset()
        self.first = self.last = self.latest = self.apart = 0
        self.run = next(RUNS)

    def copied(self) -> "Course":
        """A course of its own with the same parts."""
        other = Course(self.parts[0].state)
        other.parts = [part._replace(kept=dict(part.kept)) for part in self.parts]
        other.before, other.run = self.before, self.run
        other.first, other.last = self.first, self.last
        other.latest, other.apart = self.latest, self.apart
        return other

    def reached(self, simulation: Simulation) -> None:
        """The run has come to where `simulation` is, between two calls. Its state is
        kept if the last one is some steps away.
        """
        step = simulation.step
        if step <= self.last:
            return
        self.last = step
        if step >= self.latest + max(self.apart, steps_a_call(simulation)):
            self._keep(self.parts[-1], simulation)

    def changed(
        self, simulation: Simulation, state: ViewState, names: frozenset[str]
    ) -> tuple["Course", Simulation]:
        """The course that has `state` from the step of `simulation` on, in which
        `names` differ, and the simulation that goes on with it. What was ahead is no
        part of it.

        Where no step was taken since the last change, the new one takes its place.
        """
        course, step = self._until(simulation.step), simulation.step
        if course.parts[-1].begin == step and len(course.parts) > 1:
            names |= course.parts.pop().altered
            simulation = course.at(step)
        before = course.parts[-1]
        if before.state.job.settings == state.job.settings and (
            before.state.own == state.own
        ):
            return course, simulation
        course._keep(before, simulation)
        later = changed(simulation, state.job)
        course.parts.append(Part(step, state, names, {}))
        course._keep(course.parts[-1], later)
        course._forget()
        return course, later

    def lengthened(self, steps: int) -> "Course":
        """The same course of a run of so many steps, which no frame depends on."""
        course = self._until(min(steps, self.last))
        course.parts = [
            part._replace(state=part.state.with_settings({"steps": steps}))
            for part in course.parts
        ]
        return course

    def _until(self, step: int) -> "Course":
        """This course up to a step."""
        course = self.copied()
        del course.parts[course._place(step) + 1 :]
        kept = course.parts[-1].kept
        for later in [one for one in kept if one > step]:
            del kept[later]
        course.last = step
        course.latest = max(max(part.kept, default=0) for part in course.parts)
        return course

    def part(self, step: int) -> Part:
        """The part with the settings that go on from a step."""
        return self.parts[self._place(step)]

    def next_change(self, step: int) -> int | None:
        """The step of the next change after a step."""
        return next((part.begin for part in self.parts if part.begin > step), None)

    def altered(self, step: int) -> frozenset[str]:
        """What was changed on the way to a step."""
        until = self.parts[: self._place(step) + 1]
        return self.before.union(*(part.altered for part in until))

    def at(self, step: int) -> Simulation:
        """A simulation at a step from `first` to `last`, which holds no frames."""
        place = self._place(step)
        start, begin = max(
            (
                (index, kept)
                for index, part in enumerate(self.parts[: place + 1])
                for kept in part.kept
                if kept <= step
            ),
            default=(0, 0),
        )
        simulation = quiet(self.parts[start].state.job)
        if begin in self.parts[start].kept:
            simulation.restore(self.parts[start].kept[begin])
        for part in self.parts[start + 1 : place + 1]:
            run_to(simulation, part.begin)
            simulation = changed(simulation, part.state.job)
        run_to(simulation, step)
        return simulation

    def _place(self, step: int) -> int:
        begins = [part.begin for part in self.parts]
        return max(0, bisect_right(begins, step) - 1)

    def _keep(self, part: Part, simulation: Simulation) -> None:
        state = simulation.state().copied()
        part.kept[simulation.step] = state
        self.latest = simulation.step
        size = sum(array.nbytes for array in state.arrays.values())
        kept = [(one, step) for one in self.parts for step in one.kept]
        if len(kept) > 1 and size * len(kept) > MOST_BYTES:
            self.apart = 2 * max(self.apart, steps_a_call(simulation))
            for one, step in kept[1::2]:
                del one.kept[step]

    def _forget(self) -> None:
        """Forget the earlier half of the run where too many changes were made: all
        before the first kept state of the later half.
        """
        half = len(self.parts) // 2
        later = (i for i in range(half, len(self.parts)) if self.parts[i].kept)
        place = next(later, 0)
        if len(self.parts) <= MOST_PARTS or not place:
            return
        self.before = self.altered(self.parts[place].begin)
        self.first = min(self.parts[place].kept)
        del self.parts[:place]
