"""Messages and frames on the way to a page, in the order of the calls.

Callers need not wait until a message or frame is sent.
"""

import asyncio
from typing import Protocol

from sweep.web.protocol import Reply

MOST_WAITING = 64
"""Number of waiting messages at which the server stops reading from the page.

The server resumes reading when fewer messages wait.
"""


class Line(Protocol):
    """A connection to a page; all methods raise ConnectionError after the end."""

    async def hear(self) -> str:
        """Return the next message of the page."""

    async def tell(self, reply: Reply) -> None:
        """Send a message."""

    async def show(self, frame: bytes) -> None:
        """Send a frame."""


class Outbox:
    """A queue whose content is sent to a line as soon as the line is ready.

    An Outbox must be made in a running event loop.
    """

    def __init__(self, line: Line) -> None:
        self.line = line
        self._loop = asyncio.get_running_loop()
        self._items: asyncio.Queue[Reply | bytes] = asyncio.Queue()
        self._room = asyncio.Event()
        self._room.set()

    def put(self, *items: Reply | bytes) -> None:
        """Send messages and frames. Any thread may call the method."""
        for item in items:
            self._loop.call_soon_threadsafe(self._put, item)

    def _put(self, item: Reply | bytes) -> None:
        self._items.put_nowait(item)
        if self._items.qsize() >= MOST_WAITING:
            self._room.clear()

    async def room(self) -> None:
        """Wait until fewer than MOST_WAITING items are on the way."""
        await self._room.wait()

    async def send(self) -> None:
        """Send everything that comes, without end.

        Raises ConnectionError after a disconnection.
        """
        while True:
            item = await self._items.get()
            if self._items.qsize() < MOST_WAITING:
                self._room.set()
            if isinstance(item, bytes):
                await self.line.show(item)
            else:
                await self.line.tell(item)
