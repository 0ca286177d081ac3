"""One live run: the state on the screen, the simulation of it, and what the page may do
with both.

Nothing here waits or draws. As long as nobody changes a setting on the way, the frames
of a session are those of a launch of its spec, bit by bit. It does not matter who looks
at them, or how often.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from kernels.settings import StartSettings
from sweep.errors import SpecError
from sweep.spec.settings import Value
from sweep.text import unknown
from sweep.trial.derived import measured
from sweep.trial.looking import counts_visits
from sweep.trial.robots import robot_layers_of
from sweep.trial.state import Taken
from sweep.web.compiling import prepare
from sweep.web.course import Course, Part
from sweep.web.edits import EditStack, Moment, differing
from sweep.web.history import History
from sweep.web.opened import OpenedSpec
from sweep.web.protocol import OVERLAYS
from sweep.web.running import changed, recorded, simulation_of
from sweep.web.state import COMMON, Range, Shape, ViewState, begin

START = {"n", "map", "seed", *StartSettings._fields}
"""The settings that a run needs at its start. If one of them changes, the run begins
again.
"""
SPEED, FASTEST = 60.0, 1e6


class Session:
    """The run of a ViewState: `simulation`, and `bodies` (4, N), x, y, vx and vy, of
    its last frame.

    `exact` says whether the frames so far are those of the copied spec, and `note` why
    they are not. `version` grows with every change that may be visible. `course` is
    what was run since the start, `entered` counts how often a change in it was come to
    again. Methods raise SpecError for what is not allowed, and change nothing then.
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
        """Show the first step of a state. The run does not go on yet."""
        self._prepare(state)
        self.simulation = simulation_of(state.job)
        self.course = Course(state)
        self.running, self.aim = False, 0
        self.exact, self.note, self.diverged = True, "", False
        self._show(state)
        self.history.begin(state.plots)
        self._take()
        if self.selected is not None and self.selected >= self.n:
            self.selected = None

    def _prepare(self, state: ViewState) -> None:
        """Compile what the plots of a state need, before any step waits for it."""
        metrics = recorded(state.job, state.plots).metrics
        layers = robot_layers_of(state.job)
        prepare(state.model, state.preset, state.known, metrics, layers)

    def _show(self, state: ViewState) -> None:
        self.state = state

    def _take(self) -> Taken:
        job = self.state.job
        wanted = replace(recorded(job, self.state.plots), trajectories=True)
        taken = self.simulation.take_frames(wanted)
        if len(taken.steps):
            self.bodies: NDArray[np.float64] = taken.bodies[-1]
            values = measured(wanted, taken, job.settings)
            self.history.add(taken.steps, values)
        self.version += 1
        return taken

    @property
    def number(self) -> int:
        """The number of the run: one that begins again has another."""
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
        """Whether steps are to be taken: the run goes on, or single steps were asked
        for.
        """
        return self.running or self.step < self.aim

    def advance(self, steps: int) -> Taken:
        """Take up to `steps` steps, and return their frames. It takes fewer steps where
        there is no room for so many frames, and up to a change that was made before.

        The run pauses after the last step that was asked for, at its end, and when it
        diverges.
        """
        most = self.simulation.steps_left if self.running else self.aim - self.step
        if change := self.course.next_change(self.step):
            most = min(most, change - self.step)
        self.diverged = not self.simulation.advance(min(steps, most))
        if self.diverged:
            self.note = (
                f"diverged at step {self.step:,}:"
                f" {self.simulation.watched} was not a finite number"
            )
        if self.diverged or self.simulation.steps_left <= 0:
            self.pause()
        taken = self._take()
        if self.diverged:
            self.course.last = max([self.course.last, *taken.steps.tolist()])
        else:
            self.course.reached(self.simulation)
        if self.step == change:
            self.simulation = changed(
                self.simulation, self.course.part(change).state.job
            )
            self._enter(self.course.part(change))
        return taken

    def _enter(self, part: Part) -> None:
        """Show the settings of a part of the course."""
        state, then = self.state, part.state
        same = (then.plots, then.sweeps) == (state.plots, state.sweeps)
        self._show(
            then if same else replace(then, plots=state.plots, sweeps=state.sweeps)
        )
        self.entered += 1
        self._judge()

    def _judge(self) -> None:
        """Say whether the spec gives the run up to here."""
        altered = self.course.altered(self.step)
        what, last = ", ".join(sorted(altered)), self.course.part(self.step).begin
        self.exact = not altered
        self.note = (
            f"{what} changed, last at step {last:,}; reset shows what the spec gives"
            if altered
            else ""
        )

    @property
    def past(self) -> tuple[int, int]:
        """The first and the last step that can be gone to."""
        return self.course.first, self.course.last

    def seek(self, step: int) -> None:
        """Go to a step of the past, with the settings of then, and pause. The steps
        after it stay known. Where there is no such step, go to the nearest one.
        """
        first, last = self.past
        step = min(max(step, first), last)
        self.pause()
        self.simulation, self.diverged = self.course.at(step), False
        self._enter(self.course.part(step))
        self._refresh()

    def _refresh(self) -> None:
        self.bodies = np.stack(self.simulation.flock[:4])
        self.version += 1

    def moment(self) -> Moment:
        """The run as it is now, to come back to it."""
        return Moment(
            self.state, self.step, self.course.copied(), self.history.copied()
        )

    def undo(self) -> None:
        """Take the last edit back."""
        self._return(self.edits.undo(self.moment()))

    def redo(self) -> None:
        """Make the edit again that was undone last."""
        self._return(self.edits.redo(self.moment()))

    def _return(self, moment: Moment) -> None:
        """Show the state of a moment. If the run has begun again since, or has not gone
        on, it is the run of then, at its step. Otherwise it goes on from here.
        """
        course, history = moment.course, moment.history
        other = course and (course.run != self.course.run)
        if course and history and (other or moment.step == self.step):
            self.recall(moment._replace(course=course.copied()))
        else:
            self._turn(moment.state)

    def recall(self, moment: Moment) -> None:
        """Show a moment, whose run must be remembered. A run that goes on does so."""
        if moment.course is None or moment.history is None:
            raise ValueError("nothing is remembered of the run of this moment")
        running, era = self.running, self.history.era + 1
        self.course, self.history = moment.course, moment.history.copied()
        self.history.era = era
        self._show(moment.state)
        self.seek(moment.step)
        self.running = running
        if self.selected is not None and self.selected >= self.n:
            self.selected = None

    def _turn(self, state: ViewState) -> None:
        """Show another state from here on, or from the start where it must be."""
        before, plots = self.state, state.plots
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
        """Go on without being asked for each step."""
        self._check_going()
        self.running = True

    def pause(self) -> None:
        """Take no more steps."""
        self.running, self.aim = False, 0

    def take_steps(self, count: int) -> None:
        """Ask for `count` more steps, in addition to those that were asked for
        before.
        """
        self._check_going()
        self.running, self.aim = (
            False,
            min(
                max(self.aim, self.step) + count, self.step + self.simulation.steps_left
            ),
        )

    def _check_going(self) -> None:
        if self.diverged:
            raise SpecError(f"the run {self.note}; reset begins again")
        if self.simulation.steps_left <= 0:
            raise SpecError(
                f"the run has ended after {self.step:,} steps; continue makes it"
                " longer, reset begins again"
            )

    def reset(self) -> None:
        """Go back to the start, with the settings as they are."""
        self._again(self.state)

    def _again(self, state: ViewState) -> None:
        """Begin with a state. The run goes on if it went on before."""
        running = self.running
        self._begin(state)
        self.running = running

    def extend(self) -> None:
        """Make the run twice as long, and go on."""
        self.change({"steps": 2 * self.simulation.schedule.steps})
        self.run()

    def choose(self, model: str, preset: str) -> None:
        """Show another model or preset, with the same seed. Another preset of the same
        model keeps what was changed, and the plots.
        """
        state = self.state
        other = begin(model, preset, state.seed, state.known)
        if model == state.model and preset != state.preset:
            other = state.on_preset(other)
        self._begin(other)

    def show_trial(self, point: int, replicate: int) -> None:
        """Show another trial of the opened spec, from its start."""
        self._again(self.state.moved(self._opened.at(point, replicate)))

    def show_value(self, name: str, value: Value) -> None:
        """Show the point of the opened spec at which a setting has this value."""
        self._again(self.state.moved(self._opened.having(name, value)))

    @property
    def _opened(self) -> OpenedSpec:
        if self.state.opened is None:
            raise SpecError("no spec was opened: this is a single trial")
        return self.state.opened

    def change(self, changes: Mapping[str, object]) -> None:
        """Change settings, or the seed."""
        self._become(self.state.with_settings(changes), set(changes))

    def place(self, shapes: list[Shape]) -> None:
        """Replace all obstacles. The boids stay where they are."""
        self._become(self.state.place(shapes), {"obstacles"})

    def _become(self, state: ViewState, names: set[str]) -> None:
        """Show a state in which `names` differ from now. The run begins again if they
        can only change at its start; otherwise it goes on from here.
        """
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
            self.simulation = changed(self.simulation, state.job)
        else:
            self.course, self.simulation = self.course.changed(
                self.simulation, state, frozenset(names)
            )
        self.history.cut(self.course.last)
        self._show(state)
        self._judge()
        self.version += 1

    def follow(self, metrics: tuple[str, ...]) -> None:
        """Plot these metrics, new ones from this step on. The run begins again if one
        of them needs visits and they were not counted.
        """
        state = self.state.follow(metrics)
        uncounted = any(
            state.known.metrics[name].covers
            for name in recorded(state.job, metrics).metrics
        ) and not counts_visits(self.simulation)
        if self.step == 0 or uncounted:
            self._again(state)
        else:
            self._prepare(state)
            self._show(state)
            self.history.follow(metrics)

    def sweep(self, name: str, range_: Range | None) -> None:
        """Let the copied spec sweep a setting over a range; None ends that."""
        self._show(self.state.sweep(name, range_))

    def draw(self, overlays: tuple[str, ...]) -> None:
        """Show these overlays."""
        for name in overlays:
            if name not in OVERLAYS:
                raise SpecError(unknown("overlay", name, OVERLAYS))
        if "coverage" in overlays and not counts_visits(self.simulation):
            moving = self.simulation.flight.work.motion is not None
            raise SpecError(
                "visits are not counted while obstacles move: a pixel is free for a"
                " while or not at all"
                if moving
                else "visits are not counted in a world of so many pixels:"
                " plot coverage first, or change pixel"
            )
        self.overlays = overlays
        self.version += 1

    def select(self, boid: int | None) -> None:
        """Select a boid; None selects none."""
        if boid is not None and boid >= self.n:
            raise SpecError(
                f"there is no boid {boid:,}; there are boids 0 to {self.n - 1:,}"
            )
        self.selected = boid
        self.version += 1

    def hurry(self, steps_per_second: float) -> None:
        """Run at this speed; 0 is as fast as possible."""
        if not 0 <= steps_per_second <= FASTEST:
            raise SpecError(
                f"{steps_per_second:g} steps a second are not allowed; 0 to"
                f" {FASTEST:,.0f} are"
            )
        self.speed = steps_per_second
