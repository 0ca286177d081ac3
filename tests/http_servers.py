"""An HTTP server in a thread of the test, whose answers the test writes."""

import http.server
import threading
from collections.abc import Callable

Request = http.server.BaseHTTPRequestHandler
Answer = Callable[[Request], None]


class HttpServer:
    """Passes each request of any method to `answer`, at a free port of this machine."""

    def __init__(self, answer: Answer) -> None:
        class Handler(http.server.BaseHTTPRequestHandler):
            protocol_version = "HTTP/1.1"

            def do_GET(self) -> None:
                answer(self)

            do_PUT = do_POST = do_HEAD = do_DELETE = do_GET  # noqa: N815

            def log_message(self, *_: object) -> None:
                pass

        self._server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self._server.daemon_threads = True
        threading.Thread(
            target=self._server.serve_forever, args=(0.01,), daemon=True
        ).start()
        self.port = self._server.server_port

    def close(self) -> None:
        """End it; what is being answered may still be on its way."""
        self._server.shutdown()
        self._server.server_close()
