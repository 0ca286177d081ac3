"""The interface of what a server or a notebook plays to a page: a live run or a stored
one.
"""

from collections.abc import Callable
from typing import Protocol

from sweep.web.history import Cursor
from sweep.web.messages import Message
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

    def status(self) -> Reply:
        """The state message."""

    def handle(self, message: Message) -> list[Reply]:
        """Do what the page asks, and return the answer. Raises a UserError for what is
        refused.
        """

    def export(self, kind: str) -> Callable[[], Reply]:
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
