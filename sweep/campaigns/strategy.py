"""What a campaign needs of a strategy, which says which trials of a study are asked
for.

A strategy asks in rounds. What it asks for follows only from the spec and from what is
stored. So the number of workers, the order in which results come back, and
interruptions change nothing. Methods have strategies of their own. Here are:

    FixedStrategy    one round: all trials of the design
    SearchStrategy   a round per rung of a race, and one for the held-out trials
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol, TypeVar

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from sweep.campaigns.progress import Progress
from sweep.design.design import evenly
from sweep.design.jobs import Counts, Job
from sweep.design.trial_ids import Ids, as_texts, blocks
from sweep.spec.study import Study
from sweep.store.shares import Share

Origin = Mapping[str, object]
"""Where results come from, as `sweep.store.provenance` says it."""

PlanTables = tuple[pa.RecordBatchReader, pa.Table | None]
"""What becomes the plan, some rows at a time, and what a search has asked for."""

Look = Callable[[], pa.Table]
"""Returns what is stored of the trials of the last round: a row each, in their order.

The columns are `status` and those that the strategy looks at. A cell is null where the
trial is not stored, and where it has no such value.
"""

P_co = TypeVar("P_co", bound=Progress, covariant=True)


@dataclass(frozen=True, eq=False)
class Round:
    """Trials that are asked for together, none of which was asked for before.

    `ids` are their ids. `jobs_at` makes the jobs at some places among them. `plan`
    makes the tables of all trials that have been asked for so far. The campaign calls
    it before it runs what is missing of this round, and at the end if nothing is
    missing of the last round. Where a share must have some trials together, each of
    them goes where that of `led_by` does.
    """

    ids: Ids
    jobs_at: Callable[[Counts], Sequence[Job]]
    plan: Callable[[Origin], PlanTables]
    led_by: Ids | None = None

    def some(self, most: int) -> Sequence[Job]:
        """At most so many of the jobs, spread evenly."""
        return self.jobs_at(np.array(evenly(len(self.ids), most)))

    def in_share(self, share: Share) -> NDArray[np.bool_]:
        """Which of the trials a launch of this share runs, shape (len(ids),)."""
        decide = self.ids if self.led_by is None else self.led_by
        masks = [share.has(as_texts(some).to_pylist()) for some in blocks(decide)]
        return np.concatenate([np.empty(0, np.bool_), *masks])


class Strategy(Protocol[P_co]):
    """Says which trials of `study` are asked for.

    `grows` says whether there may be a second round. Such a strategy may look;
    `looks_at` names the columns of trials that it then sees. The campaign counts trials
    in `progress`, and the strategy enters there what it alone knows.
    """

    @property
    def study(self) -> Study: ...

    @property
    def progress(self) -> P_co: ...

    @property
    def grows(self) -> bool: ...

    @property
    def looks_at(self) -> Sequence[str]: ...

    def rounds(self, look: Look) -> Iterator[Round]:
        """One round after the other.

        The next one is asked for when all trials of the last one are stored. In a
        launch of a share, trials of other shares may be missing.
        """


def beyond(before: Counts, trials: Counts) -> NDArray[np.bool_]:
    """Return which trials come after the first ones of their points.

    Parameters
    ----------
    before
        How many trials each point had, shape (P,).
    trials
        How many it has now, shape (P,).

    Returns
    -------
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
    """Merge the values of new trials with those from before, each in its order.

    Parameters
    ----------
    new
        Whether each trial is new, as `beyond` returns it.
    values
        The values of the new trials.
    before
        The values of the other trials.
    """
    merged = np.empty(len(new))
    merged[new] = values
    merged[~new] = before
    return merged
