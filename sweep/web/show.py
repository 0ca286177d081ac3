"""The interface of a show, which a server or a notebook plays to a page."""

from typing import Protocol

from sweep.web.filing import Make
from sweep.web.history import Cursor
from sweep.web.messages import Hello, Message
from sweep.web.protocol import Reply


class Show(Protocol):
    """A live run, a stored trial, or two runs, as frames and messages.

    While the show is `going`, the player calls `advance`, at `speed` steps per second.
    The show is as fast as possible if `speed` is 0, and for single steps of a show that
    is not `running`. Only a single method is called at a time, and no method waits.
    """

    @property
    def version(self) -> int:
        """A number that grows with every change that may be visible."""

    @property
    def going(self) -> bool:
        """True while steps are to be taken."""

    @property
    def running(self) -> bool:
        """True while the show runs without a message for each step."""

    @property
    def speed(self) -> float:
        """The speed in steps per second; 0 is as fast as possible."""

    def greeting(self) -> list[Reply]:
        """Return the messages for a new page: controls, scene, state."""

    def states(self) -> list[Reply]:
        """Return the state message of each run that is shown."""

    def side(self, number: int, /) -> "RunShow":
        """Return the run for messages with this `side`.

        Raises SpecError if there is no such run.
        """

    def waiting(self, message: Message) -> str:
        """Return the text for a page that waits for the answer to a message.

        The text is "" where the answer does not take long.
        """

    def restore(self, hello: Hello) -> None:
        """Show the run that a page has kept of a former session.

        Raises a UserError, without any change, for a run that cannot be shown.
        """

    def handle(self, message: Message) -> list[Reply]:
        """Handle a message of the page, and return the answer.

        Raises a UserError for a message that the show rejects.
        """

    def export(self, kind: str) -> Make:
        """Return a function that makes a file of the present frames.

        The function may take long; later changes of the show do not change the file.
        """

    def advance(self, steps: int) -> object:
        """Take up to `steps` steps."""

    def picture(self) -> bytes:
        """Return the present frame, see sweep.web.protocol."""

    def news(self, cursor: Cursor) -> tuple[list[Reply], Cursor]:
        """Return the messages that a page needs before the next frame, and a cursor.

        `cursor` has the news that the page already has; the next cursor is returned.
        """


class RunShow(Show, Protocol):
    """A show of a single run, which can go to the steps from `past[0]` to `past[1]`."""

    @property
    def step(self) -> int:
        """The steps done."""

    @property
    def past(self) -> tuple[int, int]:
        """The first and the last step that the show can go to."""

    @property
    def diverged(self) -> bool:
        """True if the run has diverged at the last step."""

    def status(self) -> Reply:
        """Return the state message."""

    def kept(self) -> Reply:
        """Return the kept message."""

    def seek(self, step: int, /) -> None:
        """Go to a step."""

    def pause(self) -> None:
        """Take no more steps."""

    def beside(self, preset: str, /) -> "RunShow":
        """Return a run to be shown next to this run, see sweep.web.messages.Beside.

        Raises SpecError if a second run is impossible.
        """
