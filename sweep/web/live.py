"""A live run as a Show: it turns the messages of a page into calls of a Session, and
the Session into messages.
"""

import time
from collections.abc import Callable

from sweep.errors import SpecError
from sweep.trial import looking
from sweep.trial.kinds import kinds_of
from sweep.web import encoding, messages
from sweep.web.controls import controls
from sweep.web.filing import Order, filed
from sweep.web.history import Cursor
from sweep.web.messages import Message
from sweep.web.overlays import coarsened
from sweep.web.protocol import Reply, plain
from sweep.web.session import Session
from sweep.web.state import Range

COVERAGE_PERIOD = 0.25
"""Seconds between two pictures of the coverage while the run goes on."""


class Live(Session):
    """The Show of a Session."""

    covered = 0.0

    def greeting(self) -> list[Reply]:
        """Controls, scene, and the state as the last: a page that has the state has the
        other two already.
        """
        own = (str(self.state.settings["map"]),) if self.state.own else ()
        return [
            controls(
                self.state.model,
                self.state.preset,
                own,
                self.state.derive,
                self.state.known,
            ),
            self.scene(),
            self.status(),
        ]

    def handle(self, message: Message) -> list[Reply]:
        """Do what the page asks. Returns the answer: the state, before it the scene
        where the world may have changed, or the spec that was asked for.
        """
        if isinstance(message, messages.Spec):
            return [
                {
                    "type": "spec",
                    "yaml": self.state.as_text(),
                    "exact": self.exact,
                    "note": self.note,
                }
            ]
        before, own = self.simulation, self.state.own
        _do(self, message)
        if isinstance(message, messages.ChooseModel) or (own is None) != (
            self.state.own is None
        ):
            return self.greeting()
        return [*([] if self.simulation is before else [self.scene()]), self.status()]

    def export(self, kind: str) -> Callable[[], Reply]:
        """A function that makes a file: a picture of this frame, or the run up to it. A
        run whose settings changed on the way is refused.
        """
        study = str(self.state.as_spec()["study"]) + ("" if self.exact else "-changed")
        refused = (
            ""
            if self.exact
            else f"an animation shows the run that the spec gives, but {self.note}"
        )
        order = Order(
            study,
            self.state.job,
            self.step,
            self.bodies,
            self.state.plots,
            self.step,
            refused,
        )
        return filed(order, kind, self.greeting(), self.state.as_text())

    def news(self, cursor: Cursor) -> tuple[list[Reply], Cursor]:
        """What is new since `cursor`: metrics, the neighbours of the selected boid, the
        names of the rules whose accelerations are shown.
        """
        metrics, cursor = self.history.since(cursor)
        replies: list[Reply] = [metrics] if metrics else []
        replies.append(self.selection())
        if "accelerations" in self.overlays:
            replies.append({"type": "rules", "names": looking.rules(self.simulation)})
        return replies, cursor

    def picture(self) -> bytes:
        """The frame, with the chosen overlays."""
        simulation, sections = self.simulation, []
        if "flocks" in self.overlays:
            sections.append(encoding.flocks(looking.flocks(simulation)))
        if "accelerations" in self.overlays:
            sections.append(encoding.accelerations(looking.accelerations(simulation)))
        if "coverage" in self.overlays and (
            not self.going or time.monotonic() - self.covered > COVERAGE_PERIOD
        ):
            self.covered = time.monotonic()
            sections.append(encoding.coverage(coarsened(looking.visits(simulation))))
        world = simulation.world
        return encoding.frame(
            self.step, self.bodies, (world.width, world.height), sections
        )

    def status(self) -> Reply:
        """The state message."""
        state = self.state
        return {
            "type": "state",
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
            "exact": self.exact,
            "note": self.note,
            "sweeps": {name: range_._asdict() for name, range_ in state.sweeps.items()},
            "selected": self.selected,
            "overlays": list(self.overlays),
            "plots": list(state.plots),
            "replay": None,
        }

    def scene(self) -> Reply:
        """The scene message."""
        simulation = self.simulation
        world, model = simulation.world, self.state.known.models[self.state.model]
        columns = (
            world.obstacle_x,
            world.obstacle_y,
            world.half_width,
            world.half_height,
            world.is_round,
        )
        drawn = any(rule.to_goal for rule in model.rules)
        goal = (
            [world.goal_x, world.goal_y, float(self.state.settings["goal_radius"])]
            if drawn
            else None
        )
        return {
            "type": "scene",
            "width": world.width,
            "height": world.height,
            "borders": str(self.state.settings["borders"]),
            "length": model.length,
            "time": model.time,
            "downwards": model.y_down,
            "obstacles": [
                list(map(float, obstacle)) for obstacle in zip(*columns, strict=True)
            ],
            "goal": goal,
            "kinds": list(map(list, kinds_of(simulation.job).items())),
        }

    def selection(self) -> Reply:
        """The selected boid and the boids that it sees."""
        boid = self.selected
        if boid is None:
            return {"type": "selection", "boid": None}
        seen, flock = looking.seen_by(self.simulation, boid), self.simulation.flock
        place = {"x": float(flock.x[boid]), "y": float(flock.y[boid])}
        return {
            "type": "selection",
            "boid": boid,
            **place,
            **seen._asdict(),
            "range": plain(seen.range),
        }


def _do(session: Session, message: Message) -> None:
    """Call the method of the session that belongs to a message. Raises SpecError for
    what is refused.
    """
    match message:
        case messages.Set(name, value):
            session.change({name: value})
        case messages.Goal(x, y):
            session.change({"goal_x": x, "goal_y": y})
        case messages.Shapes(shapes):
            session.place(shapes)
        case messages.ChooseModel(model, preset):
            session.choose(model, preset)
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
        case messages.Seek():
            raise SpecError("only a stored trial can be scrubbed; this is a live run")
