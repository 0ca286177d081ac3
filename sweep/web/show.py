"""What the server, or a notebook, plays to a page: a live run or a stored one."""

from collections.abc import Callable
from typing import Protocol

from sweep.web.history import Cursor
from sweep.web.messages import Message
from sweep.web.protocol import Reply


class Show(Protocol):
    """Something with frames. `version` grows with whatever may change what is drawn.

    While it is `going`, whoever plays it calls `advance`, at `speed` steps a second, or
    as fast as it goes for 0 or where it is not `running`. One call at a time; none of
    them waits for anything.
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
        """What a page is told that has just come: controls, state, scene."""

    def status(self) -> Reply:
        """The state message."""

    def handle(self, message: Message) -> list[Reply]:
        """Do what the page asks, and what it is told in return. Raises a UserError
        for what is refused.
        """

    def export(self, kind: str) -> Callable[[], Reply]:
        """What makes a file of the frames as they are, as long as that may take, and
        whatever happens meanwhile.
        """

    def advance(self, steps: int) -> object:
        """Take up to so many steps."""

    def picture(self) -> bytes:
        """The frame as it is, see sweep.web.protocol."""

    def news(self, cursor: Cursor) -> tuple[list[Reply], Cursor]:
        """What the page is to be told before the next frame, given what it knows, and
        what it knows then.
        """
