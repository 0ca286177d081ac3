"""A line to a server of this machine, on which whatever can happen to a network does.

What happens is decided by counting, connections and packets, never by a clock: so the
same test does the same on any machine.
"""

import socket
import socketserver
import threading
from collections.abc import Callable
from contextlib import suppress

HERE = "127.0.0.1"
PACKET_BYTES = 65536


class Line:
    """A port of this machine that leads to another, `target`, which may be changed.

    At first it is cut: nobody listens at it, but the port stays ours. `greets` is asked
    about each connection, counted from 1, and closes it by False; `passes` is called
    for each packet, counted from 1, before that is passed on: it may take its time, and
    cut.
    """

    def __init__(self, target: int = 0) -> None:
        self._held = socket.socket()
        self._held.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
        self._held.bind((HERE, 0))
        self.port: int = self._held.getsockname()[1]
        self.target = target
        self.greets: Callable[[int], bool] = lambda _: True
        self.passes: Callable[[int], None] = lambda _: None
        self.greeted = self.passed = 0
        self._counting = threading.Lock()
        self._connections: set[socket.socket] = set()
        self._server: socketserver.ThreadingTCPServer | None = None

    def mend(self) -> "Line":
        """Let everything through again."""
        line = self

        class Handler(socketserver.BaseRequestHandler):
            def handle(self) -> None:
                line.answer(self.request)

        class Server(socketserver.ThreadingTCPServer):
            allow_reuse_port = True
            daemon_threads = True
            request_queue_size = 128

        self._server = Server((HERE, self.port), Handler)
        serving = threading.Thread(
            target=self._server.serve_forever, args=(0.01,), daemon=True
        )
        serving.start()
        return self

    def cut(self) -> None:
        """Refuse new connections, and end those that there are."""
        if self._server:
            self._server.shutdown()
            self._server.server_close()
            self._server = None
        self.reset()

    def reset(self) -> None:
        """End all connections that there are."""
        with self._counting:
            connections, self._connections = self._connections, set()
        for connection in connections:
            with suppress(OSError):
                connection.shutdown(socket.SHUT_RDWR)

    def close(self) -> None:
        """Cut it, and give the port back."""
        self.cut()
        self._held.close()

    def answer(self, caller: socket.socket) -> None:
        """Pass on what comes on a new connection, both ways, until it ends."""
        with self._counting:
            self.greeted += 1
            number = self.greeted
            self._connections.add(caller)
        if self.greets(number):
            self.talk(caller)
        with self._counting:
            self._connections.discard(caller)

    def talk(self, caller: socket.socket) -> None:
        """What becomes of a connection that is greeted."""
        with suppress(OSError), socket.create_connection((HERE, self.target)) as server:
            back = threading.Thread(
                target=self._pour, args=(server, caller), daemon=True
            )
            back.start()
            self._pour(caller, server)
            back.join()

    def count(self) -> int:
        """The number of the packet that passes now."""
        with self._counting:
            self.passed += 1
            return self.passed

    def _pour(self, source: socket.socket, target: socket.socket) -> None:
        with suppress(OSError):
            while content := source.recv(PACKET_BYTES):
                self.passes(self.count())
                target.sendall(content)
        with suppress(OSError):
            target.shutdown(socket.SHUT_WR)
