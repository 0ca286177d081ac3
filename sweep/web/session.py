"""A live run: the state on the screen, the simulation and the actions of a page.

A session does not wait or draw. Without changes of parameters on the way, the frames of
a session are bitwise identical to the frames of a launch of the spec. The number of
pages and the rate of drawn frames do not matter.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from kernels.settings import StartSettings
from sweep.errors import SpecError
from sweep.spec import RecordSpec, Value
from sweep.text import unknown
from sweep.trial import Taken, counts_visits, looking, measured
from sweep.web.compiling import prepare
from sweep.web.course import Course, Part
from sweep.web.edits import EditStack, Moment, differing
from sweep.web.history import History
from sweep.web.protocol import OVERLAYS
from sweep.web.running import (
    can_cover,
    changed,
    counts_for,
    recorded,
    simulation_of,
)
from sweep.web.state import COMMON, Range, Shape, ViewState

START = {"n", "map", "seed", *StartSettings._fields}
"""The parameters that a run needs at the start.

If such a parameter changes, the run begins again.
"""
SPEED = 60.0
FASTEST = 1e6
BODIES = RecordSpec((), trajectories=True)
"""A record of the bodies alone."""


class Session:
    """The run of a ViewState.

    Methods raise SpecError for an action that is not allowed, without any change.

    Attributes
    ----------
    simulation : Simulation
        The simulation of the state.
    bodies : array (4, N)
        x, y, vx and vy of the last frame.
    exact : bool
        Whether the copied spec reproduces the frames so far.
    note : str
        Reason for a difference; "" for an exact run.
    version : int
        Grows with every change that may be visible.
    course : Course
        Parameters and states since the start.
    entered : int
        Number of times that the run has reached an earlier change of the course again.
    """

    def __init__(self, state: ViewState) -> None:
        self.history = History()
        self.edits = EditStack()
        self.version = self.entered = 0
        self.speed = SPEED
        self.selected: int | None = None
        self.overlays: tuple[str, ...] = ()
        self._begin(state)

    def _begin(self, state: ViewState) -> None:
        """Show the first step of a state. The run does not start yet."""
        record = self._record(state)
        prepare(state.job, record.metrics)
        self.simulation = simulation_of(state.job, record)
        self.course = Course(state, record)
        self.running = False
        self.aim = 0
        self.exact = True
        self.note = ""
        self.diverged = False
        self._show(state)
        self.history.begin(state.plots)
        self._take()
        if self.selected is not None and self.selected >= self.n:
            self.selected = None

    def _record(self, state: ViewState) -> RecordSpec:
        """Return what the plots and overlays need of each frame of a state."""
        visits = "coverage" in self.overlays
        return recorded(state.job, state.plots, visits=visits)

    def _show(self, state: ViewState) -> None:
        self.state = state

    def _take(self, *, measuring: bool = True) -> Taken:
        """Take the frames, and measure each frame on request.

        A frame at a change of the course is measured in the world after the change.
        """
        record = self._record(self.state)
        taken = self.simulation.take_frames(record if measuring else BODIES)
        if len(taken.steps):
            self.bodies: NDArray[np.float64] = taken.bodies[-1]
        if measuring:
            change = self.course.part(self.step).begin == self.step > 0
            self._add(record, taken, len(taken.steps) - int(change))
        self.version += 1
        return taken

    def _add(self, record: RecordSpec, taken: Taken, frames: int) -> None:
        """Add the values of the first `frames` frames to the history."""
        values = measured(record, taken, self.state.job.settings)
        early = {name: column[:frames] for name, column in values.items()}
        self.history.add(taken.steps[:frames], early)

    def measure(self) -> None:
        """Measure the present step, unless its values are known already."""
        if self.diverged or self.history.knows(self.step):
            return
        record = self._record(self.state)
        looking.retake_frame(self.simulation)
        self._add(record, self.simulation.take_frames(record), 1)

    @property
    def number(self) -> int:
        """The number of the run; a run that begins again has a new number."""
        return self.course.run

    @property
    def n(self) -> int:
        """The number of boids."""
        return self.simulation.schedule.n

    @property
    def step(self) -> int:
        """The steps done."""
        return self.simulation.step

    @property
    def going(self) -> bool:
        """True while the run continues, or requested single steps are left."""
        return self.running or self.step < self.aim

    def advance(self, steps: int) -> Taken:
        """Take up to `steps` steps, and return the frames.

        The method takes fewer steps if there is no room for so many frames, and stops
        at an earlier change of the course. The run pauses after the last requested
        step, at the end of the run, and at a divergence.

        A run as fast as possible measures no frames; pages call `measure` for the steps
        that they show.
        """
        measuring = not (self.running and self.speed == 0)
        most = self.simulation.steps_left if self.running else self.aim - self.step
        if change := self.course.next_change(self.step):
            most = min(most, change - self.step)
        self.diverged = not self.simulation.advance(min(steps, most))
        if self.diverged:
            self.note = (
                f"diverged at step {self.step:,}:"
                f" {self.simulation.watched} was not finite"
            )
        if self.diverged or self.simulation.steps_left <= 0:
            self.pause()
        taken = self._take(measuring=measuring)
        if self.diverged:
            self.course.last = max([self.course.last, *taken.steps.tolist()])
        else:
            self.course.reached(self.simulation)
        if self.step == change:
            self.simulation = changed(
                self.simulation, self.course.part(change).state.job, self.course.record
            )
            self._enter(self.course.part(change))
            if measuring:
                self.measure()
        return taken

    def _enter(self, part: Part) -> None:
        """Show the parameters of a part of the course."""
        shown = part.state
        plots = self.state.plots
        sweeps = self.state.sweeps
        if (shown.plots, shown.sweeps) != (plots, sweeps):
            shown = replace(shown, plots=plots, sweeps=sweeps)
        self._show(shown)
        self.entered += 1
        self._judge()

    def _judge(self) -> None:
        """Record whether the spec gives the run up to here."""
        altered = self.course.altered(self.step)
        names = ", ".join(sorted(altered))
        last = self.course.part(self.step).begin
        self.exact = not altered
        self.note = (
            f"{names} changed, last at step {last:,}; reset shows the run of the spec"
            if altered
            else ""
        )
        restarts = [step for step in self.restarts if step <= self.step]
        if restarts and counts_visits(self.simulation):
            self.note += (
                f"; visits count from step {restarts[-1]:,} on, because the pixels"
                " or the motion of obstacles changed"
            )

    @property
    def restarts(self) -> list[int]:
        """The steps at which visits restart from 0; see `Course.restarts`."""
        return self.course.restarts

    @property
    def past(self) -> tuple[int, int]:
        """The first and the last step that can be reached."""
        return self.course.first, self.course.last

    def seek(self, step: int) -> None:
        """Go to a step of the past, with the parameters of that step, and pause.

        Later steps stay known. If the step is not in the past, go to the nearest step.
        """
        first, last = self.past
        step = min(max(step, first), last)
        self.pause()
        self.simulation = self.course.at(step)
        self.diverged = False
        self._enter(self.course.part(step))
        self._refresh()

    def _refresh(self) -> None:
        self.bodies = np.stack(self.simulation.flock[:4])
        self.version += 1

    def moment(self) -> Moment:
        """Return the present state of the run, for a later return."""
        return Moment(
            self.state, self.step, self.course.copied(), self.history.copied()
        )

    def undo(self) -> None:
        """Take the last edit back."""
        self._return(self.edits.undo(self.moment()))

    def redo(self) -> None:
        """Repeat the edit that was undone last."""
        self._return(self.edits.redo(self.moment()))

    def _return(self, moment: Moment) -> None:
        """Show the state of a moment.

        If the run has begun again since, or is at the step of the moment, the run of
        the moment returns. Otherwise the present run continues with the state of the
        moment.
        """
        course = moment.course
        history = moment.history
        restarted = course and (course.run != self.course.run)
        if course and history and (restarted or moment.step == self.step):
            self.recall(moment._replace(course=course.copied()))
        else:
            self._turn(moment.state)

    def recall(self, moment: Moment) -> None:
        """Show a moment, whose run must be remembered; a running session runs on."""
        if moment.course is None or moment.history is None:
            raise ValueError("the run of this moment is no longer remembered")
        running = self.running
        era = self.history.era + 1
        self.course = moment.course
        self.history = moment.history.copied()
        self.history.era = era
        self._show(moment.state)
        self.seek(moment.step)
        self.running = running
        self._count()
        if self.selected is not None and self.selected >= self.n:
            self.selected = None

    def _turn(self, state: ViewState) -> None:
        """Show another state from here on, or from the start if necessary."""
        before = self.state
        plots = state.plots
        if (state.model, state.preset) != (before.model, before.preset) or (
            state.opened is not before.opened
        ):
            self._again(state)
            return
        if names := differing(before, state):
            self._become(replace(state, plots=before.plots), names)
        self._show(replace(state, plots=self.state.plots))
        if plots != self.state.plots:
            self.follow(plots)

    def run(self) -> None:
        """Run without a message for each step."""
        self._check_going()
        self.running = True

    def pause(self) -> None:
        """Take no more steps."""
        self.running = False
        self.aim = 0

    def take_steps(self, count: int) -> None:
        """Ask for `count` more steps, in addition to earlier requests."""
        self._check_going()
        self.running = False
        self.aim = min(
            max(self.aim, self.step) + count, self.step + self.simulation.steps_left
        )

    def _check_going(self) -> None:
        if self.diverged:
            raise SpecError(f"the run {self.note}; reset begins again")
        if self.simulation.steps_left <= 0:
            raise SpecError(
                f"the run has ended after {self.step:,} steps; continue extends the"
                " run, reset begins again"
            )

    def reset(self) -> None:
        """Go back to the start, with the present parameters."""
        self._again(self.state)

    def _again(self, state: ViewState) -> None:
        """Begin with a state; a running session continues to run."""
        running = self.running
        self._begin(state)
        self.running = running

    def extend(self) -> None:
        """Make the run twice as long, and run."""
        self.change({"steps": 2 * self.simulation.schedule.steps})
        self.run()

    def choose(self, model: str, preset: str) -> None:
        """Show another model or preset, with the present seed.

        Another preset of the present model keeps the changes and the plots.

        Parameters
        ----------
        model : str
            Name of the model.
        preset : str
            Name of a preset of the model.
        """
        self._begin(self.state.chosen(model, preset))

    def show_trial(self, point: int, replicate: int) -> None:
        """Show another trial of the opened spec, from the start.

        Parameters
        ----------
        point : int
            Index of the point.
        replicate : int
            Number of the replicate, from 0.
        """
        self._again(self.state.at(point, replicate))

    def show_value(self, name: str, value: Value) -> None:
        """Show the point of the opened spec at which a parameter has this value.

        Parameters
        ----------
        name : str
            Parameter that varies.
        value : int, float, str or bool
            Value of the parameter.
        """
        self._again(self.state.having(name, value))

    def change(self, changes: Mapping[str, object]) -> None:
        """Change parameters, or the seed."""
        self._become(self.state.with_settings(changes), set(changes))

    def place(self, shapes: list[Shape]) -> None:
        """Replace all obstacles. The boids keep their positions."""
        self._become(self.state.place(shapes), {"obstacles"})

    def _become(self, state: ViewState, names: set[str]) -> None:
        """Show a state in which `names` differ from now.

        The run begins again if a name can change only at the start; otherwise the run
        continues from here.
        """
        prepare(state.job, self._record(state).metrics)
        if (
            self.step == 0
            or self.diverged
            or START & names
            or int(state.settings["steps"]) < self.step
        ):
            self._again(state)
            return
        if names == {"steps"} and state.streams == COMMON:
            self.course = self.course.lengthened(int(state.settings["steps"]))
            self.simulation = changed(self.simulation, state.job, self.course.record)
        else:
            self.course, self.simulation = self.course.changed(
                self.simulation, state, frozenset(names)
            )
            self.history.cut(self.step - 1)  # of the present step in the other world
        self.history.cut(self.course.last)
        self._show(state)
        self._judge()
        self.measure()
        self.version += 1

    def follow(self, metrics: tuple[str, ...]) -> None:
        """Plot metrics; a new metric is plotted from this step on.

        If a metric needs events that were not counted, the same steps run again.
        """
        state = self.state.follow(metrics)
        self._check_course(state, self.overlays)
        prepare(state.job, self._record(state).metrics)
        self._show(state)
        self.history.follow(metrics)
        self._count()
        self.measure()

    def _check_course(self, state: ViewState, overlays: tuple[str, ...]) -> None:
        """Raise SpecError if the steps so far cannot have plots and overlays.

        Parameters
        ----------
        state : ViewState
            State with the plots.
        overlays : tuple of str
            Names of the overlays.
        """
        again = "reset begins again with the present parameters"
        if self.diverged and self.uncounted(state, overlays):
            raise SpecError(f"the run {self.note}; {again}")
        for part in self.course.parts:
            try:
                replace(part.state, plots=state.plots).checked()
            except SpecError as error:
                where = f"with the parameters from step {part.begin:,} on"
                raise SpecError(f"{where}: {error}; {again}") from error

    def uncounted(self, state: ViewState, overlays: tuple[str, ...]) -> bool:
        """Return whether the run has not counted the events for plots and overlays.

        Parameters
        ----------
        state : ViewState
            State with the plots.
        overlays : tuple of str
            Names of the overlays.
        """
        record = recorded(state.job, state.plots, visits="coverage" in overlays)
        return not counts_for(self.simulation, record)

    def _count(self) -> None:
        """Count events from the first step on, if plots and overlays need more events.

        The same steps run again. A run that has forgotten its first steps begins again.
        """
        if not self.uncounted(self.state, self.overlays):
            return
        if self.course.first > 0:
            self._again(self.state)
            return
        running = self.running
        aim = self.aim
        self.course = self.course.counting(self._record(self.state))
        self.seek(self.step)
        self.running = running
        self.aim = aim

    def sweep(self, name: str, range_: Range | None) -> None:
        """Let the copied spec sweep a parameter over a range.

        Parameters
        ----------
        name : str
            Name of the parameter.
        range_ : Range or None
            Values of the parameter; None ends the sweep.
        """
        self._show(self.state.sweep(name, range_))

    def draw(self, overlays: tuple[str, ...]) -> None:
        """Show overlays."""
        for name in overlays:
            if name not in OVERLAYS:
                raise SpecError(unknown("overlay", name, OVERLAYS))
        if "coverage" in overlays and not (
            counts_visits(self.simulation) or can_cover(self.state.job)
        ):
            moving = self.simulation.flight.work.motion is not None
            raise SpecError(
                "visits are not counted in a world with moving obstacles, because the"
                " free pixels change"
                if moving
                else "visits are not counted in a world of so many pixels;"
                " plot coverage first, or change pixel"
            )
        self._check_course(self.state, overlays)
        self.show_overlays(overlays)

    def show_overlays(self, overlays: tuple[str, ...]) -> None:
        """Show overlays that the world of the run can have."""
        self.overlays = overlays
        self._count()
        self.version += 1

    def select(self, boid: int | None) -> None:
        """Select a boid; None removes the selection."""
        if boid is not None and boid >= self.n:
            raise SpecError(f"there is no boid {boid:,}; use 0 to {self.n - 1:,}")
        self.selected = boid
        self.version += 1

    def hurry(self, steps_per_second: float) -> None:
        """Run at this speed; 0 is as fast as possible."""
        if not 0 <= steps_per_second <= FASTEST:
            raise SpecError(
                f"{steps_per_second:g} steps per second are not allowed; use 0 to"
                f" {FASTEST:,.0f}"
            )
        self.speed = steps_per_second
