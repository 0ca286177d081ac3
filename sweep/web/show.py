"""The interface of what a server or a notebook plays to a page: a live run or a stored
one.
"""

from typing import Protocol

from sweep.web.filing import Make
from sweep.web.history import Cursor
from sweep.web.messages import Hello, Message
from sweep.web.protocol import Reply


class Show(Protocol):
    """Something that has frames. `version` grows with every change that may be visible.

    While it is `going`, its player calls `advance`, at `speed` steps a second. It goes
    as fast as possible if `speed` is 0, or if it is not `running` and single steps were
    asked for. Only one method is called at a time, and none of them waits.
    """

    @property
    def version(self) -> int: ...
    @property
    def going(self) -> bool: ...
    @property
    def running(self) -> bool: ...
    @property
    def speed(self) -> float: ...

    def greeting(self) -> list[Reply]:
        """The messages for a page that has just come: controls, state, scene."""

    def states(self) -> list[Reply]:
        """The state message of each run that is shown."""

    def side(self, number: int, /) -> "RunShow":
        """The run that a message with this `side` is about. Raises SpecError where
        there is none.
        """

    def waiting(self, message: Message) -> str:
        """What the page is told while it waits for the answer to a message that takes
        long; "" where the answer comes at once.
        """

    def restore(self, hello: Hello) -> None:
        """Show what a page has kept of a session that is gone. Raises a UserError for
        what cannot be shown, and shows then what it did.
        """

    def handle(self, message: Message) -> list[Reply]:
        """Do what the page asks, and return the answer. Raises a UserError for what is
        refused.
        """

    def export(self, kind: str) -> Make:
        """A function that makes a file of the frames as they are now. It may take long,
        and what happens meanwhile does not change the file.
        """

    def advance(self, steps: int) -> object:
        """Take up to `steps` steps."""

    def picture(self) -> bytes:
        """The frame as it is now, see sweep.web.protocol."""

    def news(self, cursor: Cursor) -> tuple[list[Reply], Cursor]:
        """The messages that a page needs before the next frame, and the next cursor.
        `cursor` says what the page knows already.
        """


class RunShow(Show, Protocol):
    """A show of one run. It can go to its steps from `past[0]` to `past[1]`."""

    @property
    def step(self) -> int: ...
    @property
    def past(self) -> tuple[int, int]: ...
    @property
    def diverged(self) -> bool: ...

    def status(self) -> Reply:
        """The state message."""

    def kept(self) -> Reply:
        """The kept message."""

    def seek(self, step: int, /) -> None:
        """Go to a step."""

    def pause(self) -> None:
        """Take no more steps."""

    def beside(self, preset: str, /) -> "RunShow":
        """A run to be shown beside this one, see sweep.web.messages.Beside. Raises
        SpecError where there can be none.
        """
