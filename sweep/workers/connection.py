"""A connection to the scheduler of a dask cluster.

It is made within a time limit, and never renewed without our knowing. dask itself has
no time limit for the greeting, so a launch would wait for ever at a port where
something else listens. And dask's client renews a cut connection, which has then lost
its subscriptions. A connection here is one stream: when it is cut it is over, and the
caller makes another to continue.

Whoever reaches a scheduler can run code on its workers, and here: messages of dask are
pickles. With `tls://` each side proves by a certificate that it belongs here; without,
only the network keeps others away.
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
    """No connection can be made in this way, however often it is tried."""


class Connection:
    """An open connection to a scheduler.

    Parameters
    ----------
    address : str or None
        Where the scheduler answers.
    scheduler_file : str or None
        File in which the scheduler has written its address; needed without `address`.
    seconds : float
        About how long to try.

    Raises
    ------
    OSError
        If no connection is made within that time: another attempt may succeed.
    ConnectionImpossibleError
        If none can be made.
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
        """Return whether the scheduler is there, as far as is known."""
        stream = self.client.scheduler_comm
        same = stream is self._stream and not stream.closed()
        return same and self.client.status == "running"

    def close(self) -> None:
        """Close the connection; the scheduler then cancels what we asked of it."""
        with suppress(Exception):  # a client may just be failing to connect anew
            self.client.close(timeout=CLOSE_SECONDS)
        self.client.status = "closed"  # or it tried once more when it is collected
        self._loop.end()


class _EventLoop:
    """A thread with an event loop, which ends with all that is left in it.

    A loop that dask's client makes for itself stays for ever where connecting fails.
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
        """Run a coroutine on the connection's loop, and return its result."""
        return asyncio.run_coroutine_threadsafe(work, self._loop).result()

    def end(self) -> None:
        """End the loop, whatever runs there."""
        with suppress(RuntimeError):  # it has ended before
            self._loop.call_soon_threadsafe(self._over.set)
        self._thread.join(CLOSE_SECONDS)


def _close_streams() -> None:
    """Close the connections that were given up during the greeting: dask forgets them.

    It looks through the handlers of the loop for objects that can be closed.
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

    # dask reports a lost connection in many lines; we report it in one.
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
    # dask may read words of another protocol as a length: this is no lack of memory.
    if isinstance(error, MemoryError):
        return "something else than a scheduler of dask answers there"
    message = " ".join(str(error).split())
    cause = str(error.__cause__ or "")
    why = cause.rpartition(">: ")[2]  # without the address of an object of dask's
    return f"{message} ({why})" if why else message or "nothing answers"


def exposed(address: str) -> bool:
    """Return whether messages to an address leave this machine as plain text."""
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
