"""Serves the page, to this machine alone.

Only those who know the token in the address may open it. A page from elsewhere is
refused: the header Host must be a name of this machine, and the Origin of a socket must
be the page itself.
"""

import asyncio
import base64
import hmac
import json
import secrets
import socket
import time
from collections.abc import Awaitable, Callable, Mapping, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import uvicorn
from starlette.applications import Starlette
from starlette.requests import HTTPConnection, Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from sweep.errors import SpecError, UserError
from sweep.store.user_key import own_key
from sweep.web.demo import DEMOS, moving
from sweep.web.launching import Launcher, actions, state_of
from sweep.web.messages import Hello
from sweep.web.playing import Player
from sweep.web.protocol import MOST_BYTES, MessageError, Reply, parse, write
from sweep.web.show import RunShow, Show
from sweep.web.twin import Twin

STATIC = Path(__file__).parent / "static"
TYPES = {".html": "text/html", ".js": "text/javascript", ".css": "text/css"}
HERE = "127.0.0.1"
NAMES = ("127.0.0.1", "localhost", "[::1]")
HEADERS = {
    "Content-Security-Policy": (
        "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self';"
        " img-src 'self' blob: data:; base-uri 'none';"
        " form-action 'none'; frame-ancestors 'none'"
    ),
    "Cache-Control": "no-store",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}
NOT_FOUND = (
    "not found: each server has an address of its own; open the one that sweep view has"
    " printed last"
)
MOST_SESSIONS = 16
KEPT_SECONDS = 600
"""How long a session waits for its page to come back."""
PATIENCE = 1.0
"""Seconds after which a page is told what it waits for."""
TAKEN, REFUSED = 4001, 4002
"""Codes with which the server closes a socket for good: another window took the session
over, or there is no session for this page.
"""


Pairs = Sequence[tuple[str, str]]
"""The names and values of a query, in their order; a name may stand several times."""


def _nothing_stored(study: str, trial: str) -> RunShow:
    raise SpecError(f"there is no stored trial {trial} of {study} on this page")


class PageSite(NamedTuple):
    """What a server has besides the page of the simulator.

    home     the file that its address shows
    answers  what it knows, by the names of questions: a function of the query of a GET,
             which returns plain data; a UserError that it raises is the answer too
    stored   the run of a stored trial, by its study and its id
    launcher launches what a page proposes; None where pages only read
    """

    home: str = "index.html"
    answers: Mapping[str, Callable[[Pairs], Any]] = {}
    stored: Callable[[str, str], RunShow] = _nothing_stored
    launcher: Launcher | None = None


class Socket:
    """A WebSocket as the line to a page."""

    def __init__(self, socket: WebSocket) -> None:
        self.socket = socket

    async def hear(self) -> str:
        """The next message. A binary one becomes the empty text, which is refused
        later.
        """
        event = await self.socket.receive()
        if event["type"] == "websocket.disconnect":
            raise ConnectionError("the page is gone")
        return event.get("text") or ""

    async def tell(self, reply: Reply) -> None:
        """Send a message."""
        await self._send(self.socket.send_text(write(reply)))

    async def show(self, frame: bytes) -> None:
        """Send a frame."""
        await self._send(self.socket.send_bytes(frame))

    async def _send(self, sending: Awaitable[None]) -> None:
        try:
            await sending
        except (WebSocketDisconnect, RuntimeError, OSError):
            raise ConnectionError("the page is gone") from None


