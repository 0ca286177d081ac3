"""A connection to the scheduler of a dask cluster.

The connection is made within a time limit, and is never renewed silently.

- dask has no time limit for the greeting: if another program listens at the port, a
  launch would wait forever.
- dask's client renews a cut connection, and thereby loses its subscriptions. A
  connection here is a single stream. After a cut, the caller makes a new connection.

Anybody with access to a scheduler can run code on its workers, and here: messages of
dask are pickles. With `tls://` each side proves by a certificate that it belongs to the
cluster. Without `tls://`, only the network protects the cluster.
"""

import asyncio
import ipaddress
import logging
import socket
from collections.abc import Coroutine
from concurrent.futures import Future
from contextlib import suppress
from threading import Thread
from typing import Any
from urllib.parse import urlsplit

GREETING_SECONDS = 1.0
CLOSE_SECONDS = 5.0
THREAD = "connection to a scheduler"


class ConnectionImpossibleError(Exception):
    """No connection can be made in this way, even after many attempts."""


class Connection:
    """An open connection to a scheduler.

    Parameters
    ----------
    address : str or None
        Address of the scheduler.
    scheduler_file : str or None
        File in which the scheduler has written its address; needed without `address`.
    seconds : float
        Approximate time to try.

    Raises
    ------
    OSError
        If there is no connection after that time: another attempt may succeed.
    ConnectionImpossibleError
        If no attempt can succeed.
    """

    def __init__(
        self, address: str | None, scheduler_file: str | None, seconds: float
    ) -> None:
        self._loop = _EventLoop()
        try:
            self.client = self._loop.do(_opened(address, scheduler_file, seconds))
        except BaseException:
            self._loop.end()
            raise
        self.address: str = self.client.scheduler.address
        self._stream = self.client.scheduler_comm

    def alive(self) -> bool:
        """Return whether the scheduler is connected, as far as is known."""
        stream = self.client.scheduler_comm
        same = stream is self._stream and not stream.closed()
        return same and self.client.status == "running"

    def close(self) -> None:
        """Close the connection; the scheduler then cancels the tasks of this client."""
        with suppress(Exception):  # a client may just be failing to connect again
            self.client.close(timeout=CLOSE_SECONDS)
        self.client.status = "closed"  # or it tried once more when it is collected
        self._loop.end()


class _EventLoop:
    """A thread with an event loop; all tasks in the loop end with the thread.

    An event loop made by dask's client remains forever if connecting fails.
    """

    def __init__(self) -> None:
        started: Future[asyncio.AbstractEventLoop] = Future()
        self._over = asyncio.Event()
        turn = self._turn(started)
        self._thread = Thread(
            target=asyncio.run, args=(turn,), name=THREAD, daemon=True
        )
        self._thread.start()
        self._loop = started.result()

    async def _turn(self, started: "Future[asyncio.AbstractEventLoop]") -> None:
        started.set_result(asyncio.get_running_loop())
        await self._over.wait()
        _close_streams()

    def do(self, work: "Coroutine[Any, Any, Any]") -> Any:
        """Run a coroutine on the connection's loop, and return the result."""
        return asyncio.run_coroutine_threadsafe(work, self._loop).result()

    def end(self) -> None:
        """End the loop and everything that runs there."""
        with suppress(RuntimeError):  # it has ended before
            self._loop.call_soon_threadsafe(self._over.set)
        self._thread.join(CLOSE_SECONDS)


def _close_streams() -> None:
    """Close connections that were given up during the greeting: dask forgets them.

    The connections are found among the handlers of the loop, as objects that can be
    closed.
    """
    from tornado.ioloop import IOLoop

    watched: Any = IOLoop.current()
    for _, watching in list(watched.handlers.values()):
        if close := getattr(getattr(watching, "__self__", None), "close", None):
            close()


async def _opened(
    address: str | None, scheduler_file: str | None, seconds: float
) -> Any:
    from distributed import Client
    from distributed.comm.core import FatalCommClosedError

    # dask reports a lost connection in many lines; boidsweep reports it in one.
    for name in ("distributed", "distributed.client"):
        logging.getLogger(name).setLevel(logging.CRITICAL)
    make: Any = Client
    client = None
    try:
        client = make(
            address,
            scheduler_file=scheduler_file,
            timeout=seconds,
            set_as_default=False,
            asynchronous=True,
        )
        return await asyncio.wait_for(client, seconds + GREETING_SECONDS)
    except Exception as error:
        if client is not None:
            with suppress(Exception):
                await client.close(timeout=CLOSE_SECONDS)
        if isinstance(error, FatalCommClosedError) or not isinstance(error, OSError):
            raise ConnectionImpossibleError(_reason(error)) from error
        raise OSError(_reason(error)) from error


def _reason(error: BaseException) -> str:
    """Return an error of dask in one line."""
    # dask may read words of another protocol as a length: memory is not the cause.
    if isinstance(error, MemoryError):
        return "the program that answers is not a dask scheduler"
    message = " ".join(str(error).split())
    cause = str(error.__cause__ or "")
    why = cause.rpartition(">: ")[2]  # without the address of an object of dask
    return f"{message} ({why})" if why else message or "no answer"


def exposed(address: str) -> bool:
    """Return whether messages to an address leave this machine unencrypted."""
    parts = urlsplit(address)
    if parts.scheme != "tcp" or parts.hostname is None:
        return False
    try:
        addresses = socket.getaddrinfo(parts.hostname, None, type=socket.SOCK_STREAM)
    except OSError:
        return True
    return not all(_is_ours(str(endpoint[0])) for *_, endpoint in addresses)


def _is_ours(host: str) -> bool:
    import psutil

    plain = host.partition("%")[0]
    own = {
        address.address.partition("%")[0]
        for addresses in psutil.net_if_addrs().values()
        for address in addresses
    }
    return ipaddress.ip_address(plain).is_loopback or plain in own
