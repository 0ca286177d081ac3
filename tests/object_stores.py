"""A real S3-compatible server in a process of its own, and buckets in it."""

import http.client
import io
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import pyarrow as pa
import pytest
from pyarrow import fs

from sweep.store.locations import ObjectPath, location
from tests.patience import PATIENCE

CREDENTIALS = {
    "AWS_ACCESS_KEY_ID": "key",
    "AWS_SECRET_ACCESS_KEY": "secret",
    "AWS_REGION": "us-east-1",
    "AWS_EC2_METADATA_DISABLED": "true",
}


SERVER = """
from moto.server import ThreadedMotoServer
server = ThreadedMotoServer("127.0.0.1", 0, verbose=False)
server.start()
print(server.get_host_and_port()[1], flush=True)
server._thread.join()
"""


class ObjectStore:
    """moto's server at a free port of this machine; what it holds is in its memory."""

    def __init__(self) -> None:
        command = [sys.executable, "-c", SERVER]
        self.process = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
        )
        assert self.process.stdout is not None
        self.port = int(self.process.stdout.readline())

    def stop(self) -> None:
        """End it, at once."""
        self.process.kill()
        self.process.communicate()

    def request(self, method: str, path: str) -> int:
        """The status of an answer."""
        connection = http.client.HTTPConnection(
            "127.0.0.1", self.port, timeout=PATIENCE
        )
        connection.request(method, path, headers={"Content-Length": "0"})
        status = connection.getresponse().status
        connection.close()
        return status

    def url(self, bucket: str, port: int | None = None) -> str:
        """The place of results in a bucket, which is made; over a line to the server
        where its port is given.
        """
        assert self.request("PUT", f"/{bucket}") in (200, 409)
        server = f"127.0.0.1:{port or self.port}"
        return f"s3://{bucket}/results?endpoint_override={server}&scheme=http"

    def results(self, bucket: str, port: int | None = None) -> ObjectPath:
        """The same, ready to be used."""
        place = location(self.url(bucket, port))
        assert isinstance(place, ObjectPath)
        return place


@contextmanager
def object_store() -> Iterator[ObjectStore]:
    """A server, and the variables that are needed to use it."""
    with pytest.MonkeyPatch.context() as patch:
        for name, value in CREDENTIALS.items():
            patch.setenv(name, value)
        started = ObjectStore()
        try:
            yield started
        finally:
            started.stop()


class Crashed(BaseException):
    """The process has ended here: no request follows."""


class Memory:
    """The calls of pyarrow's file system that a store makes, on a dictionary; after
    `allowed` requests it is over.

    Like pyarrow it deletes what is below a prefix by several requests, here one for
    each object, in no good order.
    """

    def __init__(self) -> None:
        self.objects: dict[str, bytes] = {}
        self.allowed = sys.maxsize
        self.requests = 0

    def _ask(self, *_keys: str, writes: bool = False) -> None:  # noqa: ARG002
        """Begin a request for objects, or for those below a prefix that ends in a
        slash. A subclass may ask whether it writes.
        """
        if self.requests >= self.allowed:
            raise Crashed
        self.requests += 1

    def _found(self, key: str) -> fs.FileInfo:
        if key in self.objects:
            return fs.FileInfo(
                key, fs.FileType.File, mtime_ns=0, size=len(self.objects[key])
            )
        return fs.FileInfo(
            key, fs.FileType.NotFound if "/" in key else fs.FileType.Directory
        )

    def get_file_info(
        self, what: "str | fs.FileSelector"
    ) -> "fs.FileInfo | list[fs.FileInfo]":
        self._ask(what if isinstance(what, str) else f"{what.base_dir}/")
        if isinstance(what, str):
            return self._found(what)
        return [
            self._found(key)
            for key in sorted(self.objects)
            if key.startswith(f"{what.base_dir}/")
        ]

    def open_input_file(self, key: str) -> pa.BufferReader:
        self._ask(key)
        if key not in self.objects:
            raise FileNotFoundError(key)
        return pa.BufferReader(self.objects[key])

    open_input_stream = open_input_file

    @contextmanager
    def open_output_stream(self, key: str) -> Iterator[io.BytesIO]:
        self._ask(key, writes=True)
        content = io.BytesIO()
        yield content
        self.objects[key] = content.getvalue()

    def copy_file(self, key: str, target: str) -> None:
        self._ask(key, target, writes=True)
        if key not in self.objects:
            raise FileNotFoundError(key)
        self.objects[target] = self.objects[key]

    def delete_file(self, key: str) -> None:
        self._ask(key, writes=True)
        if self.objects.pop(key, None) is None:
            raise FileNotFoundError(key)

    def delete_dir(self, key: str) -> None:
        self._ask(f"{key}/")
        for one in sorted(self.objects, reverse=True):
            if one.startswith(f"{key}/"):
                self._ask(one, writes=True)
                self.objects.pop(one, None)
