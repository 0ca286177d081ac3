"""The progress of a campaign, and the interface of its display."""

from collections import Counter
from dataclasses import dataclass, field
from types import TracebackType
from typing import Protocol

from sweep.store import Location


@dataclass
class Progress:
    """Progress of a launch.

    Attributes
    ----------
    points : int
        Number of points.
    most : int
        Largest number of trials to which the plan can grow.
    settled : int or None
        Number of points that have had their last trial, if a rule decides how many
        trials a point gets. None if the number is fixed.
    trials : int
        Number of trials of the plan; in a launch of a shard, of the shard.
    stored : int
        Number of trials of the plan that were stored before.
    apart : int
        Number of stored trials that the plan does not list.
    continued : int
        Number of new trials that resume from stored last states.
    steps_saved : int
        Sum of the steps that resumed trials did not run again.
    ahead : bool
        True if `trials` counts from the beginning all that may be requested, until the
        campaign ends.
    note : str
        The state of the strategy, in words.
    statuses : Counter of str
        Number of new trials by status.
    """

    points: int = 0
    most: int = 0
    settled: int | None = None
    trials: int = 0
    stored: int = 0
    apart: int = 0
    continued: int = 0
    steps_saved: int = 0
    ahead: bool = False
    note: str = ""
    statuses: Counter[str] = field(default_factory=Counter)

    def count(self, trials: int, stored: int, /) -> None:
        """Count trials of a round.

        Parameters
        ----------
        trials : int
            Number of trials that are requested now.
        stored : int
            Number of them that are stored.
        """
        self.trials += 0 if self.ahead else trials
        self.stored += stored

    @property
    def missing(self) -> int:
        """Number of trials that were not stored before."""
        return self.trials - self.stored

    @property
    def left(self) -> int:
        """Number of missing trials that have not run.

        At the end of a launch, these are links of chains after a link that did not
        finish.
        """
        return self.missing - self.statuses.total()

    @property
    def troubled(self) -> int:
        """Number of new trials that did not finish."""
        return sum(count for status, count in self.statuses.items() if status != "done")


class Display(Protocol):
    """A display of the progress of one study, as a context manager."""

    def __enter__(self) -> "Display": ...

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None: ...

    def show(self, progress: Progress) -> None:
        """Show the progress."""

    def summary(self, progress: Progress, folder: Location) -> str:
        """Return the outcome in one line.

        Parameters
        ----------
        progress : Progress
            Progress at the end.
        folder : Location
            Folder of the study.
        """
