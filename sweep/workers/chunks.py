"""How jobs are dealt out to workers: in chunks of about equal work."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

MAX_CHUNK_JOBS = 1000
COST_RANGE = (1e-6, 1e9)
MOST_A_SECOND = 50
"""Chunks that come back, from all workers. Dask's scheduler on a busy core takes 90."""


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
        seconds: float,
        in_order: bool = False,
        at_once: int = 1,
    ) -> None:
        import numpy as np

        self._costs = np.clip(np.asarray(costs, float), *COST_RANGE)
        self._order = np.arange(len(self._costs))
        if not in_order:
            self._order = np.argsort(-self._costs, kind="stable")
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