class Rooms:
    """The sessions, by the names of their pages. If a page is gone, its session is kept
    for some minutes.
    """

    def __init__(
        self,
        begin: Callable[[], Show],
        stored: Callable[[str, str], RunShow] = _nothing_stored,
    ) -> None:
        self.begin, self.stored = begin, stored
        self.players: dict[str, Player] = {}

    async def player(self, hello: Hello, line: Socket) -> Player:
        """The player of this page; a new page gets a new one, with what it has kept.
        Raises SpecError where there are too many.
        """
        page = hello.page
        if page not in self.players:
            self._make_room()
            begin = partial(self._begin, hello)
            making = asyncio.create_task(asyncio.to_thread(begin))
            if not (await asyncio.wait({making}, timeout=PATIENCE))[0]:
                await line.tell(
                    {
                        "type": "info",
                        "message": (
                            "compiling, which takes up to a minute the first time"
                        ),
                    }
                )
            show = await making
            if hello.yaml or hello.kept_trial:
                try:
                    show = await asyncio.to_thread(_restored, show, hello)
                except UserError as error:
                    said = f"what this page has kept cannot be shown: {error}"
                    await line.tell({"type": "error", "message": said})
            self._make_room()
            self.players.setdefault(page, Player(show))
        return self.players[page]

    def _begin(self, hello: Hello) -> Show:
        if not hello.trial:
            return self.begin()
        run = self.stored(hello.study, hello.trial)
        if not hello.beside:
            return run
        return Twin(run, self.stored(hello.study, hello.beside))

    def _make_room(self) -> None:
        """Forget the sessions whose pages did not come back in time. If there are still
        too many, forget the one whose page left first.
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
            raise SpecError(f"{MOST_SESSIONS} pages are open already; close one")


class PageServer:
    """Serves the Show that `begin` makes for each page, at `url`, and what `site` has
    besides; and at `start` the page with the demos, which open in the page at `url`.
    Raises SpecError if the port is not free.
    """

    def __init__(
        self, begin: Callable[[], Show], port: int = 0, site: PageSite | None = None
    ) -> None:
        self.site = site or PageSite()
        self.rooms = Rooms(begin, self.site.stored)
        launcher = self.site.launcher
        self.answers = {**self.site.answers, "launch": lambda _: state_of(launcher)}
        self.actions = actions(launcher)
        self.token = _token(port)
        self.socket = _bound(port)
        self.url = f"http://{HERE}:{self.socket.getsockname()[1]}/{self.token}/"
        self.start = f"{self.url}start.html"
        self.flying = asyncio.Lock()
        routes = [
            Route("/{token}/demos", self._demos),
            Route("/{token}/demos/{name}", self._moving),
            Route("/{token}/ask/{question}", self._answer),
            Route("/{token}/do/{action}", self._act, methods=["POST"]),
            WebSocketRoute("/{token}/socket", self._talk),
            Route("/{token}/", self._file),
            Route("/{token}/{file}", self._file),
        ]
        self._server = uvicorn.Server(
            uvicorn.Config(
                Starlette(routes=routes),
                http="h11",
                ws="websockets-sansio",
                loop="asyncio",
                ws_max_size=MOST_BYTES,
                ws_per_message_deflate=False,
                lifespan="off",
                log_level="warning",
                access_log=False,
                server_header=False,
                timeout_graceful_shutdown=1,
            )
        )

    def run(self) -> None:
        """Serve until `stop`, or Ctrl-C."""
        self._server.run(sockets=[self.socket])

    def stop(self) -> None:
        """End `run`, from any thread."""
        self._server.should_exit = True

    def _admits(self, connection: HTTPConnection) -> bool:
        """Whether the connection has the token, and addresses this machine by its own
        name.
        """
        name, _, port = connection.headers.get("host", "").rpartition(":")
        token = str(connection.path_params["token"])
        return (
            name in NAMES
            and port.isdecimal()
            and hmac.compare_digest(token.encode(), self.token.encode())
        )

    async def _file(self, request: Request) -> Response:
        """A file of the page."""
        name = request.path_params.get("file", self.site.home)
        files = {path.name: path for path in STATIC.iterdir() if path.suffix in TYPES}
        if not self._admits(request) or name not in files:
            return Response(NOT_FOUND, 404, HEADERS, "text/plain")
        return Response(
            files[name].read_bytes(), 200, HEADERS, TYPES[files[name].suffix]
        )

    async def _answer(self, request: Request) -> Response:
        """What the site knows, as JSON; or why it is not told, as `error`."""
        answer = self.answers.get(request.path_params["question"])
        if not self._admits(request) or answer is None:
            return Response(NOT_FOUND, 404, HEADERS, "text/plain")
        try:
            pairs = request.query_params.multi_items()
            return JSONResponse(await asyncio.to_thread(answer, pairs), 200, HEADERS)
        except UserError as error:
            return JSONResponse({"error": str(error)}, 400, HEADERS)

    async def _act(self, request: Request) -> Response:
        """Do what the page asks for, and answer with JSON; or why not, as `error`. Only
        a script of the page itself can ask, and says so by Origin.
        """
        act = self.actions.get(request.path_params["action"])
        ours = request.headers.get("origin") == _origin(request)
        if not self._admits(request) or not ours or act is None:
            return Response(NOT_FOUND, 404, HEADERS, "text/plain")
        try:
            body = await _object(request)
            return JSONResponse(await asyncio.to_thread(act, body), 200, HEADERS)
        except (UserError, MessageError) as error:
            return JSONResponse({"error": str(error)}, 400, HEADERS)

    async def _demos(self, request: Request) -> Response:
        """All demos, for the start page."""
        if not self._admits(request):
            return Response(NOT_FOUND, 404, HEADERS, "text/plain")
        return _data({"demos": [demo.entry() for demo in DEMOS.values()]})

    async def _moving(self, request: Request) -> Response:
        """The moving picture of a demo. One after the other is flown, in a thread."""
        name = request.path_params["name"]
        if not self._admits(request) or name not in DEMOS:
            return Response(NOT_FOUND, 404, HEADERS, "text/plain")
        try:
            async with self.flying:
                return _data(await asyncio.to_thread(moving, name))
        except asyncio.CancelledError:  # the server ends before it
            return Response("", 503, HEADERS)

    async def _talk(self, websocket: WebSocket) -> None:
        """The conversation with a page, from its hello on."""
        ours = websocket.headers.get("origin") == _origin(websocket)
        if not self._admits(websocket) or not ours:
            await websocket.close()
            return
        await websocket.accept()
        with suppress(ConnectionError):
            await websocket.close(await self._serve(Socket(websocket)))

    async def _serve(self, line: Socket) -> int:
        """Play to a page after its hello. Returns the code with which its socket is
        closed.
        """
        try:
            player = await self.rooms.player(await _hello(line), line)
        except UserError as error:
            await line.tell({"type": "error", "message": str(error)})
            return REFUSED
        taken = await player.play(line)
        if not taken:
            raise ConnectionError("the page is gone")
        return TAKEN


def _restored(show: Show, hello: Hello) -> Show:
    """The show of what a page has kept: one run, or two. Raises a UserError for what
    cannot be shown.
    """
    show.restore(hello)
    if not hello.yaml_beside:
        return show
    first = show.side(0)
    second = first.beside("")
    second.restore(hello.of_second)
    return Twin(first, second)


def _origin(connection: HTTPConnection) -> str:
    """What a script of the page itself has as its origin."""
    return "http://" + connection.headers.get("host", "")


async def _object(request: Request) -> Any:
    """The JSON that a page sends. Raises MessageError where it is none, or too long."""
    if request.headers.get("content-type") != "application/json":
        raise MessageError("a message must be application/json")
    content = b""
    async for part in request.stream():
        content += part
        if len(content) > MOST_BYTES:
            raise MessageError(f"a message has at most {MOST_BYTES:,} bytes")
    try:
        return json.loads(content)
    except (ValueError, RecursionError):
        raise MessageError("a message must be JSON") from None


def _data(reply: Reply) -> Response:
    return Response(write(reply), 200, HEADERS, "application/json")


async def _hello(line: Socket) -> Hello:
    """The first message of the page."""
    while True:
        try:
            message = parse(await line.hear())
            if isinstance(message, Hello):
                return message
            raise MessageError("the first message of a page must be hello")
        except MessageError as error:
            await line.tell({"type": "error", "message": str(error)})


def _token(port: int) -> str:
    """The secret in the address. At a port that the user has chosen it is always the
    same, so that a page finds the server again that was started anew.
    """
    if port == 0:
        return secrets.token_urlsafe(16)
    sealed = hmac.digest(own_key(), f"page at port {port}".encode(), "sha256")
    return base64.urlsafe_b64encode(sealed[:16]).decode().rstrip("=")


def _bound(port: int) -> socket.socket:
    # Without the protocol asyncio leaves Nagle's algorithm on, which holds every second
    # small message back for 40 ms.
    bound = socket.socket(socket.AF_INET, socket.SOCK_STREAM, socket.IPPROTO_TCP)
    # A port that was just left is free again. By the same option Windows would let
    # another program share the port, and has one against that.
    alone = getattr(socket, "SO_EXCLUSIVEADDRUSE", socket.SO_REUSEADDR)
    bound.setsockopt(socket.SOL_SOCKET, alone, 1)
    try:
        bound.bind((HERE, port))
        bound.listen()
    except OSError as error:
        bound.close()
        raise SpecError(
            f"port {port} cannot be used ({error.strerror}); --port 0 takes a free one"
        ) from None
    return bound
