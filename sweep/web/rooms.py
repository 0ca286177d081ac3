"""The sessions of pages, and the answers to pages: of a server, or of a notebook."""

import asyncio
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import partial
from typing import Any, NamedTuple

from sweep.errors import SpecError, UserError
from sweep.web import compiling
from sweep.web.launching import Launcher, state_of
from sweep.web.messages import Hello
from sweep.web.outbox import Line
from sweep.web.playing import Player
from sweep.web.protocol import MessageError, parse
from sweep.web.show import RunShow, Show
from sweep.web.twin import Twin

MOST_SESSIONS = 16
KEPT_SECONDS = 600
"""Seconds for which a session waits for the return of the page."""
PATIENCE = 1.0
"""Seconds after which a page gets the reason for a wait."""
PREPARING = "preparing the run"
TAKEN = 4001
"""The code that closes a socket for good after another window took over the session."""
REFUSED = 4002
"""The code that closes a socket for good where the page gets no session."""

Pairs = Sequence[tuple[str, str]]
"""The names and values of a query, in order; a name may occur several times."""


def _nothing_stored(study: str, trial: str) -> RunShow:
    raise SpecError(f"trial {trial} of {study} is not stored on this page")


class PageSite(NamedTuple):
    """The content of a server in addition to the simulator.

    Attributes
    ----------
    home : str
        File that the address of the server shows.
    answers : mapping of str to callable
        Answers by the names of questions: a function of the query of a GET, which
        returns plain data. If the function raises a UserError, the answer is the error.
    stored : callable
        Returns the run of a stored trial, by study and trial id.
    launcher : Launcher or None
        Launches proposals of a page; None where pages only read.
    """

    home: str = "index.html"
    answers: Mapping[str, Callable[[Pairs], Any]] = {}
    stored: Callable[[str, str], RunShow] = _nothing_stored
    launcher: Launcher | None = None

    @property
    def questions(self) -> Mapping[str, Callable[[Pairs], Any]]:
        """All answers, with the state of launches from the pages."""
        return {**self.answers, "launch": lambda _: state_of(self.launcher)}


class Rooms:
    """The sessions, by the names of the pages.

    The session of a page that is gone is kept for some minutes.
    """

    def __init__(
        self,
        begin: Callable[[], Show],
        stored: Callable[[str, str], RunShow] = _nothing_stored,
    ) -> None:
        self.begin = begin
        self.stored = stored
        self.players: dict[str, Player] = {}

    async def player(self, hello: Hello, line: Line) -> Player:
        """Return the player of a page.

        A new page gets a new player, with the run that the page has kept.

        Parameters
        ----------
        hello : Hello
            First message of the page.
        line : Line
            Connection to the page.

        Raises
        ------
        SpecError
            If there are too many pages.
        """
        page = hello.page
        if page not in self.players:
            self._make_room()
            show = await _patiently(line, partial(self._begin, hello))
            if hello.yaml or hello.kept_trial:
                try:
                    show = await _patiently(line, partial(_restored, show, hello))
                except UserError as error:
                    reason = f"the run that this page has kept cannot be shown: {error}"
                    await line.tell({"type": "error", "message": reason})
            self._make_room()
            self.players.setdefault(page, Player(show))
        return self.players[page]

    async def serve(self, line: Line) -> int:
        """Play to a page after the hello message.

        Return the code that closes the socket. Raises ConnectionError when the page is
        gone.
        """
        try:
            player = await self.player(await _hello(line), line)
        except UserError as error:
            await line.tell({"type": "error", "message": str(error)})
            return REFUSED
        taken = await player.play(line)
        if not taken:
            raise ConnectionError("the page is gone")
        return TAKEN

    def _begin(self, hello: Hello) -> Show:
        if not hello.trial:
            return self.begin()
        run = self.stored(hello.study, hello.trial)
        if not hello.beside:
            return run
        return Twin(run, self.stored(hello.study, hello.beside))

    def _make_room(self) -> None:
        """Forget the sessions whose pages did not come back in time.

        If there are still too many sessions, forget the session whose page left first.
        """
        empty = sorted(
            (player.left, page)
            for page, player in self.players.items()
            if player.task is None
        )
        for left, page in empty:
            if (
                time.monotonic() - left > KEPT_SECONDS
                or len(self.players) >= MOST_SESSIONS
            ):
                del self.players[page]
        if len(self.players) >= MOST_SESSIONS:
            raise SpecError(f"{MOST_SESSIONS} pages are open already; close a page")


async def _patiently(line: Line, begin: Callable[[], Show]) -> Show:
    """Return the show that `begin` makes in a thread, and tell the page of the wait."""
    making = asyncio.create_task(asyncio.to_thread(begin))
    reason = ""
    while not (await asyncio.wait({making}, timeout=PATIENCE))[0]:
        notice = next(iter(compiling.IN_PROGRESS), PREPARING)
        if notice != reason:
            reason = notice
            with suppress(ConnectionError):  # who leaves meanwhile may come back
                await line.tell({"type": "info", "message": notice})
    return await making


def _restored(show: Show, hello: Hello) -> Show:
    """Return the show of the run, or the two runs, that a page has kept.

    Raises a UserError for a run that cannot be shown.
    """
    show.restore(hello)
    if not hello.yaml_beside:
        return show
    first = show.side(0)
    second = first.beside("")
    second.restore(hello.of_second)
    return Twin(first, second)


async def _hello(line: Line) -> Hello:
    """Return the first message of the page."""
    while True:
        try:
            message = parse(await line.hear())
            if isinstance(message, Hello):
                return message
            raise MessageError("the first message of a page must be hello")
        except MessageError as error:
            await line.tell({"type": "error", "message": str(error)})
