"""A live run as a Show.

The Show turns messages of a page into calls of a Session, and the Session into
messages.
"""

import time
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

from sweep.errors import SpecError
from sweep.spec import Value, in_a_line, needed, places_of
from sweep.text import numbered
from sweep.trial import looking
from sweep.web import encoding, messages
from sweep.web.compiling import waiting
from sweep.web.controls import controls, trial_of, trials_of
from sweep.web.filing import Make, Order, filed, origin_of, unavailable
from sweep.web.history import Cursor
from sweep.web.messages import Message
from sweep.web.opened import opened_again
from sweep.web.overlays import visited_shares
from sweep.web.protocol import Reply, plain
from sweep.web.scene import scene_of
from sweep.web.session import Session
from sweep.web.state import Range, ViewState, from_opened

COVERAGE_PERIOD = 0.25
"""Seconds between two sections of coverage during the run."""

EDITING = (
    messages.Set
    | messages.Goal
    | messages.Shapes
    | messages.ChooseModel
    | messages.ShowTrial
    | messages.ShowValue
    | messages.Metrics
    | messages.Sweep
    | messages.Reset
    | messages.Continue
)
"""The messages that can be undone."""


class Live(Session):
    """The Show of a Session."""

    covered = 0.0

    def greeting(self) -> list[Reply]:
        """Return controls, scene and state.

        The state comes last, so a page that has the state also has controls and scene.
        """
        state = self.state
        shown = controls(
            state.model,
            state.preset,
            own=(str(state.settings["map"]),) if state.own else (),
            derive=state.derive,
            catalogue=state.catalogue,
            plots=state.plots,
        )
        return [
            shown | {"trials": trials_of(state.opened)},
            self.scene(),
            self.status(),
        ]

    def waiting(self, message: Message) -> str:
        """Return a text on the work before an answer; "" for an answer at once.

        The work is a compilation, or another run of the same steps.
        """
        with suppress(SpecError):
            state = self._state_after(message)
            metrics = self._record(state).metrics
            if state is not self.state and (notice := waiting(state.job, metrics)):
                return notice
            overlays = self.overlays
            if isinstance(message, messages.Overlays):
                overlays = message.names
            counting = isinstance(message, messages.Overlays | messages.Metrics)
            if counting and self.step > 0 and self.uncounted(state, overlays):
                return f"running {self.step:,} steps again, to count from the start"
        return ""

    def _state_after(self, message: Message) -> ViewState:
        """Return the state that a message leads to. Raises SpecError if rejected."""
        state = self.state
        match message:
            case messages.ChooseModel(model, preset):
                return state.chosen(model, preset)
            case messages.Beside(preset) if preset:
                return state.chosen(state.model, preset)
            case messages.Metrics(names):
                return state.follow(names)
            case messages.Set(name, value):
                return state.with_settings({name: value})
            case messages.Shapes(shapes):
                return state.place(shapes)
            case messages.ShowTrial(point, replicate):
                return state.at(point, replicate)
            case messages.ShowValue(name, value):
                return state.having(name, value)
        return state

    def handle(self, message: Message) -> list[Reply]:
        """Handle a message of the page, and return the answer.

        The answer is the state, after the scene if the world may have changed. The
        answer to a request for the spec, the kept run or the origin is only the
        requested message.
        """
        if isinstance(message, messages.Spec):
            yaml = self.spec()
            return [
                {
                    "type": "spec",
                    "yaml": yaml,
                    "trial": self._which(yaml),
                    "exact": self.exact,
                    "note": self.note,
                }
            ]
        if isinstance(message, messages.Keep):
            return [self.kept()]
        if isinstance(message, messages.Origin):
            return [origin_of(self.order(), self.spec())]
        before = self.simulation
        state = self.state
        self._edit(message)
        if _kind(self.state) != _kind(state):
            return self.greeting()
        return [*([] if self.simulation is before else [self.scene()]), self.status()]

    def _edit(self, message: Message) -> None:
        """Handle a message of the page, and record the edit."""
        if not isinstance(message, EDITING):
            do(self, message)
            return
        before = self.moment()
        do(self, message)
        target = getattr(message, "name", getattr(message, "index", ""))
        subject = f"{type(message).__name__} {target}"
        part = getattr(message, "part", False)
        self.edits.add(before, self.moment(), subject, part=part)

    def beside(self, preset: str, /) -> "Live":
        """Return a run to be shown next to this run.

        With a preset, the new run has this preset, and the two runs begin at the start.
        With "" the new run is a copy of this run, from here on.
        """
        other = Live(self.state)
        if preset:
            other.choose(self.state.model, preset)
            self._edit(messages.Reset())
        else:
            other.recall(self.moment())
        self.pause()
        other.speed = self.speed
        other.show_overlays(self.overlays)
        other.selected = self.selected
        return other

    def _which(self, yaml: str) -> str:
        """Return the shown trial of the copied spec, in words.

        The text is "" where the spec has only one trial, or gets a new sweep.
        """
        state = self.state
        spec = state.opened
        if spec is None or state.sweeps:
            return ""
        trial = (state.job.point, spec.replicate)
        spec = opened_again(
            yaml, *trial, catalogue=state.catalogue, path=spec.study.path
        )
        if spec.design.n_points * spec.replicates == 1:
            return ""
        point = numbered("point", spec.point, spec.design.n_points)
        return f"{point}, {numbered('replicate', spec.replicate, spec.replicates)}"

    def kept(self) -> Reply:
        """Return the message with which a page resumes after the end of a session."""
        return {"type": "kept"} | self.state.as_trial()

    def restore(self, hello: messages.Hello) -> None:
        """Show the run that a page has kept, except a stored trial.

        Raises SpecError where the run cannot be shown.
        """
        if not hello.yaml:
            return
        before = self.state
        path = before.opened.study.path if before.opened else Path("spec.yaml")
        trial = (hello.point, hello.replicate)
        spec = opened_again(hello.yaml, *trial, catalogue=before.catalogue, path=path)
        self._begin(from_opened(spec))

    def export(self, kind: str) -> Make:
        """Return a function that makes a file: an image of this frame, or the run.

        A run whose parameters changed on the way is rejected.
        """
        return filed(self.order(), kind, self.greeting(), self.spec())

    def order(self) -> Order:
        """Return the content of the screen, for files."""
        return Order(
            study=self.state.study + ("" if self.exact else "-changed"),
            job=self.state.job,
            step=self.step,
            bodies=self.bodies,
            metrics=self.state.plots,
            until=self.step,
            refused=self._unfilmed,
        )

    def spec(self) -> str:
        """Return the YAML of the content of the screen."""
        return self.state.as_text()

    @property
    def _unfilmed(self) -> str:
        """Reason why a file of the run is impossible; "" where a file is possible."""
        if self.exact:
            return ""
        return f"an animation shows the run of the spec, but {self.note}"

    def news(self, cursor: Cursor) -> tuple[list[Reply], Cursor]:
        """Return the news since `cursor`, and the next cursor.

        The messages are metrics, the neighbours of the selected boid, and the names of
        the rules whose accelerations are shown.
        """
        replies: list[Reply] = []
        if cursor.entered != self.entered:
            replies += [self.scene(), self.status()]
        self.measure()
        metrics, cursor = self.history.since(cursor._replace(entered=self.entered))
        replies += [metrics | {"restarts": self._restarts}] if metrics else []
        replies.append(self.selection())
        if "accelerations" in self.overlays:
            replies.append({"type": "rules", "names": looking.rules(self.simulation)})
        return replies, cursor

    @property
    def _restarts(self) -> dict[str, list[int]]:
        """The steps at which plotted metrics of visits restart from 0."""
        state = self.state
        derived = {metric.name: needed((metric,)) for metric in state.derive}
        return {
            name: self.restarts
            for name in state.plots
            if any(
                state.catalogue.metrics[source].covers
                for source in derived.get(name, (name,))
                if source in state.catalogue.metrics
            )
        }

    def picture(self) -> bytes:
        """Return the frame, with the chosen overlays."""
        simulation = self.simulation
        sections = []
        if "flocks" in self.overlays:
            sections.append(encoding.flocks(looking.flocks(simulation)))
        if "accelerations" in self.overlays:
            sections.append(encoding.accelerations(looking.accelerations(simulation)))
        if (
            "coverage" in self.overlays
            and looking.counts_visits(simulation)
            and (not self.going or time.monotonic() - self.covered > COVERAGE_PERIOD)
        ):
            self.covered = time.monotonic()
            shares = visited_shares(looking.visits(simulation))
            sections.append(encoding.coverage(shares))
        world = simulation.world
        return encoding.frame(
            self.step, self.bodies, (world.width, world.height), sections
        )

    def side(self, number: int, /) -> "Live":
        """Return this run, which is the only run.

        Raises SpecError for a second run.
        """
        if number:
            raise SpecError("there is no second run next to this run")
        return self

    def states(self) -> list[Reply]:
        """Return the state message in a list."""
        return [self.status()]

    def status(self) -> Reply:
        """Return the state message."""
        state = self.state
        return {
            "type": "state",
            "run": self.number,
            "model": state.model,
            "preset": state.preset,
            "settings": {name: plain(value) for name, value in state.settings.items()},
            "changed": list(state.fixed),
            "shapes": state.shapes,
            "seed": state.seed,
            "running": self.running,
            "speed": self.speed,
            "step": self.step,
            "steps": self.simulation.schedule.steps,
            "past": list(self.past),
            "undo": self.edits.past[-1].text if self.edits.past else "",
            "redo": self.edits.future[-1].text if self.edits.future else "",
            "exact": self.exact,
            "note": self.note,
            "sweeps": {name: range_._asdict() for name, range_ in state.sweeps.items()},
            "follows": state.follows,
            "selected": self.selected,
            "overlays": list(self.overlays),
            "plots": list(state.plots),
            "trial": trial_of(state.opened),
            "files": unavailable(self._unfilmed),
            "replay": None,
        }

    def scene(self) -> Reply:
        """Return the scene message."""
        return scene_of(self.simulation.job)

    def selection(self) -> Reply:
        """Return the selected boid and the perceived neighbours."""
        boid = self.selected
        if boid is None:
            return {"type": "selection", "boid": None}
        flock = self.simulation.flock
        perceived = looking.seen_by(self.simulation, boid)
        return {
            "type": "selection",
            "boid": boid,
            "x": float(flock.x[boid]),
            "y": float(flock.y[boid]),
            **perceived._asdict(),
            "range": plain(perceived.range),
        }


