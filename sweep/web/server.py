"""Serves the page, to this machine alone.

Only those who know the token in the address may open it. A page from elsewhere is
refused: the header Host must be a name of this machine, and the Origin of a socket must
be the page itself.
"""

import asyncio
import hmac
import secrets
import socket
import time
from collections.abc import Awaitable, Callable
from contextlib import suppress
from pathlib import Path

import uvicorn
from starlette.applications import Starlette
from starlette.requests import HTTPConnection, Request
from starlette.responses import Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from sweep.errors import SpecError, UserError
from sweep.web.messages import Hello
from sweep.web.playing import Player
from sweep.web.protocol import MOST_BYTES, MessageError, Reply, parse, write
from sweep.web.show import Show

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
MOST_SESSIONS = 16
KEPT_SECONDS = 600
"""How long a session waits for its page to come back."""
PATIENCE = 1.0
"""Seconds after which a page is told what it waits for."""
TAKEN, REFUSED = 4001, 4002
"""Codes with which the server closes a socket for good: another window took the session
over, or there is no session for this page.
"""


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

    def __init__(self, begin: Callable[[], Show]) -> None:
        self.begin = begin
        self.players: dict[str, Player] = {}

    async def player(self, page: str, line: Socket) -> Player:
        """The player of this page; a new page gets a new one. Raises SpecError where
        there are too many.
        """
        if page not in self.players:
            self._make_room()
            making = asyncio.create_task(asyncio.to_thread(self.begin))
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
            self._make_room()
            self.players.setdefault(page, Player(show))
        return self.players[page]

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
    """Serves the Show that `begin` makes for each page, at `url`. Raises SpecError if
    the port is not free.
    """

    def __init__(self, begin: Callable[[], Show], port: int = 0) -> None:
        self.rooms = Rooms(begin)
        self.token = secrets.token_urlsafe(16)
        self.socket = _bound(port)
        self.url = f"http://{HERE}:{self.socket.getsockname()[1]}/{self.token}/"
        routes = [
            Route("/{token}/", self._file),
            Route("/{token}/{file}", self._file),
            WebSocketRoute("/{token}/socket", self._talk),
        ]
        self._server = uvicorn.Server(
            uvicorn.Config(
                Starlette(routes=[routes[2], *routes[:2]]),
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
        name = request.path_params.get("file", "index.html")
        files = {path.name: path for path in STATIC.iterdir() if path.suffix in TYPES}
        if not self._admits(request) or name not in files:
            return Response("not found", 404, HEADERS, "text/plain")
        return Response(
            files[name].read_bytes(), 200, HEADERS, TYPES[files[name].suffix]
        )

    async def _talk(self, websocket: WebSocket) -> None:
        """The conversation with a page, from its hello on."""
        origin = "http://" + websocket.headers.get("host", "")
        if not self._admits(websocket) or websocket.headers.get("origin") != origin:
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


async def _hello(line: Socket) -> str:
    """The name that the page gives itself in its first message."""
    while True:
        try:
            message = parse(await line.hear())
            if isinstance(message, Hello):
                return message.page
            raise MessageError("the first message of a page must be hello")
        except MessageError as error:
            await line.tell({"type": "error", "message": str(error)})


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
