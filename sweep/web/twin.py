"""Two runs side by side on a common clock."""

import struct
from contextlib import suppress

from sweep.errors import SpecError
from sweep.web import messages
from sweep.web.filing import Make
from sweep.web.history import Cursor
from sweep.web.messages import Hello, Message
from sweep.web.protocol import Reply
from sweep.web.show import RunShow

MAGIC = b"BSF2"
HEAD = struct.Struct("<4sI")
SHARED = (
    messages.StartRun
    | messages.Pause
    | messages.Step
    | messages.Reset
    | messages.Continue
    | messages.Speed
    | messages.Seek
)
"""The messages that apply to the two runs, whichever run is named."""


class Twin:
    """A Show of two runs, live or stored.

    The two runs are at equal steps after each call. So the runs stop where the first
    run ends or diverges.
    """

    def __init__(self, first: RunShow, second: RunShow) -> None:
        self.sides = first, second
        self.stopped: tuple[int, dict[int, str]] = -1, {}
        for side in self.sides:
            side.pause()
        self._level(self.step)

    @property
    def step(self) -> int:
        """The steps done by the two runs."""
        return min(side.step for side in self.sides)

    @property
    def version(self) -> int:
        """A number that grows with every change that may be visible."""
        return sum(side.version for side in self.sides)

    @property
    def going(self) -> bool:
        """True while the two runs are to take steps."""
        return all(side.going for side in self.sides)

    @property
    def running(self) -> bool:
        """True while the two runs need no message for each step."""
        return all(side.running for side in self.sides)

    @property
    def speed(self) -> float:
        """The common speed in steps per second; 0 is as fast as possible."""
        return self.sides[0].speed

    def side(self, number: int) -> RunShow:
        """Return the first or the second run.

        Raises SpecError for another number.
        """
        if number >= len(self.sides):
            raise SpecError(f"there is no run {number}; there are runs 0 and 1")
        return self.sides[number]

    def greeting(self) -> list[Reply]:
        """Return the messages of the two runs for a new page."""
        return [
            reply
            for number, side in enumerate(self.sides)
            for reply in _of(number, side.greeting())
            if reply["type"] != "state"
        ] + self.states()

    def states(self) -> list[Reply]:
        """Return the state of each run, which ends at the end of the shorter run."""
        states = [side.status() for side in self.sides]
        ends = [self._ended(number, state) for number, state in enumerate(states)]
        first, last = self._past
        clock = {
            "steps": min(state["steps"] for state in states),
            "past": [first, last],
            "running": self.running,
        }
        return [
            _clipped(state, last) | clock | {"side": number, "ended": end}
            for number, (state, end) in enumerate(zip(states, ends, strict=True))
        ]

    def _ended(self, number: int, state: Reply) -> str:
        """Return why a run ends at the present step; "" for a run that can continue."""
        step, reasons = self.stopped
        if step == self.step and number in reasons:
            return reasons[number]
        replay = state["replay"]
        last = replay["frames"][1] if replay else state["steps"]
        return f"ended at step {last:,}" if self.step >= last else ""

    @property
    def _past(self) -> tuple[int, int]:
        """The first and the last step that the two runs can go to."""
        firsts, lasts = zip(*(side.past for side in self.sides), strict=True)
        return max(firsts), min(lasts)

    def waiting(self, message: Message) -> str:
        """Return the text for a page that waits for the run of the message."""
        return self.side(message.side).waiting(message)

    def restore(self, hello: Hello) -> None:
        """Show the run that a page has kept, as the first run."""
        self.sides[0].restore(hello)
        self._level(self.step)

    def export(self, kind: str) -> Make:
        """Return a function that makes a file of the first run."""
        return self.sides[0].export(kind)

    def handle(self, message: Message) -> list[Reply]:
        """Handle a message of the page, with the two runs or with the named run.

        Messages about the clock apply to the two runs. If another message moves a run
        to a new step, the second run follows.
        """
        step = self.step
        running = self.running
        if isinstance(message, messages.Keep):
            replies = [self._kept()]
        elif isinstance(message, SHARED):
            replies = self._both(message)
        else:
            side = self.side(message.side)
            replies = _of(message.side, side.handle(message))
            if side.step != step:
                self._level(side.step)
        if running and not isinstance(message, SHARED) and not self.running:
            with suppress(SpecError):
                self._both(messages.StartRun())
        return [reply for reply in replies if reply["type"] != "state"] + self.states()

    def _kept(self) -> Reply:
        """Return the kept messages of the two runs as a single message."""
        first, second = (side.kept() for side in self.sides)
        named = {f"{key}_beside": second[key] for key in second.keys() - {"type"}}
        return first | named

    def _both(self, message: Message) -> list[Reply]:
        replies: list[Reply] = []
        try:
            for number, side in enumerate(self.sides):
                replies += _of(number, side.handle(message))
        except SpecError:
            for side in self.sides:
                side.pause()
            raise
        finally:
            self._level(self.step)
        return replies

    def _level(self, step: int) -> None:
        """Bring the two runs to a step, or to the nearest possible step."""
        if all(side.step == step and not side.diverged for side in self.sides):
            return
        first, last = self._past
        for side in self.sides:
            side.seek(min(max(step, first), last))

    def advance(self, steps: int) -> object:
        """Take up to `steps` steps with each run, as many as the slower run takes."""
        first, second = self.sides
        first.advance(steps)
        while second.going and second.step < first.step and not second.diverged:
            second.advance(first.step - second.step)
        notes = {
            number: str(side.status()["note"])
            for number, side in enumerate(self.sides)
            if side.diverged
        }
        self._level(self.step)
        if notes:
            self.stopped = self.step, notes
        if not self.going:
            for side in self.sides:
                side.pause()
        return None

    def picture(self) -> bytes:
        """Return BSF2, u32 the size of the first frame, and the two frames."""
        first, second = (side.picture() for side in self.sides)
        return HEAD.pack(MAGIC, len(first)) + first + second

    def news(self, cursor: Cursor) -> tuple[list[Reply], Cursor]:
        """Return the news of the two runs, and the next cursor."""
        replies: list[Reply] = []
        each = list[Cursor]()
        before = cursor.each or (Cursor(), Cursor())
        for number, (side, shown) in enumerate(zip(self.sides, before, strict=True)):
            news, now = side.news(shown)
            replies += _of(number, news)
            each.append(now)
        return replies, cursor._replace(each=tuple(each))


def _clipped(state: Reply, last: int) -> Reply:
    """Return the state of a stored trial that is played up to a step.

    The state of a live run is returned unchanged.
    """
    if not state["replay"]:
        return state
    first, _, every = state["replay"]["frames"]
    return state | {"replay": state["replay"] | {"frames": [first, last, every]}}


def _of(number: int, replies: list[Reply]) -> list[Reply]:
    """Return the messages with the number of the run."""
    return [reply | {"side": number} for reply in replies]
