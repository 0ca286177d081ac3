"""Collection of results until the store has a part of them."""

import time
from collections.abc import Callable, Iterable, Mapping
from types import TracebackType
from typing import Generic, TypeVar

import pyarrow as pa

from sweep.errors import StoreError
from sweep.store.store import Store

R = TypeVar("R")

MOST_BYTES = 256 * 2**20


class Writer(Generic[R]):
    """Context manager that collects results, and stores a part from time to time.

    A part is also stored when results take MOST_BYTES, and at the end of the context,
    even after an error. Results are held until the part is stored. An error reports the
    number of results that could not be stored. Many small parts are merged.

    Parameters
    ----------
    store : Store
        Store of the parts.
    build : callable
        Makes the tables of a list of results.
    size : callable, optional
        Returns the bytes that a result takes while it is held; by default 0.
    stored : callable, optional
        Called with results as soon as the part is on the disk.
    rows : int, default 1000
        Number of held results at which a part is stored.
    seconds : float, default 5.0
        Seconds since the last part after which the next one is stored.
    clock : callable, default time.monotonic
        Returns the seconds since any moment, never decreasing.
    """

    def __init__(
        self,
        store: Store,
        build: Callable[[list[R]], Mapping[str, pa.Table]],
        *,
        size: Callable[[R], int] = lambda _result: 0,
        stored: Callable[[list[R]], None] = lambda _results: None,
        rows: int = 1000,
        seconds: float = 5.0,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._store = store
        self._build = build
        self._size = size
        self._stored = stored
        self._rows = rows
        self._seconds = seconds
        self._clock = clock
        self._held: list[R] = []
        self._bytes = 0
        self._flushed = clock()

    def __enter__(self) -> "Writer[R]":
        self._flushed = self._clock()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.flush()

    def add(self, results: Iterable[R]) -> None:
        """Hold results, and store a part if a part is due."""
        for result in results:
            self._held.append(result)
            self._bytes += self._size(result)
        full = len(self._held) >= self._rows or self._bytes >= MOST_BYTES
        if full or self._clock() - self._flushed >= self._seconds:
            self.flush()

    def flush(self) -> None:
        """Store all held results."""
        if self._held:
            try:
                self._store.append(self._build(self._held))
            except StoreError as error:
                lost = (
                    f"results that could not be stored: {len(self._held):,};"
                    " launch again to run them"
                )
                raise StoreError(f"{error}; {lost}") from error
            self._stored(self._held)
            self._held = []
            self._bytes = 0
            self._store.gather()
        self._flushed = self._clock()
