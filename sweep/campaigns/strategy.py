"""The interface of a strategy, which decides which trials of a study are requested.

A strategy requests trials in rounds. The requests follow only from the spec and from
stored results. So the requests do not depend on the number of workers, the order of
results, or interruptions. `FixedStrategy` has a single round, with all trials of the
design. Methods have their strategies, such as a round per rung of a race.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol, TypeVar

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from sweep.campaigns.progress import Progress
from sweep.design import Counts, Ids, Job, as_texts, blocks, evenly
from sweep.spec import ProfilePoint, Study
from sweep.store import Share

Origin = Mapping[str, object]
"""Provenance of results, from `sweep.store.provenance`."""

PlanTables = tuple[pa.RecordBatchReader, pa.Table | None]
"""The plan, some rows at a time, and the table of a search, if there is a search."""

Look = Callable[[], pa.Table]
"""Function that returns a stored row per trial of the last round, in order.

The columns are `status` and all values in `looks_at` of the strategy. A cell is null
if the trial is not stored, or lacks the value.
"""

P_co = TypeVar("P_co", bound=Progress, covariant=True)


@dataclass(frozen=True, eq=False)
class Round:
    """Trials that are requested together, and were not requested before.

    Attributes
    ----------
    ids : Ids
        Ids of the n trials, shape (n,).
    jobs_at : callable
        Returns the jobs at some indices into `ids`.
    plan : callable
        Returns the tables of all trials requested so far. The campaign calls it before
        it runs the missing trials of this round. If no trial of the last round is
        missing, the campaign calls `plan` at the end.
    led_by : Ids, optional
        Ids that decide the shard of each trial, shape (n,), where a shard must have
        some trials together. By default the id of each trial decides.
    """

    ids: Ids
    jobs_at: Callable[[Counts], Sequence[Job]]
    plan: Callable[[Origin], PlanTables]
    led_by: Ids | None = None

    def some(self, most: int) -> Sequence[Job]:
        """Return at most `most` of the jobs, spread evenly."""
        return self.jobs_at(np.array(evenly(len(self.ids), most)))

    def in_share(self, share: Share) -> NDArray[np.bool_]:
        """Return whether a launch of this shard runs each of the trials, shape (n,)."""
        decide = self.ids if self.led_by is None else self.led_by
        masks = [share.has(as_texts(some).to_pylist()) for some in blocks(decide)]
        return np.concatenate([np.empty(0, np.bool_), *masks])


class Strategy(Protocol[P_co]):
    """Decides which trials of a study are requested."""

    @property
    def study(self) -> Study:
        """The study."""

    @property
    def progress(self) -> P_co:
        """Progress in which the campaign counts trials.

        The strategy enters the numbers that only the strategy knows.
        """

    @property
    def grows(self) -> bool:
        """True if there may be a second round.

        Only strategies with this property may look.
        """

    @property
    def looks_at(self) -> Sequence[str | ProfilePoint]:
        """Values of trials that a look shows, in addition to the status.

        A value is a column of `trials`, or a point of a profile.
        """

    def rounds(self, look: Look) -> Iterator[Round]:
        """Yield round after round.

        The next round is requested when all trials of the last round are stored. In a
        launch of a shard, trials of further shards may be missing.
        """


def beyond(before: Counts, trials: Counts) -> NDArray[np.bool_]:
    """Return which trials of each point are new.

    Parameters
    ----------
    before : array of int
        Number of trials that each point had, shape (P,).
    trials : array of int
        Number of trials that each point has now, shape (P,).

    Returns
    -------
    array of bool
        Whether each trial is new, point after point, shape (sum of trials,).
    """
    first = np.repeat(np.cumsum(trials) - trials, trials)
    replicate = np.arange(trials.sum()) - first
    new: NDArray[np.bool_] = replicate >= np.repeat(before, trials)
    return new


def filled(
    new: NDArray[np.bool_],
    values: NDArray[np.float64],
    before: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Merge the values of new trials with earlier values, and keep the two orders.

    Parameters
    ----------
    new : array of bool
        Whether each of the n trials is new, shape (n,): the result of `beyond`.
    values : array of float
        Values of the new trials.
    before : array of float
        Values of the other trials.

    Returns
    -------
    array of float
        Values of all trials, shape (n,).
    """
    merged = np.empty(len(new))
    merged[new] = values
    merged[~new] = before
    return merged
