"""Dealing of jobs to workers.

Jobs are dealt in chunks of about equal work, or in batches of about equal size.
"""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

MAX_CHUNK_JOBS = 1000
COST_RANGE = (1e-6, 1e9)
MOST_A_SECOND = 50
"""Number of chunks per second that all workers return together.

Dask's scheduler on a busy core can handle 90.
"""


class Dealing(Protocol):
    """Dealer of the indices of jobs, from 0 on, each once."""

    @property
    def left(self) -> int:
        """Number of jobs that have not been dealt out."""

    def take(self, workers: int, /) -> list[int]:
        """Return the next indices for a worker among `workers` workers.

        The list is empty when every index has been dealt out.
        """

    def observe(self, indices: Sequence[int], seconds: float, /) -> None:
        """Learn from the duration of some jobs.

        Parameters
        ----------
        indices : sequence of int
            Indices of the jobs of a chunk.
        seconds : float
            Wall seconds of all jobs together.
        """

    def split(self, indices: list[int], /) -> list[list[int]]:
        """Return smaller chunks in which the jobs of a lost chunk run again.

        The chunk was lost with its worker, and a job of the chunk may be the cause.
        """


class Chunks:
    """Dealer of chunks of about equal work: the longest jobs first, or all in order.

    Jobs are dealt singly until the first chunk has been timed; from then on the
    estimates are scaled by the measured pace. A chunk is at most a third of one
    worker's part of the remaining work, so that the workers finish together. The number
    of workers may change. Many workers get longer chunks, so that at most MOST_A_SECOND
    come back per second. Estimates are clipped to COST_RANGE, in seconds.

    Parameters
    ----------
    costs : array-like of float
        Estimated seconds of each job, shape (number of jobs,).
    seconds : float, default 1.0
        Work per chunk, in wall seconds.
    in_order : bool, default False
        Whether jobs are dealt in their order.
    at_once : int, default 1
        Number of jobs that run together: chunk sizes are multiples of this number. If
        fewer jobs per worker are left, chunk sizes are multiples of the jobs per
        worker, so that each worker has a job.
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
        self._seconds = seconds
        self._at_once = at_once
        self._first = 0
        self._pace: float | None = None

    @property
    def left(self) -> int:
        """Number of jobs that have not been dealt out."""
        return len(self._order) - self._first

    def take(self, workers: int) -> list[int]:
        """Return the next chunk of indices for a worker among `workers` workers.

        The chunk is empty when every index has been dealt out.
        """
        group = max(1, min(self._at_once, math.ceil(self.left / workers)))
        rounded = math.ceil(self._size(self.left, workers) / group) * group
        stop = self._first + min(self.left, rounded)
        indices: list[int] = self._order[self._first : stop].tolist()
        self._first = stop
        return indices

    def observe(self, indices: Sequence[int], seconds: float) -> None:
        """Scale the estimates by the duration of some jobs.

        Parameters
        ----------
        indices : sequence of int
            Indices of the jobs of a chunk.
        seconds : float
            Wall seconds of all jobs together.
        """
        pace = max(seconds, COST_RANGE[0]) / float(self._costs[indices].sum())
        self._pace = pace if self._pace is None else (self._pace * pace) ** 0.5

    def split(self, indices: list[int]) -> list[list[int]]:
        """Return one chunk per job: a chunk takes about as long as its single jobs."""
        return [[index] for index in indices]

    def _size(self, left: int, workers: int) -> int:
        if self._pace is None:
            return min(left, 1)
        most = 1 / (3 * workers)
        seconds = max(self._seconds, workers / MOST_A_SECOND)
        start = float(self._through[self._first])
        end = float(self._through[-1])
        budget = min(seconds / self._pace, (end - start) * most)
        stop = int(self._through.searchsorted(start + budget, side="right")) - 1
        by_time = stop - self._first
        by_count = min(MAX_CHUNK_JOBS, int(left * most))
        return min(left, max(1, min(by_time, by_count)))


class Batches:
    """Dealer of as few batches as possible: the longest jobs first, or all in order.

    The sizes of batches differ by at most one job. A device takes about as long for a
    batch of few jobs as for a batch of many jobs, and runs one batch after another. So,
    unlike chunks, all batches are about full, for any number of workers.

    Parameters
    ----------
    costs : array-like of float
        Estimated seconds of each job, shape (number of jobs,).
    in_order : bool, default False
        Whether jobs are dealt in their order.
    at_once : int
        Largest number of jobs of a batch.
    """

    def __init__(
        self, costs: "ArrayLike", *, in_order: bool = False, at_once: int
    ) -> None:
        import numpy as np

        self._order = _order(np.asarray(costs, float), in_order)
        self._at_once = at_once
        self._first = 0

    @property
    def left(self) -> int:
        """Number of jobs that have not been dealt out."""
        return len(self._order) - self._first

    def take(self, _workers: int) -> list[int]:
        """Return the next batch of indices; empty when all have been dealt out."""
        batches = math.ceil(self.left / self._at_once)
        stop = self._first + (math.ceil(self.left / batches) if batches else 0)
        indices: list[int] = self._order[self._first : stop].tolist()
        self._first = stop
        return indices

    def observe(self, _indices: Sequence[int], _seconds: float) -> None:
        """Do nothing: the duration of a batch changes no later batch.

        Parameters
        ----------
        _indices : sequence of int
            Indices of the jobs of a batch.
        _seconds : float
            Wall seconds of all jobs together.
        """

    def split(self, indices: list[int]) -> list[list[int]]:
        """Return two halves: 12 batches find the failing job among 4096."""
        half = math.ceil(len(indices) / 2)
        return [part for part in (indices[:half], indices[half:]) if part]


def _order(costs: "NDArray[Any]", in_order: bool) -> "NDArray[Any]":
    """Return the indices of jobs with these costs in the order of dealing."""
    import numpy as np

    if in_order:
        return np.arange(len(costs))
    return np.argsort(-costs, kind="stable")
