"""How jobs are dealt out to workers: in chunks of about equal work, or in batches of
about equal numbers.
"""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

MAX_CHUNK_JOBS = 1000
COST_RANGE = (1e-6, 1e9)
MOST_A_SECOND = 50
"""Chunks that come back, from all workers. Dask's scheduler on a busy core takes 90."""


class Dealing(Protocol):
    """Deals out the indices of jobs, from 0 on, each once."""

    @property
    def left(self) -> int:
        """How many jobs have not been dealt out."""

    def take(self, workers: int, /) -> list[int]:
        """The next indices for one of so many workers; empty when every index has been
        dealt out.
        """

    def observe(self, indices: Sequence[int], seconds: float, /) -> None:
        """Learn that the jobs at `indices` took `seconds` together."""

    def split(self, indices: list[int], /) -> list[list[int]]:
        """How the jobs of a chunk are tried again that was lost with its worker: one
        of them may be to blame. Those of several go in smaller chunks.
        """


class Chunks:
    """Deals out job indices in chunks of about `seconds` of work each: the longest jobs
    first, or all `in_order`.

    Jobs go singly until a first chunk has been timed; from then on the estimates are
    scaled by the measured pace. No chunk is more than a third of one worker's share of
    the remaining work, so that the workers finish together. The number of workers may
    change. Many workers get longer chunks, so that at most MOST_A_SECOND come back in a
    second. Estimates are clipped to COST_RANGE, in seconds.

    Jobs go by multiples of `at_once`, as so many run together. Where a worker's share
    of what is left is fewer, they go by multiples of that: no worker stays without.
    """

    def __init__(
        self,
        costs: "ArrayLike",
        *,
        seconds: float = 1.0,
        in_order: bool = False,
        at_once: int = 1,
    ) -> None:
        import numpy as np

        self._costs = np.clip(np.asarray(costs, float), *COST_RANGE)
        self._order = _order(self._costs, in_order)
        self._through = np.concatenate([[0.0], np.cumsum(self._costs[self._order])])
        self._seconds, self._at_once = seconds, at_once
        self._first = 0
        self._pace: float | None = None

    @property
    def left(self) -> int:
        """How many jobs have not been dealt out."""
        return len(self._order) - self._first

    def take(self, workers: int) -> list[int]:
        """The next chunk of indices for one of so many workers; empty when every index
        has been dealt out.
        """
        group = max(1, min(self._at_once, math.ceil(self.left / workers)))
        whole = math.ceil(self._size(self.left, workers) / group) * group
        stop = self._first + min(self.left, whole)
        indices: list[int] = self._order[self._first : stop].tolist()
        self._first = stop
        return indices

    def observe(self, indices: Sequence[int], seconds: float) -> None:
        """Learn that the jobs at `indices` took `seconds` together."""
        pace = max(seconds, COST_RANGE[0]) / float(self._costs[indices].sum())
        self._pace = pace if self._pace is None else (self._pace * pace) ** 0.5

    def split(self, indices: list[int]) -> list[list[int]]:
        """Each job alone: a chunk takes about as long as its jobs one by one."""
        return [[index] for index in indices]

    def _size(self, left: int, workers: int) -> int:
        if self._pace is None:
            return min(left, 1)
        most, seconds = 1 / (3 * workers), max(self._seconds, workers / MOST_A_SECOND)
        start, end = float(self._through[self._first]), float(self._through[-1])
        budget = min(seconds / self._pace, (end - start) * most)
        by_time = (
            int(self._through.searchsorted(start + budget, side="right"))
            - 1
            - self._first
        )
        by_count = min(MAX_CHUNK_JOBS, int(left * most))
        return min(left, max(1, min(by_time, by_count)))


class Batches:
    """Deals out job indices in as few batches of at most `at_once` as there can be, and
    these of equal numbers but for one: the longest jobs first, or all `in_order`.

    A device takes about as long for a batch of few jobs as for one of many, and it runs
    one batch after another. So, unlike chunks, batches are whole from the first to the
    last one, and no fewer where there are many workers.
    """

    def __init__(
        self, costs: "ArrayLike", *, in_order: bool = False, at_once: int
    ) -> None:
        import numpy as np

        self._order = _order(np.asarray(costs, float), in_order)
        self._at_once, self._first = at_once, 0

    @property
    def left(self) -> int:
        """How many jobs have not been dealt out."""
        return len(self._order) - self._first

    def take(self, _workers: int) -> list[int]:
        """The next batch of indices; empty when every index has been dealt out."""
        batches = math.ceil(self.left / self._at_once)
        stop = self._first + (math.ceil(self.left / batches) if batches else 0)
        indices: list[int] = self._order[self._first : stop].tolist()
        self._first = stop
        return indices

    def observe(self, _indices: Sequence[int], _seconds: float) -> None:
        """How long a batch takes changes no other one."""

    def split(self, indices: list[int]) -> list[list[int]]:
        """Two halves: so the one job to blame among 4096 is found in 12 batches."""
        half = math.ceil(len(indices) / 2)
        return [part for part in (indices[:half], indices[half:]) if part]


def _order(costs: "NDArray[Any]", in_order: bool) -> "NDArray[Any]":
    """The indices of jobs with these costs in the order in which they are dealt."""
    import numpy as np

    if in_order:
        return np.arange(len(costs))
    return np.argsort(-costs, kind="stable")
