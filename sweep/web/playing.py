"""The player of a Show, which takes steps at the wanted pace and sends frames.

The player sends a frame whenever the page is ready. Stepping never waits for drawing. A
page that draws slowly gets fewer frames: always the latest frame, and never a queue of
frames.
"""

import asyncio
import logging
import math
import re
import time
from collections.abc import Callable
from functools import partial
from threading import Event
from typing import NoReturn, TypeVar

from sweep.errors import SpecError, UserError
from sweep.trial import of_own_code
from sweep.web.filing import StoppedError, Tell
from sweep.web.history import Cursor
from sweep.web.messages import (
    Alone,
    Beside,
    Export,
    Hello,
    Message,
    Ready,
    StopExport,
)
from sweep.web.outbox import Line, Outbox
from sweep.web.protocol import MessageError, Reply, parse
from sweep.web.show import Show
from sweep.web.twin import Twin

CALL_SECONDS = 0.005
"""Seconds for which steps are taken at a time.

A message of the page waits at most this time, unless a single step takes longer.
"""
ROUNDS = 3
"""Rounds of the event loop after each time of CALL_SECONDS.

The rounds answer messages and send the frame.
"""
SHORTEST_WAIT = 1 / 120
LONGEST_WAIT = 0.1
DRAWING_SHARE = 0.2
"""Largest share of the time for frames while a run is as fast as possible.

The rest is for steps. The metrics of a frame are measured when the frame is sent, and
may take longer than many steps.
"""
FRAME_SECONDS = 1 / 30
"""Shortest time between two frames while a run is as fast as possible."""
LONGEST_DEBT = 0.25
"""Largest delay, in seconds, that late steps make up for.

A machine that is slower than the wanted pace falls behind, and does not catch up.
"""

IN_SPEC = re.compile(r"^spec\.yaml:\d+: ")
"""The beginning of an error about the page's spec.

The line number is cut off, because users have not seen this spec as a file.
"""


def without_lines(error: Exception) -> str:
    """Return the text of an error in a single line, without line numbers."""
    mistakes = error.mistakes if isinstance(error, SpecError) else (error,)
    return "; ".join(IN_SPEC.sub("", str(mistake)) for mistake in mistakes)


R = TypeVar("R")
log = logging.getLogger("sweep")


class Pace:
    """The number of steps that are due, by the clock.

    Each start and each resumption of a run makes a new Pace.
    """

    def __init__(self) -> None:
        self.owed = 1.0
        self.last = time.monotonic()
        self.most = 1

    def due(self, show: Show) -> tuple[int, float]:
        """Return the number of steps to take now and the seconds to wait afterwards."""
        before = self.last
        self.last = time.monotonic()
        if show.speed == 0 or not show.running:
            return self.most, 0.0
        self.owed = min(
            self.owed + (self.last - before) * show.speed,
            max(1.0, show.speed * LONGEST_DEBT),
        )
        steps = min(int(self.owed), self.most)
        self.owed -= steps
        wait = max(SHORTEST_WAIT, (1 - self.owed) / show.speed)
        return steps, 0.0 if self.owed >= 1 else min(wait, LONGEST_WAIT)

    def took(self, steps: int, seconds: float) -> None:
        """Record the duration of the last steps.

        The next time fewer steps are taken, or up to twice as many.

        Parameters
        ----------
        steps : int
            Number of steps.
        seconds : float
            Total duration of the steps.
        """
        self.most = max(
            1, min(2 * steps, int(steps * CALL_SECONDS / max(seconds, 1e-6)))
        )


