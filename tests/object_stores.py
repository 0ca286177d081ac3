"""A real S3-compatible server in a process of its own, and buckets in it."""

import http.client
import io
import socket
import socketserver
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from typing import ClassVar

import pyarrow as pa
from pyarrow import fs

from sweep.storing.locations import ObjectPath, location

CREDENTIALS = {
    "AWS_ACCESS_KEY_ID": "key",
    "AWS_SECRET_ACCESS_KEY": "secret",
    "AWS_REGION": "us-east-1",
    "AWS_EC2_METADATA_DISABLED": "true",
}


def free_port() -> int:
    """A port that nobody listens at."""
    with socket.socket() as made:
        made.bind(("127.0.0.1", 0))
        port: int = made.getsockname()[1]
        return port


@dataclass
class ObjectStore:
    """moto's server at a port of this machine, which can be stopped and started; what it holds is in its memory."""

    port: int = field(default_factory=free_port)
    process: "subprocess.Popen[bytes] | None" = None

    def start(self) -> None:
        """Start it, and wait until it answers."""
        command = [sys.executable, "-m", "moto.server", "-H", "127.0.0.1", "-p", str(self.port)]
        self.process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        deadline = time.monotonic() + 60
        while True:
            with suppress(OSError):
                self.request("GET", "/")
                return
            assert self.process.poll() is None
            assert time.monotonic() < deadline
            time.sleep(0.05)

    def stop(self) -> None:
        """End it, at once."""
        if self.process:
            self.process.kill()
            self.process.wait()

    def request(self, method: str, path: str) -> int:
        """The status of an answer."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=30)
        connection.request(method, path, headers={"Content-Length": "0"})
        status = connection.getresponse().status
        connection.close()
        return status

    def url(self, bucket: str) -> str:
        """The place of results in a bucket, which is made."""
        assert self.request("PUT", f"/{bucket}") in (200, 409)
        return f"s3://{bucket}/results?endpoint_override=127.0.0.1:{self.port}&scheme=http"

    def results(self, bucket: str) -> ObjectPath:
        """The same, ready to be used."""
        place = location(self.url(bucket))
        assert isinstance(place, ObjectPath)
        return place


class Crashed(BaseException):
    """The process has ended here: no request follows."""


class Memory:
    """The calls of pyarrow's file system that a store makes, on a dictionary; after `allowed` requests it is over.

    Like pyarrow it deletes what is below a prefix by several requests, here one for each object, in no good order.
    """

    def __init__(self) -> None:
        self.objects: dict[str, bytes] = {}
        self.allowed = sys.maxsize
        self.requests = 0

    def _ask(self, _key: str) -> None:
        """A request begins, for an object, or for those below a prefix that ends in a slash."""
        if self.requests >= self.allowed:
            raise Crashed
        self.requests += 1

    def _found(self, key: str) -> fs.FileInfo:
        if key in self.objects:
            return fs.FileInfo(key, fs.FileType.File, mtime_ns=0, size=len(self.objects[key]))
        return fs.FileInfo(key, fs.FileType.NotFound if "/" in key else fs.FileType.Directory)

    def get_file_info(self, what: "str | fs.FileSelector") -> "fs.FileInfo | list[fs.FileInfo]":
        self._ask(what if isinstance(what, str) else f"{what.base_dir}/")
        if isinstance(what, str):
            return self._found(what)
        return [self._found(key) for key in sorted(self.objects) if key.startswith(f"{what.base_dir}/")]

    def open_input_file(self, key: str) -> pa.BufferReader:
        self._ask(key)
        if key not in self.objects:
            raise FileNotFoundError(key)
        return pa.BufferReader(self.objects[key])

    open_input_stream = open_input_file

    @contextmanager
    def open_output_stream(self, key: str) -> Iterator[io.BytesIO]:
        self._ask(key)
        content = io.BytesIO()
        yield content
        self.objects[key] = content.getvalue()

    def copy_file(self, key: str, target: str) -> None:
        self._ask(key)
        if key not in self.objects:
            raise FileNotFoundError(key)
        self.objects[target] = self.objects[key]

    def delete_file(self, key: str) -> None:
        self._ask(key)
        if self.objects.pop(key, None) is None:
            raise FileNotFoundError(key)

    def delete_dir(self, key: str) -> None:
        for one in sorted(self.objects, reverse=True):
            if one.startswith(f"{key}/"):
                self._ask(one)
                self.objects.pop(one, None)


class Line:
    """A port of this machine that leads to another, and can be cut and mended: then nobody listens at it."""

    def __init__(self, target: int) -> None:
        self.port = free_port()
        self.target = target
        self.server: socketserver.ThreadingTCPServer | None = None

    def mend(self) -> None:
        """Let everything through again."""
        target = self.target

        class Handler(socketserver.BaseRequestHandler):
            def handle(self) -> None:
                with socket.create_connection(("127.0.0.1", target)) as onward, suppress(OSError):
                    back = threading.Thread(target=_pour, args=(onward, self.request), daemon=True)
                    back.start()
                    _pour(self.request, onward)
                    back.join()

        class Server(socketserver.ThreadingTCPServer):
            allow_reuse_address = True
            daemon_threads = True
            connections: ClassVar[list[socket.socket]] = []

            def get_request(self) -> tuple[socket.socket, object]:
                connection, address = super().get_request()
                self.connections.append(connection)
                return connection, address

        self.server = Server(("127.0.0.1", self.port), Handler)
        threading.Thread(target=self.server.serve_forever, args=(0.01,), daemon=True).start()

    def cut(self) -> None:
        """Refuse new connections, and end those that there are."""
        if self.server:
            self.server.shutdown()
            self.server.server_close()
            for connection in self.server.connections:
                with suppress(OSError):
                    connection.shutdown(socket.SHUT_RDWR)
            self.server = None


def _pour(source: socket.socket, target: socket.socket) -> None:
    """Pass on what comes, until there is no more."""
    with suppress(OSError):
        while content := source.recv(65536):
            target.sendall(content)
    with suppress(OSError):
        target.shutdown(socket.SHUT_WR)
