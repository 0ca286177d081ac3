"""The server of the page, to this machine alone.

Only users who know the token in the address may open the page. Pages of other servers
are rejected: the header Host must be a name of this machine, and the Origin of a socket
must be the page.
"""

import asyncio
import base64
import hmac
import json
import secrets
import socket
from collections.abc import Awaitable, Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeVar

import uvicorn
from starlette.applications import Starlette
from starlette.requests import ClientDisconnect, HTTPConnection, Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from sweep.errors import SpecError, UserError
from sweep.store import own_key
from sweep.web.demo import DEMOS, kept
from sweep.web.launching import actions
from sweep.web.protocol import MOST_BYTES, MessageError, Reply, write
from sweep.web.rooms import PageSite, Rooms
from sweep.web.show import Show

R = TypeVar("R")
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
    "not found: each server has a new address; open the last address that sweep view"
    " has printed"
)


class Socket:
    """A WebSocket as the line to a page."""

    def __init__(self, socket: WebSocket) -> None:
        self.socket = socket

    async def hear(self) -> str:
        """Return the next message.

        A binary message becomes the empty string, which is rejected later.
        """
        event = await _there(self.socket.receive())
        if event["type"] == "websocket.disconnect":
            raise ConnectionError("the page is gone")
        return event.get("text") or ""

    async def tell(self, reply: Reply) -> None:
        """Send a message."""
        await _there(self.socket.send_text(write(reply)))

    async def show(self, frame: bytes) -> None:
        """Send a frame."""
        await _there(self.socket.send_bytes(frame))


class PageServer:
    """The server of a Show for each page.

    The pages are at `url`. The page at `start` has the demos, which open at `url`.

    Parameters
    ----------
    begin : callable
        Returns the Show of a new page.
    port : int, default 0
        Port of the server; 0 takes a free port.
    site : PageSite, optional
        The content of the server in addition to the simulator.

    Raises
    ------
    SpecError
        If the port is not free.
    """

    def __init__(
        self, begin: Callable[[], Show], port: int = 0, site: PageSite | None = None
    ) -> None:
        self.site = site or PageSite()
        self.rooms = Rooms(begin, self.site.stored)
        self.answers = self.site.questions
        self.actions = actions(self.site.launcher)
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
        self.app = Starlette(routes=routes)
        self._server = uvicorn.Server(
            uvicorn.Config(
                self.app,
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
        """Return whether a connection has the token, and this machine as the host."""
        name, _, port = connection.headers.get("host", "").rpartition(":")
        token = str(connection.path_params["token"])
        return (
            name in NAMES
            and port.isdecimal()
            and hmac.compare_digest(token.encode(), self.token.encode())
        )

    async def _file(self, request: Request) -> Response:
        """Return a file of the page."""
        name = request.path_params.get("file", self.site.home)
        files = {path.name: path for path in STATIC.iterdir() if path.suffix in TYPES}
        if not self._admits(request) or name not in files:
            return Response(NOT_FOUND, 404, HEADERS, "text/plain")
        return Response(
            files[name].read_bytes(), 200, HEADERS, TYPES[files[name].suffix]
        )

    async def _answer(self, request: Request) -> Response:
        """Return the answer of the site as JSON, or `error` with the reason."""
        answer = self.answers.get(request.path_params["question"])
        if not self._admits(request) or answer is None:
            return Response(NOT_FOUND, 404, HEADERS, "text/plain")
        try:
            pairs = request.query_params.multi_items()
            return JSONResponse(await asyncio.to_thread(answer, pairs), 200, HEADERS)
        except UserError as error:
            return JSONResponse({"error": str(error)}, 400, HEADERS)

    async def _act(self, request: Request) -> Response:
        """Act on a request of the page, and answer with JSON, or with `error`.

        Only a script of the page can send the request; the header Origin is the proof.
        """
        act = self.actions.get(request.path_params["action"])
        ours = request.headers.get("origin") == _origin(request)
        if not self._admits(request) or not ours or act is None:
            return Response(NOT_FOUND, 404, HEADERS, "text/plain")
        try:
            body = await _object(request)
            return JSONResponse(await asyncio.to_thread(act, body), 200, HEADERS)
        except ClientDisconnect:  # the page is gone before the end of the request
            return Response("", 400, HEADERS)
        except (UserError, MessageError) as error:
            return JSONResponse({"error": str(error)}, 400, HEADERS)

    async def _demos(self, request: Request) -> Response:
        """Return all demos, for the start page."""
        if not self._admits(request):
            return Response(NOT_FOUND, 404, HEADERS, "text/plain")
        return _json(write({"demos": [demo.entry() for demo in DEMOS.values()]}))

    async def _moving(self, request: Request) -> Response:
        """Return the animation of a demo. Demos run in sequence, in a thread."""
        name = request.path_params["name"]
        if not self._admits(request) or name not in DEMOS:
            return Response(NOT_FOUND, 404, HEADERS, "text/plain")
        try:
            async with self.flying:
                return _json(await asyncio.to_thread(kept, name))
        except asyncio.CancelledError:  # the server ends before the demo
            return Response("", 503, HEADERS)

    async def _talk(self, websocket: WebSocket) -> None:
        """Hold the conversation with a page, from the hello message on."""
        ours = websocket.headers.get("origin") == _origin(websocket)
        with suppress(ConnectionError):
            if not self._admits(websocket) or not ours:
                await _there(websocket.close())
                return
            await _there(websocket.accept())
            code = await self.rooms.serve(Socket(websocket))
            await _there(websocket.close(code))


async def _there(work: Awaitable[R]) -> R:
    """Return the result of an operation of a socket.

    Raises ConnectionError if the page is gone, which can happen at any moment.
    starlette and uvicorn report the loss by several exceptions.
    """
    try:
        return await work
    except (WebSocketDisconnect, RuntimeError, OSError):
        raise ConnectionError("the page is gone") from None


def _origin(connection: HTTPConnection) -> str:
    """Return the origin of a script of the page."""
    return "http://" + connection.headers.get("host", "")


async def _object(request: Request) -> Any:
    """Return the JSON that a page sends.

    Raises MessageError if the content is not JSON, or too long.
    """
    if request.headers.get("content-type") != "application/json":
        raise MessageError("a message must be application/json")
    content = b""
    async for part in request.stream():
        content += part
        if len(content) > MOST_BYTES:
            raise MessageError(f"a message must have at most {MOST_BYTES:,} bytes")
    try:
        return json.loads(content)
    except (ValueError, RecursionError):
        raise MessageError("a message must be JSON") from None


def _json(content: bytes | str) -> Response:
    return Response(content, 200, HEADERS, "application/json")


def _token(port: int) -> str:
    """Return the secret in the address.

    At a port that the user has chosen the secret is constant, so that a page finds the
    server again after a restart.
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
            f"port {port} cannot be used ({error.strerror}); --port 0 takes a free port"
        ) from None
    return bound