def _kind(state: ViewState) -> tuple[str, str, bool]:
    """Return the parts of a state on which the controls depend."""
    return state.model, state.preset, state.own is None


def do(session: Session, message: Message) -> None:
    """Call the method of the session that belongs to a message.

    Raises SpecError for a message that the session rejects.
    """
    match message:
        case messages.Set(name, value):
            session.change({name: value})
        case messages.Goal(x, y, index):
            session.change(_aimed(session.state.settings, (x, y), index))
        case messages.Shapes(shapes):
            session.place(shapes)
        case messages.ChooseModel(model, preset):
            session.choose(model, preset)
        case messages.ShowTrial(point, replicate):
            session.show_trial(point, replicate)
        case messages.ShowValue(name, value):
            session.show_value(name, value)
        case messages.Metrics(names):
            session.follow(names)
        case messages.Overlays(names):
            session.draw(names)
        case messages.Sweep(name, low, high, points, off):
            session.sweep(name, None if off else Range(low, high, points))
        case messages.Select(boid):
            session.select(boid)
        case messages.Speed(steps_per_second):
            session.hurry(steps_per_second)
        case messages.Step(count):
            session.take_steps(count)
        case _:
            _steer(session, message)


def _aimed(
    settings: Mapping[str, Value], position: tuple[float, float], index: int
) -> dict[str, Value]:
    """Return the parameters by which the goal of this index is at a position.

    Raises SpecError if the index is too large.
    """
    if index == 0:
        return dict(zip(("goal_x", "goal_y"), position, strict=True))
    later = list(places_of(settings["next_goals"]) or ())
    if index > len(later):
        raise SpecError(f"goal: index must be at most {len(later)}, not {index}")
    later[index - 1] = position
    return {"next_goals": in_a_line(tuple(later))}


def _steer(session: Session, message: Message) -> None:
    match message:
        case messages.StartRun():
            session.run()
        case messages.Pause():
            session.pause()
        case messages.Reset():
            session.reset()
        case messages.Continue():
            session.extend()
        case messages.Seek(frame):
            session.seek(frame)
        case messages.Undo():
            session.undo()
        case messages.Redo():
            session.redo()