class Player:
    """The player of a Show to a single line at a time.

    Without a line the Show takes no steps.
    """

    def __init__(self, show: Show) -> None:
        self.show = show
        self.turn = asyncio.Lock()
        self.filing = asyncio.Lock()
        self.asked = asyncio.Event()
        self.changed = asyncio.Event()
        self.ready = asyncio.Event()
        self.stopped = Event()
        self.cursor = Cursor()
        self.told: dict[tuple[str, int], Reply] = {}
        self.next_frame = 0.0
        self.task: asyncio.Task[None] | None = None
        self.left = time.monotonic()

    async def play(self, line: Line) -> bool:
        """Play to this line until the connection ends, or another line takes over.

        Return whether another line has taken over.
        """
        if self.task:
            self.task.cancel()
        task = self.task = asyncio.create_task(self._play(line))
        try:
            await asyncio.wait({task})
        finally:
            task.cancel()
            if self.task is task:
                self.task = None
                self.left = time.monotonic()
        if not task.cancelled() and (error := task.exception()):
            log.error("the simulator failed", exc_info=error)
        return task.cancelled()

    async def _play(self, line: Line) -> None:
        outbox = Outbox(line)
        try:
            async with asyncio.TaskGroup() as tasks:
                tasks.create_task(outbox.send())
                await self._greet(outbox)
                tasks.create_task(self._step(outbox))
                tasks.create_task(self._paint(outbox))
                tasks.create_task(self._listen(line, outbox, tasks))
        except* ConnectionError:
            pass

    async def in_turn(self, work: Callable[[], R]) -> R:
        """Return the result of `work`, run with exclusive access to the show.

        `work` runs in a thread, may take long, and finishes even if the caller is
        cancelled.
        """

        async def alone() -> R:
            async with self.turn:
                return await asyncio.to_thread(work)

        return await asyncio.shield(asyncio.create_task(alone()))

    async def _greet(self, outbox: Outbox) -> None:
        self.cursor = Cursor()
        self.told = {}
        await self.in_turn(lambda: outbox.put(*self.show.greeting()))
        for event in (self.ready, self.changed, self.asked):
            event.set()

    async def _listen(
        self, line: Line, outbox: Outbox, tasks: asyncio.TaskGroup
    ) -> None:
        while True:
            await outbox.room()
            text = await line.hear()
            try:
                message = parse(text)
            except MessageError as error:
                await self._answer(outbox, error.id, partial(_refuse, error))
                continue
            if isinstance(message, Ready):
                self.ready.set()
            elif isinstance(message, Hello):
                await self._greet(outbox)
            elif isinstance(message, Export):
                await self._answer(outbox, message.id, list)
                tasks.create_task(self._export(outbox, message))
            elif isinstance(message, StopExport):
                self.stopped.set()
                await self._answer(outbox, message.id, list)
            else:
                if notice := self.show.waiting(message):
                    outbox.put({"type": "info", "message": notice})
                await self._answer(outbox, message.id, partial(self._handle, message))

    def _handle(self, message: Message) -> list[Reply]:
        """Handle a message of the page. Two runs side by side begin and end here."""
        run = self.show.side(message.side)
        match message:
            case Beside() if isinstance(self.show, Twin):
                raise SpecError("two runs are side by side already")
            case Beside(preset):
                self.show = Twin(run, run.beside(preset))
            case Alone():
                self.show = run
            case _:
                return self.show.handle(message)
        self.cursor = Cursor()
        self.told = {}
        return [{"type": "anew"}, *self.show.greeting()]

    async def _answer(
        self, outbox: Outbox, message_id: str, work: Callable[[], list[Reply]]
    ) -> None:
        """Send the result of `work`, or the reason for a rejection; then the state.

        The state names the answered message.
        """

        def answer() -> None:
            try:
                replies = work()
            except Exception as error:
                replies = [_error(_reason(error)) | {"answers": message_id}]
            if all(reply["type"] != "state" for reply in replies):
                replies += self.show.states()
            outbox.put(
                *(
                    reply | {"answers": message_id}
                    if reply["type"] == "state"
                    else reply
                    for reply in replies
                )
            )

        await self.in_turn(answer)
        self.asked.set()
        self.changed.set()

    async def _export(self, outbox: Outbox, message: Export) -> None:
        """Make a file while the show continues, and send the file.

        Only a single file is made at a time. A request of the page, or the end of the
        connection, stops the work on the file.
        """
        side = {"side": message.side}
        over = _progress(None, "", 1.0) | side
        if self.filing.locked():
            busy = _error("another file is being made; try again later")
            outbox.put(over, busy | side)
            return
        async with self.filing:
            stopped = self.stopped = Event()
            try:
                make = await self.in_turn(
                    lambda: self.show.side(message.side).export(message.kind)
                )
                tell = _telling(outbox, message, stopped)
                outbox.put(await asyncio.to_thread(make, tell) | side)
            except StoppedError:
                pass
            except Exception as error:
                outbox.put(_error(_reason(error)) | side)
            finally:
                stopped.set()
                outbox.put(over)

    async def _step(self, outbox: Outbox) -> None:
        """Advance the show while the show is going, and send the state at a stop."""
        while True:
            self.asked.clear()
            if not self.show.going:
                await self.asked.wait()
            pace = Pace()
            while self.show.going:
                steps, wait = pace.due(self.show)
                if steps:
                    pace.took(steps, await self._advance(outbox, steps))
                for _ in range(ROUNDS if wait == 0.0 else 1):
                    await asyncio.sleep(wait)

    async def _advance(self, outbox: Outbox, steps: int) -> float:
        """Take steps, and return the duration in seconds.

        No step is taken if the show has stopped meanwhile. A kernel call lets other
        threads run, so other pages do not wait for a step that takes long.
        """

        def advance() -> float:
            began = time.perf_counter()
            if self.show.going:
                self.show.advance(steps)
            seconds = time.perf_counter() - began
            if not self.show.going:
                outbox.put(*self.show.states())
            return seconds

        seconds = await self.in_turn(advance)
        self.changed.set()
        return seconds

    async def _paint(self, outbox: Outbox) -> None:
        """Send each new frame with the news, when the page is ready.

        Only the latest frame is sent. Each step of a fast run asks again for a frame.
        """
        painted: tuple[Show, int] | None = None
        while True:
            await self.ready.wait()
            await self.changed.wait()
            self.changed.clear()
            hurries = self.show.running and self.show.speed == 0
            early = hurries and time.monotonic() < self.next_frame
            if early or painted == (self.show, self.show.version):
                continue
            self.ready.clear()
            painted = await self.in_turn(partial(self._send_frame, outbox))

    def _send_frame(self, outbox: Outbox) -> tuple[Show, int]:
        """Send the news and the frame, and return the show and its version."""
        began = time.monotonic()
        painted = self.show, self.show.version
        replies, self.cursor = self.show.news(self.cursor)
        for reply in replies:
            kind = reply["type"], reply.get("side", 0)
            if self.told.get(kind) != reply:
                self.told[kind] = reply
                outbox.put(reply)
        outbox.put(self.show.picture())
        took = time.monotonic() - began
        self.next_frame = began + max(FRAME_SECONDS, took / DRAWING_SHARE)
        return painted


def _progress(kind: str | None, doing: str, share: float) -> Reply:
    return {"type": "progress", "kind": kind, "doing": doing, "share": share}


def _telling(outbox: Outbox, message: Export, stopped: Event) -> Tell:
    """Return a function that reports the progress of a file to a page.

    The function reports each hundredth at most once. Any thread may call the function.
    """
    last: list[tuple[str, float]] = []

    def tell(doing: str, share: float) -> None:
        if stopped.is_set():
            raise StoppedError
        here = doing, math.floor(100 * share) / 100
        if [here] != last:
            last[:] = [here]
            outbox.put(_progress(message.kind, *here) | {"side": message.side})

    return tell


def _refuse(error: MessageError) -> NoReturn:
    raise error


def _error(message: str) -> Reply:
    return {"type": "error", "message": message}


def _reason(error: Exception) -> str:
    """Return the message of an error for the page.

    The whole error is logged if the user cannot fix it.
    """
    if isinstance(error, UserError | MessageError):
        return without_lines(error)
    if message := of_own_code(error):
        return message
    log.error("the simulator failed", exc_info=error)
    return (
        f"the simulator failed: {type(error).__name__}; the simulator continues,"
        " and its terminal shows the details"
    )
