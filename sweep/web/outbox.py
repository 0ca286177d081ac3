"""Messages and frames on their way to a page, in the order in which they were put in.

Callers that put something in need not wait until it is sent.
"""

import asyncio
from typing import Protocol

from sweep.web.protocol import Reply

MOST_WAITING = 64
"""The number of waiting messages at which the page is no longer heard.

It is heard again when there are fewer.
"""


class Line(Protocol):
    """The connection to a page. All methods raise ConnectionError when it is gone."""

    async def hear(self) -> str:
        """Return the next message of the page."""

    async def tell(self, reply: Reply) -> None:
        """Send a message."""

    async def show(self, frame: bytes) -> None:
        """Send a frame."""


class Outbox:
    """A queue whose content is sent to a line as soon as the line takes it.

    It must be made in a running event loop.
    """

    def __init__(self, line: Line) -> None:
        self.line = line
        self._loop = asyncio.get_running_loop()
        self._items: asyncio.Queue[Reply | bytes] = asyncio.Queue()
        self._room = asyncio.Event()
        self._room.set()

    def put(self, *items: Reply | bytes) -> None:
        """Send messages and frames. May be called from any thread."""
        for item in items:
            self._loop.call_soon_threadsafe(self._put, item)

    def _put(self, item: Reply | bytes) -> None:
        self._items.put_nowait(item)
        if self._items.qsize() >= MOST_WAITING:
            self._room.clear()

    async def room(self) -> None:
        """Wait until fewer than MOST_WAITING items are on their way."""
        await self._room.wait()

    async def send(self) -> None:
        """Send everything that comes, for ever.

        Raises ConnectionError when the line is gone.
        """
        while True:
            item = await self._items.get()
            if self._items.qsize() < MOST_WAITING:
                self._room.set()
            if isinstance(item, bytes):
                await self.line.show(item)
            else:
                await self.line.tell(item)
