"""The course of a live run since its start.

A course has the parameters from each change on, and states from which any step is run
again.
"""

from bisect import bisect_right
from itertools import count, pairwise
from typing import NamedTuple

from sweep.spec import RecordSpec
from sweep.trial import Simulation, State, pixels_of
from sweep.web.running import can_cover, changed
from sweep.web.state import ViewState
from sweep.web.track import quiet, run_to, steps_a_call

MOST_BYTES = 128 * 2**20
"""Largest memory, in bytes, that the kept states of a run take.

Beyond this limit every second state is dropped, and reaching a step takes longer.
"""
MOST_PARTS = 1000
"""Largest number of changes of a run that are remembered.

Beyond this limit the earlier half of the run is forgotten.
"""

RUNS = count()
"""Numbers for the runs of this process, live or stored."""


class Part(NamedTuple):
    """Steps with equal parameters.

    Attributes
    ----------
    begin : int
        The first step.
    state : ViewState
        The state with the parameters.
    altered : frozenset of str
        Names that differ from the part before.
    checkpoints : dict of int to State
        States of the simulation by step.
    """

    begin: int
    state: ViewState
    altered: frozenset[str]
    checkpoints: dict[int, State]


class Course:
    """The parts of a run, whose steps from `first` to `last` can be reached.

    A change makes another course with an equal `run` number. A run that begins again
    has a new number. All simulations of a course count events for `record`.
    """

    def __init__(self, state: ViewState, record: RecordSpec) -> None:
        self.record = record
        self.parts = [Part(0, state, frozenset(), {})]
        self.before: frozenset[str] = frozenset()
        self.first = self.last = self.latest = self.apart = 0
        self.run = next(RUNS)

    def copied(self) -> "Course":
        """Return an independent course with equal parts."""
        other = Course(self.parts[0].state, self.record)
        other.parts = [
            part._replace(checkpoints=dict(part.checkpoints)) for part in self.parts
        ]
        other.before = self.before
        other.run = self.run
        other.first = self.first
        other.last = self.last
        other.latest = self.latest
        other.apart = self.apart
        return other

    def reached(self, simulation: Simulation) -> None:
        """Note that the run has come to the step of `simulation`, between two calls.

        The state of the simulation is kept if the last kept one is some steps away.
        """
        step = simulation.step
        if step <= self.last:
            return
        self.last = step
        self._keep_some(self.parts[-1], simulation)

    def changed(
        self, simulation: Simulation, state: ViewState, names: frozenset[str]
    ) -> tuple["Course", Simulation]:
        """Return the course with another state from here on, and its simulation.

        The steps after the step of `simulation` are not part of the new course. If no
        step was taken since the last change, the new change replaces the last change.

        Parameters
        ----------
        simulation : Simulation
            The simulation at the step of the change.
        state : ViewState
            The state from that step on.
        names : frozenset of str
            Names in which `state` differs.

        Returns
        -------
        Course
            The new course.
        Simulation
            The simulation that continues the new course.
        """
        step = simulation.step
        course = self._until(step)
        if course.parts[-1].begin == step and len(course.parts) > 1:
            names |= course.parts.pop().altered
            simulation = course.at(step)
        before = course.parts[-1]
        if before.state.job.settings == state.job.settings and (
            before.state.own == state.own
        ):
            return course, simulation
        course._keep(before, simulation)
        later = changed(simulation, state.job, self.record)
        course.parts.append(Part(step, state, names, {}))
        course._keep(course.parts[-1], later)
        course._forget()
        return course, later

    def counting(self, record: RecordSpec) -> "Course":
        """Return this course with simulations that count events for `record`.

        No kept state has these counts, so the run is repeated from the first step.
        """
        course = self.copied()
        course.record = record
        course.latest = course.apart = 0
        course.parts = [part._replace(checkpoints={}) for part in self.parts]
        return course

    def lengthened(self, steps: int) -> "Course":
        """Return this course for a run of `steps` steps.

        No frame depends on the number of steps.
        """
        course = self._until(min(steps, self.last))
        course.parts = [
            part._replace(state=part.state.with_settings({"steps": steps}))
            for part in course.parts
        ]
        return course

    def _until(self, step: int) -> "Course":
        """Return the course up to a step."""
        course = self.copied()
        del course.parts[course._index(step) + 1 :]
        checkpoints = course.parts[-1].checkpoints
        for later in [reached for reached in checkpoints if reached > step]:
            del checkpoints[later]
        course.last = step
        course.latest = max(max(part.checkpoints, default=0) for part in course.parts)
        return course

    def part(self, step: int) -> Part:
        """Return the part whose parameters hold after a step."""
        return self.parts[self._index(step)]

    def next_change(self, step: int) -> int | None:
        """Return the step of the next change after a step."""
        return next((part.begin for part in self.parts if part.begin > step), None)

    @property
    def restarts(self) -> list[int]:
        """The steps at which visits restart from 0.

        The pixels change, or obstacles begin or cease to move.
        """
        return [
            later.begin
            for before, later in pairwise(self.parts)
            if pixels_of(before.state.job) != pixels_of(later.state.job)
            or can_cover(before.state.job) != can_cover(later.state.job)
        ]

    def altered(self, step: int) -> frozenset[str]:
        """Return the names that were changed on the way to a step."""
        until = self.parts[: self._index(step) + 1]
        return self.before.union(*(part.altered for part in until))

    def at(self, step: int) -> Simulation:
        """Return a simulation at a step from `first` to `last`.

        The simulation holds no frames.
        """
        index = self._index(step)
        start, begin = max(
            (
                (earlier, checkpoint)
                for earlier, part in enumerate(self.parts[: index + 1])
                for checkpoint in part.checkpoints
                if checkpoint <= step
            ),
            default=(0, 0),
        )
        simulation = quiet(self.parts[start].state.job, self.record)
        if begin in self.parts[start].checkpoints:
            simulation.restore(self.parts[start].checkpoints[begin])
        for part, later in pairwise(self.parts[start : index + 1]):
            self._run_to(part, simulation, later.begin)
            simulation = changed(simulation, later.state.job, self.record)
        self._run_to(self.parts[index], simulation, step)
        return simulation

    def _run_to(self, part: Part, simulation: Simulation, step: int) -> None:
        """Run up to a step of a part, and keep states where none are kept yet."""
        while simulation.step < step:
            run_to(simulation, min(step, simulation.step + steps_a_call(simulation)))
            self._keep_some(part, simulation)

    def _index(self, step: int) -> int:
        begins = [part.begin for part in self.parts]
        return max(0, bisect_right(begins, step) - 1)

    def _keep_some(self, part: Part, simulation: Simulation) -> None:
        """Keep the state of a simulation if the last kept one is some steps away."""
        apart = max(self.apart, steps_a_call(simulation))
        if simulation.step >= self.latest + apart:
            self._keep(part, simulation)

    def _keep(self, part: Part, simulation: Simulation) -> None:
        state = simulation.state().copied()
        part.checkpoints[simulation.step] = state
        self.latest = simulation.step
        size = sum(array.nbytes for array in state.arrays.values())
        checkpoints = [
            (owner.checkpoints, step)
            for owner in self.parts
            for step in owner.checkpoints
        ]
        if len(checkpoints) > 1 and size * len(checkpoints) > MOST_BYTES:
            self.apart = 2 * max(self.apart, steps_a_call(simulation))
            for owned, step in checkpoints[1::2]:
                del owned[step]

    def _forget(self) -> None:
        """Forget the earlier half of the run where there were too many changes.

        The new course begins at the first kept state of the later half.
        """
        half = len(self.parts) // 2
        later = (i for i in range(half, len(self.parts)) if self.parts[i].checkpoints)
        index = next(later, 0)
        if len(self.parts) <= MOST_PARTS or not index:
            return
        self.before = self.altered(self.parts[index].begin)
        self.first = min(self.parts[index].checkpoints)
        del self.parts[:index]
